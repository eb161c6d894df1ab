"""Parts of all pictures of a block: a view along an axis, its faces from back to front."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.text import OffsetFrom

from taichi_dem.kit.display import counted
from taichi_dem.kit.plot_style import area_key, png_of, styled
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
from taichi_dem.mesh.topology import Topology, skin
from taichi_dem.output.fracture import picture_axes
from taichi_dem.output.record import Frame, body_corners
from taichi_dem.state.model import Model

#: Faces that lean away from the viewer by less than this sine count as seen edge on.
_EDGE_ON = 1e-6
STONE, JOINT = "#E4E0D6", "#C9C3B5"
#: A view along the z axis.
ALONG_Z = (0.0, 0.0, 1.0)
#: Colours of groups, one after the other; those of colour-blind eyes first.
_COLOURS = (
    *("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#882255", "#999933"),
    *("#6A51A3", "#8C6D31", "#222222", "#F0E442"),
)
_NONE = "#DDDDDD"
#: Directions to the viewer, of both views.
_AXES = (0.55, 0.5, 1.0), (-0.55, -0.5, -1.0)
#: Share of the light on a face that is seen edge on.
_DARKEST, _SQUARE = 0.7, 2.0**0.5
#: Centre of the arrows of x, y and z, from the upper right corner, and their length [points].
_TRIAD, _ARROW = (-30.0, 24.0), 18.0
#: Most lines of the legend.
_MOST = 24
#: Strokes over the faces of groups that are held, one after the other, and their colour.
_STROKES = ("////", r"\\\\", "----", "||||", "++++", "xxxx")
_STROKE = "#000000"


class View:
    """Projection along an axis; right, up, toward (3,): unit vectors of the picture."""

    def __init__(self, axis: Sequence[float] = (0.0, 0.0, 1.0)):
        along = np.asarray(axis, dtype=float)
        main = int(np.abs(along).argmax())
        self.toward = along / np.linalg.norm(along) * np.sign(along[main])
        self.right, self.up = picture_axes(self.toward)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Picture coordinates [m] of points (..., 3), shape (..., 2)."""
        return points @ np.column_stack([self.right, self.up])

    def labels(self) -> Any:
        """Labels of the two picture axes: a coordinate's name where the axis is one."""
        return tuple(self._label(vector) for vector in (self.right, self.up))

    def _label(self, vector):
        axis = int(np.abs(vector).argmax())
        along = abs(vector[axis]) > 1.0 - 1e-6
        return f"{'xyz'[axis]} [m]" if along else "in the picture [m]"

    def facing(self, triangles: np.ndarray) -> np.ndarray:
        """Indices of triangles (n, 3, 3) whose normal points to the viewer, the farthest first."""
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        seen = np.flatnonzero(normal @ self.toward > _EDGE_ON * np.linalg.norm(normal, axis=1))
        depth = triangles[seen].mean(axis=1) @ self.toward
        return seen[np.argsort(depth, kind="stable")]


def surface(topology: Topology, view: View, corners: np.ndarray, broken: object) -> Any:
    """Visible polygons (n, 3, 2) [m] from back to front, their bodies, which are crack faces."""
    body, face, crack = skin(topology, broken)
    triangles = corners[body[:, None], LOCAL_FACES[face]]
    seen = view.facing(triangles)
    return view.project(triangles[seen]), body[seen], crack[seen]


def traces(mesh: Mesh, topology: Topology, view: View, broken_time: np.ndarray) -> Any:
    """Where broken faces reach the outer faces that the viewer sees of the block at rest."""
    body, face, _ = skin(topology, np.zeros(topology.bond_count, dtype=bool))
    seen = view.facing(mesh.points[mesh.tetrahedra[body[:, None], LOCAL_FACES[face]]])
    body = np.repeat(body[seen], 3)
    ends = _edges(LOCAL_FACES[face[seen]])
    points = np.take_along_axis(mesh.tetrahedra[body], ends, axis=1)
    first = first_breaks(mesh, topology, broken_time, points)
    hit = ~np.isnan(first)
    return body[hit], ends[hit], first[hit]


def first_breaks(
    mesh: Mesh, topology: Topology, broken_time: np.ndarray, edges: np.ndarray
) -> np.ndarray:
    """First break [s] of a face that ends at each edge of points (n, 2); (n,), or NaN."""
    broken = ~np.isnan(broken_time)
    cracked = _edge_keys(_edges(topology.vertices[broken]), mesh.point_count)
    times = np.repeat(broken_time[broken], 3)
    order = np.lexsort((times, cracked))
    keys, first = np.unique(cracked[order], return_index=True)
    wanted, break_times = _edge_keys(edges, mesh.point_count), np.full(len(edges), np.nan)
    hit = np.isin(wanted, keys)
    break_times[hit] = times[order[first[np.searchsorted(keys, wanted[hit])]]]
    return break_times


