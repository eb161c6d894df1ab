"""Inputs that contradict each other, of which a run would give wrong numbers: each is refused."""

from dataclasses import replace

import numpy as np
import pytest

import ca_damper as ca
import taichi_dem as td
from ca_damper import excitation
from taichi_dem import CONCRETE, effects
from taichi_dem.kit.validation import told_apart
from taichi_dem.laws.base import Effect
from tests.bad_input.arguments import ALONE, CUT, PAIR
from tests.bad_input.refusals import assert_refused

WRAPPED = PAIR.tetrahedra.astype(np.int64) + 2**32
TABLE = ca.SceneTable(particles=[0, 1], seed=1, dt=1e-3)
STILL = excitation.sines(6.0, 0.0, duration=59.9999)
QUIET = replace(ALONE, effects=[effects.QuietBoundary("base")])


def scene(*listed, mesh=PAIR, **options):
    """A scene of two bodies."""
    return td.Scene(mesh, CONCRETE, listed, **options)


def on_demand(*loads, **options):
    """The same with effects on demand."""
    return td.Scene(PAIR, CONCRETE, "auto", loads=loads, **options)


def own(base, *options, **members):
    """An effect of a user's own."""
    return type("Mine", (base,), members)(*options)


def pressed():
    """A pressure on inner faces that are bonded."""
    return scene(effects.Pressure("notch", 1.0), mesh=CUT, weaker={"notch": 0.5})


def ramped():
    """A motion by a ramp and by a history."""
    return effects.PrescribedMotion("left", (1, 0, 0), ramp=1.0, history=([0], [1]))


def falling():
    """Ratios that fall."""
    return ca.frequency_response(ca.RigidMass(), particles=1, ratios=[1.0, 0.9], dt=1e-3)


def outlasting():
    """A box that is shaken for longer than its motion lasts."""
    return ca.shake(ca.Empty(), STILL, particles=0, seeds=1, duration=60.0, progress=None)


#: What contradicts itself, by words of the sentence.
CASES = {
    # A number that would wrap around.
    "must lie in [0, 4]": lambda: td.checked_mesh(PAIR.points, WRAPPED, {}),
    "both take": lambda: scene(effects.Softening(), effects.Softening()),
    "list BodyContact too": lambda: scene(effects.Friction()),
    "must have inner faces": lambda: scene(unbonded=["left"]),
    "must be of outer faces, or unbonded": pressed,
    "p_speed of quiet_boundary must be given": lambda: td.Simulation(QUIET, td.Uniform()),
    "times must rise": lambda: effects.Pressure("left", [1, 2], [1, 0]),
    "ramp must be 0": ramped,
    "dashpot_floor must be 0 unless": lambda: td.Uniform(control=td.StepControl(dashpot_floor=1)),
    "sleep must be 0 unless effects is 'auto'": lambda: scene(sleep=1e-6),
    "loads must be left out": lambda: scene(loads=[effects.Gravity()]),
    "that act": lambda: on_demand(effects.Softening().silent()),
    "derive from taichi_dem.effects.Load": lambda: scene(own(Effect, role="load")),
    "Mine must have wrench(i, motion), as": lambda: scene(own(effects.Load)),
    "push(m, k, touch)": lambda: scene(own(effects.ContactLaw, effects.BodyGeometry())),
    "keep(m, k, touch)": lambda: scene(own(effects.BodyContact, declare_columns=print)),
    "must be one of": lambda: scene(effects.BodyGeometry()),
    "particles must be 0": lambda: ca.Batch(ca.Empty(), TABLE),
    "call start() first": lambda: ca.Batch(ca.RigidMass(), TABLE).run(1, 1),
    "ratios must ascend": falling,
    "pass rules=Paper(accounting=...)": lambda: ca.Automaton(accounting="landing"),
    "pass rules=Place(friction=...)": lambda: ca.Automaton(friction=0.3),
    "must not name a cell twice": lambda: ca.Automaton(start=[(1, 1), (1, 1)]),
    "off the walls": lambda: ca.Spheres(start=[(0.0, 0.03)]),
    "59.9999 s, got 60 s": outlasting,
}


@pytest.mark.parametrize("words", CASES)
@pytest.mark.filterwarnings("error")
def test_what_contradicts_itself_is_refused(words):
    assert_refused(CASES[words], words)


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
