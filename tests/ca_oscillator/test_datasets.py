"""Results of the damper have the same numbers, with units, in pandas, xarray and OVITO."""

import dataclasses

import numpy as np
import pandas
import pytest

from ca_damper import Automaton, Spheres
from ca_damper.report.measures import MEASURE_UNITS
from ca_damper.report.record import Frame
from ca_damper.runs.film import Film
from tests.made_response import response

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
