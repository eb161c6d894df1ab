"""Attacks on what a report says of effects: small scenes drawn at random, run with and without."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    checked_mesh,
    effects,
    needed_effects,
)
from taichi_dem.diagnostics.shared_volume import NOTABLE, SharedVolume
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.needed_effects import recorded_difference
from taichi_dem.simulate import run_simulation
from tests.scenes import apart, beside, quaternions

ATTACKS = "effects: active, droppable, missed"

STEP, SAMPLES = 5e-8, 10
UNTIL = 800 * STEP
CELL = 0.05
TARGET, THROWN = bar(2 * CELL, CELL, (2, 1, 1)), bar(CELL, CELL, (1, 1, 1))
#: Effects of bonds and contacts that a scene may leave out, and how a report names them.
CHOICE = {
    "softening": effects.Softening,
    "shear_slip": effects.ShearSlip,
    "bond_damping": effects.BondDamping,
    "friction": effects.Friction,
    "sphere_contact": effects.SphereContact,
}


class Drawn:
    """A block that is thrown at a bar, or drifts past it: material, speeds and loads drawn."""

    def __init__(self, seed):
        draw = np.random.default_rng(seed)
        strength = CONCRETE.tensile_strength * 10.0 ** draw.uniform(-3.0, 0.5)
        failure = strength**2 / (2.0 * CONCRETE.normal_stiffness)
        self.material = replace(
            CONCRETE,
            tensile_strength=strength,
            cohesion=CONCRETE.cohesion * 10.0 ** draw.uniform(-3.0, 0.5),
            fracture_energy=failure * (1.0 + 10.0 ** draw.uniform(-1.0, 1.0)),
            friction=draw.choice([0.0, 0.1, 0.6]),
            # With more, dashpots of many spheres in contact at once would need a shorter step.
            contact_damping=draw.choice([0.0, 0.003, 0.015]) * CONCRETE.contact_damping,
            **({"normal_damping": 0.0, "shear_damping": 0.0} if draw.random() < 0.3 else {}),
        )
        self.gap = 10.0 ** draw.uniform(-5.0, -3.5)
        self.mesh = beside(TARGET, THROWN, [2 * CELL + self.gap, *(0.3 * CELL * draw.random(2))])
        self.speed = 10.0 ** draw.uniform(0.0, 1.7) * draw.choice([-1.0, -1.0, -1.0, 1.0])
        thrown = np.arange(self.mesh.body_count) >= TARGET.body_count
        self.velocity = np.outer(thrown, [self.speed, *draw.normal(size=2)])
        weight = effects.Gravity(tuple(10.0 ** draw.uniform(0.0, 4.0) * draw.normal(size=3)))
        self.posed = [weight, effects.Fixed("first left")]

    def run(self, *left_out, silent=True):
        """The run without some effects; silent ones compile nothing, and are as good as none."""
        made = []
        for name, kind in CHOICE.items():
            if name not in left_out:
                made.append(kind())
            elif silent and name != "sphere_contact" and "sphere_contact" not in left_out:
                made.append(kind().silent())
            elif silent and name in ("softening", "shear_slip", "bond_damping"):
                made.append(kind().silent())
        made = [e for e in made if e.role != "friction" or "sphere_contact" not in left_out]
        scene = Scene(self.mesh, self.material, [*made, *self.posed])
        simulation = Simulation(scene, Uniform(STEP), driver="resident")
        simulation.state.set_motion(simulation.model.centre, None, self.velocity)
        return run_simulation(simulation, until=UNTIL, samples=SAMPLES, progress=None)


def uses(result):
    return {use.effect: use for use in result.report.effect_activity}


def missed(result):
    return {one.effect for one in result.report.missing_effects}


def same_bits(first, second):
    """Whether two runs recorded the same."""
    return (
        all(
            first.history[name].tobytes() == second.history[name].tobytes()
            for name in first.history
        )
        and first.peak_speed.tobytes() == second.peak_speed.tobytes()
        and first.broken_time.tobytes() == second.broken_time.tobytes()
    )


@pytest.mark.slow
def test_an_effect_acted_if_a_bit_depends_on_it(seed):
    """And if it acted, some bit does: each acts by an energy of its own, which has a column.

    What is damped by no more than rounding is said to be neither.
    """
    scene = Drawn(seed)
    whole = scene.run()
    for name, use in uses(whole).items():
        if name in CHOICE:
            without = ("friction", name) if name == "sphere_contact" else (name,)
            other = scene.run(*without)
            idle = all(uses(whole)[each].idle for each in without)
            if not use.rounding:
                assert same_bits(whole, other) == idle, (name, str(use))


@pytest.mark.slow
def test_an_effect_is_missed_if_it_acts_where_it_is_listed(seed):
    """Up to its first act the two runs are one: the limits of bonds are watched at every step.

    Strain is watched at samples only, and must be beyond rounding. Friction of dashpots needs some.
    """
    scene = Drawn(seed)
    listed = uses(scene.run())
    for name in ("softening", "shear_slip", "friction"):
        found, kind = missed(scene.run(name)), CHOICE[name].__name__
        assert (kind in found) == listed[name].is_active, (name, found, str(listed[name]))
    damped = "BondDamping" in missed(scene.run("bond_damping"))
    assert damped <= (listed["bond_damping"].energy_J > 0.0)
    assert damped or not listed["bond_damping"].is_active


def test_contact_is_missed_where_bodies_stay_within_each_other(seed):
    """Bodies are looked at when they are recorded: a touch between two of them leaves no trace.

    What flies on by a millimetre after it should have touched is still within the other.
    """
    scene = Drawn(seed)
    touched = uses(scene.run())["sphere_contact"].is_active
    found = "SphereContact" in missed(scene.run("sphere_contact", "friction"))
    assert touched or not found
    if -scene.speed * UNTIL > 2.0 * scene.gap + 2e-3:
        assert touched and found


def test_what_never_acted_can_be_left_out_together(seed):
    """Bit for bit; what the advice calls droppable, within its tolerance."""
    scene = Drawn(seed)
    whole = scene.run()
    idle = {use.effect for use in uses(whole).values() if use.idle}
    if "friction" not in idle:
        idle -= {"sphere_contact"}
    assert same_bits(whole, scene.run(*idle))


@pytest.fixture(scope="module")
def gentle():
    """A scene in which no effect acts but dashpots, which take less than a thousandth."""
    scene = Drawn(0)
    scene.material, scene.posed = CONCRETE, scene.posed[:1]
    scene.velocity = scene.velocity * 0.0
    return scene


@pytest.mark.slow
def test_what_advice_calls_droppable_can_be_dropped_at_once(gentle):
    whole = gentle.run()
    droppable = needed_effects(whole).droppable
    assert set(droppable) == set(CHOICE)
    other = gentle.run(*droppable, silent=False)
    assert recorded_difference(whole, other) <= 1e-9


def loose(velocity, *listed, material=CONCRETE, shift=2.0 * CELL, until=UNTIL, samples=1):
    """Two single bodies, base to base, the second at a distance and with a velocity."""
    base = single(CELL)
    mirrored = checked_mesh(base.points * [-1.0, 1.0, 1.0], base.tetrahedra, {})
    mesh = beside(base, mirrored, [shift, 0.0, 0.0])
    simulation = Simulation(Scene(mesh, material, listed), Uniform(STEP), driver="resident")
    simulation.state.set_motion(simulation.model.centre, None, [[0.0] * 3, velocity])
    return run_simulation(simulation, until=until, samples=samples, progress=None)


def test_weight_that_throws_back_what_it_catches_is_not_idle(seed):
    """Work of gravity is zero when a body is back: its bits are there all the same."""
    draw = np.random.default_rng(seed)
    rise = draw.uniform(0.1, 10.0)
    weight = effects.Gravity((2.0 * rise / UNTIL, 0.0, 0.0))
    result = loose([-rise, 0.0, 0.0], weight, shift=10.0)
    use = uses(result)["gravity"]
    assert use.events == 2 and not use.idle and "part of the question" in use.kept
    assert needed_effects(result).droppable == ()


@pytest.mark.slow
def test_a_bounce_between_two_samples_is_counted(seed):
    """Without dashpots nothing is left of it but the motion that it turned round."""
    draw = np.random.default_rng(seed)
    lossless = replace(CONCRETE, contact_damping=0.0, friction=0.6)
    speed = draw.uniform(5.0, 30.0)
    listed = effects.SphereContact(), effects.Friction()
    result = loose([-speed, 0.1, 0.0], *listed, material=lossless, shift=1e-5)
    found = uses(result)
    assert result.history["sphere_strain_J"].max() == 0.0
    assert result.history["sphere_dashpot_J"].max() == 0.0
    assert found["sphere_contact"].events == 2
    # Friction is a dashpot's force: without a dashpot there is none, and springs alone would hold.
    assert found["friction"].idle and needed_effects(result).droppable == ("friction",)
    alone = loose([-speed, 0.1, 0.0], listed[0], material=lossless, shift=1e-5)
    assert same_bits(result, alone) and missed(alone) == {"StickingFriction"}


def test_a_support_that_holds_a_loaded_bar_is_not_idle(seed):
    draw = np.random.default_rng(seed)
    scene = Drawn(seed)
    scene.posed = [effects.Gravity(tuple(draw.normal(size=3))), effects.Fixed("first left")]
    use = uses(scene.run())["fixed"]
    assert use.events == 2 and use.energy_J == 0.0 and use.kept.endswith("without doing work")


@pytest.mark.slow
def test_bodies_that_are_apart_miss_nothing(seed):
    """A tenth of a metre, and a drift of a millimetre."""
    draw = np.random.default_rng(seed)
    drift = draw.normal(size=3) * 1e-3 / UNTIL / 3.0
    listed = effects.SphereContact(), effects.Friction()
    result = loose(drift, *listed, shift=0.1 + 2 * CELL)
    assert all(use.idle for use in uses(result).values())
    assert set(needed_effects(result).droppable) == {"sphere_contact", "friction"}
    alone = loose(drift, shift=0.1 + 2 * CELL)
    assert missed(alone) == set() and alone.report.unresolved == ()


def softened(share):
    """Concrete with so much of its contact stiffness and damping."""
    return replace(
        CONCRETE,
        contact_stiffness=share * CONCRETE.contact_stiffness,
        contact_damping=share * CONCRETE.contact_damping,
    )


def thrown(contact, material):
    """Two blocks of which one hits the other at 50 m/s, for the time of two thirds of a passage."""
    bonds = [effects.BondDamping(), contact, effects.Friction()]
    mesh = beside(THROWN, THROWN, [CELL + 1e-4, 0.2 * CELL, 0.1 * CELL])
    simulation = Simulation(Scene(mesh, material, bonds), Uniform(STEP), driver="resident")
    second = np.arange(mesh.body_count) >= THROWN.body_count
    velocity = np.outer(second, [-50.0, 0.0, 0.0])
    simulation.state.set_motion(simulation.model.centre, None, velocity)
    return run_simulation(simulation, until=CELL / 75.0, samples=SAMPLES, progress=None)


@pytest.mark.slow
def test_blocks_do_not_pass_through_each_other_unseen():
    # A tenth, so that the step resolves the dashpots of all spheres of a body.
    stopped = thrown(effects.SphereContact(), softened(0.1))
    assert stopped.report.interpenetration.share < NOTABLE
    assert missed(stopped) == set() and stopped.report.unresolved == ()
    passed = thrown(effects.SphereContact(outer_faces=False), softened(0.1))
    assert missed(passed) == {"SphereContact(outer_faces=True)"}
    assert passed.report.interpenetration.share > NOTABLE
    assert any(
        "share" in words and "outer_faces=True" in words for words in passed.report.unresolved
    )


@pytest.mark.slow
def test_contact_that_is_too_soft_diverges_in_words_or_warns(seed):
    """Spheres of 1.5 kN/m, a hundred by 5 mm, take 2 J of the 370 J: nothing is stopped."""
    draw = np.random.default_rng(seed)
    soft = softened(10.0 ** draw.uniform(-8.0, -6.0))
    try:
        report = thrown(effects.SphereContact(), soft).report
    except SimulationDiverged as error:
        words = str(error)
        assert "of its volume with body" in words or "contact sphere inside one of body" in words
    else:
        assert any("a larger contact_stiffness" in words for words in report.unresolved)


def test_shared_volume_does_not_depend_on_place_direction_or_order(seed):
    """Points of which rounding decides change the count by one of 512, of all bodies at a time."""
    draw, count = np.random.default_rng(seed), 12
    bodies = apart(count, 1.0)
    points = bodies.points + 0.2 * draw.normal(size=bodies.points.shape)
    mesh = checked_mesh(points, bodies.tetrahedra, {})
    position, (turn, _) = 0.8 * draw.random((count, 3)), quaternions(draw, count)
    first = shares(mesh, position, turn)
    about, turned = (each[0] for each in quaternions(draw, 1))
    order = draw.permutation(count)
    mixed = checked_mesh(mesh.points, mesh.tetrahedra[order], {})
    moved = position @ turned.T + draw.uniform(-10.0, 10.0, 3)
    again = shares(mixed, moved[order], product(about, turn[order]))
    back = {tuple(sorted((int(order[i]), int(order[j])))): s for (i, j), s in again.items()}
    assert len(first) > 5
    for pair in set(first) | set(back):
        assert abs(first.get(pair, 0.0) - back.get(pair, 0.0)) <= 1.0 / 512.0 + 1e-12


def shares(mesh, position, turn):
    """Shares by pair of bodies that are put somewhere."""
    simulation = Simulation(Scene(mesh, CONCRETE), Uniform(STEP))
    volume = SharedVolume(simulation.model, simulation.state)
    simulation.state.set_motion(position, turn)
    volume.sample(0.0, finished=True)
    return dict(zip(map(tuple, volume.pairs.tolist()), volume.share.tolist()))


def product(first, second):
    """Quaternions (n, 4) of a rotation after others."""
    w, x = first[0], first[1:]
    scalar = w * second[:, :1] - second[:, 1:] @ x[:, None]
    vector = w * second[:, 1:] + second[:, :1] * x + np.cross(x, second[:, 1:])
    return np.hstack([scalar, vector])
