"""A linear system answers with its transfer function; results have the same numbers anywhere."""

import dataclasses
import math

import numpy as np
import pandas
import pytest

from ca_damper import (
    Automaton,
    Oscillator,
    RigidMass,
    Spheres,
    Sweep,
    frequency_response,
    sweep_up_and_down,
)
from ca_damper.report.measures import MEASURE_UNITS
from ca_damper.report.record import Frame
from ca_damper.runs.film import Film
from tests.made_response import response

RATIOS = np.linspace(0.9, 1.1, 5)


def wanted_rms(oscillator, particles, ratios):
    frequency = np.asarray(ratios) * oscillator.natural_frequency
    gain = [np.abs(oscillator.transfer(frequency, 0.2e-3 * number)) for number in particles]
    return oscillator.base_amplitude * np.array(gain) / math.sqrt(2.0)


def rigid_response(**changes):
    few = {"particles": [0, 10], "ratios": RATIOS, "seeds": 2}
    few.update(transient_cycles=0, measured_cycles=2, start="rigid")
    return frequency_response(RigidMass(), **{**few, **changes})


def test_response_of_the_user_s_oscillator_has_a_place_for_every_scene():
    oscillator = Oscillator(mass=0.2, stiffness=500.0, damping=0.5, base_amplitude=1e-3)
    made = rigid_response(oscillator=oscillator, dt=2e-4, seeds=[4, 9, 2])
    wanted = wanted_rms(oscillator, [0, 10], RATIOS)
    assert made.rms == pytest.approx(np.repeat(wanted[:, :, None], 3, axis=2), rel=1e-8)
    assert made.apparent_mass[1] == pytest.approx(np.full((5, 3), 2e-3), rel=1e-8)
    assert (1.9e-4 < made.dt).all() and (made.dt <= 2e-4).all()


def test_peak_of_a_response_and_of_one_that_ends_before_it():
    # A parabola through points 0.005 apart misses the top of this curve by less than a tenth of
    # that; damped resonance of the absolute transfer function from a fine grid.
    made = rigid_response(ratios=np.arange(0.93, 1.03, 0.005), particles=[10, 30])
    fine = np.linspace(0.93, 1.03, 20001)
    ratio, rms = made.peaks()
    for row, curve in enumerate(wanted_rms(Oscillator(), [10, 30], fine)):
        assert ratio[row] == pytest.approx([fine[curve.argmax()]] * 2, abs=5e-4)
        assert rms[row] == pytest.approx([curve.max()] * 2, rel=5e-3)
    assert np.isnan(rigid_response(ratios=[0.9, 0.92, 0.94]).peaks()).all()


def test_a_linear_system_answers_alike_on_the_way_up_and_down():
    job = {"particles": [0, 10], "ratios": RATIOS, "seeds": 1}
    sweep = sweep_up_and_down(RigidMass(), **job, transient_cycles=150, measured_cycles=10)
    # What is left of the frequency before: at most the two amplitudes, 17 and 1.8 mm RMS, times
    # exp(-2 pi zeta 150 / ratio), against 1.8 mm.
    zeta = Oscillator().damping_ratio
    left = np.exp(-2.0 * np.pi * zeta * 150.0 / 1.1) * (17.0 + 1.8) / 1.8
    assert np.abs(sweep.hysteresis).max() < 2.0 * left
    for way in (sweep.up, sweep.down):
        wanted = wanted_rms(Oscillator(), [0, 10], RATIOS)
        assert way.rms[:, :, 0] == pytest.approx(wanted, rel=2.0 * left)


def test_a_mean_that_still_grows_is_carried_on_and_shows_no_hysteresis():
    # Without transient cycles the way up remembers rest, the way down the resonance.
    asked = {"particles": 0, "ratios": [0.95, 1.0], "seeds": 1, "progress": None}
    grows = sweep_up_and_down(RigidMass(), transient_cycles=0, measured_cycles=20, **asked)
    assert np.abs(grows.hysteresis).max() > 0.1 and not grows.shows_hysteresis.any()


def swept(up, down, error):
    """Sweep of one particle number from RMS (ratios, seeds) and their half-widths."""
    ratios, seeds = RATIOS[: len(up)], tuple(range(1, 1 + up.shape[1]))
    ways = [response((10,), ratios, seeds, rms=rms[None]) for rms in (up, down)]
    return Sweep(*ways, up_error=error[None], down_error=error[None])


