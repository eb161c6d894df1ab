"""Files for other programs, read back: VTKHDF, extended XYZ, glTF."""

import dataclasses
import json
import re
import struct
import sys

import h5py
import meshio
import numpy as np
import pytest

from taichi_dem import InputError, write_paraview
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
from taichi_dem.mesh.topology import skin
from taichi_dem.output.body_values import COLOURS, body_values, shares_of_scale
from taichi_dem.output.record import body_corners
from tests.made_result import made_result, moved_rigidly

WRITERS = {
    "vtkhdf": lambda result, path: result.write_vtkhdf(path),
    "xyz": lambda result, path: result.write_xyz(path),
    "glb": lambda result, path: result.write_gltf(path),
}


@pytest.fixture(scope="module")
def result():
    made = made_result()
    since = np.where(np.arange(made.model.body_count) % 2, 1.5e-5, np.nan)
    return dataclasses.replace(made, acting_since={"softening": since})


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("frames", [1, 4])
def test_a_file_is_there_whole_and_alone(result, tmp_path, name, frames):
    some = dataclasses.replace(result, frames=result.frames[:frames])
    for _ in range(2):
        WRITERS[name](some, tmp_path / f"run.{name}")
    assert [path.name for path in tmp_path.iterdir()] == [f"run.{name}"]


@pytest.mark.parametrize("name", WRITERS)
def test_what_cannot_be_written_is_said_in_a_sentence(result, tmp_path, name):
    with pytest.raises(InputError, match="there is no folder"):
        WRITERS[name](result, tmp_path / "nowhere" / f"run.{name}")
    (tmp_path / "taken").mkdir()
    with pytest.raises(InputError, match=r"cannot write .*taken"):
        WRITERS[name](result, tmp_path / "taken")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]
    with pytest.raises(InputError, match="a result must have frames for this"):
        WRITERS[name](dataclasses.replace(result, frames=()), tmp_path / f"run.{name}")


def test_vtkhdf_holds_what_the_pvd_series_holds(result, tmp_path):
    result.write_vtkhdf(tmp_path / "run.vtkhdf")
    write_paraview(tmp_path, result.model, result.frames, "run", result.acting_since)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        root, count = file["VTKHDF"], result.model.body_count
        assert root.attrs["Type"] == b"UnstructuredGrid" and tuple(root.attrs["Version"]) == (2, 0)
        steps = root["Steps"]
        assert steps.attrs["NSteps"] == len(result.frames)
        assert steps["Values"][:].tolist() == [frame.time_s for frame in result.frames]
        cells = root["Connectivity"][:].reshape(-1, 4)
        assert root["Offsets"][:].tolist() == list(range(0, 4 * count + 1, 4))
        assert set(root["Types"][:]) == {10} and root["NumberOfCells"][:].tolist() == [count]
        assert set(steps["CellDataOffsets"]) == set(root["CellData"])
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


def test_without_h5py_it_is_named(result, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match="h5py must be installed for this: pip install h5py"):
        result.write_vtkhdf(tmp_path / "run.vtkhdf")
    assert not list(tmp_path.iterdir())


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
        assert len(rows) == count and all(len(row) == at for row in cells)
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
        assert about["pbc"] == "F F F" and float(about["Time"]) == pytest.approx(frame.time_s)
        alike = {"rel": 1e-9, "abs": 1e-9}
        if of == "bodies":
            wanted = frame.position, frame.velocity, result.model.body_mass, fragments.of_body
        else:
            vectors = fragments.vectors("centre"), fragments.vectors("velocity")
            wanted = *vectors, fragments["mass_kg"], fragments["fragment"]
        for name, values in zip(("pos", "velo", "mass", "fragment"), wanted):
            values = np.reshape(values, (len(values), -1))
            assert found[name] == pytest.approx(values, **alike), name
        volume = 4.0 / 3.0 * np.pi * found["radius"] ** 3
        assert volume.sum() == pytest.approx(fragments["volume_m3"].sum(), rel=1e-8)
        assert np.linalg.norm(found["orientation"], axis=1) == pytest.approx(1.0, rel=1e-8)
        low = np.array(about["Origin"].split(), dtype=float)
        size = np.array(about["Lattice"].split(), dtype=float).reshape(3, 3)
        assert (found["pos"] >= low).all() and (found["pos"] <= low + np.diag(size)).all()
        assert np.count_nonzero(size) == 3


def test_particles_of_an_unknown_kind_are_refused(result, tmp_path):
    with pytest.raises(InputError, match="of must be one of bodies, fragments, got 'grains'"):
        result.write_xyz(tmp_path / "run.xyz", "grains")


