"""The automaton by the rules of the paper, and runs of it where it is known to fail."""

import contextlib
from functools import partial

import pytest

from ca_damper import Automaton, Paper
from ca_damper.report.certificate import checked_range

#: An Automaton with other options than the rules.
paper = partial(Automaton, Paper())
#: The same where landings and pushes alone act on the container.
ejecting = partial(Automaton, Paper("landing+ejection"))


def outside():
    """Expect the warning of a run of the paper's rules where they are known to fail."""
    return pytest.warns(UserWarning, match="rules 'paper' of the automaton are known to fail with")


def expected(batch):
    """Expect that warning where the range that a batch was checked in asks for it, or nothing."""
    found = checked_range(batch)
    return outside() if found is not None and found.warning else contextlib.nullcontext()
