"""Results of the damper for pandas, xarray, OVITO, and as figures."""

import dataclasses
import sys

import numpy as np
import pandas
import pytest
from matplotlib.figure import Figure

from ca_damper import (
    AmplitudeResponse,
    Automaton,
    DamperMap,
    InputError,
    ModalStructure,
    Oscillator,
    RigidMass,
    Spheres,
    StructureHistory,
    Sweep,
    TimeHistory,
)
from ca_damper.film import Film
from ca_damper.measures import COLUMNS, MEASURE_UNITS, SAMPLE, SAMPLE_UNITS, Cycles
from ca_damper.record import Frame
from tests.figures import defects
from tests.made_response import response

RNG = np.random.default_rng(2)
#: Units of all measures of a response.
UNITS = {
    **dict.fromkeys(("rms", "amplitude", "mean", "rms_about_all"), "m"),
    **{"mean_force": "N", "apparent_mass": "kg", "apparent_damping": "N s/m", "energy": "J"},
    **{"loss_factor": "1", "damping_ratio": "1"},
}


def made_response(**others):
    """A response whose measures all differ."""
    shape = 2, 41, 2
    measures = {name: RNG.uniform(1e-3, 2e-3, shape) for name in MEASURE_UNITS}
    return dataclasses.replace(response(), **measures, **others)


def time_history():
    samples, shape = 5, (5, 2, 3)
    base = RNG.normal(size=samples)
    return TimeHistory(
        *("spheres", Oscillator(), None, (0, 30), (1, 2, 3), np.arange(5.0), base),
        **{name: RNG.normal(size=shape) for name in ("x", "v", "force")},
        **{name: RNG.uniform(size=shape[1:]) for name in ("rms", "peak")},
    )


def structure_history():
    structure = ModalStructure([1.0, 1.0], [1.0, 2.0], [0.01, 0.01], np.eye(2))
    places = {name: RNG.normal(size=(5, 2, 3)) for name in ("x", "v")}
    return StructureHistory(
        *("spheres", structure, (), None, (1, 2, 3), np.arange(5.0), RNG.normal(size=5)),
        **places,
        force=RNG.normal(size=(5, 1, 3)),
        **{name: RNG.uniform(size=(2, 3)) for name in ("rms", "peak")},
    )


def damper_map(clearances=(0.01, 0.02)):
    shape = len(clearances), 2, 1, 3, 2
    return DamperMap(
        *("spheres", 1e-3, clearances, (10, 20), (5e-3,), (5.0, 6.0, 7.0), (1, 2)),
        gaps=RNG.uniform(1e-2, 2e-2, shape[:2]),
        **{n: RNG.uniform(size=shape) for n in ("apparent_damping", "apparent_mass")},
    )


def same(dataset, owner, names):
    """Whether variables of a dataset are the arrays of their owner."""
    return all(np.array_equal(dataset[name].to_numpy(), getattr(owner, name)) for name in names)


def test_a_response_is_a_dataset_over_particles_frequency_and_seed():
    made = made_response()
    found = made.to_xarray()
    assert dict(found.sizes) == {"particles": 2, "frequency": 41, "seed": 2}
    assert set(found.data_vars) == set(UNITS) and same(found, made, UNITS)
    assert {name: found[name].attrs["units"] for name in UNITS} == UNITS == made.units
    assert found["rms"].dims == ("particles", "frequency", "seed")
    natural = made.oscillator.natural_frequency
    assert found["frequency"].to_numpy() == pytest.approx(natural * made.ratios, rel=1e-15)
    assert found["frequency"].attrs["units"] == "Hz"
    assert np.array_equal(found["ratio"], made.ratios) and found.attrs["filling"] == "rigid"
    one = found.sel(particles=10, seed=2).isel(frequency=3)
    assert float(one["rms"]) == made.rms[1, 3, 1]


@pytest.mark.parametrize("made", [made_response(), damper_map(), time_history()])
def test_tables_have_a_unit_for_every_column(made, tmp_path):
    frame = made.to_pandas()
    assert all(frame.attrs["units"].values()) and set(frame.attrs["units"]) == set(frame)
    made.write_csv(tmp_path / "table.csv")
    assert list(pandas.read_csv(tmp_path / "table.csv")) == list(frame)


def test_sweeps_and_amplitudes_add_a_dimension():
    up, down = made_response(), made_response()
    swept = Sweep(up, down).to_xarray()
    assert swept["direction"].to_numpy().tolist() == ["up", "down"]
    assert same(swept.sel(direction="up"), up, UNITS)
    assert same(swept.sel(direction="down"), down, UNITS)
    several = AmplitudeResponse((1e-3, 2e-3), (up, down))
    found = several.to_xarray()
    assert same(found.sel(base_amplitude=2e-3), down, UNITS)
    assert found["base_amplitude"].attrs["units"] == "m"
    assert found["rms"].attrs["units"] == "m"
    frame = several.to_pandas()
    assert len(frame) == 2 * up.rms.size and all(frame.attrs["units"].values())


def test_histories_are_datasets_over_time():
    made = time_history()
    found = made.to_xarray()
    assert dict(found.sizes) == {"time": 5, "particles": 2, "seed": 3}
    assert same(found, made, ("base", "x", "v", "force", "rms", "peak"))
    assert [found[n].attrs["units"] for n in ("time", "x", "v", "force")] == ["s", "m", "m/s", "N"]
    built = structure_history()
    found = built.to_xarray()
    assert dict(found.sizes) == {"time": 5, "place": 2, "seed": 3, "box": 1}
    assert same(found, built, ("base", "x", "v", "force", "rms", "peak"))
    assert all(built.to_pandas().attrs["units"].values())


