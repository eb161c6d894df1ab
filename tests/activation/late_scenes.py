"""Small scenes, each of which needs one effect once, late, in one place; their kinds are drawn.

Where a bond shall soften or slip, a run of elastic bonds that record their tractions tells the
limit that one bond alone exceeds; the scene's twin is stronger.
"""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import taichi as ti

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, checked_mesh, effects
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import sine_and_cosine
from taichi_dem.kit.types import vec3
from taichi_dem.laws.base import Effect, ElasticShear, ElasticTension
from taichi_dem.mesh.shapes import bar, pair, placed_together

#: Step [s], and steps of a run.
STEP = 4e-7
METHOD = Uniform(STEP)
#: No bond reaches it [Pa].
ENDLESS = 1e12
#: Width of the bars, of one box [m].
WIDE = 0.03
#: Largest acceleration [m/s^2] of a pulse, and its duration [s]: to about 1 m/s.
RATE, PULSE = 1e5, 3e-5
#: Concrete with dashpots that a step of ``STEP`` resolves.
MATERIAL = replace(
    CONCRETE, normal_damping=2e5, shear_damping=1e5, contact_damping=1e2, contact_stiffness=1e8
)

NOWHERE = ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))


def within(model, box):
    """1 for bodies with their centre in a box, lowest and highest corner, else 0."""
    low, high = np.array(box)
    inside = ((model.centre > low) & (model.centre < high)).all(axis=1)
    return inside.astype(np.int32)


@ti.data_oriented
class Marked(Effect):
    """Base of effects that act on bodies with their centre in a box."""

    def __init__(self, box=NOWHERE, start=0.0, vector=(0.0, 0.0, 0.0)):
        self.box, self.start, self.vector = box, start, vector

    def declare(self, capacity):
        """Marks of the bodies."""
        self.marked = ti.field(ti.i32, shape=capacity.bodies)

    def load(self, model):
        """Mark the bodies."""
        assign(self.marked, within(model, self.box))

    @ti.func
    def acts_on(self, i):
        """1 for a marked body, else 0."""
        return self.marked[i]


