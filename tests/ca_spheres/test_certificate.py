"""What a run of spheres certifies: onsets of effects, what was left out, skipped contact tests."""

import json
import math

import numpy as np
import pytest

from ca_damper import Batch, InputError, RigidMass, SceneTable, Spheres, frequency_response
from ca_damper.certificate import NEEDED, NEGLIGIBLE, UNCLEAR, Certificate, Estimate, onset
from ca_damper.spheres.contact_law import wall_numbers
from ca_damper.spheres.estimates import rotation_estimate
from tests.ca_spheres.rig import Rig

DT = 2e-5
SHAKEN = {"dt": DT, "frequency": 6.0, "amplitude": 0.02}
EFFECTS = ("normal contact", "friction")
SCENES = 20


def test_audit_finds_no_miss_in_one_test_of_a_thousand():
    audit = Rig(Spheres(), [30] * 8, seed=np.arange(8), **SHAKEN).run(5000).device.audit()
    assert audit.misses == 0
    # Tests of a pair are chosen in one step of 1024, those of a sphere and a wall, of which there
    # are 30 beside 435, half as often; 29 to 31 at a time: 5 sigma of 40,000 steps.
    expected = audit.skipped / 1024 * (435 + 15) / 465
    assert abs(audit.audited - expected) < 5.0 * math.sqrt(31.0 * expected)


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_audit_finds_a_bound_that_is_too_loose(share):
    """Lists that are to serve for a way of which they hold a tenth or nothing lack contacts."""
    rig = Rig(Spheres(), [30] * 8, seed=np.arange(8), **SHAKEN)
    rig.device.search.tighten(share)
    audit = rig.run(5000).device.audit()
    rig.device.search.tighten(1.0)
    assert audit.misses > 0
    assert audit.misses_bound > audit.misses / audit.audited


