"""With effects="auto" a part beside another of any scale has the bits that it has alone."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import Scene
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.output.cracks import apertures_of
from taichi_dem.state.timeline import NEVER
from tests.activation.late_scenes import (
    MATERIAL,
    METHOD,
    PULSE,
    WIDE,
    Late,
    loads,
    push,
    simulation,
)

UNTIL, CELLS, APART = 3e-4, 5, 5.0
#: Sixteen roundings of a coordinate of up to 2 m [m].
ROUNDING = 16.0 * 2.0 * np.finfo(float).eps
BONDS = ("normal_stiffness", "shear_stiffness", "normal_damping", "shear_damping")
TOUCH = ("contact_stiffness", "contact_damping")


class Part:
    """A bar [m] at a place x [m], whose right end is pulled from a start [s] to a speed [m/s].

    Its bonds reach their strength at an opening tear [m], and its frequencies are those of a bar as
    wide as ``WIDE``, so that one step fits all.
    """

    def __init__(self, x, length, tear, speed, start):
        self.mesh = bar(length, length / CELLS, (CELLS, 1, 1)).moved(by=(x, 0.0, 0.0))
        box = (x + 0.8 * length, -1.0, -1.0), (x + 1.1 * length, 1.0, 1.0)
        self.pull = push(box, (2.0 * speed / PULSE, 0.0, 0.0), start)
        scale = length / CELLS / WIDE
        given = {name: scale * getattr(MATERIAL, name) for name in BONDS}
        given.update({name: scale**3 * getattr(MATERIAL, name) for name in TOUCH})
        stress = tear * given["normal_stiffness"]
        tough = 4.0 * stress * tear
        limits = {"tensile_strength": stress, "cohesion": stress, "fracture_energy": tough}
        self.material = replace(MATERIAL, **given, **limits)


def ran(mesh, first, second=None, word="auto", **materials):
    """Motion at the end, ticks at which bonds broke, and the certificate."""
    late = Late("tension", mesh, loads(first.pull, second and second.pull), 0.0)
    scene = Scene(mesh, first.material, word, loads=late.loads, materials=materials)
    run = simulation(late, scene)
    run.advance_to(round(UNTIL / METHOD.dt0))
    motion = np.hstack([run.motion()[key] for key in ("position", "velocity", "orientation")])
    broken = run.values(run.state.broken_tick)[: run.model.bond_count]
    return motion, broken, run.report(brief=True).certificate


#: A metre that is pulled early and fast, and a specimen of 1 mm, pulled late and slowly.
SPECIMEN = (0.0, 1.0, 1e-6, 10.0, 2e-5), (APART, 1e-3, 1e-8, 1e-2, 1e-4)


def drawn(seed):
    """Two parts: a metre, and one that is shorter, slower or later, or all of that."""
    if seed is None:
        return tuple(Part(*numbers) for numbers in SPECIMEN)
    rng = np.random.default_rng(seed)
    smaller, slower = 10.0 ** (rng.uniform(-3.0, 0.0, 2) * rng.integers(0, 2, 2))
    late = rng.uniform(0.0, 0.6) * UNTIL * rng.integers(0, 2)
    # Openings that bonds bear, over the speed [s]: half of the parts break.
    first, second = 10.0 ** rng.uniform(-7.0, -4.5, 2)
    speed = 10.0 ** rng.uniform(-1.0, 1.0)
    return (
        Part(0.0, 1.0, first * speed, speed, 2e-5),
        Part(APART, smaller, second * smaller * speed * slower, smaller * speed * slower, late),
    )


@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
@pytest.mark.parametrize("seed", [None, *range(40)])
def test_each_part_has_the_bits_that_it_has_alone(seed):
    """And breaks where it does with all effects; what was left out is told of the worst part."""
    first, second = drawn(seed)
    alone = [ran(part.mesh, part) for part in (first, second)]
    both = placed_together({"a": (first.mesh, (0, 0, 0)), "b": (second.mesh, (0, 0, 0))})
    motion, broken, certificate = ran(both, first, second, b=second.material)
    every = ran(both, first, second, "all", b=second.material)
    assert ((broken != NEVER) == (every[1] != NEVER)).all()
    assert np.array_equal(motion, np.vstack([each[0] for each in alone]))
    assert np.array_equal(broken, np.concatenate([each[1] for each in alone]))
    assert certificate.holds and certificate.asleep > 0.0
    assert certificate.impulse == max(each[2].impulse for each in alone)


@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
@pytest.mark.parametrize("seed", range(4))
def test_no_sleeping_bond_is_open_by_more_than_it_may_be(seed):
    """After every step: by the share of the opening at which its law begins, but for rounding."""
    part = drawn(seed)[0]
    late = Late("tension", part.mesh, loads(part.pull), 0.0)
    run = simulation(late, Scene(part.mesh, part.material, "auto", loads=late.loads))
    model, slept = run.model, 0
    bonds, ends = slice(model.bond_count), [model.topology.master, model.topology.slave]
    onset = part.material.tensile_strength / model.bond_stiffness[:, 0]
    for step in range(1, round(UNTIL / METHOD.dt0)):
        run.advance_to(step)
        asleep = (run.values(run.schedule.sleeping.awake)[: model.body_count] == 0)[ends].any(
            axis=0
        )
        asleep &= run.values(run.state.broken_tick)[bonds] == NEVER
        opening = np.abs(apertures_of(model, SimpleNamespace(**run.motion())))
        assert (opening <= run.scene.sleep * onset + ROUNDING)[asleep].all()
        slept += asleep.sum()
    assert slept > 0
