"""effects="auto" finds what is needed once, late, in one place, and nothing where it is not.

A part beside another of any scale has the bits that it has alone.
"""

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import pytest

from cases.meshes import with_moved_nodes
from taichi_dem import CONCRETE, Scene, Uniform, checked_mesh, effects, simulate
from taichi_dem.materials.bond_rules import ModulusOverDistance
from taichi_dem.mesh.shapes import bar, placed_together

STEP, UNTIL, START = 4e-7, 2.4e-4, 6e-5
#: Width of the bars, of one box [m]; duration of a pulse [s].
WIDE, PULSE = 0.03, 3e-5
#: Concrete with dashpots that the step resolves, so strong that nothing breaks or slips.
SOFT = replace(
    CONCRETE, normal_damping=2e5, shear_damping=1e5, contact_damping=1e2, contact_stiffness=1e8
)
ENDLESS = 1e12


def limited(tension=ENDLESS, cohesion=ENDLESS):
    """Material with a strength in tension and a cohesion, tough enough to soften."""
    least = tension**2 / (2.0 * SOFT.normal_stiffness)
    return replace(SOFT, tensile_strength=tension, cohesion=cohesion, fracture_energy=8.0 * least)


def pulse(group, pressure, start=START):
    """A pressure that rises and falls from a start on [Pa]; negative pulls."""
    return effects.Pressure(group, [0.0, pressure, 0.0], start + PULSE * np.array([0.0, 0.5, 1.0]))


def rod(cells, seed=1):
    """A bar of six bodies a box, its nodes moved at random."""
    return with_moved_nodes(bar(cells * WIDE, WIDE, (cells, 1, 1)), 0.04 * WIDE, seed)


@dataclass(frozen=True)
class Late:
    """What one effect alone is needed for, in the bodies of a group "weak", and not before START.

    effect: its name. pressure: of a pulse [Pa]; none: a bar flies to another. weak: material of
    one body. needed: whether it is weak, or the other bar near enough. rules: of the bonds.
    """

    effect: str
    pressure: float
    weak: object = None
    needed: bool = True
    rules: dict = field(default_factory=dict)

    def scene(self, word, **options):
        """The scene with effects "auto" or "all"."""
        if self.pressure:
            mesh, moves, loads = rod(8), None, [pulse("left", self.pressure), pulse("right", 0.0)]
        else:
            gap = 1e-3 if self.needed else 6e-3
            parts = {"first": (rod(3), (0, 0, 0)), "second": (rod(6, 2), (3 * WIDE + gap, 0, 0))}
            mesh, moves = placed_together(parts), {"first": (9.0, 2.0, 0.0)}
            loads = [pulse("first_left", 0.0), pulse("second_right", 0.0)]
        place = mesh.points[mesh.tetrahedra].mean(axis=1)
        at = np.abs(place - [5.1 * WIDE if self.pressure else 1.5 * WIDE, 0.5 * WIDE, 0.5 * WIDE])
        mesh = mesh.body_group("weak", lambda x: np.arange(len(x)) == at.sum(axis=1).argmin())
        weak = {"weak": replace(self.weak, **self.rules)} if self.weak and self.needed else {}
        options |= {"materials": weak, "velocity": moves}
        return Scene(mesh, replace(limited(), **self.rules), word, loads=loads, **options)


#: Bonds about as stiff as those of SOFT, of a material from moduli.
MODULI = {"normal_stiffness": ModulusOverDistance(4e9), "shear_stiffness": ModulusOverDistance(2e9)}
#: Bonds soften, slip while they are pulled or pressed, or break behind a blow that begins to rub.
SCENES = {
    "pulled": Late("softening", -1e7, limited(tension=2e6)),
    "pulled across": Late("shear_slip", -1e7, limited(cohesion=1e6)),
    "pressed across": Late("shear_slip", 1e7, replace(limited(cohesion=5e5), friction=0.1)),
    "cracked": Late("cohesive_crack", -1e7, limited(2e6, 6e6), rules=MODULI),
    "hit": Late("body_contact", 0.0, limited(tension=2e6)),
}


@cache
def run(name, word="auto", needed=True, **options):
    """Result of a scene, or of its twin without a need, made once."""
    scene = replace(SCENES[name], needed=needed).scene(word, **options)
    counted = {"samples": 8, "frames": 8, "progress": None}
    return simulate(scene, method=Uniform(STEP), until=UNTIL, driver="resident", **counted)


