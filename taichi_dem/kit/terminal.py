"""The look of all programs: with style on a terminal, plain text in a pipe or a file."""

import os
import sys
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

#: Most columns of a paragraph.
_WIDE = 100
#: Cells of a table that say nothing.
BLANK = ("", "None", "nan")
#: Blanks between two columns.
_GAP = 2


def show_heading(text: str) -> None:
    """Print a line that heads what follows."""
    console = _console()
    if console is None:
        print(text)
    else:
        console.print(text, style="bold", markup=False)


def show_paragraph(text: str) -> None:
    """Print a text in lines of at most 100 characters, or as many as the terminal has columns."""
    console = _console()
    print(textwrap.fill(text, _WIDE if console is None else min(_WIDE, console.width)))


def print_table(rows: Sequence[Sequence[Any]], header: Sequence[str]) -> None:
    """Print rows of cells under a header, columns as wide as they need to be; blanks as a dash.

    Parameters
    ----------
    rows, header
        Cells and names of the columns, as many in each row. On a terminal that is too narrow, cells
        go on in further lines of their column; where even words do not fit, columns go on in
        further tables, each with the first column.
    """
    filled = [["-" if str(cell) in BLANK else str(cell) for cell in row] for row in rows]
    cells, console = [[*header], *filled], _console()
    if console is None:
        print(*aligned(cells), sep="\n")
        return
    least = [max(len(word) for row in cells for word in [*row[k].split(), ""]) for k in _of(cells)]
    # A name that takes more than half of a line is cut.
    least = [min(width, (console.width - _GAP) // 2) for width in least]
    for number, part in enumerate(_parts(least, console.width)):
        print(end="\n" if number else "")
        _show_styled(console, [[row[k] for k in part] for row in cells], [least[k] for k in part])


def _of(cells):
    """Numbers of the columns."""
    return range(len(cells[0]))


def _parts(least, width):
    """Numbers of the columns of each table, as many as fit at their least widths."""
    parts = [[0]]
    for k in range(1, len(least)):
        if sum(least[i] + _GAP for i in parts[-1]) + least[k] > width and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(k)
    return parts


def _show_styled(console, cells, least):
    """A table by rich, its widest columns as narrow as the terminal asks for."""
    from rich.table import Table
    from rich.text import Text

    widths = [max(len(row[k]) for row in cells) for k in _of(cells)]
    while sum(widths) + _GAP * (len(widths) - 1) > console.width and widths != least:
        widest = max(_of(cells), key=lambda k: widths[k] if widths[k] > least[k] else -1)
        widths[widest] -= 1
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, _GAP, 0, 0))
    for name, width in zip(cells[0], widths):
        table.add_column(Text(name), overflow="fold", width=width)
    for row in cells[1:]:
        table.add_row(*map(Text, row))
    console.print(table)


def aligned(cells: Sequence[Sequence[str]]) -> list[str]:
    """Lines of rows of cells, columns as wide as they need to be."""
    widths, gap = [max(len(row[k]) for row in cells) for k in _of(cells)], " " * _GAP
    padded = ([cell.ljust(width) for cell, width in zip(row, widths)] for row in cells)
    return [gap.join(row).rstrip() for row in padded]


def show_names(title: str, rows: Iterable[tuple[str, str]]) -> None:
    """Print a title and, below it, names with a line on each; nothing where there are none.

    Lines stand beside their names, or below them where the terminal is too narrow for that.
    """
    rows = list(rows)
    if not rows:
        return
    show_heading(f"\n{title}")
    console, width = _console(), max(len(name) for name, _ in rows)
    lines = [f"  {name:{width}}  {line}".rstrip() for name, line in rows]
    if console is None or max(map(len, lines)) <= console.width:
        print(*lines, sep="\n")
        return
    from rich.padding import Padding
    from rich.text import Text

    for name, line in rows:
        print(f"  {name}")
        if line:
            console.print(Padding(Text(line, style="dim"), (0, 0, 0, 6)))


def _console():
    """Rich's console on standard output, None where that is no terminal or one without style."""
    if sys.stdout is None or not sys.stdout.isatty() or os.environ.get("TERM") == "dumb":
        return None
    from rich.console import Console

    return Console(file=sys.stdout, highlight=False)
