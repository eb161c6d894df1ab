"""A scene in other units is the same run, bit for bit: no number in the code has a unit.

Lengths, masses and times are multiplied by powers of four, which rounds nothing, not in square
roots either. A length, time or energy that the code compared with a constant would show.
"""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Mesh,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.mesh.shapes import bar
from tests.scenes import beside

pytestmark = pytest.mark.attack

#: Powers of length, mass and time in each constant of a material.
DIMENSIONS = {
    "density": (-3, 1, 0),
    **dict.fromkeys(("normal_stiffness", "shear_stiffness"), (-2, 1, -2)),
    **dict.fromkeys(("normal_damping", "shear_damping"), (-2, 1, -1)),
    **dict.fromkeys(("tensile_strength", "cohesion"), (-1, 1, -2)),
    **dict.fromkeys(("fracture_energy", "contact_stiffness"), (0, 1, -2)),
    "contact_damping": (0, 1, -1),
}
# Less damping of spheres, so that steps of any method are stable.
MATERIAL = replace(CONCRETE, contact_damping=0.1 * CONCRETE.contact_damping)
BLOCKS = beside(bar(0.1, 0.05, (3, 2, 2)), bar(0.05, 0.05, (1, 1, 1)), (0.101, 0.01, 0.02))


def run_in(length, mass, time, number, weight, speed):
    """Motion, energies and work of a bar that breaks and is hit, in the first units again."""

    def of(x, m, t):
        return length**x * mass**m * time**t

    constants = {name: getattr(MATERIAL, name) * of(*by) for name, by in DIMENSIONS.items()}
    laws = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    laws += [(effects.SphereContact, effects.BodyContact)[number % 2](), effects.Friction()]
    gas = effects.GasPressure("first_left", peak=2e9 * of(-1, 1, -2), rise=1e-5 * time)
    thrown = effects.PrescribedMotion("second_right", tuple(speed * of(1, 0, -1)), 2e4 / time)
    scene = Scene(
        Mesh(BLOCKS.points * length, BLOCKS.tetrahedra, BLOCKS.groups),
        replace(MATERIAL, **constants),
        [*laws, gas, effects.Gravity(tuple(weight * of(1, 0, -2))), thrown],
        max_speed=1e5 * of(1, 0, -1),
    )
    control = StepControl(dashpot_floor=1e-8 * time)
    method = (
        Uniform(2e-8 * time),
        Multirate(8e-8 * time, 1e-5 * length, control=control, dashpot="limited"),
        ImplicitDashpots(2e-7 * time, refresh=3e-5 * time),
    )[number % 3]
    result = simulate(scene, method=method, until=3e-5 * time, frames=1, progress=None)
    last, report = result.frames[-1], result.report
    assert report.broken_faces > 0 and report.pair_evaluations > 0
    joules = [v / of(2, 1, -2) for k, v in result.series.items() if k.endswith("_J")]
    motion = [last.position / length, last.rotation, last.velocity / of(1, 0, -1)]
    work = [report.substeps, report.bond_evaluations, report.pair_evaluations, report.searches]
    return [*motion, result.broken_time / time, *joules, work]


# Numbers in other units than those of the SI are meant here, and long steps in contact.
@pytest.mark.filterwarnings("ignore:.*is read in .* likely", "ignore:the step of .* is above")
def test_units_change_no_bit(seed):
    random = np.random.default_rng(seed)
    drawn = seed, 1e4 * random.normal(size=3), np.array([-30.0, *random.normal(size=2)])
    found = [run_in(*units, *drawn) for units in ([1.0] * 3, 4.0 ** random.integers(-5, 6, 3))]
    assert all(np.array_equal(one, other, equal_nan=True) for one, other in zip(*found))