def _edges(triangles):
    return triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def _edge_keys(edges, point_count):
    """One number for every edge (n, 2), whichever way round it is given."""
    return edges.min(axis=1).astype(np.int64) * point_count + edges.max(axis=1)


def shades(name: str, low: float, high: float, count: int = 256) -> ListedColormap:
    """A part of a map of colours of matplotlib; low, high: shares of it."""
    return ListedColormap(matplotlib.colormaps[name](np.linspace(low, high, count)))


def displaced(model: Model, frame: Frame, magnify: float) -> np.ndarray:
    """Corners of all bodies (body_count, 4, 3) [m], their displacement magnified."""
    rest = model.mesh.points[model.mesh.tetrahedra]
    return rest + magnify * (body_corners(model, frame) - rest)


def frame_block(axes: Any, view: View, model: Model, margin: float = 0.05) -> None:
    """Limits, equal scales and labels of a view of the whole block; margin: share of its size."""
    flat = view.project(model.mesh.points)
    low, high = flat.min(axis=0), flat.max(axis=0)
    pad = margin * (high - low).max()
    axes.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad))
    axes.set_aspect("equal")
    axes.locator_params(nbins=5)
    axes.grid(False)


def draw_stone(axes: Any, view: View, model: Model) -> None:
    """Draw the outer faces of the block at rest, all in one colour."""
    rest = model.mesh.points[model.mesh.tetrahedra]
    polygons, _, _ = surface(model.topology, view, rest, np.zeros(model.bond_count, dtype=bool))
    axes.add_collection(PolyCollection(polygons, facecolor=STONE, edgecolor=JOINT, linewidth=0.4))


def draw_lines(axes: Any, segments: np.ndarray, values: np.ndarray, **look: Any) -> Any:
    """Draw lines (n, points, 2) coloured by a value each; look: of the ``LineCollection``."""
    # Not up to light yellow, which vanishes on the colour of stone.
    lines = LineCollection(segments, **{"cmap": shades("plasma", 0.0, 0.88), **look})
    lines.set_array(values)
    lines.set_capstyle("round")
    axes.add_collection(lines)
    return lines


def draw_bodies(
    axes: Any,
    model: Model,
    frame: Frame | None,
    values: np.ndarray,
    *,
    magnify: float = 1.0,
    broken: Any = None,
    axis: Sequence[float] = ALONG_Z,
    **look: Any,
) -> Any:
    """Draw the bodies where they are, coloured by a value each; returns the collection."""
    drawn = PolyCollection([], **{"linewidth": 0.3, "edgecolor": "#00000060", **look})
    move_bodies(drawn, model, frame, values, magnify=magnify, broken=broken, axis=axis)
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.grid(False)
    return drawn


def move_bodies(
    drawn: Any,
    model: Model,
    frame: Frame | None,
    values: np.ndarray,
    *,
    magnify: float = 1.0,
    broken: Any = None,
    axis: Sequence[float] = ALONG_Z,
) -> None:
    """Change what ``draw_bodies`` has drawn to another frame: arguments as there."""
    corners = model.mesh.points[model.mesh.tetrahedra]
    if frame is not None:
        corners = displaced(model, frame, magnify)
    whole = np.zeros(model.bond_count, dtype=bool)
    seen = whole if broken is None else broken
    polygons, body, _ = surface(model.topology, View(axis), corners, seen)
    drawn.set_verts(polygons)
    drawn.set_array(values[body])


