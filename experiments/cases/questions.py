"""Questions with a tolerance, drawn at random by seeds.

To the blast they ask about bars under gas pressure, the paper's block and beams and plates under
blows; to the damper about small scenes with short transients, so that references are affordable.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

import ca_damper as ca
import taichi_dem as dem
from ca_damper import goals as damper_goals
from cases.meshes import with_moved_nodes
from taichi_dem import effects, goals, shapes
from taichi_dem.kit.display import counted
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar

#: Fewest and most boxes along x, y and z, and bodies of a bar.
BOXES, BODIES = ((2, 12), (1, 5), (1, 5)), (12, 1500)
#: Powers of ten between which are drawn: edge of a box [m], stiffness and damping over those of
#: concrete, peak of the pressure [Pa]; end of the run and rise of the pressure over the time of a
#: wave along the bar; tolerances.
EDGE, STIFFNESS, DAMPING, PEAK = (-2, -1), (-0.3, 0.5), (-1.5, 0.3), (6.5, 8.7)
LASTS, RISES, TOLERANCE = (0.0, 1.3), (-1.0, 0.5), (-2.5, -1.0)
#: Shares of the bars that have dashpots, that may break, and that are fixed at one end.
DAMPED, BREAKING, FIXED = 0.85, 0.6, 0.4
PAPER = ca.Automaton(ca.Paper())
#: Fillings by how often they are drawn, in tenths.
FILLINGS = (
    *((ca.Empty(), 1), (ca.RigidMass(), 1), (ca.Spheres(), 2), (PAPER, 3)),
    *((ca.Automaton(ca.Paper(word)), 1.5) for word in ("landing", "landing+ejection")),
)
#: CPU seconds that an answer may take, and a peak of spheres, which are dearer.
BUDGET_S, PEAK_OF_SPHERES_S = 4.0, 12.0
#: Of the paper's block: ends of runs, and how far its nodes are moved at most [powers of ten, m].
BLOCK_LASTS, BLOCK_MOVED = (-4.3, -3.0), (-4.0, -2.6)
#: Share of the meshes whose bodies are numbered at random, and of those whose nodes are moved.
RENUMBERED = 0.5


@dataclass(frozen=True)
class BlastQuestion:
    """A question about a scene: the value of a goal at a time [s], to a tolerance."""

    scene: dem.Scene
    until: float
    goal: goals.Goal
    tolerance: float

    def __str__(self):
        bodies = counted(self.scene.mesh.body_count, "body")
        names = " ".join(effect.name for effect in self.scene.effects if effect.name)
        share = f"{100.0 * self.tolerance:.2g} %"
        return f"{bodies} to {self.until:.3g} s: {self.goal.name} to {share}; {names}"


def bar_question(*seed):
    """A question about a bar of concrete-like bonds under gas pressure on its left end."""
    random = np.random.default_rng(seed)
    mesh, edge = _bar(random)
    stiffer, damped = _power(random, STIFFNESS), _power(random, DAMPING)
    springs, dashpots = (
        [f"{k}_{end}" for k in ("normal", "shear")] for end in ("stiffness", "damping")
    )
    constants = {name: stiffer * getattr(dem.CONCRETE, name) for name in springs}
    constants.update({name: damped * getattr(dem.CONCRETE, name) for name in dashpots})
    material = replace(dem.CONCRETE, **constants)
    travel = float(np.ptp(mesh.points[:, 0])) / _wave_speed(material, edge)
    until = travel * _power(random, LASTS)
    scene = dem.Scene(mesh, material, _effects(random, travel))
    goal = _goal(random, scene)
    return BlastQuestion(scene, until, goal, _power(random, TOLERANCE))


def block_question(*seed):
    """A question about the paper's block with nodes moved and bodies numbered at random."""
    random = np.random.default_rng(seed)
    mesh = dem.read_mesh(dem.PAPER_BLOCK)
    if random.random() < RENUMBERED:
        mesh = _renumbered(mesh, random)
    if random.random() < RENUMBERED:
        mesh = with_moved_nodes(mesh, _power(random, BLOCK_MOVED), int(random.integers(2**31)))
    loads = [effects.GasPressure(rise=1.33e-4 * _power(random, (-0.5, 0.3)))]
    scene = dem.Scene(mesh, dem.CONCRETE, "auto", loads=loads)
    until = _power(random, BLOCK_LASTS)
    goal = goals.hole_displacement() if random.random() < 0.5 else _goal(random, scene, "hole")
    return BlastQuestion(scene, until, goal, _power(random, TOLERANCE))


