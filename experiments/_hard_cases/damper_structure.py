"""Hard cases of the damper: the container and its spring at their limits, in closed form."""

from functools import partial

import numpy as np

from _hard_cases._damper_run import OSCILLATOR
from ca_damper import Batch, Empty, RigidMass, SceneTable
from taichi_dem.kit.study.cases import Cases

case = CASES = Cases("damper")
M, K, C = OSCILLATOR.mass, OSCILLATOR.stiffness, OSCILLATOR.damping
#: Frequency of the empty structure [Hz], and motion of the base [m].
F, Y = OSCILLATOR.natural_frequency, 0.6e-3
#: A share of what RK45 allows a step, over the steps of some hundred cycles.
TOLERANCE = 1e-6


def swung(trial, what, particles, cycles, mount="spring", begin="rest", **numbers):
    """Batch after some cycles, and the measures of the last of them."""
    numbers = {"dt": 1e-3, "frequency": F, "base_amplitude": Y, **numbers}
    start = numbers.pop("start", {})
    batch = Batch(what, SceneTable(particles, 1, **numbers), mount=mount)
    batch.start(begin, **start)
    measured = batch.run(cycles - 1, 1)
    trial.compile_s += batch.compile_seconds
    return batch, measured


def answers_rigidly(trial, what=None, particles=0, cycles=50, ratio=1.0, **structure):
    """RMS displacement of a structure with a fixed mass against the transfer function."""
    what = what or Empty()
    m, k, c = (structure.get(n, d) for n, d in (("mass", M), ("stiffness", K), ("damping", C)))
    numbers = {"frequency": ratio * F, **structure}
    _, measured = swung(trial, what, particles, cycles, begin="rigid", **numbers)
    omega, held = 2.0 * np.pi * ratio * F, k + 2j * np.pi * ratio * F * c
    whole = m + particles * what.particle_mass
    true = Y * abs(held / (held - whole * omega**2)) / np.sqrt(2.0)
    trial.limit("response error", abs(measured.rms[0] / true - 1.0), TOLERANCE, "transfer function")


#: Structures far from that of the paper, from their steady state on: what is odd, and options.
ODD = {
    "overdamped_structure": (
        "A hundred times critical damping",
        {"damping": 200.0 * (K * M) ** 0.5},
    ),
    "stiff_structure": ("A spring 1e4 times as stiff", {"stiffness": 1e4 * K, "cycles": 5}),
    "soft_structure": (
        "A spring 1e6 times as soft, far above its resonance",
        {"stiffness": 1e-6 * K},
    ),
    "container_of_a_milligram": ("A container of 1 mg", {"mass": 1e-6, "cycles": 5}),
    "container_of_a_thousand_tonnes": ("A container of 1e6 kg", {"mass": 1e6, "stiffness": 1e9}),
    "far_above_resonance": ("A base at thirty times the resonance", {"ratio": 30.0, "dt": 1e-4}),
    "far_below_resonance": ("A base at a hundredth of the resonance", {"ratio": 0.01, "cycles": 3}),
    "million_particles_glued": (
        # Without weight: it would hang 16 m low, of which RK45 keeps nine digits.
        "A million particles glued to the container",
        {"what": RigidMass(gravity=0.0), "particles": 1_000_000},
    ),
}
for name, (odd, options) in ODD.items():
    case.add(name, f"{odd}: the transfer function.", partial(answers_rigidly, **options), ["empty"])


@case(["empty"])
def undamped_resonance(trial):
    """No damping, at resonance: it grows by pi y0 a cycle, x = y0 (sin wt - wt cos wt) / 2."""
    cycles = 20 if trial.quick else 500
    batch, _ = swung(trial, Empty(), 0, cycles, damping=0.0)
    found, true = batch.sample()["x"][0], -np.pi * cycles * Y
    trial.limit("error / amplitude", abs(found / true - 1.0), TOLERANCE, "x = -pi n y0")


@case(["empty"])
def free_swing_for_long(trial):
    """An undamped container that is let go swings with the same energy after many cycles."""
    cycles = 100 if trial.quick else 10000
    numbers = {"damping": 0.0, "base_amplitude": 0.0, "start": {"displacement": 0.01}}
    batch, _ = swung(trial, Empty(), 0, cycles, **numbers)
    state = batch.sample()
    energy = OSCILLATOR.energy(state["x"][0], state["v"][0]) / (0.5 * K * 0.01**2)
    trial.limit("energy error", abs(energy - 1.0), 1e-9 * 50.0 * cycles, "rtol a step")


@case(["empty"])
def nothing_moves_at_all(trial):
    """No base motion, no damping, no particles: it stays, to the bit."""
    batch, measured = swung(trial, Empty(), 0, 20, damping=0.0, base_amplitude=0.0)
    moved = abs(batch.sample()["x"][0]) + measured.rms[0]
    trial.limit("displacement [m]", moved, 0.0, "nothing acts")


@case(["empty"])
def mass_on_a_floor_below_1_g(trial):
    """A mass on a floor that is shaken at 0.9 g does not lift: its sag stays that of 1.9 g."""
    amplitude, heavy = 0.9 * 9.8 / (20.0 * np.pi) ** 2, {"stiffness": 4e5, "damping": 80.0}
    shaken = {"frequency": 10.0, "base_amplitude": amplitude, "dt": 1e-4, **heavy}
    batch = Batch(RigidMass(), SceneTable(0, 1, **shaken), mount="floor", recorded_samples=20000)
    batch.start()
    batch.run(10, 0, record_every=1)
    series = batch.time_series()
    gap = (series["x"] - series["y"])[len(series["x"]) // 2 :, 0]
    sag = M * 9.8 / 4e5
    trial.limit("lift / sag", gap.max() / sag, 0.0, "m (g - A w^2) > 0")
    trial.limit("sag / static", -gap.min() / sag, 2.0, "1.9 g, and 5 % of ringing")


def refused(name, words, question, **numbers):
    """A table of one scene that has to be refused."""

    def run(_):
        table = {"particles": 0, "seed": 1, "dt": 1e-3, "frequency": 6.0, **numbers}
        Batch(Empty(), SceneTable(**table), mount="spring").start()

    case.add(name, question, run, (), (["empty"], words))


refused("container_without_mass", "mass", "A container without mass.", mass=0.0)
refused("spring_that_pushes", "stiffness", "A spring of negative stiffness.", stiffness=-1.0)
refused(
    "amplitude_without_end", "base_amplitude", "A base of infinite motion.", base_amplitude=np.inf
)
refused("half_a_particle", "particles", "Half a particle.", particles=0.5)
refused("seed_below_zero", "seed", "A seed below zero.", seed=-1)
refused("cycle_of_few_steps", "dt must lie in", "Ten steps a cycle.", dt=1.0 / 60.0)
