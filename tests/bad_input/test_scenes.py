"""Inputs that contradict each other, of which a run would give wrong numbers: each is refused."""

from dataclasses import replace

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Empty,
    RigidMass,
    SceneTable,
    Spheres,
    excitation,
    frequency_response,
    shake,
)
from taichi_dem import CONCRETE, Scene, Simulation, StepControl, Uniform, checked_mesh, effects
from taichi_dem.kit.validation import told_apart
from taichi_dem.laws.base import Effect
from taichi_dem.mesh.mesh import with_inner_group
from taichi_dem.mesh.shapes import pair, single
from tests.bad_input.refusals import assert_refused

PAIR = pair()
CUT = with_inner_group(PAIR, "notch", lambda x: x[:, 0] < 1.0)
WRAPPED = PAIR.tetrahedra.astype(np.int64) + 2**32


def scene(*listed, mesh=PAIR, **options):
    """A scene of two bodies."""
    return Scene(mesh, CONCRETE, listed, **options)


def on_demand(*loads, **options):
    """The same with effects on demand."""
    return Scene(PAIR, CONCRETE, "auto", loads=loads, **options)


def own(base, **members):
    """An effect of a user's own."""
    return type("Mine", (base,), members)()


NOTCHED = {"mesh": CUT, "weaker": {"notch": 0.5}}
QUIET = Scene(single(), CONCRETE, [effects.QuietBoundary("base")])
SCENES = {
    "a number that wraps around": (
        lambda: checked_mesh(PAIR.points, WRAPPED, {}),
        "must lie in [0, 4]",
    ),
    "laws of one role": (lambda: scene(effects.Softening(), effects.Softening()), "both take"),
    "friction alone": (lambda: scene(effects.Friction()), "list BodyContact too"),
    "a notch outside": (lambda: scene(unbonded=["left"]), "must have inner faces"),
    "pressure inside": (
        lambda: scene(effects.Pressure("notch", 1.0), **NOTCHED),
        "must be of outer faces, or unbonded",
    ),
    "a quiet face without bonds": (
        lambda: Simulation(QUIET, Uniform()),
        "p_speed of quiet_boundary must be given",
    ),
    "times that fall": (lambda: effects.Pressure("left", [1, 2], [1, 0]), "times must rise"),
    "ramp and history": (
        lambda: effects.PrescribedMotion("left", (1, 0, 0), ramp=1.0, history=([0], [1])),
        "ramp must be 0",
    ),
    "a floor of whole dashpots": (
        lambda: Uniform(control=StepControl(dashpot_floor=1e-9)),
        "dashpot_floor must be 0 unless",
    ),
    "sleep of a list": (lambda: scene(sleep=1e-6), "sleep must be 0 unless effects is 'auto'"),
    "loads of a list": (lambda: scene(loads=[effects.Gravity()]), "loads must be left out"),
    "a load by its role alone": (
        lambda: scene(own(Effect, role="load")),
        "derive from taichi_dem.effects.Load",
    ),
    "a load without its force": (
        lambda: scene(own(effects.Load)),
        "Mine must have wrench(i, motion)",
    ),
    "a silent law on demand": (lambda: on_demand(effects.Softening().silent()), "that act"),
}


TABLE = SceneTable(particles=[0, 1], seed=1, dt=1e-3)


def shaken_for(duration):
    """A box that is shaken for 59.9999 s."""
    still = excitation.sines(6.0, 0.0, duration=59.9999)
    return shake(Empty(), still, particles=0, seeds=1, duration=duration, progress=None)


DAMPERS = {
    "particles of nothing": (lambda: Batch(Empty(), TABLE), "particles must be 0"),
    "run before start": (lambda: Batch(RigidMass(), TABLE).run(1, 1), "call start() first"),
    "ratios that fall": (
        lambda: frequency_response(RigidMass(), particles=1, ratios=[1.0, 0.9], dt=1e-3),
        "ratios must ascend",
    ),
    "a cell twice": (lambda: Automaton(start=[(1, 1), (1, 1)]), "must not name a cell twice"),
    "a sphere in the wall": (lambda: Spheres(start=[(0.0, 0.03)]), "off the walls"),
    "after the end of its motion": (lambda: shaken_for(60.0), "59.9999 s, got 60 s"),
}
CASES = {**SCENES, **DAMPERS}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("error")
def test_what_contradicts_itself_is_refused(name):
    call, words = CASES[name]
    assert_refused(call, words)


#: What a law of a user's own may change, by the law that it is made of.
CHANGED = {
    effects.Softening: "traction",
    effects.SlipWeakening: "failed",
}


@pytest.mark.parametrize("law", CHANGED)
def test_a_law_that_does_not_say_when_it_begins_is_not_taken_on_demand(law):
    """It would never be evaluated."""
    mine = type("Mine", (law,), {CHANGED[law]: lambda *_: 0.0})
    made = mine(1e3) if law is effects.SlipWeakening else mine()
    assert_refused(lambda: on_demand(made), "when they begin to act: Mine has no begins")


def test_a_scene_that_is_changed_keeps_its_loads():
    """The certificate may send a user from auto to all."""
    made = on_demand(effects.Gravity(), effects.BodyContact())
    every = replace(made, effects="all", sleep=0.0)
    assert [effect.name for effect in every.effects] == [effect.name for effect in made.effects]
    stronger = replace(made, material=replace(CONCRETE, cohesion=1e7))
    assert tuple(stronger.effects) == tuple(made.effects) and stronger.on_demand


@pytest.mark.parametrize("scale", [1.0, 60.0, 1e-7])
@pytest.mark.parametrize("apart", [0.0, 1e-14, 1e-9, -1e-9, 1e-3, -1.0])
def test_a_value_and_the_bound_that_it_misses_read_as_they_are(scale, apart):
    """Unequal unless they are equal, and the bound on its own side of the limit."""
    limit = scale * 0.99999999
    given = limit * (1.0 + apart)
    value, bound = told_apart(given, limit)
    assert (float(value) == float(bound)) == (given == limit)
    assert float(bound) == limit if apart == 0.0 else apart * (limit - float(bound)) >= 0.0
