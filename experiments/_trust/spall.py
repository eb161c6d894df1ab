"""Spall of a bar by a triangular pulse: planes at lambda sigma_t / (2 s0) from the free end."""

from functools import partial

import numpy as np

from _trust.meshes import material_of, plate, springs_step
from _trust.number import Number
from taichi_dem import ImplicitDashpots, Scene, effects, simulate
from taichi_dem.kit.plot_style import BLACK, RED

SOURCE = "one-dimensional waves, Kolsky"
#: Bar: length [m], speed of waves [m/s], density [kg/m3], strength [Pa]. Pulse: peak [Pa], its
#: length [m].
LENGTH, SPEED, DENSITY, STRENGTH, PEAK, PULSE = 0.3, 3500.0, 2350.0, 5e6, 20e6, 0.3
#: Width of the bar [m], elements across it; fracture energy [J/m2].
WIDTH, ACROSS, ENERGY = 10e-3, (2, 3), 2.0
#: The pulse's front [m], and the share of critical damping, without which elements ring behind it.
FRONT, DAMPING = 25e-3, 0.1
#: Least share of all mass that counts as a piece; below it is dust.
LEAST = 0.005
DEPTH = 0.5 * PULSE * STRENGTH / PEAK
LEAVES = (2.0 * PEAK - STRENGTH) / (DENSITY * SPEED)
PLANES = PEAK / STRENGTH


def spall(effort):
    """Depth of the first plane, speed at which its piece leaves, and the number of planes."""
    sizes = ACROSS[: effort.sizes]
    found = [[spalled(WIDTH / across, seed) for seed in effort.seeds] for across in sizes]
    numbers = [
        number for across, bars in zip(sizes, found) for number in of_size(WIDTH / across, bars)
    ]
    return numbers, partial(draw, ends=[ends for *_, ends in found[-1]])


def of_size(edge, bars):
    """Numbers of the bars with elements of one size [m]."""
    depth, speed, planes, _ = zip(*bars)
    tag, size = f"{1e3 * edge:.2g}_mm", f"elements of {1e3 * edge:.2g} mm"
    miss = "each new end rings at the length of an element, and breaks further pieces off"
    near = 1e3 * (DEPTH - edge), 1e3 * (DEPTH + edge)
    first = f"spall_depth_{tag}", f"first plane from the free end, {size}", "mm", SOURCE
    leaves = f"spall_speed_{tag}", f"it leaves at, {size}", "m/s", SOURCE, LEAVES
    count = f"spall_planes_{tag}", f"planes, {size}", "1", SOURCE, PLANES, np.array(planes)
    return (
        Number(*first, 1e3 * DEPTH, 1e3 * np.array(depth), *near, note="a bar broke near its end"),
        Number(*leaves, np.array(speed), allowed=0.03),
        Number(*count, note=miss),
    )


def spalled(edge, seed):
    """Depth [m] of the first plane, speed [m/s] of the piece, planes, and pieces' ends [m]."""
    mesh = plate(LENGTH, WIDTH, edge, seed, layers=round(WIDTH / edge))
    options = {"density": DENSITY, "tensile_strength": STRENGTH, "fracture_energy": ENERGY}
    more = {"friction_angle": 30.0, "cohesion": 10 * STRENGTH, "damping_ratio": DAMPING}
    material, _ = material_of(mesh, DENSITY * SPEED**2, 0.0, axes=(0,), **options, **more)
    # Dashpots take some of the peak on its way: the published one is that which arrives.
    weak = run(mesh, material, PEAK, [])
    last = weak.model.centre[:, 0] > LENGTH - edge
    fastest = max(frame.velocity[last, 0].mean() for frame in weak.frames)
    arrived = 0.5 * DENSITY * SPEED * fastest
    result = run(mesh, material, PEAK * PEAK / arrived, [effects.Softening()])
    fragments = result.fragments()
    mass, far = fragments["mass_kg"].to_numpy(), np.full(len(fragments), -np.inf)
    np.maximum.at(far, result.fragment_of_body(), mesh.points[mesh.tetrahedra][..., 0].max(axis=1))
    pieces = np.flatnonzero(mass > LEAST * mass.sum())
    first = pieces[far[pieces].argmax()]
    speed = fragments["velocity_x_m_s"].to_numpy()[first]
    return mass[first] / (DENSITY * WIDTH**2), speed, len(pieces) - 1, sorted(far[pieces].tolist())


def run(mesh, material, peak, laws):
    """A pulse of a peak [Pa] through the bar, with fracture or without."""
    times = 0.0, FRONT / SPEED, (FRONT + PULSE) / SPEED
    pulse = effects.Pressure("left", (0.0, peak, 0.0), times)
    scene = Scene(mesh, material, [effects.BondDamping(), *laws, pulse])
    until = (LENGTH + FRONT + 1.2 * PULSE) / SPEED
    method = ImplicitDashpots(springs_step(scene))
    return simulate(scene, method=method, until=until, samples=1, frames=120, progress=None)


def draw(axes, ends):
    """Where the bars came apart."""
    look = {"color": RED, "ms": 14}
    for k, places in enumerate(ends):
        from_end = 1e3 * (LENGTH - np.array(places))
        axes.plot(from_end, np.full(len(places), k + 1.0), "|", **look)
    axes.plot([], [], "|", label="end of a piece", **look)
    for k in range(1, 5):
        words = "" if k > 1 else "planes of the formula"
        axes.axvline(1e3 * k * DEPTH, color=BLACK, lw=0.8, ls=":", label=words)
    axes.set(xlabel="distance from the free end [mm]", ylabel="random mesh [1]")
    axes.set(yticks=range(1, len(ends) + 1), ylim=(0.4, len(ends) + 0.6))
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
