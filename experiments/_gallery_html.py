"""One static page of the results of all experiments: pictures, figures, and their reading."""

import json
import os
import re
from fnmatch import fnmatchcase
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader

from taichi_dem.kit.files import write_text
from taichi_dem.kit.study import value_in_words

HERE = Path(__file__).resolve().parent
#: Notes of ``gallery.py`` on a run, beside the output of the experiment.
RUN = "gallery.json"
#: Folder of the small pictures of the list, beside the page.
THUMBNAILS = "thumbnails"
#: Words of a run about its own pictures, where there are any.
CAPTION = "caption.txt"
#: Key figures shown unfolded; all others are one touch away.
MOST_KEY_FIGURES = 12


def shown(page, root, failed=""):
    """Content of the page for an experiment, by the names that _gallery.html uses.

    page: its entry. root: folder of the page, in which its results stand in root/NAME. failed: why
    it did not end well, or "". quick: whether it was the smaller job. pictures, more: files shown,
    and files linked. caption: words of the run about its own pictures. key, rest: rows of figures
    (name, value, paper).
    """
    folder = Path(root, page.name)
    summary, run = read_json(folder / "summary.json"), read_json(folder / RUN)
    files = sorted(path.name for path in folder.glob("*") if path.is_file())
    pictures = [name for name in page.pictures if name in files]
    command = summary.get("command", page.command.split(" ", 1)[1])
    key, rest = figure_rows(summary.get("figures", {}), page.figures)
    small = Path(root, THUMBNAILS, f"{page.name}.png").is_file() and page.pictures[0] in files
    return SimpleNamespace(
        page=page,
        folder=quote(page.name),
        command=f"python {command}",
        # Summaries of older versions have the command alone.
        quick=summary.get("quick", "--quick" in command.split()),
        pictures=pictures,
        more=[name for name in files if name not in (*pictures, RUN, CAPTION)],
        thumbnail=f"{THUMBNAILS}/{quote(page.name)}.png" if small else "",
        caption=read_text(folder / CAPTION),
        key=key,
        rest=rest,
        seconds=_seconds(summary, run),
        output=run.get("output", ""),
        failed=failed or ("" if summary else "it has not been run"),
    )


def read_text(path):
    """Text of a file, "" where there is none that can be read."""
    try:
        return Path(path).read_text(encoding="utf-8").strip()
    except (OSError, ValueError):
        return ""


def read_json(path):
    """Content of a JSON file, an empty dict where there is none that can be read."""
    try:
        content = json.loads(read_text(path))
    except (ValueError, RecursionError):
        content = {}
    return content if isinstance(content, dict) else {}


def figure_rows(figures, patterns):
    """Rows (name, value, paper) of the key figures, and of all others; paper: "" without a value.

    figures: of summary.json. Key are those with a paper's value and those that match a pattern.
    """
    key, rest = [], []
    for name, item in figures.items():
        value, paper = (with_unit(item[k], item["unit"]) for k in ("value", "paper"))
        known = item["paper"] is not None
        row = (in_words(name, item["unit"]), value, paper if known else "")
        wanted = known or any(fnmatchcase(name, pattern) for pattern in patterns)
        (key if wanted else rest).append(row)
    # Those with a paper's value first, so that the cut never takes them.
    key.sort(key=lambda row: not row[2])
    return tuple(key[:MOST_KEY_FIGURES]), tuple(key[MOST_KEY_FIGURES:] + rest)


def in_words(name, unit):
    """A key of summary.json without underscores, and without the unit at its end.

    A number before that keeps it: plateau_at_5_MPa is that at 5 MPa.
    """
    bare = name.removesuffix("_" + re.sub("[ /]", "_", unit))
    kept = unit == "1" or re.search(r"_[0-9.]+$", bare)
    return (name if kept else bare).replace("_", " ")


def with_unit(value, unit):
    """A figure in words, with its unit unless it is a pure number, a name or was not found."""
    words = value_in_words(value)
    return words if unit in ("", "1") or value is None else f"{words} {unit}"


def _seconds(summary, run):
    spent = summary.get("seconds", {})
    parts = [f"{run['seconds']:.0f} s in all"] if "seconds" in run else []
    parts += [f"{spent['compile']:.1f} s compiling"] if "compile" in spent else []
    parts += [f"{spent['run']:.1f} s computing"] if "run" in spent else []
    return ", ".join(parts)


def write_page(path, items):
    """Write the page of all items, a sequence of ``shown``, as one HTML file beside their folders.

    Raises InputError when it cannot be written.
    """
    folder = os.path.dirname(path)
    summaries = [read_json(Path(folder, item.page.name, "summary.json")) for item in items]
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    parts = list(dict.fromkeys(item.page.part for item in items))
    text = environment.get_template("_gallery.html").render(
        parts=[(part, [item for item in items if item.page.part == part]) for part in parts],
        machines=machines(summaries),
        quick=sum(item.quick for item in items if not item.failed),
        count=sum(not item.failed for item in items),
    )
    write_text(path, text)


def machines(summaries):
    """Machines and versions of the results in words, each only once."""
    words = []
    for summary in filter(None, summaries):
        machine, versions = summary["machine"], summary["versions"]
        words.append(
            f"{machine['processor']}, {machine['cores']} cores, {machine['arch']}; "
            f"taichi {versions['taichi']}, numpy {versions['numpy']}, "
            f"commit {versions.get('commit') or 'unknown'}"
        )
    return list(dict.fromkeys(words))
