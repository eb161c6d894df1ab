"""Meshes made with Gmsh; the only importer of gmsh, which nothing else needs.

``mesh.filled`` fills drawn surfaces by the same session.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import renamed_when_done
from taichi_dem.kit.validation import FileName, finite, path_name, plain_fields, positive, shown

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


@dataclass(frozen=True)
class _Block:
    """Shape and element sizes of a block with a hole [m]; checked."""

    width: float
    height: float
    depth: float
    hole: tuple
    hole_diameter: float
    hole_segments: int
    size_hole: float
    size_far: float
    distance_far: float

    def __post_init__(self):
        plain_fields(self)
        sizes = ("size_hole", "size_far", "distance_far")
        for name in ("width", "height", "depth", "hole_diameter", *sizes):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        segments = self.hole_segments
        if type(segments) is not int or not 4 <= segments <= _MOST_SEGMENTS or segments % 4:
            raise InputError(
                f"hole_segments must be 4, 8, 12, ... up to {_MOST_SEGMENTS} (four equal arcs), "
                f"got {shown(segments)}"
            )
        self._check_hole()

    def _check_hole(self):
        """Raise InputError unless the hole's axis leaves a wall on all four sides."""
        margin = 0.5 * self.hole_diameter
        right, top = self.width - margin, self.height - margin
        two = isinstance(self.hole, (tuple, list)) and len(self.hole) == 2
        numeric = two and all(finite(c) for c in self.hole)
        if not (numeric and margin < self.hole[0] < right and margin < self.hole[1] < top):
            raise InputError(
                f"hole must be (x, y) with x in ({margin:g}, {right:g}) m and "
                f"y in ({margin:g}, {top:g}) m, got {shown(self.hole)}"
            )
        # Gmsh ends the process on a number that it cannot read, such as np.float64(0.5).
        object.__setattr__(self, "hole", tuple(float(c) for c in self.hole))


def block_with_hole(
    path: FileName,
    *,
    width: float = 2.0,
    height: float = 2.0,
    depth: float = 0.2,
    hole: tuple[float, float] = (1.6, 1.0),
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
    block = _Block(
        width,
        height,
        depth,
        hole,
        hole_diameter,
        hole_segments,
        size_hole,
        size_far,
        distance_far,
    )
    with session("block_with_hole") as gmsh:
        _add_geometry(gmsh.model, block)
        _add_sizes(gmsh.model.mesh.field, block)
        gmsh.model.mesh.generate(3)
        with renamed_when_done(path) as temporary:
            gmsh.write(temporary)


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


def _add_geometry(model, block):
    """Front view with its hole, drawn at z = 0 and drawn out along z; physical groups."""
    geo = model.geo
    outline = _outline(geo, block)
    circle = _circle(geo, block)
    back = geo.addPlaneSurface([geo.addCurveLoop(outline), geo.addCurveLoop(circle)])
    drawn = geo.extrude([(2, back)], 0.0, 0.0, block.depth)
    front, volume, *sides = [tag for _, tag in drawn]
    geo.synchronize()
    _divide_walls(model, sides[4:], block)
    faces = dict(zip(("bottom", "right", "top", "left"), ([tag] for tag in sides[:4])))
    faces.update(hole=sides[4:], back=[back], front=[front])
    model.addPhysicalGroup(3, [volume], name="block")
    for name, tags in faces.items():
        model.addPhysicalGroup(2, tags, name=name)


def _outline(geo, block):
    """Four lines anticlockwise, from the lower left corner: bottom, right, top, left."""
    w, h = block.width, block.height
    corners = [geo.addPoint(x, y, 0.0) for x, y in ((0, 0), (w, 0), (w, h), (0, h))]
    return [geo.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4)]


def _circle(geo, block):
    """Four quarter arcs."""
    x, y = block.hole
    r = 0.5 * block.hole_diameter
    centre = geo.addPoint(x, y, 0.0)
    ends = [geo.addPoint(x + a * r, y + b * r, 0.0) for a, b in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    return [geo.addCircleArc(ends[k], centre, ends[(k + 1) % 4]) for k in range(4)]


def _divide_walls(model, walls, block):
    """Regular triangles on the hole's walls: chords around it, layers of size_hole along it."""
    chords = block.hole_segments // 4
    layers = max(1, round(block.depth / block.size_hole))
    for wall in walls:
        for _, curve in model.getBoundary([(2, wall)], combined=False):
            arc = model.getType(1, abs(curve)) == "Circle"
            model.mesh.setTransfiniteCurve(abs(curve), (chords if arc else layers) + 1)
        # Alternating diagonals: all of one hand would give the block a twist.
        model.mesh.setTransfiniteSurface(wall, "AlternateRight")


def _add_sizes(field, block):
    """Element size: linear in the distance from the hole's wall."""
    x, y = block.hole
    radius = 0.5 * block.hole_diameter
    growth = (block.size_far - block.size_hole) / block.distance_far
    distance = f"Max(Sqrt((x-{x!r})^2+(y-{y!r})^2)-{radius!r}, 0)"
    low, high = sorted((block.size_hole, block.size_far))
    size = f"Min(Max({block.size_hole!r}+{growth!r}*{distance}, {low!r}), {high!r})"
    tag = field.add("MathEval")
    field.setString(tag, "F", size)
    field.setAsBackgroundMesh(tag)
