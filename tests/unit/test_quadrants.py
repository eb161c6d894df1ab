"""The stand-in for Taichi and the list of ``make test-quadrants``, tried without Quadrants."""

import os
import subprocess
import sys
from types import SimpleNamespace

from tests.docs.pages import FOLDER
from tests.processes import users_environment
from tests.quadrants import report

#: A package that has the name of Quadrants, and what a user of Taichi asks of it.
PACKAGE = {
    "quadrants/__init__.py": "class QuadrantsRuntimeError(Exception): pass",
    "quadrants/lang/__init__.py": "from quadrants import QuadrantsRuntimeError",
    "quadrants/lang/impl.py": "settings = object()",
}
PROGRAM = """
import taichi as ti
import taichi.lang
from taichi.lang import impl
from taichi.lang.impl import settings
import quadrants, quadrants.lang.impl
assert ti is quadrants and impl is quadrants.lang.impl and settings is impl.settings
assert ti.TaichiRuntimeError is quadrants.QuadrantsRuntimeError
assert taichi.lang.TaichiRuntimeError is quadrants.QuadrantsRuntimeError
assert impl.__spec__.name == impl.__name__ == "quadrants.lang.impl"
try:
    import taichi.absent
except ModuleNotFoundError as error:
    print(error)
"""


def test_taichi_is_the_very_modules_of_quadrants_and_errors_have_both_names(tmp_path):
    for name, text in PACKAGE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    path = os.pathsep.join([str(FOLDER / "tests/quadrants/alias"), str(tmp_path)])
    options = {"capture_output": True, "text": True, "cwd": tmp_path}
    line = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(line, env=users_environment(PYTHONPATH=path), **options)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "No module named 'quadrants.absent'\n"


def failure(test, message):
    """A test that has failed, as pytest tells of it."""
    crash = SimpleNamespace(message=message)
    longrepr = SimpleNamespace(reprcrash=crash)
    return outcome(test, "failed", longrepr=longrepr, failed=True)


def outcome(test, word, when="call", **more):
    given = {"nodeid": test, "outcome": word, "when": when, "longrepr": None, "failed": False}
    return SimpleNamespace(**{**given, **more})


def test_failures_are_grouped_by_reasons_that_differ_in_numbers_alone(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "quadrants", SimpleNamespace(__version__=(9, 8, 7)))
    made = report.Report(tmp_path / "deep" / "list.txt")
    for k in range(10):
        made.pytest_runtest_logreport(failure(f"tests/a/t.py::one[{k}]", f"assert {k}.5 == 1e-{k}"))
    made.pytest_runtest_logreport(failure("tests/b/t.py::two", "AttributeError: no 'x'\nmore"))
    made.pytest_runtest_logreport(outcome("tests/a/t.py::three", "passed", "setup"))
    made.pytest_runtest_logreport(outcome("tests/a/t.py::three", "passed"))
    made.pytest_runtest_logreport(outcome("tests/b/t.py::four", "skipped", "setup"))
    made.pytest_sessionfinish()
    lines = (tmp_path / "deep" / "list.txt").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("Quadrants 9.8.7 in place of Taichi")
    assert lines[1] == "1 passed, 11 failed, 1 skipped"
    assert lines[2:4] == [
        "  tests/a: 1 passed, 10 failed, 0 skipped",
        "  tests/b: 0 passed, 1 failed, 1 skipped",
    ]
    assert "10 failed: assert # == #" in lines and "1 failed: AttributeError: no …" in lines
    assert f"    and {10 - report.NAMED} more" in lines
