"""With effects="auto" a part beside another of any scale has the bits that it has alone."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import Scene
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.timeline import NEVER
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


def drawn(seed):
    """Two parts of 1 mm to 1 m, pulled to 1 mm/s to 10 m/s, of strengths at 10 nm to 1 um."""
    draw = np.random.default_rng(seed)
    low, high = (-3.0, -8.0, -3.0), (0.0, -6.0, 1.0)
    return [
        Part(x, *10.0 ** draw.uniform(low, high), draw.uniform(2e-5, 1e-4)) for x in (0.0, APART)
    ]


def beside_a_metre():
    """A specimen of 1 mm, pulled late and slowly, beside a metre that is pulled early and fast."""
    return Part(0.0, 1.0, 1e-6, 10.0, 2e-5), Part(APART, 1e-3, 1e-8, 1e-2, 1e-4)


def ran(mesh, first, second=None, word="auto", **materials):
    """Motion at the end, ticks at which bonds broke, and the certificate."""
    late = Late("tension", mesh, loads(first.pull, second and second.pull), 0.0)
    scene = Scene(mesh, first.material, word, loads=late.loads, materials=materials)
    run = simulation(late, scene)
    run.advance_to(round(UNTIL / METHOD.dt0))
    motion = np.hstack([run.motion()[key] for key in ("position", "velocity", "orientation")])
    broken = run.state.broken_tick.to_numpy()[: run.model.bond_count]
    return motion, broken, run.report(brief=True).certificate


@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
@pytest.mark.parametrize("seed", [None, *range(4)])
def test_each_part_has_the_bits_that_it_has_alone(seed):
    """And breaks where it does with all effects; what was left out is told of the worst part."""
    first, second = beside_a_metre() if seed is None else drawn(seed)
    alone = [ran(part.mesh, part) for part in (first, second)]
    both = placed_together({"a": (first.mesh, (0, 0, 0)), "b": (second.mesh, (0, 0, 0))})
    motion, broken, certificate = ran(both, first, second, b=second.material)
    every = ran(both, first, second, "all", b=second.material)
    assert ((broken != NEVER) == (every[1] != NEVER)).all()
    assert np.array_equal(motion, np.vstack([each[0] for each in alone]))
    assert np.array_equal(broken, np.concatenate([each[1] for each in alone]))
    assert certificate.holds and certificate.asleep > 0.0
    assert certificate.impulse == max(each[2].impulse for each in alone)
