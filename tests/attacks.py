"""Options of the attacks: a test marked ``attack`` that takes a seed is run once for each of them.

An attack that takes more than ten minutes ends its process, which pytest-xdist names.
"""

import faulthandler
import sys

import pytest

HANGS_AFTER_S = 600.0


def pytest_addoption(parser):
    """How many seeds, from which on."""
    group = parser.getgroup("attacks")
    group.addoption("--attacks", type=int, default=1, metavar="N", help="seeds of each attack")
    group.addoption("--attack-seed", type=int, default=0, metavar="S", help="the first of them")


def pytest_generate_tests(metafunc):
    """One test a seed."""
    if metafunc.definition.get_closest_marker("attack") and "seed" in metafunc.fixturenames:
        first = metafunc.config.getoption("--attack-seed")
        seeds = range(first, first + metafunc.config.getoption("--attacks"))
        metafunc.parametrize("seed", seeds)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """A hang counts as a failure."""
    if item.get_closest_marker("attack"):
        faulthandler.dump_traceback_later(HANGS_AFTER_S, exit=True, file=sys.__stderr__)
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()
