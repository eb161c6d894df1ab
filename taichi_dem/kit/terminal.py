"""The look of all programs: headings in bold on a terminal, plain text in a pipe or a file."""

import contextlib
import os
import sys
from collections.abc import Iterator, Sequence
from typing import Any

#: Cells of a table that say nothing.
_BLANK = ("", "None", "nan")


def show_heading(text: str) -> None:
    """Print a line that heads what follows."""
    from rich.console import Console

    Console(highlight=False).print(text, style="bold", markup=False, soft_wrap=True)


def print_table(rows: Sequence[Sequence[Any]], header: Sequence[str]) -> None:
    """Print rows of cells under a header; blanks as a dash."""
    cells = [["-" if str(cell) in _BLANK else str(cell) for cell in row] for row in rows]
    print(*aligned([[*header], *cells]), sep="\n")


def aligned(cells: Sequence[Sequence[str]]) -> list[str]:
    """Lines of rows of cells, columns as wide as they need to be."""
    widths = [max(map(len, column)) for column in zip(*cells)]
    padded = ([cell.ljust(width) for cell, width in zip(row, widths)] for row in cells)
    return ["  ".join(row).rstrip() for row in padded]


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
        """Write text, or drop it."""
        with self._dropping():
            self._stream.write(text)
        return len(text)

    def flush(self):
        """Flush the buffer, or drop its contents."""
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
