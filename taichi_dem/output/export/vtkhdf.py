"""A series of frames in one VTKHDF file, which ParaView (5.12 or later) and pyvista open."""

import io
from typing import Any

import numpy as np

from taichi_dem.kit.files import write_bytes
from taichi_dem.kit.validation import FileName
from taichi_dem.output.record import body_corners, cell_data, corners_of_bodies

_TETRAHEDRON = 10
#: The format's version that brought series, the lowest that has all that is used here.
_VERSION = (2, 0)
#: Rows of a compressed piece of a column.
_CHUNK = 65536


def write_vtkhdf(path: FileName, result: Any) -> None:
    """Write the frames of a ``Result`` as one VTKHDF file: moving points, cell data of the series.

    Parameters
    ----------
    path : str or path
        Name of the file, such as ``"run.vtkhdf"``.
    result : Result
        With a frame at least.

    Raises
    ------
    InputError
        Where h5py is not installed, or the file cannot be written.

    Notes
    -----
    Format: VTK File Formats, section VTKHDF, unstructured grid over time, version 2.0.
    """
    import h5py

    model, frames = result.model, result.frames
    # In memory: HDF5 on a full disk fails when it closes the file, and then again at the end.
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = _VERSION
        kind = h5py.string_dtype("ascii", len("UnstructuredGrid"))
        root.attrs.create("Type", b"UnstructuredGrid", dtype=kind)
        _write_cells(root, model)
        points = [body_corners(model, frame).reshape(-1, 3) for frame in frames]
        _column(root, "Points", points)
        columns = [cell_data(model, frame, result.acting_since) for frame in frames]
        for name in columns[0]:
            _column(root, f"CellData/{name}", [column[name] for column in columns])
        _write_steps(root, [frame.time_s for frame in frames], model.body_count, list(columns[0]))
    write_bytes(path, content.getvalue())


def _write_cells(root, model):
    """Bodies as cells, each with four points of its own, the same in all frames."""
    cells = corners_of_bodies(model)
    count = len(cells)
    root["Connectivity"] = cells.astype(np.int64).ravel()
    root["Offsets"] = 4 * np.arange(count + 1, dtype=np.int64)
    root["Types"] = np.full(count, _TETRAHEDRON, np.uint8)
    for name, number in (("Points", cells.size), ("Cells", count), ("ConnectivityIds", cells.size)):
        root[f"NumberOf{name}"] = np.array([number], dtype=np.int64)


def _write_steps(root, times_s, count, names):
    """Where the data of each frame begin; the cells are those of the first for all."""
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = len(times_s)
    steps["Values"] = np.array(times_s)
    every, none = np.arange(len(times_s)), np.zeros(len(times_s), dtype=np.int64)
    steps["NumberOfParts"] = none + 1
    steps["PartOffsets"], steps["PointOffsets"] = none, 4 * count * every
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = none[:, None]
    for name in names:
        steps[f"CellDataOffsets/{name}"] = count * every


def _column(root, name, parts):
    """Write the values of all frames, one after the other."""
    values = np.concatenate(parts)
    packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    chunk = (min(len(values), _CHUNK), *values.shape[1:])
    root.create_dataset(name, data=values, chunks=chunk, **packed)
