"""The certificate says what acted, since when, and what was left out, also from a checkpoint."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Checkpoint, ImplicitDashpots, Scene, effects, simulate
from taichi_dem.kit.effect_table import Estimate
from taichi_dem.mesh.shapes import bar
from taichi_dem.report.effects import Certificate

METHOD, UNTIL = ImplicitDashpots(1e-6), 3e-4
BAR = bar(1.0, 0.1, (10, 1, 1))


def pulled(peak=4e7, **options):
    """A bar pushed at its left end, which breaks where the wave comes back in tension."""
    blow = effects.GasPressure("left", peak=peak, rise=5e-5, decay_ratio=1.0)
    damping = {"normal_damping": 1e5, "shear_damping": 5e4}
    return Scene(BAR, replace(CONCRETE, **damping), "auto", loads=[blow], **options)


@pytest.fixture(scope="module")
def result():
    return simulate(pulled(), until=UNTIL, method=METHOD, samples=4, frames=4)


def test_bodies_soften_before_their_bonds_break_and_the_first_of_them_tells_the_time(result):
    acting = {use.effect: use for use in result.certificate.acting}
    for name, key in (("softening", "softening"), ("shear_slip", "slip")):
        assert acting[name].since_s == np.nanmin(result.acting_since[key])
    top, broken = result.model.topology, np.flatnonzero(np.isfinite(result.broken_time))
    assert len(broken) and acting["softening"].since_s > 0.0
    for side in (top.master, top.slave):
        assert (result.acting_since["softening"][side[broken]] < result.broken_time[broken]).all()


def test_evaluations_made_and_skipped_are_those_of_all_laws_in_every_step():
    """Three units a bond, at the start and in each step; where nothing acts, all are skipped."""
    made = simulate(pulled(peak=1e4, sleep=0.0), until=UNTIL, method=METHOD, samples=1)
    found, every = made.certificate, 3 * made.model.bond_count * (1 + made.report.substeps)
    assert (found.law_evaluations, found.all_law_evaluations) == (0, every)


def test_a_resumed_run_has_the_bits_and_the_certificate_of_a_straight_one(result, tmp_path):
    """Stopped when the wave has gone through half of the bar, and the rest still sleeps."""
    path, job = tmp_path / "run.checkpoint", {"method": METHOD, "samples": 4, "frames": 4}
    half = simulate(pulled(), until=1e-4, checkpoint=Checkpoint(path), **job)
    assert np.isnan(half.acting_since["awake"]).any() and half.certificate.acting
    rest = simulate(pulled(), until=UNTIL, resume=path, **job)
    for name in ("position", "velocity", "rotation"):
        last = [getattr(found.frames[-1], name) for found in (result, rest)]
        assert np.array_equal(*last), name
    for name, since in result.acting_since.items():
        assert np.array_equal(since, rest.acting_since[name], equal_nan=True), name
    assert rest.certificate.as_dict() == result.certificate.as_dict()


CLEAR, UNCLEAR, LACKING = (Estimate("gravity", group, "share") for group in (0.01, 0.5, 9.0))
FINDING = "the energy balance leaves 3 J unexplained, 2 % of all"


@pytest.mark.parametrize(
    ("left_out", "warnings", "impulse", "grade", "named"),
    [
        (CLEAR, (), 0.0, "holds", ()),
        (UNCLEAR, (), 0.0, "holds but for", ("gravity (unclear)",)),
        (Estimate("gravity", np.nan, "share"), (), 0.0, "holds but for", ("gravity (unclear)",)),
        (LACKING, (), 0.0, "holds but for", ("gravity (needed)",)),
        (CLEAR, (f"{FINDING}: take a shorter step",), 0.0, "holds but for", (FINDING,)),
        (UNCLEAR, (f"{FINDING}: do",), 1e-5, "does not hold", ("gravity (unclear)", FINDING)),
    ],
)
def test_a_certificate_names_what_it_holds_but_for(left_out, warnings, impulse, grade, named):
    shares = {"sleep": 1e-6, "asleep": 0.0, "impulse": impulse, "energy": 0.0}
    made = Certificate(left_out=(left_out,), warnings=warnings, **shares)
    assert made.grade == made.as_dict()["grade"] == grade
    assert made.but_for == tuple(made.as_dict()["but_for"]) == named
    assert made.holds == (impulse == 0.0) and made.verdict.startswith(grade)
    assert impulse or all(words in made.verdict and words in str(made) for words in named)


def test_weight_and_air_are_judged_by_how_far_a_flight_has_gone():
    """Of m v^2 / 2, weight gives at most m g (v t + v t + g t^2 / 2), and air takes its drag."""
    speed, until, g, air = 3.0, 2e-4, 9.80665, 1.2
    flying = Scene(bar(0.05, 0.05, (1, 1, 1)), CONCRETE, "auto", velocity=(speed, 0.0, 0.0))
    made = simulate(flying, method=METHOD, until=until, samples=1)
    found = {one.effect: one.group for one in made.certificate.left_out}
    until, held = made.report.until_s, 0.5 * speed**2
    weight = g * (2.0 * speed * until + 0.5 * g * until**2) / held
    drag = 0.5 * air * np.pi * (made.model.body_radius**2).sum() * speed**3 * until
    assert found["gravity"] == pytest.approx(weight, rel=1e-9)
    assert found["air drag"] == pytest.approx(drag / held / made.model.body_mass.sum(), rel=1e-9)


def test_what_sleep_leaves_out_of_rounding_is_nothing():
    """A body of a cube turns so slowly that rounding alone may open bonds as much."""
    mesh = bar(0.05, 0.05, (1, 1, 1))
    spin = np.zeros((mesh.body_count, 3))
    spin[0, 2] = 1e-9
    made = simulate(Scene(mesh, CONCRETE, "auto", spin=spin), method=METHOD, until=2e-4, samples=1)
    assert made.report.energy_balance["kinetic"] < made.report.round_off_J
    assert made.certificate.asleep > 0.0 and made.certificate.holds