@pytest.mark.parametrize("seeds", [1, 5])
def test_chance_is_seldom_called_hysteresis(seeds):
    """400 sweeps of four frequencies: one of twenty at 95 % for all four, at 2.6 deviations."""
    rng, told = np.random.default_rng(4), 0
    for _ in range(400):
        up, down = 1.0 + 0.05 * rng.normal(size=(2, 4, seeds))
        error = np.full(up.shape, 0.05 * 2.5)
        told += bool(swept(up, down, error).shows_hysteresis.any())
    assert told <= 400 * 0.05 + 2.6 * math.sqrt(400 * 0.05)


def test_a_difference_beyond_chance_is_hysteresis_unless_a_mean_still_changes():
    rng = np.random.default_rng(5)
    up, down = 1.0 + 0.01 * rng.normal(size=(2, 4, 5))
    down[2] += 0.5
    error = np.full(up.shape, 0.02)
    assert swept(up, down, error).shows_hysteresis.tolist() == [[False, False, True, False]]
    error[2, 3] = np.inf
    assert not swept(up, down, error).shows_hysteresis.any()


RNG = np.random.default_rng(2)
#: Units of all measures of a response.
UNITS = {
    **dict.fromkeys(("rms", "amplitude", "mean", "rms_about_all"), "m"),
    **{"mean_force": "N", "apparent_mass": "kg", "apparent_damping": "N s/m", "energy": "J"},
    **{"loss_factor": "1", "damping_ratio": "1"},
}


def made_response():
    """A response whose measures all differ."""
    shape = 2, 41, 2
    measures = {name: RNG.uniform(1e-3, 2e-3, shape) for name in MEASURE_UNITS}
    return dataclasses.replace(response(), **measures)


def same(dataset, owner, names):
    """Whether variables of a dataset are the arrays of their owner."""
    return all(np.array_equal(dataset[name].to_numpy(), getattr(owner, name)) for name in names)


def test_a_response_is_a_dataset_over_particles_frequency_and_seed():
    made = made_response()
    found = made.to_xarray()
    assert found["rms"].dims == ("particles", "frequency", "seed")
    assert set(found.data_vars) == set(UNITS) and same(found, made, UNITS)
    assert {name: found[name].attrs["units"] for name in UNITS} == UNITS == made.units
    natural = made.oscillator.natural_frequency
    assert found["frequency"].to_numpy() == pytest.approx(natural * made.ratios, rel=1e-15)
    one = found.sel(particles=10, seed=2).isel(frequency=3)
    assert float(one["rms"]) == made.rms[1, 3, 1]


def test_a_table_has_a_row_for_every_scene(tmp_path):
    made = made_response()
    made.write_csv(tmp_path / "curve.csv")
    rows = pandas.read_csv(tmp_path / "curve.csv")
    assert len(rows) == 2 * 41 * 2
    row = rows.iloc[1 * 82 + 3 * 2 + 1]
    assert (row["particles"], row["seed"], row["ratio"]) == (10, 2, made.ratios[3])
    assert row["rms_m"] == pytest.approx(made.rms[1, 3, 1], rel=1e-15)


@pytest.mark.parametrize("filling", [Automaton(), Spheres()])
def test_grains_of_a_film_are_where_their_container_is(tmp_path, filling):
    """Read by a parser of our own, to the ten digits that are written."""
    place, velocity = RNG.uniform(size=(5, 2)), RNG.normal(size=(5, 2))
    frame = Frame(0.1, 1e-3, 0.0, place, velocity, None)
    Film({}, ((frame,),), filling).write_xyz(tmp_path / "grains.xyz", scene=0)
    count, head, *rows = (tmp_path / "grains.xyz").read_text().splitlines()
    assert int(count) == len(rows) == 5
    assert "Properties=species:S:1:pos:R:3:radius:R:1:velo:R:3" in head
    cells = np.array([row.split()[1:] for row in rows], dtype=float)
    near = {"rel": 1e-9, "abs": 1e-12}
    assert cells[:, :2] == pytest.approx(place + np.array([0.0, frame.x]), **near)
    wide = filling.width if isinstance(filling, Automaton) else filling.diameter
    assert cells[:, 3] == pytest.approx(0.5 * wide, **near)
    assert cells[:, 4:6] == pytest.approx(velocity, **near)