def drawn(seed):
    """A few spheres at random places of a wide grid, at rest above a floor or flying about."""
    rng = np.random.default_rng(seed)
    sites = rng.permutation(16)[: rng.integers(1, 5)]
    places = np.column_stack([sites % 4, sites // 4]) * 0.0145 + 0.004
    places[:, 1] += 0.02
    drop = seed % 2 == 0
    options = {"gravity": 9.8 if drop else 0.0, "start": tuple(map(tuple, places.tolist()))}
    speed = np.zeros((len(places), 2)) if drop else rng.uniform(-0.4, 0.4, (len(places), 2))
    if seed % 4 == 1:
        # Along one line: whatever they meet, they meet head on.
        speed[:, 1] = 0.0
    return options, speed


def rig_of(options, speed, **more):
    rig = Rig(Spheres(**options, **more), len(speed), DT)
    rig.throw(speed)
    return rig


@pytest.mark.parametrize("seed", range(SCENES))
def test_onset_of_friction_is_the_first_step_that_it_changes(seed):
    """Without friction the bits are the same until then, and other ones after it."""
    options, speed = drawn(seed)
    rubbing = rig_of(options, speed)
    smooth = rig_of(options, speed, friction=0.0, wall_friction=0.0)
    first = rubbing.run(4000).device.first_steps(EFFECTS)["friction"][0]
    if math.isinf(first):
        smooth.run(4000)
        assert np.array_equal(np.array(rubbing.state()), np.array(smooth.state()))
        return
    rubbing = rig_of(options, speed).run(int(first))
    smooth.run(int(first))
    assert np.array_equal(np.array(rubbing.state()), np.array(smooth.state()))
    assert not np.array_equal(np.array(rubbing.run(1).state()), np.array(smooth.run(1).state()))


@pytest.mark.parametrize("seed", range(SCENES))
def test_onset_of_contact_is_the_end_of_free_flight(seed):
    """Until then velocities change by gravity alone, and in that step by more."""
    options, speed = drawn(seed)
    first = rig_of(options, speed).run(4000).device.first_steps(EFFECTS)["normal contact"][0]
    steps = 4000 if math.isinf(first) else int(first)
    rig = rig_of(options, speed).run(steps)
    fallen = [0.0, -options["gravity"] * DT]
    # Sums of up to 4000 roundings of speeds below 1 m/s.
    assert rig.state()[1] == pytest.approx(speed + steps * np.array(fallen), abs=4000 * 1e-16)
    if steps < 4000:
        before = rig.state()[1]
        change = rig.run(1).state()[1] - before - fallen
        assert np.abs(change).max() > 1e-12


def test_drawn_scenes_hold_effects_that_act_early_late_and_never():
    first = np.array(
        [
            list(rig_of(*drawn(k)).run(4000).device.first_steps(EFFECTS).values())
            for k in range(SCENES)
        ]
    )[:, :, 0]
    assert np.isinf(first).any(axis=0).all()
    assert np.isfinite(first).any(axis=0).all()
    assert (first[np.isfinite(first)] > 2000).any()
    assert (first[:, 1] >= first[:, 0]).all()


def ran(filling, effects, particles=12):
    table = SceneTable([particles] * 2, [1, 2], DT, 6.0, 3e-3)
    batch = Batch(filling, table, measured_cycles=1, effects=effects)
    batch.start()
    return batch.run(1, 1).record, batch


def test_auto_has_the_bits_of_what_it_chose():
    record, batch = ran(Spheres(), "auto")
    assert batch.filling.rotation
    assert np.array_equal(record, ran(Spheres(rotation=True), "listed")[0])
    assert not np.array_equal(record, ran(Spheres(), "listed")[0])


def test_rotation_without_friction_is_left_out_and_no_bit_changes():
    smooth = {"friction": 0.0, "wall_friction": 0.0, "rotation": True}
    record, batch = ran(Spheres(**smooth), "auto")
    assert not batch.filling.rotation
    assert batch.certificate.left_out[0].share == 0.0
    assert np.array_equal(record, ran(Spheres(**smooth), "listed")[0])


@pytest.mark.parametrize(
    ("friction", "verdict"), [(0.0, NEGLIGIBLE), (1e-5, NEGLIGIBLE), (3e-5, UNCLEAR), (0.5, NEEDED)]
)
def test_estimate_of_rotation_follows_friction(friction, verdict):
    estimate = rotation_estimate(Spheres(friction=friction, wall_friction=friction), 30)
    assert estimate.verdict == verdict
    chosen, _ = Spheres(friction=friction, wall_friction=friction).activated(30)
    assert chosen.rotation == (verdict != NEGLIGIBLE)


def test_a_single_sphere_between_smooth_walls_does_not_turn():
    assert rotation_estimate(Spheres(wall_friction=0.0), 1).share == 0.0
    assert rotation_estimate(Spheres(wall_friction=0.0), 2).share > 0.0
    assert rotation_estimate(Spheres(), 0).share == 0.0


def test_estimate_of_rotation_bounds_the_share_of_a_blow():
    """A sphere that hits the floor at 45 degrees; rotating, its energy is known exactly."""
    start, speed = ((0.03, 0.01),), 0.4
    rig = Rig(Spheres(rotation=True, gravity=0.0, start=start), 1, 2e-6)
    rig.throw([speed, -speed])
    spin = rig.run(10_000).device.snapshot(0)["spin"][0]
    share = 0.4 * (3e-3 * spin) ** 2 / (2.0 * speed**2)
    assert 0.5 * rotation_estimate(rig.filling, 1).share < share
    # The lever is shorter by the overlap, which is at most that of an elastic blow.
    numbers = wall_numbers(rig.filling)
    deepest = (1.25 * numbers["mass"] * speed**2 / numbers["stiffness"]) ** 0.4
    assert share < rotation_estimate(rig.filling, 1).share * (1.0 + deepest / 3e-3)


def test_certificate_stands_in_report_and_json(tmp_path):
    cycles = {"transient_cycles": 1, "measured_cycles": 3}
    scenes = {"particles": 8, "ratios": [0.9, 1.1], "seeds": 1, "progress": None}
    answer = frequency_response(Spheres(), **scenes, **cycles, effects="auto")
    certificate = answer.report.certificate
    text = str(answer.report)
    assert "rotation, needed, at most 10 %" in text
    assert "air drag" in text
    assert "skipped contact tests, 0 misses" in text
    assert [one.effect for one in certificate.onsets] == ["normal contact", "friction", "rotation"]
    answer.report.write(tmp_path / "report.json")
    written = json.loads((tmp_path / "report.json").read_text())["certificate"]
    assert written["effects"] == "auto"
    assert written["estimates"][0]["verdict"] == NEEDED
    assert written["audit"]["misses"] == 0
    assert certificate.periods.cycles == 3


def test_unknown_word_for_effects_is_refused():
    with pytest.raises(InputError, match="effects must be one of listed, auto, got 'some'"):
        Batch(Spheres(), SceneTable(1, 1, DT), effects="some")
    with pytest.raises(InputError, match="filling must be one such as"):
        Batch(Spheres, SceneTable(1, 1, DT), effects="auto")
    with pytest.raises(InputError, match="table"):
        Batch(Spheres(), None, effects="auto")


def test_a_certificate_reads_as_a_sentence_a_line():
    none = Estimate("rotation", 0.0, "the energy", "there is no sphere")
    text = str(Certificate("auto", 2, (onset("friction", [np.inf] * 2),), (none,)))
    assert "friction: never acted" in text
    assert "left out   rotation, negligible, exactly none: there is no sphere" in text
    assert str(onset("friction", [0.25, np.inf])) == "friction: in 1 scene from 0.25 s"


@pytest.mark.parametrize(("start", "words"), [("rigid", "2 scenes every cycle"), ("rest", "none")])
def test_periodic_scenes_are_said_to_be(start, words):
    """A rigid mass is in its steady state at once, or far from it in the first cycles."""
    batch = Batch(RigidMass(), SceneTable(30, 1, 1e-4, [5.5, 6.0], 1e-3), measured_cycles=6)
    batch.start(start)
    batch.run(0, 6)
    periods = batch.certificate.periods
    assert periods.scenes == (((1, 2),) if start == "rigid" else ())
    assert periods.others == (0 if start == "rigid" else 2)
    assert str(periods).startswith(words)
    assert "periodic" in str(batch.report())
