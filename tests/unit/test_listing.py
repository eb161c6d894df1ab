"""``python -m taichi_dem`` and ``python -m ca_damper``: names with their first lines."""

import importlib
import inspect
import os
import pkgutil
import subprocess
import sys

import pytest

import ca_damper
import taichi_dem
from taichi_dem import effects, methods
from taichi_dem.effects.base import Effect
from taichi_dem.kit import listing
from taichi_dem.mesh import shapes as mesh_shapes
from tests.docs.pages import FOLDER, PAGES, headings

PACKAGES = (taichi_dem, ca_damper)


def sections(package):
    """Rows {name: line} by title."""
    main = importlib.import_module(f"{package.__name__}.__main__")
    return {title: dict(rows) for title, rows in main.sections()}


def printed(package, capsys, arguments=()):
    main = importlib.import_module(f"{package.__name__}.__main__")
    listing.run(package, main.sections(), arguments)
    return capsys.readouterr().out


def started(*arguments, **options):
    """A process of its own, in another folder than this one."""
    line = [sys.executable, "-m", *arguments]
    return subprocess.run(line, cwd=options.pop("cwd", "/"), text=True, timeout=60, **options)


def members(module, kind):
    """Public members of a class that a module and those below it define."""
    found = [module]
    for below in pkgutil.iter_modules(getattr(module, "__path__", ())):
        found.append(importlib.import_module(f"{module.__name__}.{below.name}"))
    return {
        thing
        for owner in found
        for name, thing in inspect.getmembers(owner, inspect.isclass)
        if issubclass(thing, kind) and not name.startswith("_")
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_of_the_front_page_has_a_line(package):
    rows = {name: line for part in sections(package).values() for name, line in part.items()}
    for name in package.__all__:
        thing = getattr(package, name)
        if not name.startswith("__"):
            line = rows[f"{package.__name__}.{name}"]
            assert line and line == line.strip() and "\n" not in line, name
            if inspect.isclass(thing) or inspect.isfunction(thing):
                assert line == inspect.getdoc(thing).splitlines()[0]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_listed_can_be_imported(package):
    for part in sections(package).values():
        for name in part:
            assert pkgutil.resolve_name(name) is not None


def test_effects_methods_and_fillings_are_those_that_act_as_such():
    """Null objects of effects/base.py are no choice of a user, nor abstract bases."""
    listed = {pkgutil.resolve_name(name) for name in sections(taichi_dem)["Effects"]}
    whole = {e for e in members(effects, Effect) if not inspect.isabstract(e)}
    assert listed == {e for e in whole if e.__module__ != Effect.__module__}
    listed = {pkgutil.resolve_name(name) for name in sections(taichi_dem)["Methods"]}
    assert listed == {m for m in members(methods, object) if hasattr(m, "criterion")}
    names = sections(ca_damper)["Fillings"]
    assert all(hasattr(pkgutil.resolve_name(name), "bind") for name in names)
    assert {"ca_damper.Automaton", "ca_damper.Spheres"} <= set(names)


def test_what_is_added_is_listed(monkeypatch):
    class Wind(Effect):
        """Drag of the air.

        More of it.
        """

    def ring():
        """A ring of tetrahedra."""

    ring.__module__ = mesh_shapes.__name__
    monkeypatch.setattr(effects, "Wind", Wind, raising=False)
    monkeypatch.setattr(effects, "__all__", [*effects.__all__, "Wind"])
    monkeypatch.setattr(mesh_shapes, "ring", ring, raising=False)
    made = sections(taichi_dem)
    assert made["Effects"]["taichi_dem.effects.Wind"] == "Drag of the air."
    assert made["Meshes"]["taichi_dem.mesh.shapes.ring"] == "A ring of tetrahedra."


def test_a_constant_has_the_comment_above_it():
    assert sections(taichi_dem)["Materials"]["taichi_dem.CONCRETE"].startswith("Concrete of Konno")
    assert "966 tetrahedra" in sections(taichi_dem)["Meshes"]["taichi_dem.PAPER_BLOCK"]


@pytest.mark.parametrize("package", PACKAGES)
def test_a_checkout_lists_its_experiments_and_pages(package, capsys):
    said = printed(package, capsys)
    for path in (FOLDER / "experiments").glob("*.py"):
        assert (f"experiments/{path.name} " in said) == (not path.name.startswith("_"))
    for page in PAGES:
        title = next(text for _, text in headings(page))
        assert any(line.split(None, 1) == [page, title] for line in said.splitlines()), page


def test_what_is_no_checkout_has_none_and_a_draft_has_no_line(tmp_path):
    (tmp_path / "experiments").mkdir()
    (tmp_path / "experiments" / "_gallery_pages.txt").touch()
    (tmp_path / "experiments" / "draft.py").write_bytes(b'"""Not yet."""\ndef (\xff')
    (tmp_path / "README.md").write_bytes(b"no title\n# A \xff page\n")
    assert listing.experiments(tmp_path) == []
    assert [name for name, _ in listing.documentation(tmp_path)] == ["python -m pydoc NAME"]
    (tmp_path / "pyproject.toml").touch()
    assert listing.experiments(tmp_path) == [("python experiments/draft.py", "")]
    assert ("README.md", "A \ufffd page") in listing.documentation(tmp_path)


@pytest.mark.parametrize("package", PACKAGES)
def test_it_runs_from_any_folder_as_a_module(package, tmp_path):
    done = started(package.__name__, cwd=tmp_path, capture_output=True)
    assert done.returncode == 0 and done.stderr == ""
    assert done.stdout.startswith(f"{package.__name__} {package.__version__}: ")


def test_it_ends_in_silence_when_nobody_reads(tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    done = started("taichi_dem", stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert done.stderr == "" and done.returncode == 0


def test_what_it_does_not_know_is_refused_in_words():
    done = started("ca_damper", "--all", capture_output=True)
    assert done.returncode == 2 and "unrecognized arguments: --all" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="only Linux has a disk that is full")
@pytest.mark.parametrize("package", PACKAGES)
def test_output_that_cannot_be_written_is_one_sentence(package):
    with open("/dev/full", "w") as full:
        done = started(package.__name__, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 0
    assert done.stderr == "standard output cannot be written to: No space left on device\n"