@pytest.mark.parametrize("clearances", [(0.01, 0.02), (None,)])
def test_a_map_is_a_dataset_over_its_axes(clearances):
    made = damper_map(clearances)
    found = made.to_xarray()
    axes = "clearance", "particles", "amplitude", "frequency", "seed"
    assert tuple(found.sizes) == axes and found["loss"].dims == axes
    assert same(found, made, ("apparent_damping", "apparent_mass", "loss", "mass_share", "energy"))
    assert ("clearance" in found.coords) == (clearances != (None,))
    assert all(one.attrs["units"] for one in found.variables.values())


def test_cycles_and_samples_have_units():
    record = RNG.uniform(1.0, 2.0, (3, 4, len(COLUMNS)))
    made = Cycles(np.array([1.0, 2.0, 3.0]), np.array([10, 20, 30]), record)
    found = made.to_xarray()
    assert dict(found.sizes) == {"scene": 3, "cycle": 4}
    assert same(found, made, ("rms", "amplitude", "apparent_mass", "rms_by_cycle"))
    assert all(one.attrs["units"] for one in found.variables.values())
    assert set(SAMPLE) < set(SAMPLE_UNITS)
    history = {name: RNG.normal(size=(6, 2)) for name in ("time_s", *SAMPLE)}
    found = Film(history, ()).to_xarray()
    assert dict(found.sizes) == {"sample": 6, "scene": 2}
    assert all(np.array_equal(found[name], history[name]) for name in history)


def film(filling, diameter=None):
    """Two scenes of three frames, of five particles each."""
    frames = [
        Frame(0.1 * k, 1e-3 * k, 0.0, RNG.uniform(size=(5, 2)), RNG.normal(size=(5, 2)), diameter)
        for k in range(6)
    ]
    return Film({}, (tuple(frames[:3]), tuple(frames[3:])), filling)


@pytest.mark.parametrize("filling", [Automaton(), Spheres()])
@pytest.mark.parametrize("sizes", [None, np.linspace(1e-3, 2e-3, 5)])
def test_grains_are_where_their_container_is(tmp_path, filling, sizes):
    """Read by a parser of our own, to the ten digits that are written."""
    made = film(filling, sizes)
    made.write_xyz(tmp_path / "grains.xyz", scene=1)
    lines = (tmp_path / "grains.xyz").read_text().splitlines()
    assert len(lines) == 3 * 7 and lines[0] == lines[7] == "5"
    for k, frame in enumerate(made.frames[1]):
        head, rows = lines[7 * k + 1], lines[7 * k + 2 : 7 * k + 7]
        assert f"Time={frame.time_s:.10g}" in head and 'pbc="F F F"' in head
        assert "Properties=species:S:1:pos:R:3:radius:R:1:velo:R:3" in head
        cells = np.array([row.split()[1:] for row in rows], dtype=float)
        near = {"rel": 1e-9, "abs": 1e-12}
        assert cells[:, 0] == pytest.approx(frame.position[:, 0], **near)
        assert cells[:, 1] == pytest.approx(frame.position[:, 1] + frame.x, **near)
        wide = filling.width if isinstance(filling, Automaton) else filling.diameter
        wanted = np.full(5, 0.5 * wide) if sizes is None else 0.5 * sizes
        assert cells[:, 3] == pytest.approx(wanted, **near)
        assert cells[:, 4:6] == pytest.approx(frame.velocity, **near)
        assert not cells[:, [2, 6]].any()
        origin = head.split('Origin="')[1].split('"')[0].split()
        assert float(origin[1]) == pytest.approx(frame.x)


@pytest.mark.parametrize(
    ("made", "scene", "words"),
    [
        (Film({}, (), Spheres()), 0, "a film must have frames"),
        (film(Spheres()), 2, "scene must be a whole number from 0 to 1, got 2"),
        (film(RigidMass()), 0, "filling must be an Automaton or Spheres"),
        (film(None), 0, "filling must be an Automaton or Spheres"),
    ],
)
def test_a_film_without_grains_is_refused(tmp_path, made, scene, words):
    with pytest.raises(InputError, match=words):
        made.write_xyz(tmp_path / "grains.xyz", scene)
    assert not list(tmp_path.iterdir())


def test_without_xarray_it_is_named(monkeypatch):
    up = made_response()
    everything = up, Sweep(up, up), AmplitudeResponse((1e-3,), (up,)), time_history(), damper_map()
    monkeypatch.setitem(sys.modules, "xarray", None)
    for made in everything:
        with pytest.raises(
            InputError, match="xarray must be installed for this: pip install xarray"
        ):
            made.to_xarray()


@pytest.mark.parametrize("measure", ["rms", "apparent_damping", "loss_factor"])
def test_a_measure_has_a_picture(measure, tmp_path):
    figure = made_response().plot.curves(measure, path=tmp_path / "curves.png")
    assert isinstance(figure, Figure) and (tmp_path / "curves.png").stat().st_size > 1000
    figure.canvas.draw()
    assert defects(figure) == []


def test_peaks_and_hysteresis_have_pictures(tmp_path):
    made = response()
    for figure in (made.plot.peaks(), Sweep(made, made).plot.hysteresis()):
        figure.canvas.draw()
        assert defects(figure) == []
    with pytest.raises(InputError, match="measure must be one of rms, amplitude"):
        made.plot.curves("speed")
