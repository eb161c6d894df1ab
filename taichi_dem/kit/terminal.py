"""The look of all programs, and the one that lists the contents of a package.

Headings are bold on a terminal, plain text in a pipe or a file.
"""

import argparse
import ast
import contextlib
import inspect
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from taichi_dem.kit.validation import shown
from taichi_dem.kit.version import __version__

#: Cells of a table that say nothing.
_BLANK = ("", "None", "nan")
_ROOT = Path(__file__).resolve().parents[2]
_IS_CHECKOUT = (_ROOT / "experiments" / "_gallery_pages.txt").is_file()


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


def list_contents(
    package: ModuleType,
    parts: Mapping[str, ModuleType],
    arguments: Sequence[str] | None = None,
) -> int:
    """Print what a package offers, and its experiments."""
    given = sys.argv[1:] if arguments is None else [*arguments]
    if given[:1] == ["demo"]:
        return import_module(f"{package.__name__}.demo").main(given[1:])
    demo = _docstring(Path(str(package.__file__)).with_name("demo.py"))
    parser = argparse.ArgumentParser(
        prog=f"python -m {package.__name__}",
        description=f"List what {package.__name__} offers, with the first line of each docstring. "
        f"With the word demo: {demo} It has options of its own (demo --help).",
    )
    parser.add_argument("--version", action="version", version=f"taichi-dem {__version__}")
    parser.parse_args(given)
    with lasting_output():
        show_heading(f"{package.__name__} {__version__}: {_first_line(package.__doc__)}")
        for title, module in {**parts, "Scenes, runs and results": package}.items():
            _show(title, _rows(module))
        _show("Demonstration", [(f"python -m {package.__name__} demo", demo)])
        if _IS_CHECKOUT:
            _show(f"Experiments, in {_ROOT}", _experiments())
    return 0


def _show(title, rows):
    """Print a title and, below it, names with a line on each."""
    show_heading(f"\n{title}")
    print(*aligned([(f"  {name}", line) for name, line in rows]), sep="\n")


def _rows(module):
    """Rows of the public names of a module: of its ``__all__``, or of what it itself defines."""
    own = [name for name, thing in vars(module).items() if _is_own(name, thing, module)]
    for name in getattr(module, "__all__", own):
        thing = getattr(module, name)
        documented = inspect.isclass(thing) or inspect.isroutine(thing) or inspect.ismodule(thing)
        line = _first_line(thing.__doc__) if documented else shown(thing)
        yield f"{module.__name__}.{name}", line


def _is_own(name, thing, module):
    return name[0] != "_" and getattr(thing, "__module__", "") == module.__name__


def _experiments():
    """Rows of the scripts of a checkout; they are read, not run."""
    for path in sorted((_ROOT / "experiments").glob("[a-z]*.py")):
        yield f"python experiments/{path.name}", _docstring(path)


def _docstring(path):
    """First line of the docstring of a script."""
    return _first_line(ast.get_docstring(ast.parse(path.read_bytes())))


def _first_line(docstring):
    return inspect.cleandoc(docstring or "").partition("\n")[0]
