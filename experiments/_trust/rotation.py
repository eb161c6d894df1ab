"""Spheres that meet a wall or each other while they turn: tests 6 and 7 of Chung and Ooi (2011)."""

from functools import partial

import numpy as np

from _trust.number import Number
from ca_damper import Batch, SceneTable, Spheres
from taichi_dem.kit.plot_style import BLACK, RED

SOURCE = "Chung and Ooi, Granular Matter 13 (2011) 643"
#: Radius [m], density [kg/m3], modulus [Pa], speed [m/s], restitution, friction: their test 6.
RADIUS, DENSITY, YOUNG, SPEED, RESTITUTION, FRICTION = 0.1, 2700.0, 70e9, 0.2, 0.5, 0.4
MASS = DENSITY * 4.0 / 3.0 * np.pi * RADIUS**3
#: Spins [rad/s] before the blow; the point of contact slides all the time from 7 (1 + e) / 2 mu
#: v / R = 4.2 rad/s on.
SPINS = np.array([6.0, 10.0, 16.0, 24.0])
STEP = 1e-7
#: Room around the spheres, and way to the blow [m].
BOX, WAY = 1.0, 2e-6


def rotation(effort):
    """Spin and way of parting at a wall, and the spins of two spheres."""
    spin, way = at_wall()
    change = 2.5 * (1.0 + RESTITUTION) * FRICTION * SPEED / RADIUS
    slope = FRICTION * (1.0 + RESTITUTION) / RESTITUTION
    words = "change of spin at a wall, by 5 (1 + e) mu v / (2 R)"
    alike = "change of spin where surfaces meet at one velocity"
    numbers = (
        Number("rotation_spin", words, "1", SOURCE, 1.0, (SPINS - spin) / change),
        Number("rotation_angle", "tangent of the way of parting", "1", SOURCE, slope, way),
        Number("rotation_pair", alike, "rad/s", SOURCE, 0.0, of_a_pair(), -1e-12, 1e-12),
    )
    return numbers, partial(draw, spin=spin)


def spheres(places, velocities):
    """Spheres of that size without gravity; one modulus, of wall and sphere."""
    box = {"width": BOX, "height": BOX, "gravity": 0.0, "rotation": True}
    same = {"diameter": 2.0 * RADIUS, "particle_mass": MASS, "friction_law": "history"}
    laws = {"restitution": RESTITUTION, "wall_restitution": RESTITUTION}
    rubs = {"friction": FRICTION, "wall_friction": FRICTION}
    stiff = {"young": YOUNG, "wall_young": YOUNG}
    start = {"start": places, "start_velocity": velocities}
    return Spheres(**box, **same, **laws, **rubs, **stiff, **start)


def after(filling, count, spins):
    """Velocities and spins after the blow in scenes of so many spheres; spins (scenes, count)."""
    table = SceneTable(count, np.arange(len(spins)), STEP, 1.0, 0.0)
    batch = Batch(filling, table, mount="base")
    batch.start()
    turns, stride = batch.device.rotation.spin, batch.device.bodies.stride
    for s, row in enumerate(spins):
        for k, spin in enumerate(row):
            turns[s * stride + k] = spin
    batch.advance(round(4e-3 / STEP))
    ends = [batch.snapshot(s) for s in range(len(spins))]
    return np.array([end["velocity"] for end in ends]), np.array([end["spin"] for end in ends])


def at_wall():
    """Spin [rad/s] after the blow on the floor, and tangent of the way of parting."""
    filling = spheres(((0.5 * BOX, RADIUS + WAY),), ((0.0, -SPEED),))
    velocity, spin = after(filling, 1, SPINS[:, None])
    return np.abs(spin[:, 0]), np.abs(velocity[:, 0, 0] / velocity[:, 0, 1])


def of_a_pair():
    """Changes of the spins of two that meet with surfaces at the same velocity."""
    half = RADIUS + WAY
    places = ((0.5 * BOX - half, 0.5 * BOX), (0.5 * BOX + half, 0.5 * BOX))
    filling = spheres(places, ((SPEED, 0.0), (-SPEED, 0.0)))
    before = np.stack([SPINS, -SPINS], axis=1)
    _, spin = after(filling, 2, before)
    return (spin - before).ravel()


def draw(axes, spin):
    """Spin after the blow over the spin before it, in units of mu v / R."""
    unit = FRICTION * SPEED / RADIUS
    line = np.linspace(0.0, SPINS[-1], 50) / unit
    closed = line - 2.5 * (1.0 + RESTITUTION)
    axes.plot(line, closed, color=BLACK, lw=1.0, label="sliding, closed form")
    axes.plot(SPINS / unit, spin / unit, "o", color=RED, ms=5, label="spheres")
    axes.set_xlabel(r"spin before, $R\omega/(\mu v)$ [1]")
    axes.set_ylabel(r"spin after, $R\omega/(\mu v)$ [1]")
    axes.legend(loc="upper left")
