"""What a user calls: responses, sweeps, films, and how bad input is refused."""

import csv
import math

import numpy as np
import pytest

from ca_damper import (
    Batch,
    Empty,
    InputError,
    Oscillator,
    RigidMass,
    SceneTable,
    film,
    frequency_response,
    sweep_up_and_down,
)
from ca_damper.measures import MEASURE_UNITS

PAPER = Oscillator()
RATIOS = np.linspace(0.9, 1.1, 5)


def wanted_rms(oscillator, particles, ratios):
    frequency = np.asarray(ratios) * oscillator.natural_frequency
    gain = [np.abs(oscillator.transfer(frequency, 0.2e-3 * number)) for number in particles]
    return oscillator.base_amplitude * np.array(gain) / math.sqrt(2.0)


def rigid_response(**changes):
    few = {"particles": [0, 10], "ratios": RATIOS, "seeds": 2}
    few.update(transient_cycles=0, measured_cycles=2, start="rigid")
    return frequency_response(RigidMass(), **{**few, **changes})


def test_response_has_a_place_for_every_scene():
    response = rigid_response(seeds=[4, 9, 2])
    assert response.rms.shape == (2, 5, 3)
    assert response.seeds == (4, 9, 2)
    wanted = wanted_rms(PAPER, [0, 10], RATIOS)
    assert response.rms == pytest.approx(np.repeat(wanted[:, :, None], 3, axis=2), rel=1e-9)
    assert response.apparent_mass[1] == pytest.approx(np.full((5, 3), 2e-3), rel=1e-8)
    assert response.steps_per_cycle == pytest.approx(
        np.ceil(1e4 / (RATIOS * PAPER.natural_frequency))
    )
    assert (response.dt <= 1e-4).all()


def test_several_amplitudes_are_an_axis_of_the_same_bits(tmp_path):
    """The rigid mass is linear; each amplitude has the bits of a response of its own."""
    amplitudes = [0.3e-3, 1.2e-3]
    made = rigid_response(base_amplitude=amplitudes)
    assert made.amplitudes == tuple(amplitudes) and len(made) == 2
    assert made.measure("rms").shape == (2, 2, 5, 2)
    for amplitude, one in zip(amplitudes, made):
        alone = rigid_response(base_amplitude=amplitude)
        assert one.oscillator == alone.oscillator == Oscillator(base_amplitude=amplitude)
        for name in MEASURE_UNITS:
            assert np.array_equal(getattr(one, name), getattr(alone, name)), name
    assert made.measure("rms")[1] == pytest.approx(4.0 * made.measure("rms")[0], rel=1e-8)
    assert made.peaks()[1].shape == (2, 2, 2) and made[1] is made.responses[1]
    made.write_csv(tmp_path / "curves.csv")
    with open(tmp_path / "curves.csv", newline="") as handle:
        rows = list(csv.DictReader(handle))
    assert len(rows) == 40 and float(rows[-1]["base_amplitude_m"]) == 1.2e-3
    assert float(rows[-1]["rms_m"]) == made.measure("rms")[1, -1, -1, -1]


def test_amplitudes_that_mean_nothing_are_refused():
    for bad in (-1e-3, [1e-3, math.nan], []):
        with pytest.raises(InputError, match="base_amplitude must"):
            rigid_response(base_amplitude=bad)


def test_oscillator_and_step_are_the_user_s():
    oscillator = Oscillator(mass=0.2, stiffness=500.0, damping=0.5, base_amplitude=1e-3)
    response = rigid_response(oscillator=oscillator, dt=2e-4)
    wanted = wanted_rms(oscillator, [0, 10], RATIOS)
    assert response.rms[:, :, 0] == pytest.approx(wanted, rel=1e-8)
    assert (response.dt > 1.9e-4).all()


