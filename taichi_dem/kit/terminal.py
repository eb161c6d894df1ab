"""The look of all programs: headings in bold on a terminal, plain text in a pipe or a file."""

import contextlib
import os
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

#: Most columns of a paragraph.
_WIDE = 100
#: Cells of a table that say nothing.
_BLANK = ("", "None", "nan")
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
    """Print rows of cells under a header; blanks as a dash."""
    cells = [["-" if str(cell) in _BLANK else str(cell) for cell in row] for row in rows]
    print(*aligned([[*header], *cells]), sep="\n")


def aligned(cells: Sequence[Sequence[str]]) -> list[str]:
    """Lines of rows of cells, columns as wide as they need to be."""
    widths, gap = [max(map(len, column)) for column in zip(*cells)], " " * _GAP
    padded = ([cell.ljust(width) for cell, width in zip(row, widths)] for row in cells)
    return [gap.join(row).rstrip() for row in padded]


def show_names(title: str, rows: Iterable[tuple[str, str]]) -> None:
    """Print a title and, below it, names with a line on each; nothing where there are none."""
    rows = [(f"  {name}", line) for name, line in rows]
    if rows:
        show_heading(f"\n{title}")
        print(*aligned(rows), sep="\n")


def _console():
    if sys.stdout is None or not sys.stdout.isatty():
        return None
    from rich.console import Console

    return Console(file=sys.stdout, highlight=False)


@contextlib.contextmanager
def lasting_output() -> Iterator[None]:
    """Discard prints in the block silently once their reader has left, as ``| head -1`` does."""
    if sys.stdout is None:
        yield
        return
    if hasattr(sys.stdout, "reconfigure"):
        # Question marks for characters that the encoding of the stream lacks.
        sys.stdout.reconfigure(errors="replace")
    output = _LastingOutput(sys.stdout)
    with contextlib.redirect_stdout(output):
        yield
    output.flush()


class _LastingOutput:
    """A text stream that drops text which can no longer be written."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text):
        with self._dropping():
            self._stream.write(text)
        return len(text)

    def flush(self):
        with self._dropping():
            self._stream.flush()

    @contextlib.contextmanager
    def _dropping(self):
        try:
            yield
        except OSError as error:
            if not isinstance(error, BrokenPipeError):
                print(f"standard output cannot be written to: {error.strerror}", file=sys.stderr)
            # The buffer keeps unsent text, and Python would complain of it at the exit.
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)

    def __getattr__(self, name):
        return getattr(self._stream, name)
