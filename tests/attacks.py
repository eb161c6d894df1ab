"""The frame of the attacks: a pytest plugin that draws seeds, counts, and writes the table.

A module that says ``ATTACKS = "title of its class"`` holds attacks. A test of it that takes the
argument ``seed`` is run once a seed, another one once. Whatever ends a test counts against its
class: a failed assertion, the death of the process, or more than five minutes.
"""

import ast
import faulthandler
import functools
import sys
import time
from pathlib import Path

import pytest

from taichi_dem.kit.files import write_text

BEGIN, END = "<!-- attacks: begin -->", "<!-- attacks: end -->"
HANGS_AFTER_S = 300.0
#: Exit codes of pytest after a run that came to its end: all passed, some failed.
_WHOLE = (0, 1)
_began = time.monotonic()


def pytest_addoption(parser):
    """How many attacks, and where the table goes."""
    group = parser.getgroup("attacks")
    group.addoption("--attacks", type=int, default=1, metavar="N", help="seeds an attack")
    group.addoption("--attack-seed", type=int, default=0, metavar="S", help="first seed")
    group.addoption(
        "--attack-minutes",
        type=float,
        metavar="M",
        help="all attacks of a seed before the next seed, and none is begun after M minutes",
    )
    group.addoption("--attack-table", type=Path, metavar="PAGE", help="write the table there")


def pytest_configure(config):
    """Count where the table is wanted; of several processes the one that hears of all."""
    page = config.getoption("--attack-table")
    if page is not None and not hasattr(config, "workerinput"):
        _parts(page)
        seeds = range_of_seeds(config)
        config.pluginmanager.register(Counter(config.rootpath, page, seeds))


def range_of_seeds(config):
    """Seeds that the options ask for."""
    first, count = config.getoption("--attack-seed"), config.getoption("--attacks")
    if first < 0 or count < 1:
        raise pytest.UsageError("--attack-seed must be at least 0, --attacks at least 1")
    return range(first, first + count)


def pytest_generate_tests(metafunc):
    """One test a seed."""
    if hasattr(metafunc.module, "ATTACKS") and "seed" in metafunc.fixturenames:
        metafunc.parametrize("seed", range_of_seeds(metafunc.config))


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    """All attacks of a seed before the next one, where time may run out."""
    if config.getoption("--attack-minutes") is not None:
        items.sort(key=_seed)


def _seed(item):
    """Seed of a test; those without one come first."""
    return item.callspec.params.get("seed", -1) if hasattr(item, "callspec") else -1


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """An attack that hangs ends its process, which counts as a failure like any other crash."""
    if not hasattr(item.module, "ATTACKS"):
        return (yield)
    faulthandler.dump_traceback_later(HANGS_AFTER_S, exit=True, file=sys.__stderr__)
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


def pytest_runtest_setup(item):
    """Leave out what there is no time for."""
    minutes = item.config.getoption("--attack-minutes")
    if minutes is not None and time.monotonic() - _began > 60.0 * minutes:
        pytest.skip("no time left")


@functools.cache
def class_of(file):
    """The class of attacks of a module, which may be one that cannot be imported; else None."""
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "ATTACKS":
            return ast.literal_eval(node.value)
    return None


class Counter:
    """Counts the attacks of a run by class, and writes the table at its end."""

    def __init__(self, root, page, seeds):
        self.root, self.page, self.seeds = root, page, seeds
        self.survived = {}

    def pytest_runtest_logreport(self, report):
        """Note what became of a test; one that is skipped has not been tried."""
        if report.failed:
            self.survived[report.nodeid] = False
        elif report.skipped:
            if hasattr(report, "wasxfail"):
                self.survived[report.nodeid] = False
        elif report.when == "call":
            self.survived.setdefault(report.nodeid, True)

    def pytest_collectreport(self, report):
        """A module that cannot be imported is an attack that failed."""
        if report.failed:
            self.survived[report.nodeid] = False

    def pytest_sessionfinish(self, session, exitstatus):
        """Put the table into the page, unless the run was cut short."""
        if exitstatus in _WHOLE and self.survived:
            write_table(self.page, self.counts(), self.seeds)

    def counts(self):
        """Tried and survived by class."""
        found = {}
        for nodeid, survived in self.survived.items():
            file = self.root / nodeid.split("::")[0]
            title = class_of(file) if file.suffix == ".py" and file.is_file() else None
            if title is not None:
                tried, passed = found.get(title, (0, 0))
                found[title] = (tried + 1, passed + survived)
        return found


def write_table(page, counts, seeds):
    """Renew the table of a page; classes that were not attacked keep their rows."""
    before, table, after = _parts(page)
    counts = {**dict(table_rows(table)), **counts}
    lines = ["", "| class | tried | survived |", "|---|---|---|"]
    for title in sorted(counts):
        tried, survived = counts[title]
        lines.append(f"| {title} | {tried} | {survived} |")
    total = [sum(column) for column in zip(*counts.values())]
    lines += [f"| together | {total[0]} | {total[1]} |", ""]
    lines += [f"Last run: seeds {seeds[0]} to {seeds[-1]}.", ""]
    write_text(page, f"{before}{BEGIN}" + "\n".join(lines) + f"{END}{after}")


def table_rows(text):
    """(class, (tried, survived)) of each row of a table that has been written."""
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 3 and cells[1].isdigit() and cells[0] != "together":
            yield cells[0], (int(cells[1]), int(cells[2]))


def _parts(page):
    """Text before, in and after the marked part of a page."""
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    before, begin, rest = text.partition(BEGIN)
    table, end, after = rest.partition(END)
    if not begin or not end:
        raise pytest.UsageError(f"{page} must be a page with the lines {BEGIN} and {END}")
    return before, table, after
