"""Sleeping bodies that are woken: every impulse once, energy, momentum, and the level limit."""

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Multirate, Scene, Simulation, StepControl, effects
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.state.timeline import MACRO_TICKS
from tests.scenes import brisk_scene

SPEED, EDGE, GAP = 20.0, 0.03, 3e-5


def target():
    """A bar at rest, and a small body whose one sphere will meet the one of the bar's face."""
    block, fragment = bar(0.1, 0.05, (2, 1, 1)), single(EDGE)
    aim = block.points[block.group_faces("left")[0]].mean(axis=0)
    points = np.vstack([block.points, fragment.points + np.array([-GAP, aim[1], aim[2]])])
    tetrahedra = np.vstack([block.tetrahedra, fragment.tetrahedra + len(block.points)])
    return checked_mesh(points, tetrahedra, {"hole": block.group_faces("right")})


def test_energy_never_grows_when_a_fast_fragment_hits_a_sleeping_block():
    """Dashpots and friction only take; round-off of a sum of a dozen terms is left."""
    laws = effects.Softening().silent(), effects.ShearSlip().silent()
    touch = effects.SphereContact(3, outer_faces=True), effects.Friction()
    listed = [effects.BondDamping(), *laws, *touch, effects.GasPressure(start=1.0)]
    method = Multirate(1e-6, 1e-6, control=StepControl(), dashpot="limited")
    simulation = Simulation(Scene(target(), CONCRETE, listed), method)
    velocity = np.zeros((simulation.model.body_count, 3))
    velocity[-1, 0] = SPEED
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    energy = [1.0]
    for step in range(1, 11):
        simulation.advance_to(step)
        account = simulation.energy_balance.account()
        stored = account["kinetic"] + account["bond_strain"] + account["sphere_strain"]
        energy.append(stored / simulation.energy_balance.start_energy)
    assert energy[-1] < 0.5 and np.diff(energy).max() < 1e-13
    assert simulation.schedule.limits.woken[None] > 0
    assert max(simulation.energy_balance.momentum_errors()) < 1e-13


@pytest.fixture(scope="module")
def woken():
    """The paper's block under a brisk pulse with all of the control, until bonds have broken."""
    method = Multirate(1.6e-7, 2e-6, control=StepControl(), dashpot="limited")
    simulation = Simulation(brisk_scene(), method)
    simulation.advance_to(180)
    return simulation


def test_neighbours_differ_by_no_more_than_the_level_limit(woken):
    """A jump of more than 2 lasts for no longer than a ring of neighbours needs to wake."""
    top, level = woken.model.topology, woken.values(woken.state.level)
    holds = woken.values(woken.state.broken_tick) < 0
    jumps = np.abs(level[top.master] - level[top.slave])[holds]
    assert jumps.max() == 2


def test_waking_keeps_momentum_and_the_account(woken):
    report = woken.report()
    assert report.broken_faces > 30 and woken.schedule.limits.woken[None] > 100
    assert max(report.linear_momentum_error, report.angular_momentum_error) < 1e-13
    assert report.energy_residual_fraction < 0.01


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

    def __init__(self):
        control = StepControl(level_jump=None)
        scene = Scene(pair_and_clock(), CONCRETE, [effects.Softening()])
        self.simulation = Simulation(scene, Multirate(DT0, WAY, control=control))
        self.state, model = self.simulation.state, self.simulation.model
        place = model.centre.copy()
        place[1, 0] += OPENING
        velocity = np.zeros((3, 3))
        velocity[2, 1] = 0.9 * 4.0 * WAY / DT0
        self.state.set_motion(place, velocity=velocity)
        self.simulation.start()
        # By hand from here on: the velocities are those before the first kick.
        assign(self.state.velocity, velocity)
        self.mass = model.body_mass[0]
        self.force_per_opening = 3.0 * model.bonds["area"][0] * CONCRETE.normal_stiffness
        assert self.simulation.values(self.state.level).tolist() == [0, 0, 2]

    def quarters(self, count):
        """Run to a number of quarters of DT0; velocities along the normal of the pair [m/s]."""
        end = count * MACRO_TICKS // 4
        while self.state.tick[None] < end:
            self.simulation.driver.run(end)
        return self.state.motion()["velocity"][:2, 0]

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
    assert made.simulation.values(made.state.level).tolist() == [2, 0, 2]
    velocity = made.quarters(4)
    assert velocity == pytest.approx([speed + gained, -gained], rel=ROUND)
    # A body takes a kick at the beginning of the step that it is brought over, here t = 0.
    opening = OPENING - DT0 * (speed + gained) - DT0 * gained
    velocity = made.quarters(5)
    paid = made.force_per_opening * opening * DT0 / 4.0 / made.mass
    assert velocity[0] == pytest.approx(speed + gained + paid, rel=ROUND)
    assert made.simulation.schedule.limits.woken[None] == 1
