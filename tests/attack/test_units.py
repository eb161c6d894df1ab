"""A scene in other units, or of another size, is the same run: no number in the code has a unit.

Lengths, masses and times are multiplied by powers of four, which rounds nothing, not in square
roots either: equality is asked bit for bit. A length, time or energy that the code compared with a
constant would show.
"""

from dataclasses import dataclass, replace

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
from taichi_dem.mesh.shapes import bar, placed_together
from tests.slow import slow_but

ATTACKS = "units: a scene in others is the same run"
#: Powers of four by which a unit may be larger or smaller: a mm and a km are within 4^5 of a metre.
LARGEST = 5
CONTACTS = effects.SphereContact, effects.FaceContact


@dataclass(frozen=True)
class Units:
    """Factors of length, mass and time."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def of(self, length=0, mass=0, time=0):
        """Factor of a number of these dimensions."""
        return self.length**length * self.mass**mass * self.time**time

    @property
    def pressure(self):
        return self.of(-1, 1, -2)

    @property
    def energy(self):
        return self.of(2, 1, -2)


def material_in(u):
    """Concrete, with some sphere damping less so that steps of any method are stable."""
    m = CONCRETE
    return replace(
        m,
        density=m.density * u.of(-3, 1),
        normal_stiffness=m.normal_stiffness * u.pressure / u.length,
        shear_stiffness=m.shear_stiffness * u.pressure / u.length,
        normal_damping=m.normal_damping * u.pressure * u.time / u.length,
        shear_damping=m.shear_damping * u.pressure * u.time / u.length,
        tensile_strength=m.tensile_strength * u.pressure,
        cohesion=m.cohesion * u.pressure,
        fracture_energy=m.fracture_energy * u.energy / u.length**2,
        contact_stiffness=m.contact_stiffness * u.of(0, 1, -2),
        contact_damping=0.1 * m.contact_damping * u.of(0, 1, -1),
    )


def scene_in(u, contact, acceleration, speed):
    """A bar under gas that breaks, on a roller, and a block that is thrown at it."""
    thrown = bar(0.05, 0.05, (1, 1, 1))
    both = placed_together(
        {
            "target": (bar(0.1, 0.05, (3, 2, 2)), (0.0, 0.0, 0.0)),
            "thrown": (thrown, (0.101, 0.01, 0.02)),
        }
    )
    mesh = Mesh(both.points * u.length, both.tetrahedra, both.groups)
    return Scene(
        mesh,
        material_in(u),
        [
            effects.BondDamping(),
            effects.Softening(),
            effects.ShearSlip(),
            contact(),
            effects.Friction(),
            effects.GasPressure("target_left", peak=2e9 * u.pressure, rise=1e-5 * u.time),
            effects.Gravity(tuple(acceleration * u.of(1, 0, -2))),
            effects.PrescribedMotion("thrown_right", tuple(speed * u.of(1, 0, -1)), 2e4 / u.time),
        ],
        max_speed=1e5 * u.of(1, 0, -1),
    )


def methods_in(u):
    """Every kind of step."""
    control = StepControl(dashpot_floor=1e-8 * u.time)
    return {
        "uniform": Uniform(2e-8 * u.time),
        "multirate": Multirate(2e-8 * u.time, 1e-7 * u.length),
        "controlled": Multirate(8e-8 * u.time, 1e-5 * u.length, control=control, dashpot="limited"),
        "implicit": ImplicitDashpots(2e-7 * u.time, refresh=3e-5 * u.time),
    }


def work_of(report):
    """Counts of what was evaluated and searched, which a length of its own would change."""
    counts = report.substeps, report.body_updates, report.bond_evaluations
    return (*counts, report.pair_evaluations, report.searches, report.sweeps)


def run_in(u, name, *drawn):
    """Motion and time series of a run, in the first units again."""
    result = simulate(
        scene_in(u, *drawn),
        method=methods_in(u)[name],
        until=3e-5 * u.time,
        samples=3,
        frames=1,
        progress=None,
    )
    last = result.frames[-1]
    found = {
        "position": last.position / u.length,
        "rotation": last.rotation,
        "velocity": last.velocity / u.of(1, 0, -1),
        "level": last.level,
        "broken_time": result.broken_time / u.time,
    }
    joules = {k: v / u.energy for k, v in result.history.items() if k.endswith("_J")}
    return {**found, **joules}, result.report


# Numbers in other units than those of the SI are meant here.
@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
@pytest.mark.parametrize("name", slow_but(methods_in(Units()), "uniform"))
def test_units_change_no_bit(seed, name):
    random = np.random.default_rng(seed)
    # Half of the methods with each contact, the other half at the next seed.
    contact = CONTACTS[(seed + list(methods_in(Units())).index(name)) % 2]
    drawn = contact, 1e4 * random.normal(size=3), np.array([-30.0, *random.normal(size=2)])
    first, report = run_in(Units(), name, *drawn)
    assert report.broken_faces > 0 and report.pair_evaluations > 0
    powers = random.integers(-LARGEST, LARGEST + 1, 3)
    other, again = run_in(Units(*(4.0**powers)), name, *drawn)
    assert [key for key in first if not np.array_equal(first[key], other[key], True)] == []
    assert report.outcome.split(",")[-1] == again.outcome.split(",")[-1]
    assert [m.effect for m in report.missing_effects] == [m.effect for m in again.missing_effects]
    assert [u.events for u in report.effect_activity] == [u.events for u in again.effect_activity]
    assert work_of(report) == work_of(again)
    assert len(report.unresolved) == len(again.unresolved)
