"""Cases that are tests: an experiment runs them with its options and keeps what they gave."""

from pathlib import Path

import pytest

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress_bar import ProgressBar

TESTS = Path(__file__).parents[1] / "tests"
#: Nothing of what the other tests need, and nothing said but by the program, which shows warnings.
PYTEST = """-s --noconftest -o addopts= --import-mode=importlib -p no:terminal -p no:cacheprovider
    -p no:warnings"""


class Asked:
    """A plugin of pytest that chooses cases by ``options.only`` and keeps what they gave.

    The tests find it as ``pytestconfig.option.asked``; their parameter ``case`` has a name.
    """

    def __init__(self, options, bar):
        self.options, self.bar = options, bar
        self.found, self.count, self.unknown, self.error = [], 0, [], None

    def pytest_configure(self, config):
        """Tell the test that it is asked."""
        config.option.asked = self

    def pytest_collection_modifyitems(self, items):
        """Keep the cases of these names."""
        given = [getattr(item, "callspec", None) for item in items]
        cases = [one and one.params.get("case") for one in given]
        names = {case.name for case in cases if case}
        only = self.options.only
        self.unknown = sorted({*(only or ())} - names)
        chosen = () if self.unknown else only or names
        items[:] = [item for item, case in zip(items, cases) if case and case.name in chosen]
        self.count = len(items)

    def pytest_keyboard_interrupt(self, excinfo):
        """Pytest keeps Ctrl-C to itself."""
        self.error = self.error or excinfo.value

    def pytest_exception_interact(self, call):
        """Keep what ended a test before it gave anything: figures out of bounds come later."""
        if not isinstance(call.excinfo.value, AssertionError):
            self.error = self.error or call.excinfo.value

    def take(self, found):
        """Keep what a test gave."""
        self.found.append(found)
        self.bar.count(len(self.found), self.count)


def found_by(name, options):
    """What the tests of the folder ``name`` gave, in their order; options: only, and theirs."""
    tests = TESTS / name / f"test_{name}.py"
    with ProgressBar(name.replace("_", " ")) as bar:
        asked = Asked(options, bar)
        pytest.main([str(tests), *PYTEST.split()], plugins=[asked])
    if asked.error:
        raise asked.error
    if asked.unknown:
        raise InputError(f"only must name cases of {tests.parent}, got {', '.join(asked.unknown)}")
    if not asked.found or len(asked.found) < asked.count:
        raise RuntimeError(f"cases broke: see pytest {tests}")
    return asked.found
