"""What the automaton refuses, in one sentence with the allowed range."""

import math

import pytest

from ca_damper.automaton import ACCOUNTINGS, Automaton
from ca_damper.errors import InputError
from tests.paper import paper

BAD = [
    ("accounting", "force", "landing, landing\\+ejection, all"),
    ("pair_rule", "none", "both, one_sided"),
    ("priority", "first", "random, pairs_first"),
    ("accumulator", "zero", "signed, signed_through_walls, reset, kept"),
    ("traversal", "tree", "list, scan"),
    ("restitution", 1.01, r"\[0, 1\]"),
    ("restitution", math.nan, r"\[0, 1\]"),
    ("wall_restitution", -0.1, r"\[0, 1\]"),
    ("width", 0.0, "positive"),
    ("particle_mass", 0.0, "positive"),
    ("particle_mass", -1e-3, "positive"),
    ("gravity", math.inf, "finite"),
    ("static_threshold", -1.0, "zero or a positive"),
    ("v_max", math.nan, "positive"),
    ("columns", 0, "from 1"),
    ("rows", 2.5, "whole number"),
    ("rows", 4000, "fewer than 4096 cells"),
    ("start", ((0, 16),), r"\(0, 0\) to \(9, 15\)"),
    ("start", ((1, 1), (1, 1)), "twice"),
    ("start", 7, "tuple"),
    ("start", ((0.5, 1),), "hold"),
    ("ledger", "yes", "True or False"),
    ("static_contact", "yes", "True or False"),
]


@pytest.mark.parametrize("name, value, allowed", BAD)
def test_bad_options_are_refused_by_name(name, value, allowed):
    with pytest.raises(InputError, match=f"{name}.*{allowed}") as refused:
        Automaton(**{name: value})
    assert "\n" not in str(refused.value)


def test_priority_without_conflicts_is_refused():
    """With one-sided pairs no events compete: the option would do nothing."""
    with pytest.raises(InputError, match="priority must be 'random'"):
        paper(pair_rule="one_sided", priority="pairs_first")


def test_ledger_without_anything_to_write_down_is_refused():
    """With static contact everything acts on the container."""
    with pytest.raises(InputError, match="ledger must be False"):
        paper(ledger=True)


@pytest.mark.parametrize("particles", [-1, 161, 1.5, math.nan, True])
def test_particles_must_fit(particles):
    with pytest.raises(InputError, match="particles must be a whole number from 0 to 160"):
        Automaton().check(particles, 1e-4)


def test_as_many_particles_as_start_names():
    with pytest.raises(InputError, match="particles must be 2"):
        Automaton(start=((0, 0), (0, 1))).check(3, 1e-4)
    Automaton(start=((0, 0), (0, 1))).check(2, 1e-4)


def test_step_must_stay_below_a_cell_at_the_largest_speed():
    """dt < width / v_max = 6 mm / 5 m/s = 1.2 ms."""
    automaton = Automaton()
    assert automaton.longest_dt == pytest.approx(1.2e-3)
    automaton.check(10, 1.1999e-3)
    for dt in (automaton.longest_dt, 0.0, -1e-4, math.nan):
        with pytest.raises(InputError, match="dt must"):
            automaton.check(10, dt)


def test_labels():
    assert [paper(accounting=name).label for name in ACCOUNTINGS] == [
        "ca_landing",
        "ca_ejection",
        "ca_static",
    ]
    labels = {paper(a, static_contact=c).label for a in ACCOUNTINGS for c in (False, True)}
    assert len(labels) == 2 * len(ACCOUNTINGS)


def test_particles_rest_as_suits_the_accounting_unless_the_user_says_otherwise():
    assert [paper(accounting=name).particles_rest for name in ACCOUNTINGS] == [
        False,
        False,
        True,
    ]
    resting = paper(accounting="landing", static_contact=True)
    assert resting.particles_rest
    assert resting.effects == ("pairs", "landing", "static contact")
    assert paper(static_contact=False).effects == ("pairs", "landing", "ejection")
