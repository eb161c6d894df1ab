"""Questions about bars that are drawn at random: scene, time, goal and tolerance."""

from dataclasses import dataclass, replace

import numpy as np

from taichi_dem import CONCRETE, PAPER_BLOCK, Goal, Scene, effects, goals, read_mesh
from taichi_dem.kit.display import counted
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.shapes import bar, placed_together, single

#: Fewest and most boxes along x, y and z, and bodies of a bar.
BOXES, BODIES = ((2, 12), (1, 5), (1, 5)), (12, 1500)
#: Powers of ten between which are drawn: edge of a box [m], stiffness and damping over those of
#: concrete, peak of the pressure [Pa]; end of the run and rise of the pressure over the time of a
#: wave along the bar.
EDGE, STIFFNESS, DAMPING, PEAK = (-2, -1), (-0.3, 0.5), (-1.5, 0.3), (6.5, 8.7)
LASTS, RISES = (0.0, 1.3), (-1.0, 0.5)
#: Shares of the bars that have dashpots, that may break, and that are fixed at one end.
DAMPED, BREAKING, FIXED = 0.85, 0.6, 0.4
#: Room in the lists of contacts: a bar that is crushed needs more than a block that is blasted.
LISTS = {"pairs_per_body": 200, "neighbours_per_body": 500}
#: Tolerances, powers of ten.
TOLERANCE = (-2.5, -1.0)


@dataclass(frozen=True)
class Question:
    """A question about a scene: the value of a goal at a time [s], to a tolerance."""

    seed: int
    scene: Scene
    until: float
    goal: Goal
    tolerance: float

    def __str__(self):
        bodies = counted(self.scene.mesh.body_count, "body")
        effects = " ".join(effect.name for effect in self.scene.effects if effect.name)
        return f"bar of {bodies} to {self.until:.3g} s: {self.goal.name}; {effects}"


def blast_question(seed: int) -> Question:
    """The question with a number."""
    random = np.random.default_rng(seed)
    mesh, edge = _bar(random)
    stiffer, damped = _power(random, STIFFNESS), _power(random, DAMPING)
    material = replace(
        CONCRETE,
        normal_stiffness=CONCRETE.normal_stiffness * stiffer,
        shear_stiffness=CONCRETE.shear_stiffness * stiffer,
        normal_damping=CONCRETE.normal_damping * damped,
        shear_damping=CONCRETE.shear_damping * damped,
    )
    wave = np.sqrt(material.normal_stiffness * edge / material.density)
    travel = float(np.ptp(mesh.points[:, 0]) / wave)
    until = travel * _power(random, LASTS)
    scene = Scene(mesh, material, _effects(random, travel))
    goal = _goal(random, scene)
    return Question(seed, scene, until, goal, _power(random, TOLERANCE))


def paper_question(until: float, tolerance: float) -> Question:
    """How far the hole of the paper's block opens until a time [s]."""
    scene = Scene(read_mesh(PAPER_BLOCK), CONCRETE, "auto", loads=[effects.GasPressure()])
    return Question(0, scene, until, goals.hole_displacement(), tolerance)


def dropped_question(until: float) -> Question:
    """How far three stiff tetrahedra go that fall on a slab: each bounce magnifies what differs.

    Under 3,000 times the weight of the earth, without friction and bonds of their own.
    """
    random, parts = (
        np.random.default_rng(1),
        {"floor": (bar(0.05, 0.6, (1, 4, 4)), (0.0, 0.0, 0.0))},
    )
    for k in range(3):
        body = single(0.05)
        turned = (body.points - body.points.mean(axis=0)) @ _turn(random)
        place = 0.12 + 0.04 * k, 0.3, 0.3
        parts[f"body{k}"] = checked_mesh(turned, body.tetrahedra, body.groups), place
    chosen = [effects.Gravity((-3e4, 0, 0)), effects.BodyContact(), effects.Fixed("floor_left")]
    scene = Scene(placed_together(parts), CONCRETE, chosen)
    return Question(0, scene, until, goals.displacement("base"), 0.01)


def _turn(random):
    """A random rotation matrix."""
    turn, _ = np.linalg.qr(random.standard_normal((3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def _power(random, between):
    """Number whose logarithm is evenly drawn."""
    return float(10.0 ** random.uniform(*between))


def _bar(random) -> tuple[Mesh, float]:
    """A bar whose inner points are moved at random, and the edge of its boxes [m]."""
    bodies, boxes = 0, np.ones(3, dtype=int)
    while not BODIES[0] <= bodies <= BODIES[1]:
        boxes = np.array([round(_power(random, np.log10(ends))) for ends in BOXES])
        bodies = 6 * int(boxes.prod())
    edge = _power(random, EDGE)
    width = edge * boxes[1:].max()
    mesh = bar(edge * boxes[0], width, boxes.tolist())
    size = mesh.points.max(axis=0)
    inner = (mesh.points > 1e-9) & (mesh.points < size - 1e-9)
    moved = random.uniform(-1.0, 1.0, mesh.points.shape) * 0.15 * random.random() * size / boxes
    return checked_mesh(mesh.points + inner * moved, mesh.tetrahedra, mesh.groups), edge


def _effects(random, travel):
    """Gas pressure on the left end, and what else was drawn; travel: time of a wave [s]."""
    rise, decay = travel * _power(random, RISES), random.uniform(1.5, 4.0)
    gas = effects.GasPressure("left", peak=_power(random, PEAK), rise=rise, decay_ratio=decay)
    found = [gas]
    if random.random() < DAMPED:
        found.append(effects.BondDamping())
    if random.random() < BREAKING:
        found += [effects.Softening(), effects.ShearSlip()]
        found += [effects.BodyContact(**LISTS), effects.StickingFriction()]
    if random.random() < FIXED:
        found.append(effects.Fixed("right"))
    return found


def _goal(random, scene) -> Goal:
    """One of the goals that the scene has."""
    body = int(random.integers(scene.mesh.body_count))
    choices = [
        goals.displacement("left"),
        goals.body_displacement(body),
        goals.kinetic_energy(),
        goals.peak_speed(body),
        goals.largest_fragment(),
    ]
    if scene.effect("dashpot") is not None:
        choices.append(goals.energy_share("bond_dashpot"))
    if scene.effect("contact") is not None:
        choices.append(goals.broken_faces())
    return choices[random.integers(len(choices))]
