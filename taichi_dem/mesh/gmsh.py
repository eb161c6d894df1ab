"""Meshes made with Gmsh; the only importer of gmsh, which nothing else needs.

``mesh.filled`` fills drawn surfaces by the same session.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import renamed_when_done
from taichi_dem.kit.validation import FileName, finite, path_name, positive, shown, whole

#: Options that could make two runs of the same Gmsh differ, or change the elements.
_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.MaxNumThreads1D": 1,
    "Mesh.MaxNumThreads2D": 1,
    "Mesh.MaxNumThreads3D": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 1,
    "Mesh.Optimize": 1,
    "Mesh.OptimizeNetgen": 1,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.Binary": 0,
}


#: Chords around the hole.
_MOST_SEGMENTS = 10000


def block_with_hole(
    path: FileName,
    *,
    width: float = 2.0,
    height: float = 2.0,
    depth: float = 0.2,
    hole: Sequence[float] = (1.6, 1.0),
    hole_diameter: float = 0.05,
    hole_segments: int = 8,
    size_hole: float = 0.055,
    size_far: float = 0.5,
    distance_far: float = 1.11,
) -> None:
    """Write a block with a round hole through its depth as a Gmsh 4.1 text file.

    The block fills [0, width] x [0, height] x [0, depth] (x right, y up, z to the viewer), the
    hole's axis runs along z through ``hole`` = (x, y); all lengths in m.  The hole is a polygon of
    ``hole_segments`` chords, its wall regular triangles in layers of about ``size_hole``; elements
    grow linearly from there to ``size_far`` at the distance ``distance_far``.
    Physical groups: volume block; faces hole, left, right, bottom, top, back, front.
    The same Gmsh writes the same file every time.

    path ends in .msh.  Raises InputError for a shape that cannot be, a path that cannot be
    written, and when gmsh is not installed or fails.
    Source of the defaults: Konno et al., section 4.1 and Fig 10.
    """
    path = path_name("path", path)
    if not path.endswith(".msh"):
        raise InputError(f"the name of the mesh file must end in .msh, got {path}")
    sizes = {"width": width, "height": height, "depth": depth, "hole_diameter": hole_diameter}
    grading = {"size_hole": size_hole, "size_far": size_far, "distance_far": distance_far}
    box = [positive(name, value) for name, value in sizes.items()]
    near, far, distance = (positive(name, value) for name, value in grading.items())
    centre = _checked_hole(hole, *box)
    chords, rest = divmod(whole("hole_segments", hole_segments, 4, _MOST_SEGMENTS), 4)
    if rest:
        raise InputError(f"hole_segments must be 4, 8, 12, ..., got {hole_segments}")
    with session("block_with_hole") as gmsh:
        walls = _add_geometry(gmsh.model, centre, *box)
        _divide_walls(gmsh.model, walls, chords, max(1, round(box[2] / near)))
        _add_sizes(gmsh.model.mesh.field, centre, 0.5 * box[3], near, far, distance)
        gmsh.model.mesh.generate(3)
        with renamed_when_done(path) as temporary:
            gmsh.write(temporary)


def _checked_hole(hole, width, height, depth, diameter):
    """Place of the hole's axis, which leaves a wall on all four sides."""
    margin = 0.5 * diameter
    right, top = width - margin, height - margin
    two = isinstance(hole, (tuple, list)) and len(hole) == 2 and all(map(finite, hole))
    if not (two and margin < hole[0] < right and margin < hole[1] < top):
        raise InputError(
            f"hole must be (x, y) with x in ({margin:g}, {right:g}) m and "
            f"y in ({margin:g}, {top:g}) m, got {shown(hole)}"
        )
    # Gmsh ends the process on a number that it cannot read, such as np.float64(0.5).
    return float(hole[0]), float(hole[1])


@contextlib.contextmanager
def session(name: str) -> Iterator[Any]:
    """A Gmsh model of our own, removed afterwards; a session of the caller stays open."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise InputError(
            f"making this mesh needs gmsh ({error}): pip install gmsh, or run make mesh"
        ) from None
    owned = not gmsh.isInitialized()
    if owned:
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    gmsh.model.add(name)
    try:
        for name, value in _OPTIONS.items():
            gmsh.option.setNumber(name, value)
        yield gmsh
    except InputError:
        raise
    except Exception as error:  # gmsh knows no other class
        raise InputError(f"gmsh failed: {error}") from None
    finally:
        gmsh.model.remove()
        if owned:
            gmsh.finalize()


def _add_geometry(model, hole, width, height, depth, diameter):
    """Front view with its hole, drawn at z = 0 and drawn out along z; groups. The hole's walls."""
    geo, (x, y), r = model.geo, hole, 0.5 * diameter
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    quarters = [(x + r, y), (x, y + r), (x - r, y), (x, y - r)]
    corners = [geo.addPoint(*place, 0.0) for place in corners]
    middle = geo.addPoint(x, y, 0.0)
    ends = [geo.addPoint(*place, 0.0) for place in quarters]
    # Anticlockwise from the lower left corner: bottom, right, top, left.
    outline = [geo.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4)]
    circle = [geo.addCircleArc(ends[k], middle, ends[(k + 1) % 4]) for k in range(4)]
    back = geo.addPlaneSurface([geo.addCurveLoop(outline), geo.addCurveLoop(circle)])
    front, volume, *sides = [tag for _, tag in geo.extrude([(2, back)], 0.0, 0.0, depth)]
    geo.synchronize()
    faces = dict(zip(("bottom", "right", "top", "left"), ([tag] for tag in sides[:4])))
    faces.update(hole=sides[4:], back=[back], front=[front])
    model.addPhysicalGroup(3, [volume], name="block")
    for name, tags in faces.items():
        model.addPhysicalGroup(2, tags, name=name)
    return sides[4:]


def _divide_walls(model, walls, chords, layers):
    """Regular triangles on the hole's walls: chords of each around it, layers along it."""
    for wall in walls:
        for _, curve in model.getBoundary([(2, wall)], combined=False):
            arc = model.getType(1, abs(curve)) == "Circle"
            model.mesh.setTransfiniteCurve(abs(curve), (chords if arc else layers) + 1)
        # Alternating diagonals: all of one hand would give the block a twist.
        model.mesh.setTransfiniteSurface(wall, "AlternateRight")


def _add_sizes(field, hole, radius, near, far, distance):
    """Element size: linear in the distance from the hole's wall."""
    (x, y), growth = hole, (far - near) / distance
    away = f"Max(Sqrt((x-{x!r})^2+(y-{y!r})^2)-{radius!r}, 0)"
    low, high = sorted((near, far))
    tag = field.add("MathEval")
    field.setString(tag, "F", f"Min(Max({near!r}+{growth!r}*{away}, {low!r}), {high!r})")
    field.setAsBackgroundMesh(tag)
