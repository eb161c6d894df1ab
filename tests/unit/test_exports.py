"""Files for other programs, read back: VTKHDF and extended XYZ."""

import dataclasses
import re

import h5py
import meshio
import numpy as np
import pytest

from taichi_dem import write_paraview
from taichi_dem.output.fragments import vectors_of
from tests.made_result import made_result


@pytest.fixture(scope="module")
def result():
    made = made_result()
    since = np.where(np.arange(made.model.body_count) % 2, 1.5e-5, np.nan)
    return dataclasses.replace(made, acting_since={"softening": since})


def test_vtkhdf_holds_what_the_pvd_series_holds(result, tmp_path):
    result.write_vtkhdf(tmp_path / "run.vtkhdf")
    write_paraview(tmp_path, result.model, result.frames, "run", result.acting_since)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        root, count = file["VTKHDF"], result.model.body_count
        steps = root["Steps"]
        assert steps["Values"][:].tolist() == [frame.time_s for frame in result.frames]
        cells = root["Connectivity"][:].reshape(-1, 4)
        for k in range(len(result.frames)):
            vtu = meshio.read(tmp_path / f"run_{k:04d}.vtu")
            start, number = steps["PointOffsets"][k], root["NumberOfPoints"][0]
            assert np.array_equal(root["Points"][start : start + number], vtu.points)
            assert np.array_equal(cells, vtu.cells[0].data)
            assert set(vtu.cell_data) == set(root["CellData"])
            for name, (values,) in vtu.cell_data.items():
                start = steps["CellDataOffsets"][name][k]
                found = root["CellData"][name][start : start + count]
                assert np.array_equal(found, values, equal_nan=True), name


def read_xyz(path):
    """Frames of an extended XYZ file: (what the second line says, columns by name)."""
    lines, frames = path.read_text().splitlines(), []
    while lines:
        count, head, rows = int(lines[0]), lines[1], lines[2 : 2 + int(lines[0])]
        about = {k: v.strip('"') for k, v in re.findall(r'(\w+)=("[^"]*"|\S+)', head)}
        names = about["Properties"].split(":")
        cells, at, columns = [row.split() for row in rows], 0, {}
        for name, kind, width in zip(names[::3], names[1::3], map(int, names[2::3])):
            part = [row[at : at + width] for row in cells]
            at += width
            columns[name] = part if kind == "S" else np.array(part, dtype=float)
        frames.append((about, columns))
        lines = lines[2 + count :]
    return frames


@pytest.mark.parametrize("of", ["bodies", "fragments"])
def test_xyz_holds_places_sizes_velocities_and_fragments(result, tmp_path, of):
    """To the ten digits that are written."""
    result.write_xyz(tmp_path / "run.xyz", of)
    frames = read_xyz(tmp_path / "run.xyz")
    assert len(frames) == len(result.frames)
    for k, (frame, (about, found)) in enumerate(zip(result.frames, frames)):
        fragments = result.fragments(k)
        assert float(about["Time"]) == pytest.approx(frame.time_s)
        alike = {"rel": 1e-9, "abs": 1e-9}
        if of == "bodies":
            numbers = result.fragment_of_body(k)
            wanted = frame.position, frame.velocity, result.model.body_mass, numbers
        else:
            vectors = vectors_of(fragments, "centre"), vectors_of(fragments, "velocity")
            wanted = *vectors, fragments["mass_kg"].to_numpy(), fragments["fragment"].to_numpy()
        for name, values in zip(("pos", "velo", "mass", "fragment"), wanted):
            values = np.reshape(values, (len(values), -1))
            assert found[name] == pytest.approx(values, **alike), name
        volume = 4.0 / 3.0 * np.pi * found["radius"] ** 3
        assert volume.sum() == pytest.approx(fragments["volume_m3"].sum(), rel=1e-8)
        assert np.linalg.norm(found["orientation"], axis=1) == pytest.approx(1.0, rel=1e-8)