def test_peak_of_a_response():
    # A parabola through points 0.005 apart misses the top of this curve by less than a tenth of
    # that; damped resonance of the absolute transfer function from a fine grid.
    response = rigid_response(ratios=np.arange(0.93, 1.03, 0.005), particles=[10, 30])
    fine = np.linspace(0.93, 1.03, 20001)
    for row, curve in enumerate(wanted_rms(PAPER, [10, 30], fine)):
        ratio, rms = response.peaks()
        assert ratio[row] == pytest.approx([fine[curve.argmax()]] * 2, abs=5e-4)
        assert rms[row] == pytest.approx([curve.max()] * 2, rel=5e-3)


def test_csv_has_a_row_for_every_scene(tmp_path):
    response = rigid_response()
    response.write_csv(tmp_path / "curve.csv")
    with open(tmp_path / "curve.csv", newline="") as handle:
        rows = list(csv.DictReader(handle))
    assert len(rows) == 2 * 5 * 2
    assert {row["filling"] for row in rows} == {"rigid"}
    row = rows[1 * 10 + 3 * 2 + 1]
    assert (row["particles"], row["seed"]) == ("10", "2")
    assert float(row["ratio"]) == RATIOS[3]
    assert float(row["rms_m"]) == response.rms[1, 3, 1]
    assert float(row["frequency_Hz"]) == RATIOS[3] * PAPER.natural_frequency
    assert [path.name for path in tmp_path.iterdir()] == ["curve.csv"]


def test_csv_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot write"):
        rigid_response().write_csv(tmp_path / "nowhere" / "curve.csv")


def test_a_linear_system_answers_alike_on_the_way_up_and_down():
    told = []
    sweep = sweep_up_and_down(
        RigidMass(),
        particles=[0, 10],
        ratios=RATIOS,
        seeds=1,
        transient_cycles=150,
        measured_cycles=10,
        progress=told.append,
    )
    # What is left of the frequency before: at most the two amplitudes, 17 and 1.8 mm RMS, times
    # exp(-2 pi zeta 150 / ratio), against 1.8 mm.
    left = np.exp(-2.0 * np.pi * PAPER.damping_ratio * 150.0 / 1.1) * (17.0 + 1.8) / 1.8
    assert np.abs(sweep.hysteresis).max() < 2.0 * left
    wanted = wanted_rms(PAPER, [0, 10], RATIOS)
    for way in (sweep.up, sweep.down):
        assert way.rms[:, :, 0] == pytest.approx(wanted, rel=2.0 * left)
        assert way.steps_per_cycle[0] == math.ceil(1e4 / (0.9 * PAPER.natural_frequency))
    shares = [progress.share for progress in told if progress.phase == "running"]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_a_sweep_carries_its_state_on():
    # Without transient cycles the way up remembers rest, the way down the resonance.
    sweep = sweep_up_and_down(
        *(RigidMass(),), particles=0, ratios=RATIOS, seeds=1, transient_cycles=0, measured_cycles=5
    )
    assert sweep.hysteresis.max() > 0.5


def test_film_records_samples_and_frames_at_whole_steps():
    batch = Batch(RigidMass(), SceneTable([3, 5], 1, 1e-4, 6.0, 0.6e-3))
    batch.start()
    shot = film(batch, 1667, sample_every=100, frame_every=208)
    dt = 1.0 / (6.0 * 1667)
    assert shot.history["x"].shape == (17, 2)
    assert shot.filling is batch.filling and shot.mount == "spring"
    assert shot.history["time_s"][:, 0] == pytest.approx(100 * dt * np.arange(17))
    assert len(shot.frames) == 2
    assert [frame.time_s for frame in shot.frames[1]] == pytest.approx(208 * dt * np.arange(9))
    assert shot.frames[1][0].position.shape == (5, 2)
    straight = Batch(RigidMass(), SceneTable([3, 5], 1, 1e-4, 6.0, 0.6e-3))
    straight.start()
    straight.advance(1667)
    assert np.array_equal(batch.sample()["x"], straight.sample()["x"])


