"""Bodies or fragments over time as particles, in extended XYZ for OVITO."""

from typing import Any

import numpy as np

from taichi_dem.kit.extended_xyz import XyzFrame, write_extended_xyz
from taichi_dem.kit.validation import FileName, choice
from taichi_dem.mesh.tetrahedra import signed_volumes
from taichi_dem.output.fragments import (
    fragment_of_body,
    fragments_of,
    quaternions_of,
    rigid_motion,
    vectors_of,
)


def write_particles(path: FileName, result: Any, of: str) -> None:
    """Write the frames of a ``Result`` as an extended XYZ file.

    Parameters
    ----------
    path : str or path
        Name of the file, such as ``"run.xyz"``.
    result : Result
        With a frame at least.
    of : {"bodies", "fragments"}
        What a particle is. Fragments are those of each frame, so that their number grows.

    Raises
    ------
    InputError
        For another word, or where the file cannot be written.

    Notes
    -----
    Columns: pos [m], radius of the sphere of the same volume [m], velo [m/s], orientation (unit
    quaternion x, y, z, w, from the shape at rest), mass [kg], fragment (by falling mass).
    """
    kinds = {"bodies": _bodies, "fragments": _fragments}
    particles_of = kinds[choice("of", of, kinds)]
    tables = [_table(*particles_of(result, frame)) for frame in result.frames]
    margin = max(table["radius"].max() for table in tables)
    low = np.min([table["pos"].min(axis=0) for table in tables], axis=0) - margin
    high = np.max([table["pos"].max(axis=0) for table in tables], axis=0) + margin
    shots = [XyzFrame(f.time_s, table, low, high - low) for f, table in zip(result.frames, tables)]
    write_extended_xyz(path, shots)


def _table(place, radius, velocity, rotation, mass, fragment):
    """Columns of the particles in a frame, by name."""
    turns = {"orientation": quaternions_of(rotation), "mass": mass, "fragment": fragment}
    return {"pos": place, "radius": radius, "velo": velocity, **turns}


def _bodies(result, frame):
    model = result.model
    volume = signed_volumes(model.mesh.points, model.mesh.tetrahedra)
    of_body = fragment_of_body(model, result.broken_time <= frame.time_s)
    radius = np.cbrt(0.75 * volume / np.pi)
    return frame.position, radius, frame.velocity, frame.rotation, model.body_mass, of_body


def _fragments(result, frame):
    of_body = fragment_of_body(result.model, result.broken_time <= frame.time_s)
    found = fragments_of(result.model, frame, of_body)
    centre, rotation = rigid_motion(result.model, frame, of_body)
    radius, velocity = 0.5 * found["diameter_m"], vectors_of(found, "velocity")
    return centre, radius, velocity, rotation, found["mass_kg"], found["fragment"]
