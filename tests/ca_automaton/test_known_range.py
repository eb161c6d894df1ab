"""A run warns, or is refused, where the rules that it asks for are known to fail."""

import pytest

from ca_damper import Automaton, Batch, SceneTable
from ca_damper.report.certificate import checked_range
from tests.paper import paper

#: A scene of the paper: 30 grains near resonance.
FEW = {"particles": 30, "seed": 1, "dt": 1e-4, "frequency": 6.0, "base_amplitude": 0.6e-3}
#: A container that is driven by 3.5 g.
DRIVEN = {**FEW, "base_amplitude": 24e-3}
#: Options, columns, mount, and what the sentence says.
FAILS = {
    "heavy": ({"particle_mass": 0.0087}, FEW, "spring", "a grain of 0.101 of the container's mass"),
    "ten": ({}, {**FEW, "particles": [10, 30]}, "spring", "10 grains, ten or fewer"),
    "slow": ({}, {**FEW, "base_amplitude": 6.5e-3}, "base", "a motion of 0.94 g, below 1 g"),
    "small": (
        *({}, {**FEW, "frequency": 25.0, "base_amplitude": 0.8e-3}, "base"),
        "a motion of 0.8 mm, below half a cell of 6 mm",
    ),
    "dead": ({"restitution": 0.49}, DRIVEN, "base", "restitution 0.49, below 0.5"),
}
INSIDE = {
    "heavy, driven": ({"particle_mass": 0.05}, DRIVEN, "base"),
    "resonance": ({}, FEW, "spring"),
    "still": ({}, {**FEW, "base_amplitude": 0.0}, "base"),
}


def checked(make, options, columns, mount):
    return checked_range(Batch(make(**options), SceneTable(**columns), mount=mount))


@pytest.mark.parametrize("name", FAILS)
def test_the_paper_s_rules_warn_before_a_run_where_they_fail(name):
    *scene, words = FAILS[name]
    assert words in checked(paper, *scene).warning
    assert not checked(Automaton, *scene).warning


@pytest.mark.parametrize("name", INSIDE)
def test_the_paper_s_rules_are_silent_inside_their_range(name):
    assert not checked(paper, *INSIDE[name]).warning


def test_a_run_says_where_rules_of_place_are_off():
    """Gravity across the columns is one of these places."""
    lying = checked(Automaton, {"gravity": (9.8, 0.0)}, FEW, "spring")
    upright = checked(Automaton, {"gravity": (0.0, 9.8)}, FEW, "spring")
    assert len(lying.outside) == len(upright.outside) + 1
    assert "gravity across the columns" in " ".join(lying.outside)
