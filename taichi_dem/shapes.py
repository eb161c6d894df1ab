"""Simple solids as meshes of tetrahedra of even size, without a mesh generator.

All lengths in metres; x to the right, y up, z towards the viewer. ``element`` is the length of an
edge; planes are met exactly, and round walls by polygons whose corners lie on them. With a seed as
``scatter`` the mesh has no rows, along which cracks would run::

    from taichi_dem import shapes

    plate = shapes.plate(width=0.2, height=0.1, thickness=0.01, hole=0.03, element=0.01)
    plate.picture("plate.png")
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import EDGE, in_unit
from taichi_dem.kit.validation import (
    FileName,
    direction,
    finite,
    positive,
    shown,
    told_apart,
    whole,
)
from taichi_dem.mesh.gmsh import filled_surface, refuse_too_many
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.shapes import circle, divided, drawn_out

#: Distance from a line within which a point lies on it, in elements.
_ON = 1e-6
#: Largest seed.
_MOST_SEED = 2**31 - 1


def block(size: float | Sequence[float], *, element: float, scatter: int | None = None) -> Mesh:
    """Make a box from the origin to (x, y, z) = ``size``.

    Parameters
    ----------
    size : float or sequence of float
        Lengths along x, y and z [m]; one number for a cube.
    element : float
        Length of an edge [m], at most the smallest of them.
    scatter : int, optional
        Seed of an unstructured mesh, 0 to 2147483647: without rows that cracks would follow.

    Returns
    -------
    Mesh
        Groups left, right (x), bottom, top (y), back, front (z).
    """
    lengths = (size,) * 3 if finite(size) else direction("size", size)
    x, y, z = (positive("size", length) for length in lengths)
    return _box(x, y, z, element, scatter)


def beam(
    *,
    length: float,
    width: float,
    height: float,
    element: float,
    slit: Sequence[float] | None = None,
    scatter: int | None = None,
) -> Mesh:
    """Make a beam along x from the origin.

    Parameters
    ----------
    length : float
        Length along x [m].
    width : float
        Width along z [m].
    height : float
        Height along y [m].
    element : float
        Length of an edge [m], at most the smallest of them.
    slit : sequence of float, optional
        (x, depth, width) of a slit from the bottom up [m], at least half an element wide.
    scatter : int, optional
        Seed of an unstructured mesh, 0 to 2147483647: without rows that cracks would follow.

    Returns
    -------
    Mesh
        Groups left, right (its ends), bottom, top, back, front, and slit where it is.
    """
    given = {"length": length, "height": height, "width": width}
    x, y, z = (positive(name, value) for name, value in given.items())
    return _box(x, y, z, element, scatter, slit=slit)


def cylinder(*, radius: float, height: float, element: float, scatter: int | None = None) -> Mesh:
    """Make a cylinder that stands on the plane y = 0, with the y axis as its axis.

    Parameters
    ----------
    radius : float
        Radius [m].
    height : float
        Height [m].
    element : float
        Length of an edge [m], at most the radius and the height.
    scatter : int, optional
        Seed of an unstructured mesh, 0 to 2147483647: without rows that cracks would follow.

    Returns
    -------
    Mesh
        Groups bottom, top (y), side.

    Notes
    -----
    The side is a prism of n chords: its volume lacks a share of 2 (pi / n)^2 / 3.
    """
    radius, height = positive("radius", radius), positive("height", height)
    element = _element(element, min(radius, height), np.pi * radius**2 * height)
    sides = {"side": _on_circle((0.0, 0.0), 2.0 * radius, element)}
    outline = circle((0.0, 0.0), 2.0 * radius, element)
    solid = drawn_out([outline], height, element, sides, _seed(scatter))
    solid = solid.moved(turned=(-90.0, 0.0, 0.0), about=(0.0, 0.0, 0.0))
    names = {"back": "bottom", "front": "top"}
    return replace(solid, groups={names.get(k, k): faces for k, faces in solid.groups.items()})


def plate(
    *,
    width: float,
    height: float,
    thickness: float,
    element: float,
    hole: float | Sequence[float] | None = None,
    slit: Sequence[float] | None = None,
    scatter: int | None = None,
) -> Mesh:
    """Make a plate from the origin, with a hole or a slit where asked for.

    Parameters
    ----------
    width : float
        Width along x [m].
    height : float
        Height along y [m].
    thickness : float
        Thickness along z [m].
    element : float
        Length of an edge [m], at most the width, the height and the thickness.
    hole : float or sequence of float, optional
        (x, y, diameter) of a round hole through the thickness [m]; a number: one in the middle.
    slit : sequence of float, optional
        (x, depth, width) of a slit from the bottom up [m], at least half an element wide.
    scatter : int, optional
        Seed of an unstructured mesh, 0 to 2147483647: without rows that cracks would follow.

    Returns
    -------
    Mesh
        Groups left, right (x), bottom, top (y), back, front (z), hole and slit where they are.

    Examples
    --------
    >>> drilled = plate(width=0.2, height=0.1, thickness=0.01, hole=0.03, element=0.01)
    >>> "hole" in drilled.groups
    True
    """
    given = {"width": width, "height": height, "thickness": thickness}
    x, y, z = (positive(name, value) for name, value in given.items())
    return _box(x, y, z, element, scatter, hole, slit)


def from_surface(path: FileName, *, element: float, scale: float = 1.0) -> Mesh:
    """Fill a drawn surface with tetrahedra by Gmsh.

    Parameters
    ----------
    path : path
        An STL file, or a STEP file (.step, .stp) of one solid or several.
    element : float
        Length of an edge [m].
    scale : float, default 1.0
        Length of one unit of an STL file, such as 0.001 for mm [m]; STEP files have units.

    Returns
    -------
    Mesh
        A group for each surface: of its name where the STEP file has one, else surface_1,
        surface_2, ...; surfaces of an STL end at edges of more than 40 degrees.

    Raises
    ------
    InputError
        The file is missing, unreadable or not closed, or gmsh is not installed.

    Examples
    --------
    >>> bracket = from_surface("bracket.stl", element=0.005, scale=0.001)  # doctest: +SKIP
    """
    return filled_surface(path, element, scale)


def _box(x, y, z, element, scatter, hole=None, slit=None):
    """A box from the origin, with a hole and a slit through z where asked for."""
    element = _element(element, min(x, y, z), x * y * z)
    outline, sides, loops = _corners(x, y), _box_sides(x, y, element), []
    if hole is not None:
        middle = _checked_hole(hole, x, y, element)
        loops.append(circle(middle[:2], middle[2], element)[::-1])
        sides["hole"] = _on_circle(middle[:2], middle[2], element)
    if slit is not None:
        corners = _checked_slit(slit, x, y, element)
        _check_apart(corners, loops, element)
        outline = [outline[0], *corners, *outline[1:]]
        sides["slit"] = _on_slit(corners, element)
    return drawn_out([divided(outline, element), *loops], z, element, sides, _seed(scatter))


def _element(element, smallest, volume):
    element = positive("element", element)
    if element > smallest * (1.0 + _ON):
        got, most = told_apart(element, smallest)
        raise InputError(
            f"element must be at most the smallest length of the shape, {most} m, got {got}"
        )
    refuse_too_many(element, volume)
    return in_unit("element", element, EDGE)


def _seed(scatter):
    return None if scatter is None else whole("scatter", scatter, 0, _MOST_SEED)


def _corners(x, y):
    return [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)]


def _box_sides(x, y, element):
    near = _ON * element
    return {
        "left": lambda p: p[..., 0] < near,
        "right": lambda p: p[..., 0] > x - near,
        "bottom": lambda p: p[..., 1] < near,
        "top": lambda p: p[..., 1] > y - near,
    }


def _on_circle(middle, diameter, element):
    def on(points):
        away = np.sqrt(((points - np.asarray(middle)) ** 2).sum(axis=-1))
        return np.abs(away - 0.5 * diameter) < _ON * element

    return on


def _checked_hole(hole, x, y, element):
    """Middle and diameter of a hole [m], which leaves an element on all sides."""
    given = (0.5 * x, 0.5 * y, hole) if finite(hole) else hole
    across, up, diameter = direction("hole", given)
    positive("diameter of the hole", diameter)
    room = min(across, up, x - across, y - up) - 0.5 * diameter
    if room < element * (1.0 - _ON) or diameter < element:
        raise InputError(
            f"hole must be (x, y, diameter) with a diameter of an element, {element:g} m, at least "
            f"and as much between it and the edges, got {shown(hole)}"
        )
    return across, up, diameter


def _on_slit(corners, element):
    (left, _), (_, depth), (right, _) = corners[:3]
    near = _ON * element

    def on(points):
        x, y = points[..., 0], points[..., 1]
        on_wall = np.minimum(np.abs(x - left), np.abs(x - right)) < near
        inside = (x > left - near) & (x < right + near) & (y < depth + near)
        return inside & (on_wall | (np.abs(y - depth) < near))

    return on


def _checked_slit(slit, x, y, element):
    """Corners of a slit from the bottom edge, clockwise about its empty inside."""
    middle, depth, width = direction("slit", slit)
    left, right = middle - 0.5 * width, middle + 0.5 * width
    room = min(left, x - right, y - depth, depth) - element
    if not (width >= 0.5 * element * (1.0 - _ON) and room >= -_ON * element):
        raise InputError(
            f"slit must be (x, depth, width), at least an element, {element:g} m, deep, half of "
            f"one wide, and one away from the other edges, got {shown(slit)}"
        )
    return [(left, 0.0), (left, depth), (right, depth), (right, 0.0)]


def _check_apart(corners, loops, element):
    """Raise InputError for a slit that comes nearer than an element to a hole."""
    (left, _), (_, depth), (right, _) = corners[:3]
    for loop in loops:
        aside = np.maximum(np.maximum(left - loop[:, 0], loop[:, 0] - right), 0.0)
        above = np.maximum(loop[:, 1] - depth, 0.0)
        if (aside**2 + above**2).min() < element**2 * (1.0 - _ON):
            raise InputError(f"slit must stay an element, {element:g} m, away from the hole")
