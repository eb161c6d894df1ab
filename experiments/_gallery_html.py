"""One static page of what the experiments wrote: pictures, figures, and what to read off."""

import json
import os
import re
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader

from taichi_dem.files import write_text

HERE = Path(__file__).resolve().parent
#: What ``gallery.py`` notes of a run beside what the experiment wrote.
RUN = "gallery.json"
PICTURES = (".png", ".gif", ".mp4")
#: Key figures shown unfolded; all others are one touch away.
MOST_KEY_FIGURES = 12


@dataclass(frozen=True)
class Shown:
    """What the page shows of one experiment.

    page: its entry. folder: of its results, relative to the page. command: that made them.
    pictures, more: files shown, and files linked. key, rest: rows of figures (name, value, unit,
    paper). seconds: what the run took, in words. output: what it printed. failed: why it did not
    end well, or "".
    """

    page: object
    folder: str
    command: str
    pictures: tuple
    more: tuple
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
    key, rest = figure_rows(summary.get("figures", {}), page.figures)
    return Shown(
        page=page,
        folder=quote(page.name),
        command="python " + summary.get("command", page.command.split(" ", 1)[1]),
        pictures=pictures,
        more=tuple(name for name in files if name not in pictures and name != RUN),
        key=key,
        rest=rest,
        seconds=_seconds(summary, run),
        output=run.get("output", ""),
        failed=failed,
    )


def read_json(path):
    """Content of a JSON file, an empty dict where there is none that can be read."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        content = {}
    return content if isinstance(content, dict) else {}


def figure_rows(figures, patterns):
    """Rows (name, value, unit, paper) of the key figures, and of all others.

    figures: of summary.json. Key are those with a paper's value and those that match a pattern.
    """
    rows = [
        (in_words(name, item["unit"]), short(item["value"]), item["unit"], short(item["paper"]))
        for name, item in figures.items()
    ]
    wanted = [
        item["paper"] is not None or any(fnmatchcase(name, p) for p in patterns)
        for name, item in figures.items()
    ]
    # Those with a paper's value first, so that the cut never takes them.
    key = sorted((row for row, want in zip(rows, wanted) if want), key=lambda row: not row[3])
    rest = [row for row, want in zip(rows, wanted) if not want]
    return tuple(key[:MOST_KEY_FIGURES]), tuple(key[MOST_KEY_FIGURES:] + rest)


def in_words(name, unit):
    """A key of summary.json without underscores, and without the unit at its end."""
    if unit == "1":
        return name.replace("_", " ")
    return name.removesuffix("_" + re.sub("[ /]", "_", unit)).replace("_", " ")


def short(value):
    """A figure in words: four digits, an empty string for None."""
    if value is None or isinstance(value, str):
        return value or ""
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


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
