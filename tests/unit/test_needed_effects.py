"""What a run says of its effects: which acted, which it could do without, which it missed."""

import json

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, Uniform, effects, needed_effects, simulate
from taichi_dem.effect_use import Advice, EffectUse
from taichi_dem.mesh_shapes import pair

#: Far below the strength of concrete: a block of some 1 kg that falls from rest for 1e-5 s.
STEP, UNTIL = 1e-7, 1e-5
GENTLE = (
    *(effects.BondDamping, effects.Softening, effects.ShearSlip),
    *(effects.SphereContact, effects.Friction, effects.Gravity),
)


def ran(*listed):
    """A pair of bodies, at rest at the start, with some effects."""
    return simulate(Scene(pair(), CONCRETE, listed), method=Uniform(STEP), until=UNTIL, samples=4)


@pytest.fixture(scope="module")
def gentle():
    """A pair that falls freely: nothing is stretched, nothing breaks, nothing touches."""
    return ran(*(make() for make in GENTLE))


def test_effects_that_never_act_are_named(gentle):
    advice = needed_effects(gentle)
    idle = {"softening", "shear_slip", "sphere_contact", "friction"}
    assert idle <= set(advice.never_acted)
    assert "gravity" not in advice.droppable
    assert advice.missed == ()
    lines = {line.split()[1]: line for line in str(advice).splitlines()}
    assert lines["softening"].startswith("drop")
    assert "never acted (0 bonds softened)" in lines["softening"]


def test_dropping_what_never_acted_changes_no_bit(gentle):
    """The advice is a promise: without these effects every sample is the same."""
    kept = [make() for make in GENTLE if make.name not in needed_effects(gentle).never_acted]
    again = ran(*kept)
    assert len(kept) < len(GENTLE)
    for name, column in gentle.history.items():
        np.testing.assert_array_equal(again.history[name], column, err_msg=name)


def test_weight_of_all_is_all_the_work(gentle):
    """Free fall, work = m g (g t) t / 2 = weight times height; the only load, so its share is 1.

    Kicks at the beginning of a step of dt give v = g t at its end; with the mean velocity of each
    kick the work is exactly m (g t)^2 / 2.
    """
    use = next(use for use in gentle.report.acted if use.effect == "gravity")
    mass = gentle.model.body_mass.sum()
    assert use.events == use.of == 2
    assert use.share == pytest.approx(1.0, rel=1e-12)
    assert use.energy_J == pytest.approx(0.5 * mass * (9.81 * UNTIL) ** 2, rel=1e-9)


def test_missed_effect_is_told_how_often_and_where():
    """A hundred g pull nothing apart; a support that runs away does, past the strength."""
    mesh = pair()
    runs_away = effects.PrescribedMotion(next(iter(mesh.groups)), (-50.0, 0.0, 0.0))
    # In tension the limit of slip falls to nothing: with slip listed, only the strength is missed.
    result = ran(runs_away, effects.ShearSlip())
    missed = needed_effects(result).missed
    assert {finding.effect for finding in missed} == {"Softening"}
    (finding,) = missed
    middle = mesh.points[result.model.topology.vertices[0]].mean(axis=0)
    assert finding.where == 0
    assert finding.place_m == pytest.approx(tuple(middle), rel=1e-15)
    assert finding.most == 1
    # The start and four samples were looked at; nothing is stretched yet at the first.
    assert finding.looks == 5
    assert 1 <= finding.times <= 4
    written = json.loads(json.dumps(result.report.as_dict()))
    assert written["missed"][0]["times"] == finding.times
    assert written["needs"] == [str(finding)]
    assert f"seen at {finding.times} of 5 recordings" in str(needed_effects(result))


USES = (
    EffectUse("friction", "bodies rubbed", 5, 10, 1e-4, 1e-4),
    EffectUse("softening", "bonds softened", 5, 10, 1e-4, 1e-4, steers=True),
    EffectUse("rotation", "touches", 5),
)


@pytest.mark.parametrize(("tolerance", "names"), [(1e-3, ("friction",)), (1e-4, ()), (0.0, ())])
def test_small_share_is_negligible_unless_the_effect_steers(tolerance, names):
    assert Advice(USES, (), tolerance).droppable == names


@pytest.mark.parametrize("bad", [-0.1, 1.5, float("nan"), "0.1"])
def test_tolerance_out_of_range_is_refused(gentle, bad):
    with pytest.raises(InputError, match=r"tolerance must lie in \[0, 1\]"):
        needed_effects(gentle, bad)


def test_what_is_no_result_is_refused():
    with pytest.raises(InputError, match="result must be a Result of simulate or its report"):
        needed_effects("blast")
