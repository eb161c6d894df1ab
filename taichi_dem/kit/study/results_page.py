"""Studies run one after the other, and one static page of their results."""

import json
import os
import re
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import quote

from taichi_dem.kit import children
from taichi_dem.kit.files import output_folder, write_text, write_whole
from taichi_dem.kit.study.entries import PYTHON, Entry, key_figures
from taichi_dem.kit.study.summary import value_in_words

#: Notes of the program that ran a study, beside its output: seconds, CPU seconds, whether nothing
#: was compiled before, and what it printed.
RUN = "gallery.json"
#: Words of a run about its own pictures, where there are any.
CAPTION = "caption.txt"


def markdown_table(entries: Sequence[Entry], root: str | Path, pictures: str) -> str:
    """Table of all entries for a file of a folder root, each with its picture if there is one."""
    lines = ["| question | command | time | with `--quick` | picture |", "|---|---|---|---|---|"]
    for entry in entries:
        small = f"{pictures}/{entry.name}.png"
        link = f"[picture]({small})" if Path(root, small).is_file() else ""
        times = " | ".join(entry.expected_time(quick) for quick in (False, True))
        lines.append(f"| {entry.question} | `{entry.command}` | {times} | {link} |")
    return "\n".join(lines) + "\n"


def run_entries(
    scripts: str | Path,
    entries: Sequence[Entry],
    root: str,
    *,
    quick: bool = False,
    reuse: bool = False,
    cold: bool = False,
) -> dict[str, str]:
    """Run studies into root/NAME, and print how each ended; name -> why it failed, or ""."""
    failed = {}
    for number, entry in enumerate(entries, 1):
        if reuse and Path(root, entry.name, "summary.json").exists():
            continue
        print(f"{number:2d}/{len(entries)} {entry.name} ... ", end="", flush=True)
        started = time.perf_counter()
        failed[entry.name] = run_entry(scripts, entry, root, quick, cold)
        print(failed[entry.name] or f"{time.perf_counter() - started:.0f} s", flush=True)
    return failed


def run_entry(
    scripts: str | Path, entry: Entry, root: str, quick: bool = False, cold: bool = False
) -> str:
    """Run a study and note what it printed, for its page; returns why it failed, or ""."""
    folder = output_folder(os.path.join(root, entry.name))
    # None of an earlier run shall pass for this one's.
    for name in ("summary.json", RUN, CAPTION, *entry.pictures):
        Path(folder, name).unlink(missing_ok=True)
    line = [sys.executable, os.path.join(scripts, f"{entry.name}.py"), *entry.options.split()]
    line += ["--out", folder, *(["--quick"] if quick else [])]
    started, cpu = time.perf_counter(), _children_cpu()
    with tempfile.TemporaryDirectory() as empty:
        own = {"TI_OFFLINE_CACHE_FILE_PATH": empty} if cold else {}
        done = children.run(line, env={**os.environ, **own})
    spent = {"seconds": time.perf_counter() - started, "cpu_s": _children_cpu() - cpu}
    note = {**spent, "cold": cold, "output": done.stdout}
    write_text(os.path.join(folder, RUN), json.dumps(note, indent=1))
    if done.returncode == 0:
        return ""
    said = done.stderr.strip().splitlines() or ["it printed nothing"]
    return f"exit code {done.returncode}: {said[-1]}"


def _children_cpu():
    """CPU time of all processes that this one has started and seen end [s]."""
    times = os.times()
    return times.children_user + times.children_system


def write_page(root: str, entries: Sequence[Entry], failed: Mapping[str, str]) -> list:
    """Write root/index.html, the page of all entries, whose results stand in root/NAME."""
    from jinja2 import Environment, FileSystemLoader

    items = [_shown(entry, root, failed.get(entry.name, "")) for entry in entries]
    options: Any = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), **options)
    parts = list(dict.fromkeys(entry.part for entry in entries))
    text = environment.get_template("results_page.html").render(
        parts=[(part, [item for item in items if item.page.part == part]) for part in parts],
        quick=sum(item.quick for item in items if not item.failed),
        count=sum(not item.failed for item in items),
    )
    write_text(os.path.join(root, "index.html"), text)
    return items