def acting(result):
    """Names of the effects that act, but for friction of faces at rest, which rub by roundings."""
    uses = [use for use in result.report.effect_activity if use.is_active]
    return {use.effect: use.events for use in uses}


def arrays(result):
    """What must have the same bits."""
    frames = [(one.position, one.velocity, one.rotation, one.damage) for one in result.frames]
    return [*result.series.values(), result.broken_time, *(part for row in frames for part in row)]


def moved(result):
    """Displacements at the end [m]."""
    return result.frames[-1].displacement


@pytest.mark.parametrize("name", SCENES)
def test_without_sleep_all_bits_are_those_of_all_effects(name):
    auto, every = run(name, sleep=0.0), run(name, "all")
    assert auto.series.keys() == every.series.keys()
    assert all(np.array_equal(*pair, equal_nan=True) for pair in zip(arrays(auto), arrays(every)))
    assert acting(auto) == acting(every)


@pytest.mark.parametrize("name", SCENES)
def test_the_effect_acts_late_in_its_place_and_nowhere_where_it_is_not_needed(name):
    """Bonds of the weak body alone are evaluated, once what moves has come there."""
    auto, twin, effect = run(name), run(name, needed=False), SCENES[name].effect
    assert effect in acting(auto) and effect not in acting(twin)
    since = {use.effect: use.since_s for use in auto.certificate.acting}[effect]
    assert since > START
    top, weak = auto.model.topology, auto.scene.mesh.body_groups["weak"]
    mine = np.isin(top.master, weak) | np.isin(top.slave, weak)
    near = np.union1d(top.master[mine], top.slave[mine])
    for key in {"softening", "slip", "damage"} & {*auto.acting_since}:
        acted = np.flatnonzero(np.isfinite(auto.acting_since[key]))
        assert {*acted} <= {*near}
    assert not np.isfinite(auto.broken_time[~mine]).any()


@pytest.mark.parametrize("name", SCENES)
def test_sleep_leaves_the_motion_and_what_acts_as_they_are_and_says_what_it_leaves_out(name):
    """Momentum by a rounding of every substep; the residual by what the certificate tells.

    And by the change of the motion, in which all terms of the account are of second order.
    """
    auto, awake = run(name), run(name, sleep=0.0)
    apart = np.abs(moved(auto) - moved(awake)).max()
    assert apart <= 1e-3 * np.abs(moved(awake)).max()
    assert acting(auto) == acting(awake)
    assert np.array_equal(auto.broken_time, awake.broken_time, equal_nan=True)
    report, certificate = auto.report, auto.certificate
    rounding = report.substeps * np.finfo(float).eps
    assert report.linear_momentum_error <= rounding
    assert certificate.asleep > 0.0 and certificate.holds
    assert max(certificate.impulse, certificate.energy) <= certificate.sleep == 1e-6
    strained = np.abs(moved(awake) - moved(awake).mean(axis=0)).max()
    share = certificate.energy + 2.0 * apart / strained + rounding
    found, known = (one.report.energy_balance["residual"] for one in (auto, awake))
    given = max(auto.series["kinetic_J"].max(), abs(report.energy_balance["load_work"]))
    assert abs(found - known) <= share * given


def test_far_from_the_origin_bodies_at_rest_sleep():
    """The rounding of coordinates of 10 km opens no bond by more than is expected of it."""
    mesh = rod(20)
    far = checked_mesh(mesh.points + np.array([1e4, -1e4, 1e4]), mesh.tetrahedra, dict(mesh.groups))
    scene = Scene(far, SOFT, "auto", loads=2 * [pulse("left", 0.0)])
    result = simulate(scene, method=Uniform(STEP), until=2 * STEP, samples=1, progress=None)
    beyond = result.model.centre[:, 0] > far.points[:, 0].min() + 2 * WIDE
    assert np.isnan(result.acting_since["awake"][beyond]).all()


CELLS, APART = 5, 5.0
#: Sixteen roundings of a coordinate of up to 2 m [m].
ROUNDING = 16.0 * 2.0 * np.finfo(float).eps
BONDS = ("normal_stiffness", "shear_stiffness", "normal_damping", "shear_damping")


