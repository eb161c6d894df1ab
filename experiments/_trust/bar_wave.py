"""The speed of a long wave in a bar, by the period of its first standing wave."""

from functools import partial

import numpy as np

from _trust.meshes import material_of, plate, springs_step
from _trust.number import Number
from taichi_dem import Scene, Simulation, Uniform
from taichi_dem.kit.plot_style import BLACK, GREY, RED

SOURCE = "Rayleigh, sqrt(E / rho) with lateral inertia"
#: Bar: length, width and thickness [m], Young's modulus [Pa], Poisson's ratio, density [kg/m3].
LENGTH, WIDTH, YOUNG, POISSON, DENSITY = 1.0, 0.2, 32e9, 0.2, 2450.0
#: Elements along the bar: twice as many in a wave length. Speed of the ends [m/s]; periods.
CELLS, SPEED, PERIODS = (5, 10, 20), 1e-3, 2.25
STRONG = {"tensile_strength": 1e8, "cohesion": 1e8, "fracture_energy": 1e5}
NUMBER = np.pi / LENGTH
INERTIA = (WIDTH**2 + WIDTH**2) / 12.0
EXACT = np.sqrt(YOUNG / DENSITY / (1.0 + (POISSON * NUMBER) ** 2 * INERTIA))


def bar_wave(effort):
    """Speeds with 10, 20 and 40 elements in a wave length."""
    cells = CELLS[: max(2, effort.sizes)]
    speed = np.array([[speed_of(n, seed) for n in cells] for seed in effort.seeds])
    numbers = [
        Number(
            *(f"bar_wave_{2 * n}", f"speed of a wave with {2 * n} elements in it", "m/s"),
            *(SOURCE, float(EXACT), speed[:, k]),
        )
        for k, n in enumerate(cells)
    ]
    return numbers, partial(draw, cells=cells, speed=speed)


def speed_of(cells, seed):
    """Speed of the wave that is twice as long as a bar of so many elements [m/s]."""
    edge = LENGTH / cells
    mesh = plate(LENGTH, WIDTH, edge, seed, layers=round(WIDTH / edge))
    options = {"density": DENSITY, "friction_angle": 30.0, "damping_ratio": 0.0, **STRONG}
    material, _ = material_of(mesh, YOUNG, POISSON, axes=(0,), **options)
    scene = Scene(mesh, material, [])
    simulation = Simulation(scene, Uniform(springs_step(scene)))
    model = simulation.model
    shape = np.cos(NUMBER * model.centre[:, 0])
    simulation.state.set_motion(model.centre, velocity=np.outer(SPEED * shape, (1.0, 0.0, 0.0)))
    period, step = 2.0 * LENGTH / EXACT, simulation.method.dt0
    times, swing = [], []
    for n in range(1, round(PERIODS * period / step), max(1, round(period / step / 100))):
        simulation.advance_to(n)
        velocity = simulation.state.motion()["velocity"][:, 0]
        times.append(n * step)
        swing.append(float((model.body_mass * shape * velocity).sum()))
    return 2.0 * LENGTH / period_of(np.array(times), np.array(swing))


def period_of(times, swing):
    """Period of a motion about zero, by the times at which it passes zero."""
    k = np.flatnonzero(swing[:-1] * swing[1:] < 0.0)
    passed = times[k] - swing[k] * np.diff(times)[k] / np.diff(swing)[k]
    return 2.0 * float(np.diff(passed).mean())


def draw(axes, cells, speed):
    """Error of the speed over the elements in a wave length."""
    waves, error = 2.0 * np.array(cells), 100.0 * (speed / EXACT - 1.0)
    axes.axhspan(-1.0, 1.0, color=GREY, alpha=0.25, lw=0.0, label="1 %")
    axes.plot(waves, error.T, "o", color=RED, ms=4)
    axes.plot([], [], "o", color=RED, label="a random mesh")
    axes.plot(waves, error.mean(axis=0), "_", color=BLACK, ms=16, label="mean")
    axes.set(xlabel="elements in a wave length [1]", ylabel="error of the speed [%]")
    axes.set_xticks(waves, map("{:g}".format, waves))
    axes.legend(loc="lower right")