class Glb:
    """A binary glTF file, its parts checked while it is read."""

    kinds = {5126: "<f4", 5121: "u1"}  # noqa: RUF012
    widths = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}  # noqa: RUF012

    def __init__(self, path):
        data = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.scene = json.loads(data[20 : 20 + size])
        rest, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0" and 28 + size + rest == len(data) and rest % 4 == 0
        self.bytes = data[28 + size :]
        assert len(self.bytes) - 4 < self.scene["buffers"][0]["byteLength"] <= len(self.bytes)
        self.arrays = [self._array(one) for one in self.scene["accessors"]]

    def _array(self, accessor):
        view = self.scene["bufferViews"][accessor["bufferView"]]
        kind, width = self.kinds[accessor["componentType"]], self.widths[accessor["type"]]
        start, length = view["byteOffset"], view["byteLength"]
        assert start % 4 == 0 and length == accessor["count"] * width * np.dtype(kind).itemsize
        array = np.frombuffer(self.bytes[start : start + length], kind).reshape(-1, width)
        if "min" in accessor:
            assert array.min(axis=0).tolist() == accessor["min"]
            assert array.max(axis=0).tolist() == accessor["max"]
        return array

    def pieces(self):
        """Arrays of the meshes by attribute."""
        for node in self.scene["nodes"]:
            (one,) = self.scene["meshes"][node["mesh"]]["primitives"]
            yield {name: self.arrays[k] for name, k in one["attributes"].items()}

    def motion(self, path):
        """Times and values (frames, nodes, ...) of the animation of a path."""
        (made,) = self.scene["animations"]
        mine = [c for c in made["channels"] if c["target"]["path"] == path]
        assert [c["target"]["node"] for c in mine] == list(range(len(self.scene["nodes"])))
        samplers = [made["samplers"][c["sampler"]] for c in mine]
        values = np.stack([self.arrays[one["output"]] for one in samplers], axis=1)
        return self.arrays[samplers[0]["input"]][:, 0], values


def rotated(quaternion, points):
    """Points (n, 3) turned by a unit quaternion x, y, z, w."""
    axis, scalar = quaternion[:3], quaternion[3]
    return points + 2.0 * np.cross(axis, np.cross(axis, points) + scalar * points)


def test_gltf_shows_rigid_pieces_where_they_are(tmp_path):
    """Outer and broken faces of fragments that move rigidly, to the rounding of its numbers."""
    made = made_result()
    of_body = made.fragments().of_body
    made, *_ = moved_rigidly(made, of_body, np.random.default_rng(5))
    made.write_gltf(tmp_path / "run.glb", seconds=6.0)
    file = Glb(tmp_path / "run.glb")
    times, places = file.motion("translation")
    same, turns = file.motion("rotation")
    assert np.array_equal(times, same) and times[0] == 0.0 and times[-1] == pytest.approx(6.0)
    assert (np.diff(times) > 0.0).all() and len(times) == len(made.frames)
    assert np.linalg.norm(turns, axis=2) == pytest.approx(1.0, rel=1e-6)
    assert ((turns[1:] * turns[:-1]).sum(axis=2) >= 0.0).all()
    body, face, _ = skin(made.model.topology, np.isfinite(made.broken_time))
    corners = body_corners(made.model, made.frames[-1])[body[:, None], LOCAL_FACES[face]]
    for number, piece in enumerate(file.pieces()):
        points = rotated(turns[-1, number], piece["POSITION"]) + places[-1, number]
        wanted = corners[of_body[body] == number].reshape(-1, 3)
        assert points == pytest.approx(wanted, abs=1e-6)
        normal = np.cross(*(piece["POSITION"][k::3] - piece["POSITION"][::3] for k in (1, 2)))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        assert piece["NORMAL"][::3] == pytest.approx(normal, abs=1e-3)
        assert piece["COLOR_0"].shape == (len(points), 4) and (piece["COLOR_0"][:, 3] == 255).all()
    node = file.scene["nodes"][0]
    assert node["translation"] == pytest.approx(places[0, 0].tolist(), abs=1e-6)
    assert node["rotation"] == pytest.approx(turns[0, 0].tolist(), abs=1e-6)


def test_gltf_of_one_frame_stands_still(result, tmp_path):
    still = dataclasses.replace(result, frames=result.frames[:1])
    still.write_gltf(tmp_path / "run.glb")
    file = Glb(tmp_path / "run.glb")
    assert "animations" not in file.scene and len(file.scene["nodes"]) == 1


@pytest.mark.parametrize("colour", COLOURS)
def test_colours_are_shares_of_a_scale(result, colour):
    values = body_values(result.bodies(), colour)
    shares = shares_of_scale(result.bodies(), colour)
    assert values.shape == shares.shape == (result.model.body_count,)
    assert shares.min() >= 0.0 and shares.max() <= 1.0
    if colour != "fragment":
        assert (np.diff(shares[np.argsort(values)]) >= 0.0).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"colour": "red"}, "colour must be one of speed, peak_speed"),
        ({"seconds": 0.0}, "seconds must be a positive"),
        ({"seconds": "long"}, "seconds must be a positive"),
    ],
)
def test_a_scene_that_makes_no_sense_is_refused(result, tmp_path, options, words):
    with pytest.raises(InputError, match=words):
        result.write_gltf(tmp_path / "run.glb", **options)
    assert not list(tmp_path.iterdir())