class Part:
    """A bar [m] at a place x [m], whose right end is pulled from a start [s] to a speed [m/s].

    Its bonds reach their strength at an opening tear [m], and its frequencies are those of a bar as
    wide as ``WIDE``, so that one step fits all.
    """

    def __init__(self, x, length, tear, speed, start):
        self.mesh = bar(length, length / CELLS, (CELLS, 1, 1)).moved(by=(x, 0.0, 0.0))
        self.pull, self.start = -2.0 * SOFT.density * length / CELLS * speed / PULSE, start
        scale = length / CELLS / WIDE
        given = {name: scale * getattr(SOFT, name) for name in BONDS}
        given |= {f"contact_{x}": scale**3 * getattr(SOFT, f"contact_{x}") for x in CONTACT}
        stress = tear * given["normal_stiffness"]
        limits = {"tensile_strength": stress, "cohesion": stress}
        limits["fracture_energy"] = 4.0 * stress * tear
        self.material = replace(SOFT, **given, **limits)

    def load(self, group):
        """Its pull on a group."""
        return pulse(group, self.pull, self.start)


CONTACT = ("stiffness", "damping")


def ran(mesh, material, loads, word="auto", **materials):
    """Motion and fracture at the end, and the certificate."""
    scene = Scene(mesh, material, word, loads=loads, materials=materials)
    looks = {"until": 3e-4, "samples": 1, "frames": 1, "progress": None}
    found = simulate(scene, method=Uniform(STEP), **looks)
    last = found.frames[-1]
    motion = np.hstack([last.position, last.velocity, last.rotation.reshape(-1, 9)])
    return motion, found.broken_time, found.certificate


def drawn(seed):
    """Two parts: a metre, and one that is shorter, slower or later, or all of that."""
    rng = np.random.default_rng(seed)
    smaller, slower = 10.0 ** (rng.uniform(-3.0, 0.0, 2) * rng.integers(0, 2, 2))
    late = rng.uniform(0.0, 2e-4) * rng.integers(0, 2)
    # Openings that bonds bear, over the speed [s]: half of the parts break.
    first, second = 10.0 ** rng.uniform(-7.0, -4.5, 2)
    speed = 10.0 ** rng.uniform(-1.0, 1.0)
    slow = smaller * speed * slower
    return Part(0.0, 1.0, first * speed, speed, 2e-5), Part(
        APART, smaller, second * slow, slow, late
    )


@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
@pytest.mark.parametrize("seed", range(12))
def test_each_part_has_the_bits_that_it_has_alone(seed):
    """And breaks where it does with all effects; what was left out is told of the worst part."""
    parts = drawn(seed)
    alone = [
        ran(part.mesh, part.material, [part.load("right"), pulse("right", 0.0)]) for part in parts
    ]
    both = placed_together(dict(zip("ab", ((part.mesh, (0, 0, 0)) for part in parts))))
    loads = [part.load(f"{name}_right") for name, part in zip("ab", parts)]
    materials = [part.material for part in parts]
    motion, broken, certificate = ran(both, materials[0], loads, b=materials[1])
    every = ran(both, materials[0], loads, "all", b=materials[1])
    assert (np.isfinite(broken) == np.isfinite(every[1])).all()
    assert np.array_equal(motion, np.vstack([each[0] for each in alone]))
    times = np.concatenate([each[1] for each in alone])
    assert np.array_equal(broken, times, equal_nan=True)
    assert certificate.holds and certificate.asleep > 0.0
    assert certificate.impulse == max(each[2].impulse for each in alone)


@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
@pytest.mark.parametrize("seed", range(3))
def test_no_sleeping_bond_is_open_by_more_than_it_may_be(seed):
    """After every step: by the share of the opening at which its law begins, but for rounding."""
    part = drawn(seed)[0]
    loads = [part.load("right"), pulse("right", 0.0)]
    scene, steps = Scene(part.mesh, part.material, "auto", loads=loads), 500
    looks = {"until": steps * STEP, "samples": 1, "frames": steps, "progress": None}
    result = simulate(scene, method=Uniform(STEP), **looks)
    top, slept = result.model.topology, 0
    onset = part.material.tensile_strength / result.model.bond_stiffness[:, 0]
    awake = np.nan_to_num(result.acting_since["awake"], nan=np.inf)[[top.master, top.slave]]
    for k, frame in enumerate(result.frames):
        asleep = (awake.max(axis=0) > frame.time_s) & ~(result.broken_time <= frame.time_s)
        opening = np.abs(result.apertures(k))
        assert (opening <= scene.sleep * onset + ROUNDING)[asleep].all()
        slept += asleep.sum()
    assert slept > 0
