"""Rules of place by default; a run of the paper's rules warns where they are known to fail."""

import pytest

from ca_damper import Automaton, Batch, ModalStructure, RigidMass, SceneTable
from ca_damper.checked_range import checked_range
from ca_damper.engine.modal_mount import ModalMount
from tests.paper import paper

#: A scene of the paper: 30 grains near resonance.
FEW = {"particles": 30, "seed": 1, "dt": 1e-4, "frequency": 6.0, "base_amplitude": 0.6e-3}
#: A container that is driven by 3.5 g.
DRIVEN = {**FEW, "base_amplitude": 24e-3}
#: Options, columns, mount, and what the sentence says.
FAILS = {
    "heavy": ({"particle_mass": 0.0087}, FEW, "spring", "a grain of 0.101 of the container's mass"),
    "ten": ({}, {**FEW, "particles": 10}, "spring", "10 grains, ten or fewer"),
    "one": ({}, {**FEW, "particles": [1, 30]}, "spring", "1 grain, ten or fewer"),
    "weightless": ({"gravity": 0.0}, DRIVEN, "base", "no gravity"),
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
    "eleven of a tenth": ({"particle_mass": 0.0085}, {**FEW, "particles": 11}, "spring"),
    "driven": ({"restitution": 0.5}, DRIVEN, "base"),
    "empty": ({"gravity": 0.0, "restitution": 0.0}, {**FEW, "particles": 0}, "base"),
    "still": ({}, {**FEW, "base_amplitude": 0.0}, "base"),
}


def batch(make, options, columns, mount):
    return Batch(make(**options), SceneTable(**columns), mount=mount)


def test_the_default_are_the_rules_of_place():
    assert Automaton().rules == "place"
    assert Automaton() == Automaton(rules="place") != paper()


@pytest.mark.parametrize("name", FAILS)
def test_the_paper_s_rules_warn_before_a_run_where_they_fail(name):
    *scene, words = FAILS[name]
    made = batch(paper, *scene)
    with pytest.warns(UserWarning) as said:
        made.start()
    (sentence,) = (str(one.message) for one in said)
    assert sentence.startswith("rules 'paper' of the automaton are known to fail with ")
    assert words in sentence and sentence.endswith("use rules='place', the default")
    assert "\n" not in sentence and words in str(made.report())
    # Warnings are errors in these tests: the rules of place say nothing.
    batch(Automaton, *scene).start()


@pytest.mark.parametrize("name", INSIDE)
def test_the_paper_s_rules_are_silent_inside_their_range(name):
    made = batch(paper, *INSIDE[name])
    made.start()
    report = made.report()
    assert report.checked.outside == () and "\n                   inside" in str(report)
    # The motion of a spring's box, and of one at rest, says nothing before the run.
    known = name in ("driven", "heavy, driven", "empty")
    assert ("but for the motion" in str(report)) != known and report.checked.knows_motion == known
    assert report.as_dict()["checked"]["words"] == report.checked.words


@pytest.mark.parametrize(
    ("options", "columns", "words"),
    [
        ({"restitution": 1.0}, FEW, "restitution 1, above 0.9"),
        ({}, {**FEW, "particles": 51}, "51 grains, more than 50"),
    ],
)
def test_the_report_says_what_of_a_run_the_rules_of_place_were_not_checked_with(
    options, columns, words
):
    made = batch(Automaton, options, columns, "spring")
    made.start()
    assert words in str(made.report())
    assert batch(Automaton, {}, FEW, "spring").report().checked.outside == ()


def test_what_names_no_range_has_no_line_of_it():
    made = Batch(RigidMass(), SceneTable(**FEW))
    made.start()
    assert made.report().checked is None and "checked with" not in str(made.report())


def test_a_change_of_the_scenes_is_looked_at_again():
    made = batch(paper, {}, FEW, "spring")
    made.change(particles=5)
    with pytest.warns(UserWarning, match="5 grains, ten or fewer"):
        made.start()


def test_the_mass_of_a_structure_is_that_of_the_place_that_a_blow_moves():
    """A structure of one place is an Oscillator of that mass."""
    mount = ModalMount(ModalStructure.from_matrices([0.086], [[122.0]], [0.08]), [0])
    grains = paper(particle_mass=0.2 * 0.086)
    made = Batch(grains, SceneTable(**FEW), mount="spring", structure=mount)
    assert "a grain of 0.2 of the container's mass" in checked_range(made).warning