def shrink_picture(
    entry: Entry, root: str, folder: str | Path, side: int, colours: int
) -> str | None:
    """Small copy of a study's first picture in a folder; its path, None without a picture."""
    source = Path(root, entry.name, entry.pictures[0])
    target = os.path.join(folder, f"{entry.name}.png")
    if not source.is_file():
        return None
    write_whole(target, lambda name: _write_small(name, source, side, colours))
    return target


def _write_small(name, source, side, colours):
    """Write a picture, the last image of a film, within a side [pixels] as PNG."""
    from PIL import Image

    with Image.open(source) as image:
        image.seek(getattr(image, "n_frames", 1) - 1)
        made = image.convert("RGB")
    made.thumbnail((side, side))
    # With too few colours, or without the means, thin lines take those of their neighbours.
    made = made.quantize(colours, kmeans=3, dither=Image.Dither.NONE)
    made.save(name, format="PNG", optimize=True)


def _shown(page, root, failed):
    """Content of the page for an experiment, by the names that the template uses."""
    folder = Path(root, page.name)
    summary, run = read_json(folder / "summary.json"), read_json(folder / RUN)
    files = sorted(path.name for path in folder.glob("*") if path.is_file())
    pictures = [name for name in page.pictures if name in files]
    key, rest = figure_rows(summary.get("figures", {}), page.figures)
    caption = folder / CAPTION
    return SimpleNamespace(
        page=page,
        folder=quote(page.name),
        command=f"{PYTHON} {summary['command']}" if summary else page.command,
        quick=summary.get("quick", False),
        pictures=pictures,
        more=[name for name in files if name not in (*pictures, RUN, CAPTION)],
        caption=caption.read_text(encoding="utf-8").strip() if caption.is_file() else "",
        key=key,
        rest=rest,
        seconds=_seconds(summary, run),
        output=run.get("output", ""),
        failed=failed or ("" if summary else "it has not been run"),
    )


def read_json(path: str | Path) -> dict:
    """Content of a JSON file, an empty dict where there is none."""
    return json.loads(Path(path).read_text(encoding="utf-8")) if Path(path).is_file() else {}


def figure_rows(figures: Mapping[str, dict], patterns: Sequence[str]) -> tuple[list, list]:
    """Rows (name, value, paper) of key figures, and of all others; paper: "" without a value."""
    key = key_figures(figures, patterns)
    rest = [name for name in figures if name not in key]
    return [_row(name, figures[name]) for name in key], [_row(name, figures[name]) for name in rest]


def _row(name, item):
    value, paper = (_with_unit(item[k], item["unit"]) for k in ("value", "paper"))
    return _in_words(name, item["unit"]), value, "" if item["paper"] is None else paper


def _in_words(name, unit):
    """A key of summary.json without underscores, and without the unit at its end."""
    # A number before the unit keeps it: plateau_at_5_MPa.
    bare = name.removesuffix("_" + re.sub("[ /]", "_", unit))
    kept = unit == "1" or re.search(r"_[0-9.]+$", bare)
    return (name if kept else bare).replace("_", " ")


def _with_unit(value, unit):
    """A figure in words, with its unit unless it is a pure number, a name or was not found."""
    words = value_in_words(value)
    return words if unit in ("", "1") or value is None else f"{words} {unit}"


def _seconds(summary, run):
    spent = summary.get("seconds", {})
    parts = [f"{run['seconds']:.0f} s in all"] if run else []
    parts += (
        [f"{spent['compile']:.1f} s compiling, {spent['run']:.1f} s computing"] if spent else []
    )
    return ", ".join(parts)
