"""Scenes that several tests share."""

import os

import numpy as np

from taichi_dem import CONCRETE, PAPER_BLOCK, Scene, checked_mesh, effects, read_mesh
from taichi_dem.mesh.shapes import bar, placed_together, single
from tests.structures import filled

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def paper_effects(peak=575e6, rise=1.33e-4, kind=effects.SphereContact, **contact):
    """All effects of the paper; contact: options of SphereContact, of broken faces by default.

    kind: its class.
    """
    if kind is effects.SphereContact:
        contact = {"outer_faces": False, **contact}
    return [
        effects.BondDamping(),
        effects.Softening(),
        effects.ShearSlip(),
        kind(**contact),
        effects.Friction(),
        effects.GasPressure(peak=peak, rise=rise),
    ]


def paper_scene(**options):
    """The paper's block with all of its effects."""
    return Scene(read_mesh(PAPER_BLOCK), CONCRETE, paper_effects(**options))


def brisk_scene(**contact):
    """The paper's block under a harder, faster pulse: 90 bonds break within 3e-5 s."""
    return paper_scene(peak=3 * 575e6, rise=4e-5, **contact)


def beside(mesh, other, shift):
    """Two meshes in one, the second moved by a shift [m]."""
    return placed_together({"first": (mesh, [0.0, 0.0, 0.0]), "second": (other, shift)})


def apart(count, edge=0.05):
    """Single regular bodies in a row, no two of which share a corner."""
    alone = checked_mesh(single(edge).points, single(edge).tetrahedra, {})
    return placed_together({f"body_{k}": (alone, [20.0 * k * edge, 0, 0]) for k in range(count)})


def quaternion(axis, angle):
    """Unit quaternion, scalar first, of a rotation about an axis of any length."""
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])


def matrix(q):
    """Rotation matrix of a unit quaternion: cos 1 + sin [n x] + (1 - cos) n n^T."""
    cosine, sine = q[0] ** 2 - q[1:] @ q[1:], 2 * q[0] * q[1:]
    cross = np.array([[0, -sine[2], sine[1]], [sine[2], 0, -sine[0]], [-sine[1], sine[0], 0]])
    return cosine * np.eye(3) + cross + 2 * np.outer(q[1:], q[1:])


def product(p, q):
    """Rotation q followed by rotation p."""
    vector = p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *vector])


def quaternions(random, count):
    """Random orientations, unit quaternions, and their matrices."""
    turn = random.standard_normal((count, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    return turn, np.array([matrix(each) for each in turn])


def bar_scene(*more, kind=effects.SphereContact):
    """Bar of 72 bodies that is blown at one end: 16 bonds break, and what they held touches.

    more: effects beside those of the paper. kind: of contact.
    """
    listed = paper_effects(kind=kind)[:-1]
    gas = effects.GasPressure("left", peak=2e9, rise=1e-5)
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [*listed, gas, *more])


#: Ends of runs of the two bars below [s].
UNTIL, BROKEN_UNTIL = 2e-5, 3e-4


def struck_bar(damping=True):
    """Bar of 72 bodies under a blow on its left end, damped unless told otherwise."""
    blow = effects.GasPressure("left", peak=5e6, rise=1e-5)
    acting = filled("bonds", blow, *([effects.BondDamping()] * damping))
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, acting)


def broken_bar():
    """Bar of twelve bodies that its blow breaks, as it comes back as tension."""
    blow = effects.GasPressure("left", peak=9e8, rise=1e-5, decay_ratio=1.5)
    bonds = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    touch = effects.SphereContact(), effects.Friction()
    acting = filled("held", *bonds, *touch, effects.Fixed("right"), blow)
    return Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, acting)
