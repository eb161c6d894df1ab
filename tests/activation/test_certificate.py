"""The certificate says what acted, since when, and what was left out; estimates by formula."""

import copy
import json
import pickle
from dataclasses import replace

import meshio
import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Scene,
    effects,
    estimated_effects,
    goals,
    needed_effects,
    plot,
    simulate,
    solve,
)
from taichi_dem.diagnostics.estimates import NEEDED, NEGLIGIBLE, UNCLEAR, estimates_after
from taichi_dem.diagnostics.part_scales import WEIGHT, PartScales
from taichi_dem.effects.base import Effect
from taichi_dem.effects.chosen import ChosenEffects
from taichi_dem.engine.model import Model
from taichi_dem.kit.audit import Audit
from taichi_dem.mesh.joined import join
from taichi_dem.mesh.parts import parts_of
from taichi_dem.mesh.shapes import bar
from taichi_dem.timeline import NEVER
from tests.scenes import beside

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


def test_times_are_those_of_the_first_body_on_which_an_effect_acts(result):
    acting = {one.use.effect: one for one in result.certificate.acting}
    for name, key in (("softening", "softening"), ("shear_slip", "slip")):
        assert acting[name].since_s == np.nanmin(result.acting_since[key])
    assert 0.0 < acting["softening"].since_s < np.nanmin(result.broken_time)


def test_nothing_acts_on_a_body_before_it_is_awake(result):
    since = result.acting_since
    for name in ("softening", "slip", "contact", "friction"):
        acts = np.isfinite(since[name])
        assert (since["awake"][acts] <= since[name][acts]).all()


def test_bodies_of_a_broken_bond_have_softened_before_it_broke(result):
    top, broken = result.model.topology, np.flatnonzero(np.isfinite(result.broken_time))
    assert len(broken)
    for side in (top.master, top.slave):
        assert (result.acting_since["softening"][side[broken]] < result.broken_time[broken]).all()


def test_evaluations_skipped_and_made_add_up(result):
    found, report = result.certificate, result.report
    softening, slip = found.audits[0].skipped, found.audits[1].skipped
    assert found.law_evaluations + softening + slip == found.all_law_evaluations
    assert found.law_ratio == found.all_law_evaluations / found.law_evaluations > 1.0
    assert found.all_law_evaluations <= 6 * (report.bond_evaluations + report.bond_count)


def test_share_asleep_is_the_mean_time_until_bodies_wake(result):
    awake = np.nan_to_num(result.acting_since["awake"], nan=result.report.until_s)
    assert result.certificate.asleep == pytest.approx(awake.mean() / result.report.until_s, 1e-12)
    assert 0.0 < result.certificate.asleep < 1.0


def test_without_sleep_nobody_sleeps():
    found = simulate(pulled(sleep=0), until=UNTIL, method=METHOD).certificate
    assert (found.asleep, found.impulse, found.energy, found.audits[2].skipped) == (0, 0, 0, 0)
    assert "sleep is 0" in str(found)


@pytest.mark.slow
def test_a_scene_that_lists_its_effects_has_no_certificate():
    listed = replace(pulled(), effects=list(pulled().effects), loads=(), sleep=None)
    found = simulate(listed, until=1e-5, method=METHOD)
    assert found.certificate is None and found.acting_since == {}
    assert found.report.as_dict()["certificate"] is None


def test_a_certificate_that_does_not_hold_says_so(result):
    found = result.certificate
    assert found.holds and "does not hold" not in str(found)
    missed = replace(found, audits=(Audit(1000, 10, 1, "softening"), *found.audits[1:]))
    for wrong in (missed, replace(found, impulse=2.0 * found.sleep)):
        assert not wrong.holds
        assert f"does not hold, as {wrong.failure}: run the scene with effects='all'" in str(wrong)


def test_it_is_written_with_the_report(result, tmp_path):
    result.write(tmp_path)
    written = json.loads((tmp_path / "report.json").read_text())["certificate"]
    assert written["law_ratio"] == result.certificate.law_ratio
    assert written["acting_since_s"]["softening"] == result.certificate.acting[0].since_s


