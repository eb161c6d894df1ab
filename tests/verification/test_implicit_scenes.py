"""Solved dashpots against explicit ones with a tiny step: small scenes, side by side in a mesh."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Uniform, effects
from taichi_dem.contact_search.reach import BODY_SKINS, SKINS
from taichi_dem.contact_search.search import LOOKED
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.timeline import MACRO_TICKS
from tests.again import Again
from tests.unit.test_broad_phase import (
    expected,
    listed,
    near_balls,
    near_faces,
    neighbouring_faces,
)

EPS = np.finfo(float).eps
#: Distance of the scenes from each other [m]: they never meet.
APART = 2.0
#: Of the plane on which one body tumbles, and its spin at first [rad/s].
NORMAL, SPIN = np.array([1.0, 2.0, 2.0]) / 3.0, np.array([400.0, 700.0, -600.0])
#: Speeds [m/s]: of the fragment, of two bodies that collide, of the halves of a pair pulled apart.
SHOT, MEETING, PULL = [5.0, 1.0, 0.5], [3.0, 2.0, 0.0], [5.0, 0.0, 0.0]
UNTIL, STEP, TINY = 4e-5, 1e-7, 5e-10


def shapes():
    """The parts by name: mesh, and names that its groups have in the whole."""
    sides = {"left": "drive", "bottom": "slide", "right": "wall"}
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0.02, 0.05, 0], [0.01, 0.01, 0.03]])
    uneven = checked_mesh(points, [[0, 1, 2, 3]], {"all": [[0, 1, 2]]})
    return {
        "stretched": (bar(0.3, 0.1, (3, 1, 1)), {}),
        "target": (bar(0.2, 0.1, (2, 1, 1)), {}),
        "fragment": (single(), {}),
        "first": (single(), {}),
        "second": (single(), {}),
        "supported": (bar(0.2, 0.1, (2, 1, 1)), sides),
        "pulled": (pair(0.4), {}),
        "pressed": (bar(0.2, 0.1, (2, 1, 1)), {"left": "hole"}),
        "tumbling": (uneven, {"all": "plane"}),
    }


def assembled():
    """One mesh of all parts, APART along x; bodies of each part by name."""
    points, tetrahedra, groups, bodies = [], [], {}, {}
    for place, (name, (mesh, names)) in enumerate(shapes().items()):
        first = sum(len(p) for p in points)
        start = sum(len(t) for t in tetrahedra)
        points.append(mesh.points + np.array([APART * place, 0.0, 0.0]))
        tetrahedra.append(np.asarray(mesh.tetrahedra) + first)
        for group, called in names.items():
            groups[called] = np.asarray(mesh.group_faces(group)) + first
        bodies[name] = np.arange(start, start + len(mesh.tetrahedra))
    return checked_mesh(np.vstack(points), np.vstack(tetrahedra), groups), bodies


def listed_effects():
    """Everything but gravity."""
    return [
        effects.BondDamping(),
        effects.Softening(),
        effects.ShearSlip(),
        effects.SphereContact(outer_faces=True),
        effects.Friction(),
        effects.GasPressure("hole", peak=1e8, rise=2e-5),
        effects.Fixed("wall"),
        effects.Roller("slide", (0.0, 1.0, 0.0)),
        effects.Roller("plane", tuple(NORMAL)),
        effects.PrescribedMotion("drive", (0.3, 0.0, 0.1), frequency=2e4),
    ]


def closed(model, place, mover, partner, gap):
    """Shift `mover` along x towards `partner` until the smallest gap of their spheres is `gap`."""
    size = 4 * model.spheres.per_face
    spheres = model.spheres
    ball = np.concatenate([spheres.centre, spheres.radius[..., None]], axis=-1)
    sphere = ball.reshape(-1, 4)
    centre = sphere[:, :3] + np.repeat(place, size, axis=0)
    own = np.concatenate([np.arange(size * b, size * b + size) for b in mover])
    others = np.concatenate([np.arange(size * b, size * b + size) for b in partner])
    apart = centre[others][None] - centre[own][:, None]
    reach = sphere[own, 3][:, None] + sphere[others, 3][None] + gap
    across = reach**2 - (apart[..., 1:] ** 2).sum(axis=-1)
    way = apart[..., 0][across > 0.0] - np.sqrt(across[across > 0.0])
    place[mover, 0] += way.min()


class Parts:
    """All scenes under one method, from one start."""

    def __init__(self, method):
        mesh, self.bodies = assembled()
        self.again = Again(Scene(mesh, CONCRETE, listed_effects()), method)
        self.model, self.state = self.again.model, self.again.state
        self.place, self.velocity, self.spin = self._start()

    def _start(self):
        model, bodies = self.model, self.bodies
        place = model.centre.copy()
        velocity, spin = np.zeros_like(place), np.zeros_like(place)
        stretched = bodies["stretched"]
        place[stretched, 0] += 1e-5 * (place[stretched, 0] - place[stretched, 0].mean())
        place[bodies["fragment"]] += [-APART - 0.1, 0.03, 0.04]
        closed(model, place, bodies["fragment"], bodies["target"], 2e-5)
        place[bodies["second"], 0] = place[bodies["first"], 0] + 0.2
        place[bodies["second"], 1:] += [0.004, 0.002]
        closed(model, place, bodies["first"], bodies["second"], 2e-5)
        velocity[bodies["fragment"]], velocity[bodies["first"]] = SHOT, MEETING
        velocity[bodies["pulled"]] = np.outer([-1.0, 1.0], PULL)
        spin[bodies["tumbling"]] = SPIN
        return place, velocity, spin

    def restart(self, step):
        """Begin with a step [s]."""
        self.again.restart(step, self.velocity, self.place, None, self.spin)

    def run(self, step):
        """Go to UNTIL; what the tests below ask for, by name."""
        self.restart(step)
        first = self.again.simulation.readings.bonds()
        away = self.again.run(round(UNTIL / step)) - self.place
        simulation = self.again.simulation
        bonds = simulation.readings.bonds()
        # Half a step of the dashpots is booked at the start.
        bonds[:, 1] -= first[:, 1]
        return {
            "moved": {name: away[of] for name, of in self.bodies.items()},
            "broken_s": self.state.broken_tick.to_numpy() / MACRO_TICKS * step,
            "bonds": bonds,
            "account": simulation.energy_balance.account(),
            **simulation.motion(),
        }


@pytest.fixture(scope="module")
def explicit():
    """The scenes by explicit steps."""
    return Parts(Uniform(TINY))


@pytest.fixture(scope="module")
def implicit():
    """The scenes by solved dashpots; the sweeps add nothing to what is measured."""
    return Parts(ImplicitDashpots(STEP, sweeps=(2, 200), tolerance=1e-9))


@pytest.fixture(scope="module")
def runs(explicit, implicit):
    """What both say at UNTIL: explicit, implicit."""
    return explicit.run(TINY), implicit.run(STEP)


@pytest.mark.parametrize(
    "name", ["stretched", "target", "fragment", "first", "second", "supported", "pressed"]
)
def test_displacements_agree_with_tiny_explicit_steps(runs, name):
    """To 0.1 % of the largest, at 200 times the step: both schemes tend to the same motion.

    Without contact the error is of second order, (w dt)^2 of the motion, w < 1e5 1/s; contacts are
    met up to a step late, of the hundreds that follow.
    """
    first, second = (run["moved"][name] for run in runs)
    assert np.abs(first - second).max() < 1e-3 * np.abs(first).max()


def test_the_scenes_are_what_they_are_called(runs, implicit):
    """Contacts met, slid and stopped; supports pushed; just the pulled pair broke."""
    for run in runs:
        account, bodies = run["account"], implicit.bodies
        assert min(account[name] for name in ("friction", "sphere_dashpot")) > 1e-3
        assert abs(account["support_work"]) > 0.0 and account["load_work"] > 0.0
        speed = {name: run["velocity"][of] for name, of in bodies.items()}
        assert speed["fragment"][0, 0] < 0.5 * SHOT[0]
        assert np.abs(speed["target"]).max() > 0.01
        assert abs(speed["second"][0, 0] - speed["first"][0, 0]) < 0.1 * MEETING[0]
        assert 0.1 < speed["second"][0, 1] < speed["first"][0, 1] < MEETING[1]
        assert (run["broken_s"] > 0.0).sum() == 1


def test_softening_and_release_inside_a_step(runs, implicit):
    """A pair pulled apart spends its fracture energy and breaks in the step in which it must.

    Kinetic energy falls by what the dashpots took and by that. Springs work with the means of the
    velocities: a trapezoidal rule along the envelope. Its error is that at the kink, of
    (k + slope) du^2 / 8 an area at most, and half of the last step's overshoot, less than that.
    """
    bond = implicit.model.topology.master.tolist().index(implicit.bodies["pulled"][0])
    broken = [run["broken_s"][bond] for run in runs]
    assert broken[0] > 30 * STEP
    assert abs(broken[1] - broken[0]) <= STEP
    area = 3.0 * implicit.model.bonds["area"][bond]
    fracture = area * CONCRETE.fracture_energy
    for run in runs:
        dashpot, _, release, softening = run["bonds"][bond][1:]
        assert softening + release == pytest.approx(fracture, rel=1e-9)
        assert dashpot > fracture
    pulled = implicit.bodies["pulled"]
    mass = implicit.model.body_mass[pulled]
    start = 0.5 * mass.sum() * PULL[0] ** 2
    dashpot = runs[1]["bonds"][bond][1]
    end = 0.5 * (mass * (runs[1]["velocity"][pulled] ** 2).sum(axis=1)).sum()
    opened = 2.0 * PULL[0] * STEP
    bound = 2.0 * area * (CONCRETE.normal_stiffness + CONCRETE.softening_slope) * opened**2 / 8.0
    assert bound < 1e-2 * fracture
    # Half a step of the dashpots is booked at time zero, to second order in their rate.
    rate = 2.0 * CONCRETE.normal_damping * area / mass[0]
    bound += 0.25 * (STEP * rate) ** 2 * start
    assert abs(start - end - dashpot - fracture) < bound


@pytest.mark.parametrize("place, step", [(0, TINY), (1, STEP)])
def test_a_roller_keeps_the_angular_momentum_about_its_normal(runs, implicit, place, step):
    """A body with its axes tilted to the plane: n.L stays, and it turns about n at n.L / n.I n.

    n.I n is the same in every orientation about n. Each step rounds n.L by 4 eps of L, orientation
    as in ``test_conservation`` by 4 eps, and the rate by what n.L has lost.
    """
    run, body = runs[place], implicit.bodies["tumbling"][0]
    inertia, steps = implicit.model.body_inertia[body], round(UNTIL / step)
    tilt = np.linalg.norm(np.cross(NORMAL, inertia @ NORMAL)) / (NORMAL @ inertia @ NORMAL)
    assert tilt > 0.1
    momentum = inertia @ SPIN
    kept, size = NORMAL @ momentum, np.linalg.norm(momentum)
    assert abs(run["angular_momentum"][body] @ NORMAL - kept) < 4 * EPS * steps * size
    angle = kept / (NORMAL @ inertia @ NORMAL) * UNTIL
    expected_turn = np.array([np.cos(0.5 * angle), *(np.sin(0.5 * angle) * NORMAL)])
    # The spin in the plane alone would be n.SPIN, another one.
    assert abs(angle / UNTIL - NORMAL @ SPIN) > 10.0
    assert np.abs(run["orientation"][body] - expected_turn).max() < 20 * EPS * steps


def test_one_fast_fragment_keeps_the_list_of_neighbours_right(implicit):
    """It flies through the target in leaps of several skins: it alone is listed anew.

    All that is within the list's reach, by all spheres against all, is in it, and no body twice;
    what is there besides has balls within it, or the fragment has left it behind. The candidates
    are the spheres within the skin.
    """
    simulation, fragment = implicit.again.simulation, implicit.bodies["fragment"][0]
    implicit.restart(STEP)
    neighbours, skin = simulation.broad_phase.neighbours, 1.2e-3
    simulation.contacts.skin.fill(skin)
    implicit.again.search_anew()
    reach = (BODY_SKINS + 2.0 * SKINS) * skin
    rooms, place, still = neighbours.first.to_numpy(), implicit.place.copy(), implicit.spin * 0.0
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(place), 1))
    counts = []
    for _ in range(25):
        place[fragment] += [8e-3, 2e-4, -3e-4]
        turn[fragment] += [0.0, 0.03, 0.01, 0.02]
        turn[fragment] /= np.linalg.norm(turn[fragment])
        implicit.state.set_motion(place, turn, still, still)
        # What steps would have noted of its way.
        simulation.contacts.travel[fragment] = 1e-2
        simulation.broad_phase.search(everywhere=False)
        wanted, found = near_faces(simulation, reach), neighbouring_faces(neighbours)
        assert wanted <= found
        besides = found - near_balls(simulation, reach)
        assert all(fragment in (a // 4, b // 4) for a, b in besides)
        body, last = neighbours.listed.body.to_numpy(), neighbours.last.to_numpy()
        for start, end in zip(neighbours.first.to_numpy(), last):
            assert (np.diff(body[start:end]) > 0).all()
        assert set(listed(simulation)) == expected(simulation, skin)
        counts.append(len(listed(simulation)))
        assert (simulation.broad_phase.looked.to_numpy() == LOOKED).sum() == 1
    assert np.array_equal(neighbours.first.to_numpy(), rooms)
    assert max(counts) > min(counts) + 20
