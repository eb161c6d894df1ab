"""Lists of the contents of a package, made from its modules and their docstrings."""

import argparse
import ast
import inspect
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType

from taichi_dem.kit.terminal import aligned, lasting_output, show_heading
from taichi_dem.kit.validation import shown
from taichi_dem.kit.version import __version__


def run(
    package: ModuleType,
    parts: Mapping[str, ModuleType],
    arguments: Sequence[str] | None = None,
) -> int:
    """Print what a package offers."""
    given = sys.argv[1:] if arguments is None else [*arguments]
    if given[:1] == ["demo"]:
        return import_module(f"{package.__name__}.demo").main(given[1:])
    script = Path(str(package.__file__)).with_name("demo.py")
    demo = _first_line(ast.get_docstring(ast.parse(script.read_bytes())))
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


def _first_line(docstring):
    return inspect.cleandoc(docstring or "").partition("\n")[0]
