"""Texts on a study for its page and its program, read from a file beside the scripts."""

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from taichi_dem.kit.terminal import show_heading

#: Key figures that are shown.
MOST_FIGURES = 12
#: File of the entries in the folder of the scripts.
ENTRIES = "_gallery_pages.txt"
#: Python as a user types it in a checkout: no environment has to be active.
PYTHON = ".venv/bin/python"


@dataclass(frozen=True)
class Entry:
    """Description of one study.

    time, quick: CPU seconds of the full and the quick run, with compiling, or words until these are
    measured. figures: patterns of key figures; those with a paper's value are always shown.
    """

    name: str
    part: str
    question: str
    look: str
    time: str
    quick: str
    pictures: tuple
    figures: tuple = ()
    paper: str = ""
    options: str = ""

    @property
    def command(self) -> str:
        """Command line of a user."""
        return " ".join(filter(None, [f"{PYTHON} experiments/{self.name}.py", self.options]))

    def expected_time(self, quick: bool) -> str:
        """Time in words, such as "34 s of CPU", "20 s on two cores" or "5 min on one core"."""
        words = (self.quick if quick else self.time).removeprefix("about ")
        if words.isdecimal():
            return f"{words} s of CPU"
        return f"{words} core" if words.endswith(" on one") else f"{words} on two cores"


def read_entries(path: str | Path) -> tuple[Entry, ...]:
    """Entries of a text file: "# part", "## name", and lines "field: text", indented to go on."""
    part, entries = "", []
    for block in Path(path).read_text(encoding="utf-8").split("\n\n"):
        head, *lines = re.sub(r"\n  +", " ", block).strip().split("\n")
        if head.startswith("# "):
            part = head[2:]
        elif head.startswith("## "):
            fields: Any = dict(line.split(": ", 1) for line in lines)
            words = {name: tuple(fields.get(name, "").split()) for name in ("pictures", "figures")}
            entries.append(Entry(name=head[3:], part=part, **{**fields, **words}))
    return tuple(entries)


def entry_of(run: Callable) -> Entry | None:
    """Entry of the script in which a function is defined; None where it has none."""
    try:
        script = Path(inspect.getfile(inspect.unwrap(run)))
    except TypeError:
        return None
    path = script.parent / ENTRIES
    known = read_entries(path) if path.is_file() else ()
    return next((entry for entry in known if entry.name == script.stem), None)


def key_figures(figures: Mapping[str, Mapping], patterns: Sequence[str]) -> list[str]:
    """Names of the figures of summary.json to show first, those of a paper before others."""
    compared = [name for name, pattern in figures.items() if pattern["paper"] is not None]
    matching = [name for name in figures if any(fnmatchcase(name, pattern) for pattern in patterns)]
    return list(dict.fromkeys([*compared, *matching]))[:MOST_FIGURES]


def show_opening(description: str | None, entry: Entry | None, quick: bool = False) -> None:
    """Print what a program does, and how long it is expected to take where that is known."""
    show_heading(entry.question if entry else (description or "").strip().partition("\n")[0])
    if entry:
        smaller = "" if quick else f"; with --quick {entry.expected_time(quick=True)}"
        # A pipe or a file shows it before the work, too.
        print(f"Takes about {entry.expected_time(quick)}{smaller}.\n", flush=True)


def with_time(text: str, name: str, field: str, seconds: float) -> str:
    """Text of entries with the CPU time [s] of one, in its field time or quick, to two digits."""
    rounded = f"{float(f'{seconds:.2g}'):.0f}"
    mark = rf"(^## {name}\n(?:(?!## ).*\n)*?{field}: ).*"
    return re.sub(mark, rf"\g<1>{rounded}", text, count=1, flags=re.MULTILINE)
