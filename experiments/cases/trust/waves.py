"""Waves along a bar: the speed of a long one by its standing wave, and spall by a pulse."""

from functools import partial

import numpy as np

from cases.trust import Number
from cases.trust.plates import material_of, plate, springs_step
from taichi_dem import ImplicitDashpots, Scene, Simulation, Uniform, effects, simulate

#: Bar: length, width and thickness [m], Young's modulus [Pa], Poisson's ratio, density [kg/m3].
LENGTH, WIDTH, YOUNG, POISSON, DENSITY = 1.0, 0.2, 32e9, 0.2, 2450.0
#: Elements along the bar: twice as many in a wave length. Speed of the ends [m/s]; periods.
CELLS, ENDS, PERIODS = (5, 10, 20), 1e-3, 2.25
STRONG = {"tensile_strength": 1e8, "cohesion": 1e8, "fracture_energy": 1e5}
NUMBER = np.pi / LENGTH
INERTIA = (WIDTH**2 + WIDTH**2) / 12.0
EXACT = np.sqrt(YOUNG / DENSITY / (1.0 + (POISSON * NUMBER) ** 2 * INERTIA))


def bar_wave(effort):
    """Speeds with 10, 20 and 40 elements in a wave length (Rayleigh, with lateral inertia)."""
    cells = CELLS[: max(2, effort.sizes)]
    speed = np.array([[speed_of(n, seed) for n in cells] for seed in effort.seeds])
    row = partial(Number, unit="m/s", source="Rayleigh, sqrt(E / rho) with lateral inertia")
    words = "speed of a wave with {} elements in it"
    numbers = [
        row(f"bar_wave_{2 * n}", words.format(2 * n), float(EXACT), speed[:, k])
        for k, n in enumerate(cells)
    ]
    return numbers, {}


def speed_of(cells, seed):
    """Speed of the wave that is twice as long as a bar of so many elements [m/s]."""
    edge = LENGTH / cells
    mesh = plate(LENGTH, WIDTH, edge, seed, layers=round(WIDTH / edge))
    options = {"density": DENSITY, "friction_angle": 30.0, "damping_ratio": 0.0, **STRONG}
    scene = Scene(mesh, material_of(mesh, YOUNG, POISSON, axes=(0,), **options), [])
    simulation = Simulation(scene, Uniform(springs_step(scene)))
    model = simulation.model
    shape = np.cos(NUMBER * model.centre[:, 0])
    simulation.state.set_motion(model.centre, velocity=np.outer(ENDS * shape, (1.0, 0.0, 0.0)))
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


#: Spalled bar: length [m], speed of waves [m/s], density [kg/m3], strength [Pa]. Pulse: peak [Pa],
#: its length [m].
ROD, SPEED, HEAVY, STRENGTH, PEAK, PULSE = 0.3, 3500.0, 2350.0, 5e6, 20e6, 0.3
#: Width of the bar [m], elements across it; fracture energy [J/m2].
THICK, ACROSS, ENERGY = 10e-3, (2, 3), 2.0
#: The pulse's front [m], and the share of critical damping, without which elements ring behind it.
FRONT, DAMPING = 25e-3, 0.1
#: Least share of all mass that counts as a piece; below it is dust.
LEAST = 0.005
DEPTH = 0.5 * PULSE * STRENGTH / PEAK
LEAVES = (2.0 * PEAK - STRENGTH) / (HEAVY * SPEED)


def spall(effort):
    """Depth of the first plane, speed at which its piece leaves, and the number of planes."""
    numbers = []
    for across in ACROSS[: effort.sizes]:
        edge = THICK / across
        found = zip(*(spalled(edge, seed) for seed in effort.seeds))
        numbers += of_size(edge, *map(np.array, found))
    return numbers, {}


def of_size(edge, depth, speed, planes):
    """Numbers of the bars with elements of one size [m]."""
    tag, size = f"{1e3 * edge:.2g}_mm", f"elements of {1e3 * edge:.2g} mm"
    row = partial(Number, source="one-dimensional waves, Kolsky")
    near = 1e3 * (DEPTH - edge), 1e3 * (DEPTH + edge)
    first = f"spall_depth_{tag}", f"first plane from the free end, {size}", 1e3 * DEPTH
    leaves = f"spall_speed_{tag}", f"it leaves at, {size}", LEAVES
    count = f"spall_planes_{tag}", f"planes, {size}", PEAK / STRENGTH
    near_the_end = "a bar broke near its end" if edge == THICK / ACROSS[1] else ""
    rings = "each new end rings at the length of an element, and breaks further pieces off"
    return (
        row(*first, 1e3 * depth, *near, unit="mm", miss=near_the_end),
        row(*leaves, speed, unit="m/s", allowed=0.03),
        row(*count, planes, miss=rings),
    )


def spalled(edge, seed):
    """Depth [m] of the first plane, speed [m/s] of the piece, and planes."""
    mesh = plate(ROD, THICK, edge, seed, layers=round(THICK / edge))
    options = {"density": HEAVY, "tensile_strength": STRENGTH, "fracture_energy": ENERGY}
    more = {"friction_angle": 30.0, "cohesion": 10 * STRENGTH, "damping_ratio": DAMPING}
    material = material_of(mesh, HEAVY * SPEED**2, 0.0, axes=(0,), **options, **more)
    # Dashpots take some of the peak on its way: the published one is that which arrives.
    weak = pulsed(mesh, material, PEAK, [])
    last = weak.model.centre[:, 0] > ROD - edge
    fastest = max(frame.velocity[last, 0].mean() for frame in weak.frames)
    arrived = 0.5 * HEAVY * SPEED * fastest
    result = pulsed(mesh, material, PEAK * PEAK / arrived, [effects.Softening()])
    fragments = result.fragments()
    mass, far = fragments["mass_kg"].to_numpy(), np.full(len(fragments), -np.inf)
    np.maximum.at(far, result.fragment_of_body(), mesh.points[mesh.tetrahedra][..., 0].max(axis=1))
    pieces = np.flatnonzero(mass > LEAST * mass.sum())
    first = pieces[far[pieces].argmax()]
    speed = fragments["velocity_x_m_s"].to_numpy()[first]
    return mass[first] / (HEAVY * THICK**2), speed, len(pieces) - 1


def pulsed(mesh, material, peak, laws):
    """A pulse of a peak [Pa] through the bar, with fracture or without."""
    times = 0.0, FRONT / SPEED, (FRONT + PULSE) / SPEED
    pulse = effects.Pressure("left", (0.0, peak, 0.0), times)
    scene = Scene(mesh, material, [effects.BondDamping(), *laws, pulse])
    until = (ROD + FRONT + 1.2 * PULSE) / SPEED
    method = ImplicitDashpots(springs_step(scene))
    return simulate(scene, method=method, until=until, samples=1, frames=120, progress=None)
