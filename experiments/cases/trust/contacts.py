"""Contacts with friction: a block on a slope, and spheres that turn (Chung and Ooi, 2011)."""

from functools import partial

import numpy as np

from ca_damper import Batch, SceneTable, Spheres
from cases.meshes import GRAVITY, STEP, loose, softened
from cases.trust import Number
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, placed_together

#: Time on the slope [s].
TIME = 0.12
#: Angles, as shares of the limit: one at which it stands, two from which the limit follows.
SHARES = 0.99, 1.05, 1.1
#: Rays of the contact: 9 and 36 a face.
USUAL, FINE = {"parts": 3}, {"parts": 6}
#: Width of the block [m]; its height over it where it slides, where it topples; friction there.
WIDTH, LOW, HIGH, ROUGH = 0.1, 0.5, 2.0, 0.9
SMOOTH = CONCRETE.friction


def slope(effort):
    """Angles at which blocks that stand at several turns to the plate slide and topple."""
    turns = np.linspace(0.0, 0.7, len(effort.seeds))
    way = np.array([[slid(turn, share * SMOOTH) for share in SHARES] for turn in turns])
    usual, fine = (
        np.array([[leant(turn, share / HIGH, contact) for share in SHARES] for turn in turns])
        for contact in (USUAL, FINE)
    )
    words = "tangent at which a high block topples, by b / h"
    row = partial(Number, source="statics of a rigid block")
    topples = partial(
        row, miss="springs are soft, so a leaning block stands on a strip along its edge"
    )
    slides = "tangent at which a block slides, by mu"
    numbers = (
        row("slope_slides", slides, 1.0, limit(way)),
        row("slope_stands", "way at 0.99 of it", 0.0, 1e3 * way[:, 0], 0.0, 0.01, "mm"),
        topples("slope_topples", words, 1.0, limit(usual)),
        topples("slope_topples_fine", f"{words}, 36 rays a face", 1.0, limit(fine)),
    )
    return numbers, {}


def limit(moved):
    """Share of the angle at which a motion begins that grows as the excess, of each row."""
    (early, late), (less, more) = SHARES[-2:], moved[:, -2:].T
    return early - less * (late - early) / (more - less)


def slid(turn, tangent):
    """Way of a low block down the slope [m]."""
    moved, down, _ = on_slope(turn, tangent, LOW, SMOOTH, USUAL)
    return float((moved @ down).mean())


def leant(turn, tangent, contact):
    """By how much the upper half of a high block moves down the slope more than the lower [m]."""
    moved, down, height = on_slope(turn, tangent, HIGH, ROUGH, contact)
    ahead, above = moved @ down, height > np.median(height)
    return float(ahead[above].mean() - ahead[~above].mean())


def on_slope(turn, tangent, ratio, friction, contact):
    """Displacements (n, 3) of a block's bodies, the way down, and their heights at the start [m].

    turn: of block and way down against the plate's boxes [rad]. ratio: of height to width.
    """
    angle = np.arctan(tangent)
    down = np.array([0.0, np.cos(turn), np.sin(turn)])
    plate, block = bar(0.05, 0.4, (1, 4, 4)), turned(ratio, turn)
    parts = {"plate": (plate, (-0.05, -0.2, -0.2)), "block": (block, (1e-9, 0.0, 0.0))}
    mesh, law = placed_together(parts), softened(friction)
    weight = GRAVITY * (np.sin(angle) * down - np.cos(angle) * np.array([1.0, 0.0, 0.0]))
    simulation = Simulation(Scene(mesh, law, loose(weight, **contact)), ImplicitDashpots(STEP))
    simulation.advance_to(round(TIME / STEP))
    own = slice(plate.body_count, None)
    centre = simulation.model.centre[own]
    return simulation.state.motion()["position"][own] - centre, down, centre[:, 0]


def turned(ratio, turn):
    """A block that stands on x = 0, turned about x."""
    mesh = bar(ratio * WIDTH, WIDTH, (max(1, round(2 * ratio)), 2, 2))
    points = mesh.points - np.array([0.0, 0.5 * WIDTH, 0.5 * WIDTH])
    c, s = np.cos(turn), np.sin(turn)
    return checked_mesh(points @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), mesh.tetrahedra, {})


#: Radius [m], density [kg/m3], modulus [Pa], speed [m/s], restitution, friction: their test 6.
RADIUS, DENSITY, YOUNG, SPEED, RESTITUTION, FRICTION = 0.1, 2700.0, 70e9, 0.2, 0.5, 0.4
#: Spins [rad/s] before the blow; the point of contact slides all the time from 7 (1 + e) / 2 mu
#: v / R = 4.2 rad/s on.
SPINS = np.array([6.0, 10.0, 16.0, 24.0])
#: Step [s], room around the spheres, and way to the blow [m].
SHORT, BOX, WAY = 1e-7, 1.0, 2e-6
#: One modulus, restitution and friction, of wall and sphere; no gravity.
SPHERES = {
    **{"width": BOX, "height": BOX, "gravity": 0.0, "rotation": True, "friction_law": "history"},
    **{"diameter": 2.0 * RADIUS, "particle_mass": DENSITY * 4.0 / 3.0 * np.pi * RADIUS**3},
    **{"restitution": RESTITUTION, "wall_restitution": RESTITUTION},
    **{"friction": FRICTION, "wall_friction": FRICTION, "young": YOUNG, "wall_young": YOUNG},
}


def rotation(effort):
    """Spin and way of parting at a wall, and the spins of two spheres."""
    half = RADIUS + WAY
    floor = Spheres(**SPHERES, start=((0.5 * BOX, half),), start_velocity=((0.0, -SPEED),))
    velocity, spin = after(floor, 1, SPINS[:, None])
    spin, way = np.abs(spin[:, 0]), np.abs(velocity[:, 0, 0] / velocity[:, 0, 1])
    places = ((0.5 * BOX - half, 0.5 * BOX), (0.5 * BOX + half, 0.5 * BOX))
    meeting = {"start": places, "start_velocity": ((SPEED, 0.0), (-SPEED, 0.0))}
    before = np.stack([SPINS, -SPINS], axis=1)
    _, of_pair = after(Spheres(**SPHERES, **meeting), 2, before)
    change = 2.5 * (1.0 + RESTITUTION) * FRICTION * SPEED / RADIUS
    tangent = FRICTION * (1.0 + RESTITUTION) / RESTITUTION
    words = "change of spin at a wall, by 5 (1 + e) mu v / (2 R)"
    alike = "change of spin where surfaces meet at one velocity"
    row = partial(Number, source="Chung and Ooi, Granular Matter 13 (2011) 643")
    numbers = (
        row("rotation_spin", words, 1.0, (SPINS - spin) / change),
        row("rotation_angle", "tangent of the way of parting", tangent, way),
        row("rotation_pair", alike, 0.0, (of_pair - before).ravel(), -1e-12, 1e-12, "rad/s"),
    )
    return numbers, {}


def after(filling, count, spins):
    """Velocities and spins after the blow in scenes of so many spheres; spins (scenes, count)."""
    table = SceneTable(count, np.arange(len(spins)), SHORT, 1.0, 0.0)
    batch = Batch(filling, table, mount="base")
    batch.start()
    turns, stride = batch.device.rotation.spin, batch.device.bodies.stride
    for s, row in enumerate(spins):
        for k, spin in enumerate(row):
            turns[s * stride + k] = spin
    batch.advance(round(4e-3 / SHORT))
    ends = [batch.snapshot(s) for s in range(len(spins))]
    return np.array([end["velocity"] for end in ends]), np.array([end["spin"] for end in ends])
