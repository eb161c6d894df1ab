"""What every study says in the same way: question and time before it, figures and files after."""

import os
from collections.abc import Mapping
from typing import Any

from taichi_dem.kit.files import older_files
from taichi_dem.kit.study.entries import Entry, is_key_figure
from taichi_dem.kit.terminal import print_table, show_heading

#: Most figures of a table, and most pictures of a list.
_MOST = 12
#: Endings of what is looked at.
_PICTURES = (".png", ".gif", ".mp4", ".html")


def show_opening(description: str | None, entry: Entry | None, quick: bool = False) -> None:
    """Print what a program does, and how long it is expected to take where that is known."""
    line = entry.question if entry else (description or "").strip().partition("\n")[0]
    show_heading(line)
    if entry:
        smaller = "" if quick else f"; with --quick {entry.quick}"
        # A pipe or a file shows it before the work, too.
        print(f"Takes about {entry.expected_time(quick)}{smaller}.\n", flush=True)


def print_figures(figures: Mapping[str, dict], entry: Entry | None = None) -> None:
    """Print figures of summary.json, beside the paper's values where it gives any.

    entry: of the study; with one only the key figures are printed, those of a paper first, and no
    more than a dozen.
    """
    shown = [*figures] if entry is None else _key_names(figures, entry)
    header, rows = ["figure", "value", "unit", "paper"], []
    for name in shown:
        one = figures[name]
        paper = "" if one["paper"] is None else value_in_words(one["paper"])
        rows.append([name, value_in_words(one["value"]), one["unit"], paper])
    columns = 4 if any(row[3] for row in rows) else 3
    print_table([row[:columns] for row in rows], header[:columns])
    if len(shown) < len(figures):
        print(f"and {len(figures) - len(shown)} more in summary.json")


def _key_names(figures, entry):
    key = [name for name, one in figures.items() if is_key_figure(name, one, entry.figures)]
    key = sorted(key or figures, key=lambda name: figures[name]["paper"] is None)
    return key[:_MOST]


def value_in_words(value: Any) -> str:
    """A figure's value: four digits, or "not found" where the run looked for one in vain."""
    if value is None or isinstance(value, str):
        return value or "not found"
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


def show_files(folder: str, since: float = 0.0, first: tuple[str, ...] = ()) -> None:
    """Print the paths of the pictures in a folder, and where everything else is.

    since: when the run began, as of ``time.time``; what is older is not named. first: names of
    pictures in the order in which they tell most.
    """
    names = set(os.listdir(folder)) - set(older_files(folder, since))
    made = sorted(name for name in names if name.endswith(_PICTURES) and not name.startswith("."))
    made.sort(key=lambda name: first.index(name) if name in first else len(first))
    print()
    if made:
        show_heading("Pictures")
        print(*(f"  {os.path.join(folder, name)}" for name in made[:_MOST]), sep="\n")
    if len(made) > _MOST:
        print(f"  and {len(made) - _MOST} more")
    print(f"Tables and all figures are in {folder}")