def picture_of_groups(
    mesh: Mesh, acting: Mapping[str, Sequence[str]], held: Sequence[str] = ()
) -> bytes:
    """The outer faces of a mesh as PNG, from the front and from behind, coloured by group."""
    faces = geometry.all_faces(mesh.tetrahedra)
    rows = geometry.outer_rows(faces)
    outer = faces[rows]
    masks = _masks(mesh, outer, rows // 4)
    names, member = _coloured(masks, acting)
    strokes = dict(zip((name for name in names if name in held), cycle(_STROKES)))
    with styled(1, 2, size=(9.6, 4.8), sharey=True) as (figure, panels):
        for axes, axis, title in zip(panels, _AXES, ("from the front", "from behind and below")):
            view = ObliqueView(axis)
            _draw(axes, mesh, outer, member, view)
            for name, hatch in strokes.items():
                _draw_strokes(axes, mesh.points[outer[masks[name]]], view, hatch)
            _draw_axes(axes, view)
            axes.set_title(title, fontsize=9)
        panels[0].set_ylabel("in the picture [m]")
        keys = _keys(masks, names, member, acting, strokes)
        figure.legend(handles=keys, loc="outside lower center", ncols=3, fontsize=8)
        return png_of(figure)


def _keys(masks, names, member, acting, strokes):
    keys = [
        area_key(
            _label(name, masks[name].sum(), acting),
            facecolor=_COLOURS[k % len(_COLOURS)],
            **({"hatch": strokes[name], "edgecolor": _STROKE} if name in strokes else {}),
        )
        for k, name in enumerate(names[:_MOST])
    ]
    inside = (", ".join([f"{name}: inside", *acting[name]]) for name in acting if name not in masks)
    keys += [area_key(words, facecolor="white") for words in inside]
    if len(names) > _MOST:
        keys.append(area_key(f"and {len(names) - _MOST} more groups", facecolor="white"))
    if (member < 0).any():
        keys.append(area_key(_label("no group", (member < 0).sum(), {}), facecolor=_NONE))
    return keys


def _masks(mesh, outer, bodies):
    """Whether each outer face is in each group of faces, or of bodies where there are none."""
    names = [name for name in mesh.groups if name not in mesh.inner_groups]
    if not names:
        return {name: np.isin(bodies, rows) for name, rows in mesh.body_groups.items()}
    number, *members = geometry.numbers_in(outer, *(mesh.groups[name] for name in names))
    return {name: np.isin(number, found) for name, found in zip(names, members)}


def _coloured(masks, acting):
    """Names of the groups for the legend, and the place of that of each outer face, -1 for none."""
    # Groups that something acts on come first, so that the legend has all of them.
    order = sorted(masks, key=lambda name: (name in acting, -masks[name].sum()))
    last = np.full(len(next(iter(masks.values()), ())), -1)
    for k, name in enumerate(order):
        last[masks[name]] = k
    shown = [name for name in masks if name in acting or order.index(name) in last]
    names = sorted(shown, key=lambda name: name not in acting)
    places = np.array([*(names.index(name) if name in names else -1 for name in order), -1])
    return names, places[last]


class ObliqueView(View):
    """A view along any axis, y up in the picture. axis: from the mesh to the viewer."""

    def __init__(self, axis: Sequence[float]):
        self.toward = np.array(axis) / np.linalg.norm(axis)
        right = np.cross([0.0, 1.0, 0.0], self.toward)
        self.right = right / np.linalg.norm(right)
        self.up = np.cross(self.toward, self.right)


def _draw(axes, mesh, outer, member, view):
    triangles = mesh.points[outer]
    seen = view.facing(triangles)
    palette = np.array([to_rgb(colour) for colour in (*_COLOURS, _NONE)])
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    light = normal @ (view.toward + view.up) / np.linalg.norm(normal, axis=1)
    shade = _DARKEST + (1.0 - _DARKEST) * np.clip(light[seen] / _SQUARE, 0.0, 1.0)
    place = np.where(member < 0, len(_COLOURS), member % len(_COLOURS))
    look = {"facecolors": palette[place[seen]] * shade[:, None], "edgecolors": "#00000055"}
    axes.add_collection(PolyCollection(view.project(triangles[seen]), linewidths=0.25, **look))
    axes.set(xlabel="in the picture [m]", aspect="equal")
    axes.grid(False)
    axes.autoscale_view()
    axes.margins(0.08)


def _draw_strokes(axes, triangles, view, hatch):
    """Strokes over triangles (n, 3, 3) that are seen, in front of all faces."""
    seen = view.project(triangles[view.facing(triangles)])
    look = {"facecolors": "none", "edgecolors": _STROKE, "linewidths": 0.0, "hatch": hatch}
    axes.add_collection(PolyCollection(seen, **look))


def _draw_axes(axes, view):
    middle = np.array(_TRIAD)
    fixed = {"xycoords": "axes fraction", "textcoords": "offset points", "annotation_clip": False}
    for name, along in zip("xyz", view.project(np.eye(3))):
        end, letter = middle + _ARROW * along, middle + (_ARROW + 7.0) * along
        line = {"arrowstyle": "->", "lw": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
        tip = OffsetFrom(axes, (1.0, 1.0))
        axes.annotate("", end, middle, xycoords=tip, textcoords=tip, arrowprops=line)
        axes.annotate(name, (1.0, 1.0), letter, ha="center", va="center", fontsize=8, **fixed)


def _label(name, count, acting):
    """Name of a group with its number of faces, and what acts on it."""
    return ", ".join([f"{name}: {counted(int(count), 'face')}", *acting.get(name, ())])