def test_paraview_shows_where_and_when_each_effect_acts(result, tmp_path):
    result.write(tmp_path)
    files = sorted((tmp_path / "paraview").glob("*.vtu"))
    for frame, path in zip(result.frames, files):
        cells = meshio.read(path).cell_data
        for name, since in result.acting_since.items():
            assert np.array_equal(cells[f"{name}_acts"][0], since <= frame.time_s)
            assert np.array_equal(cells[f"{name}_since_s"][0], since, equal_nan=True)


def test_a_picture_shows_it_too(result, tmp_path):
    path = tmp_path / "acting.png"
    plot.plot_acting(path, result.model, result.acting_since, UNTIL)
    assert path.stat().st_size > 10_000


def test_outer_faces_get_their_spheres_with_the_first_break():
    weak, strong = (simulate(pulled(p), until=UNTIL, method=METHOD) for p in (1e5, 4e7))
    assert weak.report.searches == 1 and weak.report.pair_evaluations == 0
    assert strong.report.searches > 1 and strong.report.broken_faces > 0
    assert not any("outer_faces" in need for need in strong.report.needs)


def test_outer_faces_wait_for_that_break_to_the_tick():
    from taichi_dem import Simulation

    run = Simulation(pulled(), METHOD)
    outer = 4 * run.model.topology.outer_body + run.model.topology.outer_face
    run.start()
    assert (run.state.exposed_tick.to_numpy()[outer] == NEVER).all()
    run.advance_to(round(UNTIL / METHOD.dt0))
    broken = run.state.broken_tick.to_numpy()
    first = broken[broken != NEVER].min()
    assert (run.state.exposed_tick.to_numpy()[outer] == first).all()


def test_an_unknown_word_for_outer_faces_is_refused():
    with pytest.raises(InputError, match="outer_faces must be True, False or 'once_broken', got"):
        effects.SphereContact(outer_faces="late")


def test_needed_effects_tries_a_run_that_acts_on_demand_too():
    quiet = simulate(pulled(1e5), until=1e-4, method=METHOD, samples=4)
    advice = needed_effects(quiet)
    assert set(advice.droppable) >= {"softening", "shear_slip", "sphere_contact"}
    assert set(advice.shown.values()) == {0.0}


def test_an_answer_has_the_certificate_of_its_finest_run():
    answer = solve(pulled(1e6), until=1e-4, goal=goals.kinetic_energy(), tolerance=0.05)
    assert answer.certificate is answer.result.certificate is not None


def test_an_answer_is_reached_only_if_its_certificate_holds():
    """A bar sleeps beside a block of 20 t that flies at 9 km/s; to the word, "all" differs."""
    mesh = beside(bar(0.4, 0.05, (8, 1, 1)), bar(2.0, 1.0, (2, 1, 1)), [0.0, 5.0, 0.0])
    flies = np.arange(mesh.body_count)[:, None] >= 48
    blow = effects.GasPressure("first left", peak=3e7, rise=2e-5, decay_ratio=0.5)
    scene = Scene(mesh, CONCRETE, "auto", loads=[blow], velocity=9e3 * flies * [0.0, 1.0, 0.0])
    answer = solve(scene, until=6e-4, goal=goals.broken_faces())
    assert answer.error == 0.0 and answer.reached == answer.certificate.holds
    assert answer.certificate.holds or "run the scene with effects='all'" in str(answer)


def test_the_word_goes_with_the_scene(result):
    scene = result.scene
    for same in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene)), replace(scene)):
        assert same.on_demand and same.sleep == scene.sleep
        assert [type(e) for e in same.effects] == [type(e) for e in scene.effects]
    assert ChosenEffects(scene.effects).word == "listed"


def estimate(scene, name, until=1e-3):
    return next(one for one in estimated_effects(scene, until) if one.effect == name)


