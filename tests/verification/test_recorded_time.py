"""All that is recorded is of one time, and of second order in the step where the scheme is."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Uniform, effects, simulate
from taichi_dem.mesh.shapes import bar, single

UNTIL = 1.6e-5
COLUMNS = ("kinetic_J", "bond_strain_J", "load_work_J", "bond_dashpot_J")
UNDAMPED = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)


def solved(step):
    """Sweeps to the end: what is left of them must not blur the order."""
    return ImplicitDashpots(step, sweeps=(2, 400), tolerance=1e-12)


#: Method of a step, its largest step [s], and whether dashpots act: explicit ones are of order 1.
SCHEMES = {
    "implicit": (solved, 2e-7, True),
    "uniform": (Uniform, 4e-7, False),
    "multirate": (lambda step: Multirate(step, 1.0), 4e-7, False),
}


def blown(method, damped=True):
    """A blow on a bar that falls along itself."""
    listed = [effects.GasPressure("left", peak=5e6, rise=1e-5), effects.Gravity((1e5, 0.0, 0.0))]
    material = CONCRETE if damped else UNDAMPED
    scene = Scene(bar(0.2, 0.05, (4, 1, 1)), material, [*listed, effects.BondDamping()])
    return simulate(scene, method=method, until=UNTIL, samples=1, frames=1, progress=None)


def recorded(method, damped):
    """Energies and a velocity at the end."""
    result = blown(method, damped)
    energies = [result.series[name][-1] for name in COLUMNS[: 3 + damped]]
    return np.array([*energies, result.frames[-1].velocity[5, 0]])


@pytest.mark.parametrize("name", SCHEMES)
def test_what_is_recorded_is_of_second_order(name):
    """Errors of steps h, h/2 and h/4: the ratio of their differences is 4, and 2 at first order.

    A tenth of an order is allowed: dashpots answer a step of 2e-7 s by a tenth of their rate's
    next term, and a half of an order would already be another scheme.
    """
    make, largest, damped = SCHEMES[name]
    found = [recorded(make(largest / 2**k), damped) for k in range(3)]
    ratio = (found[0] - found[1]) / (found[1] - found[2])
    assert np.log2(ratio) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_body_that_falls_from_rest_is_where_the_parabola_says(name):
    """The leapfrog is exact for a constant force if velocities start half a step back."""
    weight = np.array([3.0, -981.0, 20.0])
    later = effects.GasPressure("base", start=1.0)
    listed = [later, effects.Gravity(tuple(weight)), effects.BondDamping()]
    scene, method = Scene(single(0.05), CONCRETE, listed), SCHEMES[name][0](1e-7)
    result = simulate(scene, method=method, until=1e-4, samples=2, frames=2, progress=None)
    for frame in result.frames:
        # A thousand steps round the position and the velocity a thousand times.
        moved = 0.5 * weight * frame.time_s**2
        assert frame.displacement[0] == pytest.approx(moved, rel=1e-9, abs=1e-15)
        assert frame.velocity[0] == pytest.approx(weight * frame.time_s, rel=1e-12, abs=1e-18)
