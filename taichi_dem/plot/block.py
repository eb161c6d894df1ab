"""The block seen along an axis: faces towards the viewer, cracks, steps."""

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm, ListedColormap

from taichi_dem.plot.style import figure, save
from taichi_dem.record import body_corners
from taichi_dem.tetrahedra import LOCAL_FACES

_STONE = "#E4E0D6"
# The bright end of the map would not stand out against the stone.
_AGES = ListedColormap(matplotlib.colormaps["plasma"](np.linspace(0.0, 0.86, 256)))


class View:
    """Projection of a block along one coordinate axis, faces sorted from back to front.

    axis: 0, 1 or 2, the direction of looking; the viewer stands at its far positive end.
    """

    def __init__(self, model, axis=2):
        self.model = model
        self.plane = [k for k in range(3) if k != axis]
        self.axis = axis

    def front_faces(self, corners):
        """Triangles towards the viewer, (n, 3, 2) [m], and their bodies, the nearest last.

        corners: world positions (body_count, 4, 3) [m].
        """
        faces = corners[:, LOCAL_FACES]
        normal = np.cross(faces[:, :, 1] - faces[:, :, 0], faces[:, :, 2] - faces[:, :, 0])
        body, face = np.nonzero(normal[:, :, self.axis] > 0.0)
        shown = faces[body, face]
        order = np.argsort(shown[:, :, self.axis].mean(axis=1), kind="stable")
        return shown[order][:, :, self.plane], body[order]

    def crack_lines(self, corners, broken):
        """Traces of broken faces on the front, (n, 2, 2) [m]; corners as above, broken: bonds.

        A face is drawn by the edge of it that lies nearest to the viewer.
        """
        topology = self.model.topology
        body, face = topology.master[broken], topology.master_face[broken]
        triangle = corners[body[:, None], LOCAL_FACES[face]]
        nearest = np.argsort(-triangle[:, :, self.axis], axis=1, kind="stable")[:, :2]
        ends = np.take_along_axis(triangle, nearest[:, :, None], axis=1)
        return ends[:, :, self.plane]


def prepare(axes, model, plane, margin=0.12):
    """Limits, equal scales and labels for a view of a block in a plane of two coordinates."""
    low, high = model.mesh.points.min(axis=0), model.mesh.points.max(axis=0)
    axes.set_xlim(low[plane[0]] - margin, high[plane[0]] + margin)
    axes.set_ylim(low[plane[1]] - margin, high[plane[1]] + margin)
    axes.set_aspect("equal")
    axes.grid(False)
    axes.locator_params(nbins=5)
    axes.set(xlabel=f"{'xyz'[plane[0]]} [m]", ylabel=f"{'xyz'[plane[1]]} [m]")


def plot_cracks(path, model, frame, broken_time, magnify=1.0, axis=2):
    """Cracks by time of breaking, on the block as it was and as it is (Konno et al., Fig 12).

    broken_time: (bond_count,) [s], NaN while a bond holds. magnify: of the displacement.
    """
    view = View(model, axis)
    start = model.mesh.points[model.mesh.tetrahedra]
    moved = start + magnify * (body_corners(model, frame) - start)
    broken = np.flatnonzero(~np.isnan(broken_time))
    broken = broken[np.argsort(broken_time[broken], kind="stable")]
    fig, panels = figure(1, 2, size=(12.0, 5.8))
    scale = "true scale" if magnify == 1.0 else f"displacement x {magnify:g}"
    titles = ("Cracks on the block at rest", f"Deformed block, {scale}")
    for axes, corners, title in zip(panels, (start, moved), titles):
        polygons, _ = view.front_faces(corners)
        axes.add_collection(
            PolyCollection(polygons, facecolor=_STONE, edgecolor="#B8B2A2", linewidth=0.3)
        )
        lines = LineCollection(
            view.crack_lines(corners, broken), cmap=_AGES, linewidth=1.5, capstyle="round"
        )
        lines.set_array(1e3 * broken_time[broken])
        lines.set_clim(0.0, 1e3 * max(frame.time_s, 1e-30))
        axes.add_collection(lines)
        axes.set_title(f"{title}, t = {1e3 * frame.time_s:.3g} ms")
        prepare(axes, model, view.plane)
    fig.colorbar(lines, ax=panels, label="time of breaking [ms]", shrink=0.9, pad=0.02)
    save(fig, path)


def plot_steps(path, model, frames, dt0, axis=2):
    """Step of every body at several times (Konno et al., Fig 13); dt0: step of level 0 [s]."""
    view = View(model, axis)
    rows = 1 if len(frames) <= 3 else 2
    columns = -(-len(frames) // rows)
    fig, panels = figure(rows, columns, size=(3.8 * columns + 1.0, 3.8 * rows), squeeze=False)
    top = max(int(frame.level.max()) for frame in frames)
    colours = matplotlib.colormaps["viridis_r"].resampled(top + 1)
    norm = BoundaryNorm(np.arange(-0.5, top + 1.5), top + 1)
    for axes, frame in zip(panels.flat, frames):
        polygons, body = view.front_faces(body_corners(model, frame))
        drawn = PolyCollection(polygons, cmap=colours, norm=norm, edgecolor="white", linewidth=0.2)
        drawn.set_array(frame.level[body])
        axes.add_collection(drawn)
        axes.set_title(f"t = {1e3 * frame.time_s:.3g} ms")
        prepare(axes, model, view.plane)
    for axes in panels.flat[len(frames) :]:
        axes.set_axis_off()
    bar = fig.colorbar(drawn, ax=panels, ticks=range(top + 1), shrink=0.9, pad=0.02)
    bar.set_label("step [s]")
    bar.set_ticklabels([f"{dt0 / 2.0**k:.2g}" for k in range(top + 1)])
    save(fig, path)
