"""One static page of what the experiments wrote: pictures, figures, and what to read off."""

import json
import os
import re
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader

from _cli import value_in_words
from taichi_dem.kit.files import write_text

HERE = Path(__file__).resolve().parent
#: What ``gallery.py`` notes of a run beside what the experiment wrote.
RUN = "gallery.json"
#: Folder of the small pictures of the list, beside the page.
THUMBNAILS = "thumbnails"
#: What a run says of its own pictures, where it says something.
CAPTION = "caption.txt"
#: Key figures shown unfolded; all others are one touch away.
MOST_KEY_FIGURES = 12


@dataclass(frozen=True)
class Shown:
    """What the page shows of one experiment.

    page: its entry. folder: of its results, relative to the page. command: that made them.
    quick: whether it was the smaller job. pictures, more: files shown, and files linked.
    thumbnail: small picture for the list, relative to the page, or "". caption: what the run says
    of its own pictures, or "". key, rest: rows of figures (name, value, paper). seconds: what the
    run took, in words. output: what it printed. failed: why it did not end well, or "".
    """

    page: object
    folder: str
    command: str
    quick: bool
    pictures: tuple
    more: tuple
    thumbnail: str
    caption: str
    key: tuple
    rest: tuple
    seconds: str
    output: str
    failed: str


def shown(page, root, failed=""):
    """What there is to show of an experiment in root/NAME; Shown, failed where there is nothing."""
    folder = Path(root, page.name)
    summary, run = read_json(folder / "summary.json"), read_json(folder / RUN)
    if not summary and not failed:
        failed = "it has not been run"
    files = sorted(path.name for path in folder.glob("*") if path.is_file())
    pictures = tuple(name for name in page.pictures if name in files)
    command = summary.get("command", page.command.split(" ", 1)[1])
    key, rest = figure_rows(summary.get("figures", {}), page.figures)
    return Shown(
        page=page,
        folder=quote(page.name),
        command=f"python {command}",
        # Summaries of older versions have the command alone.
        quick=summary.get("quick", "--quick" in command.split()),
        pictures=pictures,
        more=tuple(name for name in files if name not in (*pictures, RUN, CAPTION)),
        thumbnail=thumbnail_of(page, root) if page.pictures[0] in files else "",
        caption=read_caption(folder / CAPTION),
        key=key,
        rest=rest,
        seconds=_seconds(summary, run),
        output=run.get("output", ""),
        failed=failed,
    )


def thumbnail_of(page, root):
    """An experiment's small picture relative to the page in root, "" where there is none."""
    name = f"{page.name}.png"
    return f"{THUMBNAILS}/{quote(name)}" if Path(root, THUMBNAILS, name).is_file() else ""


def read_caption(path):
    """Text of a caption, "" where there is none."""
    try:
        return Path(path).read_text(encoding="utf-8").strip()
    except (OSError, ValueError):
        return ""


def read_json(path):
    """Content of a JSON file, an empty dict where there is none that can be read."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        content = {}
    return content if isinstance(content, dict) else {}


def figure_rows(figures, patterns):
    """Rows (name, value, paper) of the key figures, and of all others; paper: "" without a value.

    figures: of summary.json. Key are those with a paper's value and those that match a pattern.
    """
    rows = [
        (in_words(name, item["unit"]), with_unit(item["value"], item["unit"]), papers_value(item))
        for name, item in figures.items()
    ]
    wanted = [
        item["paper"] is not None or any(fnmatchcase(name, p) for p in patterns)
        for name, item in figures.items()
    ]
    # Those with a paper's value first, so that the cut never takes them.
    key = sorted((row for row, want in zip(rows, wanted) if want), key=lambda row: not row[2])
    rest = [row for row, want in zip(rows, wanted) if not want]
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


def papers_value(item):
    """The paper's value of a figure with its unit, "" where it gives none."""
    return "" if item["paper"] is None else with_unit(item["paper"], item["unit"])


def _seconds(summary, run):
    parts = []
    if "seconds" in run:
        parts.append(f"{run['seconds']:.0f} s in all")
    for name, words in (("compile", "compiling"), ("run", "computing")):
        if name in summary.get("seconds", {}):
            parts.append(f"{summary['seconds'][name]:.1f} s {words}")
    return ", ".join(parts)


def write_page(path, items):
    """Write the page of all items, a sequence of Shown, as one HTML file beside their folders.

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
    """Where the results come from, in words, each only once."""
    words = []
    for summary in filter(None, summaries):
        machine, versions = summary["machine"], summary["versions"]
        words.append(
            f"{machine['processor']}, {machine['cores']} cores, {machine['arch']}; "
            f"taichi {versions['taichi']}, numpy {versions['numpy']}, "
            f"commit {versions.get('commit') or 'unknown'}"
        )
    return list(dict.fromkeys(words))
