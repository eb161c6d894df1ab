"""Lists of the contents of a package, made from its modules and their docstrings.

``python -m taichi_dem`` and ``python -m ca_damper`` print them. A section is a title and rows
(name, line); names are dotted, as ``import`` and ``python -m pydoc`` take them.
"""

import argparse
import ast
import inspect
import pkgutil
import sys
from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType

from taichi_dem.kit.terminal import lasting_output, show_heading, show_names
from taichi_dem.kit.version import __version__

#: Name and line; title and rows.
Row = tuple[str, str]
Section = tuple[str, list[Row]]

_ROOT = Path(__file__).resolve().parents[2]
_PACKAGES = ("taichi_dem", "ca_damper")


def run(
    package: ModuleType, sections: Iterable[Section], arguments: Sequence[str] | None = None
) -> int:
    """Print the sections of a package, its experiments and where its documentation is.

    With "demo" as first argument, run the module of that name with the others instead. Returns the
    exit code.
    """
    given = sys.argv[1:] if arguments is None else [*arguments]
    if given[:1] == ["demo"]:
        return import_module(f"{package.__name__}.demo").main(given[1:])
    demo = first_line(_docstring(Path(str(package.__file__)).with_name("demo.py")))
    parser = argparse.ArgumentParser(
        prog=f"python -m {package.__name__}",
        description=f"List what {package.__name__} offers, with the first line of each docstring. "
        f"With the word demo: {demo} It has options of its own (demo --help).",
    )
    parser.add_argument("--version", action="version", version=f"taichi-dem {__version__}")
    parser.parse_args(given)
    where = f", in {_ROOT}" if _is_checkout(_ROOT) else ""
    tail = [
        ("Demonstration", [(f"python -m {package.__name__} demo", demo)]),
        (f"Experiments{where}", experiments(_ROOT)),
        (f"Documentation{where}", [*_other_lists(package), *documentation(_ROOT)]),
    ]
    with lasting_output():
        show_heading(f"{package.__name__} {__version__}: {first_line(package.__doc__)}")
        for title, rows in [*sections, *tail]:
            show_names(title, rows)
    return 0


def first_line(docstring: str | None) -> str:
    """First line of a docstring, "" where there is none."""
    return inspect.cleandoc(docstring or "").partition("\n")[0]


def described(prefix: str, owner: object, names: Iterable[str]) -> list[Row]:
    """Rows of the members of a module that bear these names, called prefix.name."""
    return [(f"{prefix}.{name}", _line(owner, name)) for name in names]


def own(module: ModuleType, kind: Callable[[object], bool]) -> list[str]:
    """Public names that a module itself defines, in order; kind: such as inspect.isclass."""
    return [
        name
        for name, thing in vars(module).items()
        if not name.startswith("_") and kind(thing) and thing.__module__ == module.__name__
    ]


def instances(module: ModuleType, kind: type) -> list[str]:
    """Names of the public constants of a class that a module holds."""
    return [
        name
        for name, thing in vars(module).items()
        if not name.startswith("_") and isinstance(thing, kind)
    ]


def modules(package: ModuleType) -> list[ModuleType]:
    """Modules of a package, in order of their names."""
    names = [found.name for found in pkgutil.iter_modules(package.__path__)]
    return [import_module(f"{package.__name__}.{name}") for name in names]


def experiments(root: Path) -> list[Row]:
    """Rows of the scripts of a checkout, none elsewhere; they are read, not run."""
    if not _is_checkout(root):
        return []
    paths = sorted((root / "experiments").glob("[a-z]*.py"))
    return [(f"python experiments/{path.name}", first_line(_docstring(path))) for path in paths]


def documentation(root: Path) -> list[Row]:
    """Rows of pages by their first headings, of a checkout or of an installation."""
    rows = [("python -m pydoc NAME", "all that a name above does: arguments, units, errors")]
    if not _is_checkout(root):
        about = root.glob("taichi_dem-*.dist-info/METADATA")
        return rows + [(str(page), "README, below the lines on the package") for page in about]
    pages = [*sorted(root.glob("*.md")), *sorted((root / "docs").glob("*.md"))]
    rows += [(page.relative_to(root).as_posix(), _heading(page)) for page in pages]
    return [*rows, ("make docs", "a site of all pages, the API and the gallery")]


def _other_lists(package):
    others = [name for name in _PACKAGES if name != package.__name__]
    return [(f"python -m {name}", "the same list for that package") for name in others]


def _is_checkout(root):
    marks = "pyproject.toml", "experiments/_gallery_pages.txt"
    return all((root / mark).is_file() for mark in marks)


def _line(owner, name):
    """First line on a member: of its docstring, or of the comment ``#:`` above a constant."""
    thing = getattr(owner, name)
    if inspect.ismodule(thing) or inspect.isclass(thing) or inspect.isroutine(thing):
        return first_line(inspect.getdoc(thing))
    before = inspect.getsource(owner).partition(f"\n{name} = ")[0]
    return before.rpartition("\n")[2].partition("#: ")[2]


def _docstring(path):
    """Docstring of a script; "" for one that Python cannot read, such as a draft."""
    try:
        return ast.get_docstring(ast.parse(path.read_bytes()))
    except (SyntaxError, ValueError):
        return ""


def _heading(page):
    lines = page.read_text(encoding="utf-8", errors="replace").splitlines()
    return next((line[2:] for line in lines if line.startswith("# ")), "")