BAD = [
    ({"particles": -1}, "particles"),
    ({"particles": 2.5}, "particles"),
    ({"particles": math.nan}, "particles"),
    ({"particles": 1_000_001}, "from 0 to 1000000"),
    ({"particles": []}, "particles"),
    ({"ratios": []}, "ratios"),
    ({"ratios": "0.9"}, "ratios"),
    ({"ratios": [0.9, math.nan]}, "ratios"),
    ({"ratios": [0.0, 1.0]}, "ratios"),
    ({"ratios": [1.0, 0.9]}, "ratios must ascend"),
    ({"seeds": 0}, "seeds"),
    ({"seeds": 1.5}, "seeds"),
    ({"seeds": [-1]}, "seeds"),
    ({"dt": math.nan}, "dt"),
    ({"dt": 0.0}, "dt"),
    ({"dt": 0.01}, r"dt must lie in \[.*, 0.00"),
    ({"dt": 1e-12}, r"dt must lie in"),
    ({"transient_cycles": -1}, "transient_cycles"),
    ({"measured_cycles": 0}, "measured_cycles"),
    ({"measured_cycles": math.nan}, "measured_cycles"),
    ({"start": "moving"}, "start must be one of rest, empty, rigid, got 'moving'"),
    ({"seeds": 1000, "measured_cycles": 100_000}, "scenes x measured_cycles"),
]


@pytest.mark.parametrize(("changes", "name"), BAD)
def test_bad_input_is_refused_in_a_sentence(changes, name):
    with pytest.raises(InputError, match=name) as caught:
        rigid_response(**changes)
    assert "\n" not in str(caught.value)


def test_particles_in_an_empty_container_are_refused():
    with pytest.raises(InputError, match="particles must be a whole number from 0 to 0, got 1"):
        frequency_response(Empty(), particles=1, ratios=1.0)
    with pytest.raises(InputError, match="particles must be 0 in an empty container, got 1"):
        Batch(Empty(), SceneTable(1, 1, 1e-4, 6.0))


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("mass", 0.0),
        ("mass", math.nan),
        ("stiffness", -1.0),
        ("damping", math.nan),
        ("base_amplitude", math.inf),
        ("frequency", math.nan),
        ("frequency", 0.0),
        ("dt", math.nan),
    ],
)
def test_bad_numbers_of_a_table_are_refused(column, value):
    numbers = {"particles": 0, "seed": 1, "dt": 1e-4, "frequency": 6.0, column: value}
    with pytest.raises(InputError, match=column):
        Batch(Empty(), SceneTable(**numbers))


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"mount": "ceiling"}, "mount must be one of spring, base, floor, got 'ceiling'"),
        ({"rtol": -1.0}, "rtol"),
        ({"rtol": math.nan}, "rtol"),
        ({"atol": 0.0}, "atol"),
        ({"measured_cycles": -1}, "measured_cycles"),
    ],
)
def test_bad_options_of_a_batch_are_refused(options, name):
    with pytest.raises(InputError, match=name):
        Batch(Empty(), SceneTable(0, 1, 1e-4, 6.0), **options)


@pytest.mark.parametrize("changes", [{"particle_mass": 0.0}, {"particle_mass": math.nan}])
def test_a_rigid_particle_has_a_mass(changes):
    with pytest.raises(InputError, match="particle_mass"):
        RigidMass(**changes)


def test_a_peak_outside_the_ratios_is_said_to_be_outside():
    """Both curves rise towards the last ratio; the table of a notebook has a word for it."""
    response = rigid_response(ratios=[0.9, 0.92, 0.94], particles=[0, 30])
    ratio, rms = response.peaks()
    assert ratio.shape == rms.shape == (2, 2)
    assert np.isnan(ratio).all() and np.isnan(rms).all()
    assert response._repr_html_().count("outside") == 2 * 4
    inside = rigid_response(ratios=[0.9, 0.95, 1.0, 1.05], particles=[0, 30])
    assert np.isfinite(inside.peaks()).all() and "outside" not in inside._repr_html_()