@ti.data_oriented
class Push(Marked):
    """Acceleration of bodies in a box [m/s^2], a squared sine from a start for a duration [s]."""

    role = "load"

    def __init__(self, box=NOWHERE, start=0.0, vector=(0.0, 0.0, 0.0), duration=1.0):
        super().__init__(box, start, vector)
        self.duration = duration

    def numbers(self, material):
        """Acceleration, start and duration."""
        return (*self.vector, self.start, self.duration)

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and no torque."""
        share, phase = 0.0, (motion.time - self.law[3]) / self.law[4]
        if 0.0 < phase and phase < 1.0:
            swing, _ = sine_and_cosine(math.pi * phase)
            share = swing * swing
        push = share * self.tables.mass[i] * vec3(self.law[0], self.law[1], self.law[2])
        return push, vec3(0.0)


@ti.data_oriented
class Mover(Marked):
    """Bodies in a box are held, and from a start on move at a velocity [m/s]."""

    role = "support"

    def numbers(self, material):
        """Velocity and start."""
        return (*self.vector, self.start)

    @ti.func
    def held(self, i, t, step, rotation, velocity, angular_momentum):
        """Velocity at a time and no spin."""
        allowed = vec3(0.0)
        if t > self.law[3]:
            allowed = vec3(self.law[0], self.law[1], self.law[2])
        return allowed, vec3(0.0)


@ti.data_oriented
class PeakTension(ElasticTension):
    """Elastic, and every unit records its largest pull [Pa]."""

    is_null = False
    name = "peak_tension"

    def declare(self, capacity):
        """Largest pull of every unit."""
        self.peak = ti.field(ti.f64, shape=capacity.units)

    @ti.func
    def traction(self, m, stiffness, u, opening):
        """Linear traction [Pa]."""
        self.peak[u] = ti.max(self.peak[u], stiffness * opening)
        return stiffness * opening


@ti.data_oriented
class PeakShear(ElasticShear):
    """Elastic, and every unit records the largest cohesion that it needed [Pa]."""

    is_null = False
    name = "peak_shear"

    def numbers(self, material):
        """Friction coefficient."""
        return (material.friction,)

    def declare(self, capacity):
        """Largest cohesion needed by every unit."""
        self.peak = ti.field(ti.f64, shape=capacity.units)

    @ti.func
    def traction(self, m, stiffness, u, sliding, pressure):
        """Linear traction [Pa]; nothing slips."""
        needed = stiffness * sliding.norm() - self.law[m, 0] * pressure
        self.peak[u] = ti.max(self.peak[u], needed)
        return stiffness * sliding, 0.0


@dataclass(frozen=True, eq=False)
class Late:
    """A scene before its strength is known.

    role: of the law that is needed. loads: Push, Push and Mover, so that all are compiled once.
    late: time before which the effect must not act [s]. velocity: of the bodies at the start, by
    box. until [s]. tension: the strength of bonds where another law is needed [Pa]. twin: what
    changes for the twin, in which the effect is not needed; empty where it is just stronger.
    """

    role: str
    mesh: object
    loads: tuple
    late: float
    velocity: tuple = ()
    until: float = 3.2e-4
    tension: float = ENDLESS
    twin: tuple = ()

    @property
    def is_limit(self):
        """Whether a bond must reach the limit of a law."""
        return self.role in ("tension", "shear")

    def without(self):
        """The twin, before its strength is known."""
        return replace(self, **dict(self.twin), twin=())


def push(box, vector, start=0.0, duration=PULSE):
    """A pulse on the bodies in a box."""
    return Push(box, start, vector, duration)


def layer(x0, x1):
    """Box of all bodies between two places along x."""
    return (x0, -1.0, -1.0), (x1, 1.0, 1.0)


def loads(first=None, second=None, mover=None):
    """Loads and support of every scene, those that are not given act nowhere."""
    return first or Push(), second or Push(), mover or Mover()


def rod(draw, cells=8):
    """A bar of 6 bodies a box, its points drawn."""
    mesh = bar(cells * WIDE, WIDE, (cells, 1, 1))
    points = mesh.points + draw.uniform(-0.04, 0.04, mesh.points.shape) * WIDE
    return checked_mesh(points, mesh.tetrahedra, {})


def in_a_row(first, second, gap):
    """Two solids along x, a gap between them."""
    shift = first.points[:, 0].max() - second.points[:, 0].min() + gap
    return placed_together({"first": (first, (0, 0, 0)), "second": (second, (shift, 0, 0))})


def in_boxes(centre, rows):
    """A vector for each body, of the last box that holds its centre; else zero."""
    found = np.zeros_like(centre)
    for (low, high), vector in rows:
        found[((centre > low) & (centre < high)).all(axis=1)] = vector
    return found


def simulation(late, scene):
    """Simulation of a scene, with the motion that it begins with."""
    made = Simulation(scene, METHOD, "resident")
    centre = made.model.centre
    velocity = in_boxes(centre, late.velocity)
    made.state.set_motion(centre, velocity=velocity)
    return made


def strengths(tension=ENDLESS, cohesion=ENDLESS):
    """Material with a strength in tension and a cohesion, tough enough to soften."""
    least = tension**2 / (2.0 * MATERIAL.normal_stiffness)
    return replace(
        MATERIAL, tensile_strength=tension, cohesion=cohesion, fracture_energy=8.0 * least
    )


@cache
def peaks(late):
    """Largest traction of each bond, elastic [Pa], the largest first, and the bonds."""
    laws = [PeakTension(), PeakShear(), effects.BondDamping(), effects.StickingFriction()]
    listed = [*laws, effects.BodyContact(), *late.loads]
    run = simulation(late, Scene(late.mesh, strengths(), listed))
    run.advance_to(round(late.until / STEP))
    law = run.tables.bond.tension if late.role == "tension" else run.tables.bond.shear
    units = run.values(law.peak)
    found = units.reshape(-1, 3).max(axis=1)
    order = np.argsort(found)[::-1]
    return found[order], order


def material_of(late, needed=True):
    """Material with which one bond alone needs the effect, or none does."""
    if not late.is_limit:
        return strengths(late.tension)
    (most, second, *_), _ = peaks(late)
    limit = most - 0.3 * (most - second) if needed else 1.05 * most
    return strengths(**{"tension" if late.role == "tension" else "cohesion": limit})


def scene_of(late, word="auto", needed=True, **options):
    """A scene, or its twin; options: sleep."""
    material = material_of(late, needed)
    late = late if needed else late.without()
    return Scene(late.mesh, material, word, loads=late.loads, **options)


# Kinds: functions of a generator of random numbers, each returns a Late.


def far_end(draw, role="tension", along=0):
    """A late pulse at one end, and the other end is held."""
    start, vector = draw.uniform(4e-5, 8e-5), np.zeros(3)
    vector[along] = -draw.uniform(0.5, 1.0) * RATE
    hold = Mover(layer(7.5 * WIDE, 1.0), 1.0)
    return Late(role, rod(draw), loads(push(layer(-1.0, WIDE), vector, start), None, hold), start)


def far_end_slips(draw):
    """The same with a pulse across."""
    return far_end(draw, "shear", 1)


def meeting_slips(draw):
    """Two pulses across from both ends, that turn the bar and superpose in the middle."""
    start, vector = draw.uniform(3e-5, 6e-5), (0.0, 0.0, draw.uniform(0.5, 1.0) * RATE)
    left, right = layer(-1.0, WIDE), layer(7.0 * WIDE, 1.0)
    both = loads(push(left, -np.array(vector), start), push(right, vector, start))
    return Late("shear", rod(draw), both, start)


def flight(draw):
    """A bar flies and touches another late, or not where that is farther away."""
    first, second, speed = rod(draw, 3), rod(draw, 4), draw.uniform(8.0, 12.0)
    near, far = (in_a_row(first, second, gap) for gap in (1e-3, 6e-3))
    moving = ((layer(-1.0, 3.2 * WIDE), (speed, 0.0, 0.0)),)
    return Late("contact", near, loads(), 6e-5, moving, twin=(("mesh", far),))


def fragment(draw):
    """The end of a bar is torn off and flies to another bar, or not as far."""
    torn, wall = rod(draw, 2), rod(draw, 3)
    near, far = (in_a_row(torn, wall, gap) for gap in (1e-3, 8e-3))
    moving = ((layer(WIDE, 2.1 * WIDE), (draw.uniform(14.0, 18.0), 0.0, 0.0)),)
    twin = (("mesh", far),)
    return Late("contact", near, loads(), 5e-5, moving, tension=1e4, twin=twin)


def rubbing(draw):
    """Two bodies that press on each other, face on face, begin to slide late."""
    touching = pair(WIDE)
    alone = [checked_mesh(touching.points, touching.tetrahedra[[k]], {}) for k in range(2)]
    parts = {"left": (alone[0], (0.0, 0.0, 0.0)), "right": (alone[1], (0.0, 0.0, 0.0))}
    mesh, start = placed_together(parts, keep_coincident=True), draw.uniform(1e-4, 1.5e-4)
    press = push(layer(0.0, 1.0), (-0.1 * RATE, 0.0, 0.0), 0.0, 4e-4)
    slide = push(layer(0.0, 1.0), (0.0, draw.uniform(0.5, 1.0) * RATE, 0.0), start)
    hold = Mover(layer(-1.0, 0.0), 1.0)
    twin = (("loads", loads(press, None, hold)),)
    return Late("friction", mesh, loads(press, slide, hold), start, twin=twin)


def damped(draw):
    """A bar that flies is strained late, or never."""
    start, flying = draw.uniform(1e-4, 2e-4), ((layer(-1.0, 1.0), (1.0, 0.0, 0.0)),)
    pull = push(layer(-1.0, WIDE), (-RATE, 0.0, 0.0), start)
    twin = (("loads", loads()),)
    return Late("dashpot", rod(draw, 4), loads(pull), start, flying, twin=twin)


def hit(draw):
    """A sleeping bar is hit by what flies to it, and softens where the wave is reflected."""
    mesh, speed = in_a_row(rod(draw, 1), rod(draw, 6), 1e-3), draw.uniform(8.0, 12.0)
    moving = ((layer(-1.0, 1.1 * WIDE), (speed, 0.0, 0.0)),)
    return Late("tension", mesh, loads(), 6e-5, moving)


KINDS = (
    *(far_end, far_end_slips, meeting_slips),
    *(flight, fragment, rubbing, damped, hit),
)
#: Kind and seed by name.
SCENES = {f"{kind.__name__} 0": (kind, 0) for kind in KINDS}


@cache
def late_scene(name):
    """A scene by name."""
    kind, seed = SCENES[name]
    return kind(np.random.default_rng(seed))
