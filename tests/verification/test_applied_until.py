"""Bonds of bodies that are woken: every impulse is given once; release and load while asleep."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Multirate, Scene, Simulation, StepControl, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.timeline import MACRO_TICKS

#: Step of the sleeping pair [s], a power of two; a body far away steps four times as often.
DT0 = 2.0**-22
WAY = 1e-6
OPENING = 5e-6
#: An opening is a difference of positions of 0.03 m: eps * 0.03 / 5e-6, and a few roundings.
ROUND = 1e-11


def pair_and_clock():
    """A bonded pair, and a loose body 1 m away that ticks."""
    both, clock = pair(), single()
    points = np.vstack([both.points, clock.points + np.array([0.0, 1.0, 0.0])])
    tetrahedra = np.vstack([both.tetrahedra, clock.tetrahedra + len(both.points)])
    return checked_mesh(points, tetrahedra, {})


@ti.kernel
def _notice(limits: ti.template(), body: ti.i32):
    for _ in range(1):
        limits.notice(body, 1)


class Sleepers:
    """The pair at rest, opened along its normal; three bodies, the last one ticks."""

    def __init__(self, listed=(), wake=("hit",), opening=OPENING):
        control = StepControl(wake=wake, criteria=("contact_dashpot",), level_jump=None)
        method = Multirate(DT0, WAY, control=control)
        self.simulation = Simulation(Scene(pair_and_clock(), CONCRETE, listed), method)
        self.state, model = self.simulation.state, self.simulation.model
        place = model.centre.copy()
        place[1, 0] += opening
        velocity = np.zeros((3, 3))
        velocity[2, 1] = 0.9 * 4.0 * WAY / DT0
        self.state.set_motion(place, np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)), velocity)
        self.simulation.start()
        # By hand from here on: the velocities are those before the first kick.
        self.state.velocity.from_numpy(np.resize(velocity, (self.state.velocity.shape[0], 3)))
        self.mass = model.body_mass[0]
        self.force_per_opening = 3.0 * model.bonds["area"][0] * CONCRETE.normal_stiffness
        assert self.state.level.to_numpy().tolist() == [0, 0, 2]

    def quarters(self, count):
        """Run to a number of quarters of DT0; velocities along the normal of the pair [m/s]."""
        end = count * MACRO_TICKS // 4
        while self.state.tick[None] < end:
            self.simulation.driver.run(end)
            self.search()
        return self.state.motion()["velocity"][:2, 0]

    def search(self):
        """Renew the contact lists where that is due."""
        if self.simulation.contacts is not None and self.simulation.contacts.search_requested[None]:
            self.simulation.broad_phase.search()

    def release(self):
        """Take the bond out, as one with a failed unit is; what failed it is no matter here."""
        _release(self.simulation.advance, 0)
        self.search()

    def kick(self, body, speed):
        """Let body move on at once: it has been hit, and is listed to be woken."""
        velocity = self.state.velocity[body]
        velocity[0] += speed
        self.state.velocity[body] = velocity
        _notice(self.simulation.schedule.limits, body)


def test_a_bond_applies_no_impulse_to_a_woken_body_twice():
    """F dt0 at t = 0 is all until dt0, then F dt0 / 4 with the opening of then; both bodies alike.

    By hand: impulses at t = 0 of F0 dt0. Body 0 is kicked and woken at dt0 / 4, moves at its new
    speed from t = 0 on; at dt0 body 1 moves by its whole step with what waited for it. The opening
    of then is paid for quarters, as the finer one steps.
    """
    made = Sleepers()
    impulse = made.force_per_opening * OPENING * DT0
    gained = impulse / made.mass
    made.quarters(1)
    speed = 0.9 * 4.0 * WAY / DT0
    made.kick(0, speed)
    for quarter in (2, 3):
        velocity = made.quarters(quarter)
        assert velocity[0] == pytest.approx(speed + gained, rel=ROUND)
        assert velocity[1] == 0.0
    assert made.state.level.to_numpy().tolist() == [2, 0, 2]
    velocity = made.quarters(4)
    assert velocity == pytest.approx([speed + gained, -gained], rel=ROUND)
    # A body takes a kick at the beginning of the step that it is brought over, here t = 0.
    opening = OPENING - DT0 * (speed + gained) - DT0 * gained
    velocity = made.quarters(5)
    paid = made.force_per_opening * opening * DT0 / 4.0 / made.mass
    assert velocity[0] == pytest.approx(speed + gained + paid, rel=ROUND)
    assert made.simulation.schedule.limits.woken[None] == 1


@ti.kernel
def _release(advance: ti.template(), bond: ti.i32):
    for _ in range(1):
        advance._release(bond, advance.tables.bond_slots[bond])


@pytest.mark.parametrize("wake", [pytest.param((), marks=pytest.mark.slow), ("release",)])
def test_a_release_brings_sleeping_bodies_to_the_present_where_they_now_touch(wake):
    """Their bond held them squeezed, and is released at dt0 / 4; now their spheres overlap.

    Awake they are at the present at once and step as their spheres bear, asleep they lie at t = 0
    and push each other for the rest of dt0 with what they were then.
    """
    made = Sleepers([effects.Softening(), effects.SphereContact()], wake, opening=-OPENING)
    made.quarters(1)
    made.release()
    made.quarters(2)
    level, last = made.state.level.to_numpy(), made.state.last_tick.to_numpy()
    if wake:
        assert made.simulation.schedule.limits.woken[None] == 2
        assert level[:2].min() > 2 and np.all(last[:2] == made.state.tick[None])
    else:
        assert level[:2].max() == 0 and np.all(last[:2] == 0)
    assert max(made.simulation.energy_balance.momentum_errors()) < 1e-13


def test_a_released_bond_pays_sleeping_bodies_nothing_more():
    """What it had paid ahead, F dt0, they take at their time; nothing asks to wake them."""
    made = Sleepers([effects.Softening()], ("release",))
    made.quarters(1)
    made.release()
    velocity = made.quarters(8)
    gained = made.force_per_opening * OPENING * DT0 / made.mass
    assert velocity == pytest.approx([gained, -gained], rel=ROUND)
    assert made.simulation.schedule.limits.woken[None] == 0


@pytest.mark.parametrize("criteria", [pytest.param((), marks=pytest.mark.slow), ("load",)])
def test_a_pressure_that_sets_in_while_a_body_sleeps_moves_it_by_no_more_than_the_way(criteria):
    """A free body, a pulse that rises within dt0: u = P0 A / m (t^2 / 4 - (1 - cos wt) / 2w^2).

    From cos2(pi/2 (t/a - 1)) = (1 - cos(wt)) / 2, w = pi / a. With the criterion each step goes no
    further than l, and each of the ten halvings of the step shifts the leapfrog by no more
    than l; asleep the body takes p(0) = 0 for all of
    dt0 and stays where it is.
    """
    dt0, way, peak = 4e-6, 1e-7, 575e6
    mesh = checked_mesh(single().points, [[0, 1, 2, 3]], {"hole": [[1, 2, 3]]})
    control = StepControl(criteria=criteria)
    scene = Scene(mesh, CONCRETE, [effects.GasPressure("hole", peak, dt0)])
    simulation = Simulation(scene, Multirate(dt0, way, control=control))
    simulation.advance_to(1)
    area, w = 0.05**2 * 3.0**0.5 / 4.0, np.pi / dt0
    acceleration = peak * area / simulation.model.body_mass[0]
    exact = acceleration * (dt0**2 / 4.0 - (1.0 - np.cos(w * dt0)) / (2.0 * w**2))
    moved = np.linalg.norm(simulation.state.motion()["position"][0] - simulation.model.centre[0])
    assert exact > 100.0 * way
    if criteria:
        assert abs(moved - exact) < 10.0 * way
    else:
        assert moved == 0.0