@pytest.mark.parametrize(
    ("factor", "verdict"), [(0.01, NEGLIGIBLE), (1.0, UNCLEAR), (10.0, NEEDED)]
)
def test_stress_over_strength_tells_whether_softening_is_needed(factor, verdict):
    found = estimate(pulled(factor * CONCRETE.tensile_strength), "softening")
    assert found.group == pytest.approx(factor, 1e-12)
    assert found.verdict == verdict


def test_what_a_load_of_ones_own_does_is_unclear():
    class Push(Effect):
        role, name = "load", "push"

        def acts_on(self, i): ...

        def wrench(self, i, motion): ...

    found = estimate(Scene(BAR, CONCRETE, [Push()]), "softening")
    assert np.isnan(found.group) and found.verdict == UNCLEAR
    assert found.as_dict()["group"] is None


def test_a_material_without_dashpots_needs_no_damping():
    still = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)
    assert estimate(Scene(BAR, still, "auto"), "bond damping").verdict == NEGLIGIBLE
    assert estimate(Scene(BAR, CONCRETE, "auto"), "bond damping").verdict == NEEDED


def weight_after(model, moved, speed, time_s, energy, borne=False):
    """Estimates after a run of one part."""
    scales = PartScales(model, parts_of(model.mesh))
    found = np.array([energy]), np.array([borne])
    return estimates_after(scales, moved, speed, time_s, *found)


def test_the_weight_left_out_is_bounded_by_its_work():
    """A block that falls by itself gets m g h and has m v^2 / 2: all of that was left out."""
    model = Model(BAR, CONCRETE, [])
    height, time_s, mass = 2.0, 0.1, model.body_mass.sum()
    moved, speed = np.full((model.body_count, 3), [0.0, -height, 0.0]), np.zeros(model.body_count)
    weight = weight_after(model, moved, speed, time_s, 1.0)[0]
    least = mass * WEIGHT * height
    assert weight.group == pytest.approx(least + 0.5 * mass * (WEIGHT * time_s) ** 2, 1e-12)
    listed = Model(BAR, CONCRETE, [effects.Gravity()])
    found = weight_after(listed, moved, speed, time_s, 1.0)
    assert [e.effect for e in found] == ["air drag"]


def test_weight_left_out_of_a_part_that_is_borne_is_judged_by_its_stress():
    """A cantilever at rest, 3 density g L^2 / h: twice that, as its weight sets in at once."""
    for length, verdict in ((8.0, NEEDED), (0.5, NEGLIGIBLE)):
        model = Model(bar(length, 0.25, (4, 1, 1)), CONCRETE, [])
        still = np.zeros((model.body_count, 3))
        weight = weight_after(model, still, still[:, 0], 10.0, 0.0, borne=True)[0]
        stress = 6.0 * CONCRETE.density * WEIGHT * length**2 / 0.25
        assert weight.group == pytest.approx(stress / CONCRETE.tensile_strength, 1e-9)
        assert weight.verdict == verdict


@pytest.mark.parametrize("until", [0.0, -1.0, np.nan, "long"])
def test_a_time_that_is_none_is_refused(until):
    with pytest.raises(InputError, match="until must be"):
        estimated_effects(pulled(), until)


def test_a_form_of_contact_that_the_user_chose_is_named_but_no_gap_of_the_certificate():
    """A bar flies through another: outer faces have no spheres, as the user said."""
    two = join(bar(0.2, 0.1, (2, 1, 1)), bar(0.2, 0.1, (2, 1, 1)).moved(by=(0.21, 0.0, 0.0)))
    away = np.zeros((two.body_count, 3))
    away[two.body_count // 2 :, 0] = -100.0
    chosen = effects.SphereContact(outer_faces=False)
    scene = Scene(two, CONCRETE, "auto", loads=[chosen], velocity=away)
    with pytest.warns(UserWarning, match="outer_faces=True"):
        found = simulate(scene, until=1.2e-3, method=METHOD, samples=4)
    assert any("outer_faces=True" in need for need in found.report.needs)
    assert found.certificate.holds
