"""Picture of a mesh before a run: its outer faces, coloured by group, seen from two sides."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.text import OffsetFrom

from taichi_dem.kit.display import counted
from taichi_dem.kit.plot_style import area_key, png_of, styled
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.plot.view import View

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


def picture_of_groups(mesh: Mesh, acting: Mapping[str, Sequence[str]]) -> bytes:
    """The outer faces of a mesh as PNG, from the front and from behind, coloured by group.

    A face in several groups has the colour of the smallest. Without groups of faces, colours are
    those of the groups of bodies.

    Parameters
    ----------
    mesh : Mesh
    acting : dict
        Group to what acts on it, words for the legend.
    """
    faces = geometry.all_faces(mesh.tetrahedra)
    rows = geometry.outer_rows(faces)
    outer = faces[rows]
    names, member = _members(mesh, outer, rows // 4)
    with styled(1, 2, size=(9.6, 4.8), sharey=True) as (figure, panels):
        for axes, axis, title in zip(panels, _AXES, ("from the front", "from behind and below")):
            view = _Oblique(axis)
            _draw(axes, mesh, outer, member, view)
            _draw_axes(axes, view)
            axes.set_title(title, fontsize=9)
        panels[0].set_ylabel("in the picture [m]")
        keys = _keys(mesh, names, member, acting)
        figure.legend(handles=keys, loc="outside lower center", ncols=3, fontsize=8)
        return png_of(figure)


def _keys(mesh, names, member, acting):
    """Lines of the legend."""
    counts = [(member == k).sum() for k in range(len(names))]
    keys = [
        area_key(_label(name, counts[k], acting), facecolor=_COLOURS[k % len(_COLOURS)])
        for k, name in enumerate(names[:_MOST])
    ]
    if len(names) > _MOST:
        keys.append(area_key(f"and {len(names) - _MOST} more groups", facecolor="white"))
    if (member < 0).any():
        keys.append(area_key(_label("no group", (member < 0).sum(), {}), facecolor=_NONE))
    return keys


def _members(mesh, outer, bodies):
    """Names of groups, and the place of that of each outer face, -1 for none, (n,)."""
    sizes = {name: len(faces) for name, faces in mesh.groups.items()}
    names = [name for name in sizes if name not in mesh.inner_groups]
    member = np.full(len(outer), -1)
    if names:
        number, *members = geometry.numbers_in(outer, *(mesh.groups[name] for name in names))
        chosen = np.full(max(map(np.max, (number, *members))) + 1, -1)
        for k in sorted(range(len(names)), key=lambda k: -sizes[names[k]]):
            chosen[members[k]] = k
        member = chosen[number]
    else:
        names = list(mesh.body_groups)
        for k, name in enumerate(names):
            member[np.isin(bodies, mesh.body_groups[name])] = k
    shown = [k for k in range(len(names)) if (member == k).any()]
    places = np.full(len(names) + 1, -1)
    places[shown] = np.arange(len(shown))
    return [names[k] for k in shown], places[member]


class _Oblique(View):
    """A view along any axis, y up in the picture. axis: from the mesh to the viewer."""

    def __init__(self, axis: Sequence[float]):
        self.toward = np.array(axis) / np.linalg.norm(axis)
        right = np.cross([0.0, 1.0, 0.0], self.toward)
        self.right = right / np.linalg.norm(right)
        self.up = np.cross(self.toward, self.right)


def _draw(axes, mesh, outer, member, view):
    """Faces that are seen, from back to front, the darker the more they lean away."""
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


def _draw_axes(axes, view):
    """Directions of x, y and z above the upper right corner."""
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
