"""A block on a slope: it slides beyond tan a = mu, and topples beyond tan a = b / h."""

from functools import partial

import numpy as np

from _piles import GRAVITY, STEP, loose, softened
from _trust.number import Number
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation
from taichi_dem.kit.plot_style import BLACK, BLUE, RED
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, placed_together

SOURCE = "statics of a rigid block"
#: Time [s].
TIME = 0.12
#: Angles, as shares of the limit: one at which it stands, two from which the limit follows.
SHARES = 0.99, 1.05, 1.1
#: Rays of the contact: 9 and 36 a face.
USUAL, FINE = {"parts": 3}, {"parts": 6}
#: Width of the block [m]; its height over it where it slides, where it topples; friction there.
WIDTH, LOW, HIGH, ROUGH = 0.1, 0.5, 2.0, 0.9
FRICTION = CONCRETE.friction


def slope(effort):
    """Angles at which blocks that stand at several turns to the plate slide and topple."""
    turns = np.linspace(0.0, 0.7, effort.meshes)
    way = np.array([[slid(turn, share * FRICTION) for share in SHARES] for turn in turns])
    usual, fine = (
        np.array([[leant(turn, share / HIGH, contact) for share in SHARES] for turn in turns])
        for contact in (USUAL, FINE)
    )
    words = "tangent at which a high block topples, by b / h"
    note = "springs are soft, so a leaning block stands on a strip along its edge"
    numbers = (
        Number(
            "slope_slides", "tangent at which a block slides, by mu", "1", SOURCE, 1.0, limit(way)
        ),
        Number("slope_stands", "way at 0.99 of it", "mm", SOURCE, 0.0, 1e3 * way[:, 0], 0.0, 0.01),
        Number("slope_topples", words, "1", SOURCE, 1.0, limit(usual), note=note),
        Number(
            "slope_topples_fine",
            f"{words}, 36 rays a face",
            "1",
            SOURCE,
            1.0,
            limit(fine),
            note=note,
        ),
    )
    return numbers, partial(draw, curves={"slides, mu": way, "topples, b / h": usual})


def limit(moved):
    """Share of the angle at which a motion begins that grows as the excess, of each row."""
    (early, late), (less, more) = SHARES[-2:], moved[:, -2:].T
    return early - less * (late - early) / (more - less)


def slid(turn, tangent):
    """Way of a low block down the slope [m]."""
    moved, down, _ = on_slope(turn, tangent, LOW, FRICTION, USUAL)
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


def draw(axes, curves):
    """Ways over the angle."""
    for (words, moved), colour, form in zip(curves.items(), (BLUE, RED), ("o-", "s--")):
        axes.plot(SHARES, 1e3 * moved.T, form, color=colour, ms=4, lw=0.8)
        axes.plot([], [], form, color=colour, label=words)
    axes.axvline(1.0, color=BLACK, lw=0.8, ls=":", label="limit")
    axes.set(xlabel="tangent of the slope / its limit [1]", ylabel="way after 0.12 s [mm]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