def part_question(*seed):
    """A question about a beam, plate or cylinder under a short blow on its top."""
    random = np.random.default_rng(seed)
    length, element = _power(random, (-1.0, 0.0)), random.uniform(0.3, 0.6)
    slender = {"width": 0.3 * length, "height": 0.3 * length}
    element *= 0.3 * length
    mesh = (
        partial(shapes.beam, length=length, **slender),
        partial(shapes.cylinder, radius=0.2 * length, height=length),
        partial(shapes.plate, width=length, height=0.6 * length, thickness=0.2 * length),
    )[random.integers(3)](element=element)
    if random.random() < RENUMBERED:
        mesh = _renumbered(mesh, random)
    travel = length / _wave_speed(dem.CONCRETE, element)
    rise, fall = (travel * _power(random, (-2.0, 0.0)) for _ in range(2))
    blow = effects.Pressure.triangle("top", _power(random, (6.0, 8.0)), rise, fall)
    loads = [blow] + ([effects.Fixed("bottom")] if random.random() < FIXED else [])
    scene = dem.Scene(mesh, dem.CONCRETE, "auto", loads=loads)
    until = travel * _power(random, LASTS)
    return BlastQuestion(scene, until, _goal(random, scene, "top"), _power(random, TOLERANCE))


def _wave_speed(material, edge):
    """Speed of a wave through bodies of an edge [m/s]."""
    return math.sqrt(material.normal_stiffness * edge / material.density)


def _power(random, between):
    return float(10.0 ** random.uniform(*between))


def _bar(random):
    """A bar whose inner points are moved at random, and the edge of its boxes [m]."""
    bodies, boxes = 0, np.ones(3, dtype=int)
    while not BODIES[0] <= bodies <= BODIES[1]:
        boxes = np.array([round(_power(random, np.log10(ends))) for ends in BOXES])
        bodies = 6 * int(boxes.prod())
    edge = _power(random, EDGE)
    mesh = bar(edge * boxes[0], edge * boxes[1:].max(), boxes.tolist())
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
        found += [effects.BodyContact(), effects.StickingFriction()]
    if random.random() < FIXED:
        found.append(effects.Fixed("right"))
    return found


def _renumbered(mesh, random):
    """The mesh with its bodies in another order."""
    order = random.permutation(mesh.body_count)
    return checked_mesh(mesh.points, mesh.tetrahedra[order], mesh.groups)


def _goal(random, scene, group="left"):
    """One of the goals that the scene has; group: whose displacement may be one."""
    body = int(random.integers(scene.mesh.body_count))
    choices = [
        goals.displacement(group),
        goals.body_displacement(body),
        goals.kinetic_energy(),
        goals.peak_speed(body),
    ]
    if scene.effect("dashpot") is not None:
        choices.append(goals.energy_share("bond_dashpot"))
    if scene.effect("contact") is not None:
        choices += [goals.broken_faces(), goals.largest_fragment()]
    return choices[random.integers(len(choices))]


@dataclass(frozen=True)
class DamperQuestion:
    """A question to ``solve_response``: goal at a tolerance, of a filling on an oscillator."""

    filling: Any
    particles: int
    oscillator: ca.Oscillator
    goal: damper_goals.Goal
    tolerance: float

    def arguments(self):
        """Arguments of ``solve_response``."""
        dear = isinstance(self.filling, ca.Spheres) and self.goal.kind == "extreme"
        return {**vars(self), "budget_s": PEAK_OF_SPHERES_S if dear else BUDGET_S, "progress": None}

    def __str__(self):
        o, share = self.oscillator, 100.0 * self.tolerance
        places = f"{o.natural_frequency:.1f} Hz, damping {o.damping_ratio:.3f}"
        return (
            f"{self.filling.label} x {self.particles}, {self.goal.name} to "
            f"{share:.2g} %, {places}, mass {o.mass:.3f} kg, y0 {1e3 * o.base_amplitude:.2f} mm"
        )


def damper_question(*seed):
    """A question about a filling on an oscillator that is much like the paper's."""
    rng = np.random.default_rng([2604, *seed])
    weights = np.array([weight for _, weight in FILLINGS], dtype=float)
    filling = FILLINGS[rng.choice(len(FILLINGS), p=weights / weights.sum())][0]
    most = 20 if isinstance(filling, ca.Spheres) else 40
    particles = 0 if isinstance(filling, ca.Empty) else int(rng.integers(3, most + 1))
    mass = 0.086 * 2.0 ** rng.uniform(-1.0, 1.0)
    omega = 2.0 * math.pi * rng.uniform(7.0, 12.0)
    damping = 2.0 * rng.uniform(0.02, 0.06) * mass * omega
    # Of the paper's acceleration of the base, 0.7 to 6 times, as there is more damping.
    base = 0.6e-3 * (37.9 / omega) ** 2 * 2.0 ** rng.uniform(-0.5, 2.5)
    oscillator = ca.Oscillator(mass, mass * omega**2, damping, base)
    tolerance = float(10.0 ** rng.uniform(math.log10(0.003), -1.0))
    ratio = round(float(rng.uniform(0.88, 1.06)), 3)
    asked = [damper_goals.peak_rms(), damper_goals.peak_ratio(), damper_goals.rms_at(ratio)]
    if not isinstance(filling, (ca.Empty, ca.RigidMass)):
        asked += [damper_goals.loss_factor_at(ratio), damper_goals.apparent_mass_at(ratio)]
    goal = asked[int(rng.integers(len(asked)))]
    return DamperQuestion(filling, particles, oscillator, goal, tolerance)
