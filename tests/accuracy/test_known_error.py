"""A method has the order that it declares, in all that is recorded, and a run says so."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Uniform, effects, simulate
from taichi_dem.kit.types import vec3
from taichi_dem.mesh.shapes import bar
from taichi_dem.methods import order_of
from taichi_dem.report.report import known_error
from tests.scenes import UNTIL, struck_bar
from tests.structures import filled

#: Half of an order would be another scheme; what the next order adds is a few hundredths here.
SEEN = 0.1
#: Sweeps to the end: what is left of them must not blur the order.
AGREED = {"sweeps": (2, 400), "tolerance": 1e-12}
#: How a method is made of a step [s], its step and l in proportion; whether dashpots damp, and
#: whether steps vary.
MADE = {
    "undamped": (Uniform, False, False),
    "damped": (Uniform, True, False),
    "varying": (lambda step: Multirate(step, 5e-2 * step), False, True),
    "solved": (partial(ImplicitDashpots, **AGREED), True, False),
    "solved at the end": (partial(ImplicitDashpots, theta=1.0, **AGREED), True, False),
}
ENERGIES = "kinetic", "bond_strain", "load_work", "bond_dashpot"


def run(method, damping):
    """Result of the struck bar."""
    looks = {"until": UNTIL, "samples": 1, "frames": 1, "progress": None}
    return simulate(struck_bar(damping=damping), method=method, **looks)


def measured_order(make, step, damping):
    """Orders of steps h, h/2 and h/4: of energies, way and speed of the far end; and a report."""
    results = [run(make(step / 2**k), damping) for k in range(3)]
    values = np.array([recorded(result, damping) for result in results])
    ratio = (values[0] - values[1]) / (values[1] - values[2])
    return np.log2(np.abs(ratio)), results[0].report


def recorded(result, damping):
    """What is recorded at the end, all of one time; heat of dashpots where there are any."""
    energies = [result.series[f"{name}_J"][-1] for name in ENERGIES[: 3 + damping]]
    frame = result.frames[-1]
    far = frame.displacement[:, 0].argmax()
    return [*energies, frame.displacement[far, 0], frame.velocity[far, 0]]


@pytest.mark.parametrize("name", MADE)
def test_a_method_has_the_order_that_it_declares(name):
    """Explicit dashpots bear 2e-8 s, springs ten times that; l asks for up to 16 times less.

    Half of what springs bear is taken: at all of it the third order shows beside the small second.
    """
    make, damping, varying = MADE[name]
    step = {"varying": 1.6e-8, "damped": 2e-8}.get(name, 1e-7)
    orders, report = measured_order(make, step, damping)
    assert orders == pytest.approx(order_of(make(step), damping, varying), abs=SEEN)
    word = "steps up to" if varying else "step"
    assert report.known_error.startswith(f"{word} {step:.3g} s, order {round(orders.mean())};")


class Drag(effects.Load):
    """A load that does not say its order."""

    @ti.func
    def wrench(self, i, motion):
        return -motion.velocity, vec3(0.0)


def test_a_load_that_does_not_say_its_order_leaves_it_unknown():
    """Velocities are half a step old, so that most that read them are of first order."""
    method, scene = Uniform(1e-7), struck_bar(damping=False)
    report = run(method, False).report
    assert " order 2;" in known_error(report, scene, method)
    dragged = replace(scene, effects=[*scene.effects, Drag()])
    assert " order unknown;" in known_error(report, dragged, method)


@pytest.mark.parametrize("tension", [(), (effects.Softening(),)], ids=["slip", "slip and breaks"])
def test_the_account_of_crushed_bonds_closes_with_the_order_of_the_steps(tension):
    """Slip takes a third of the work at the mean of the tractions at both ends of a step.

    Each break falls anywhere within its step, so that the third scale is needed: over four times
    smaller steps the residual falls 16 times, and 4 times where a term is of first order.
    """
    blow = effects.GasPressure("left", peak=5e7, rise=1e-5)
    acting = filled("bonds", blow, effects.ShearSlip(), *tension)
    scene = Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, acting)
    looks = {"until": 6e-5, "samples": 1, "progress": None}
    accounts = [
        (report := simulate(scene, method=Uniform(4e-7 / 2**k), **looks).report).energy_balance
        for k in (0, 2)
    ]
    assert (report.broken_faces > 30) == bool(tension)
    assert accounts[1]["slip"] > 0.2 * accounts[1]["load_work"]
    coarse, fine = (abs(account["residual"]) for account in accounts)
    seen = SEEN if not tension else 0.5
    assert 0.5 * np.log2(coarse / fine) > 2.0 - seen
