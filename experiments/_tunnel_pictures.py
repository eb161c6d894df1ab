"""Pictures of tunnel rounds: cracks in the rock, peak velocities, energy, film of a section."""

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import BoundaryNorm, Normalize

from _drawing import in_space, moving_picture
from _tunnel import FITTED, MIDDLE, PARTS, PLACE, SIZE, middle_of, peaks
from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, ORANGE, WINE, picture
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
from taichi_dem.plot.block import speed_edges
from taichi_dem.plot.view import displaced, shades

#: Colours of designs, and of what the work went into.
COLOURS = (GREY, BLUE, ORANGE, GREEN, WINE, "black")
SHADES = dict(zip(PARTS, (BLUE, WINE, ORANGE, "#c7b299", GREEN, "#dddddd")))
#: Look of what the mesh may change.
HATCHED = {"color": "none", "edgecolor": "black", "hatch": "////", "linewidth": 0.0, "height": 0.4}
#: Half of the width of the section that a film shows [m], and the part of the rock.
BAND, PART = 0.25, {"xlim": (0.6, 3.4), "ylim": (1.5, 3.9)}
#: Of displacements in the film.
MAGNIFY = 20.0


def draw_cracks(path, runs):
    """Broken faces in the transparent rock, a panel a run; runs: name -> (design, result)."""
    columns = min(len(runs), 2)
    lines = -(-len(runs) // columns)
    box = np.array([np.zeros(3), SIZE])
    with picture(path, 0, size=(4.6 * columns, 4.2 * lines)) as (figure, _):
        for number, (name, (_, result)) in enumerate(runs.items(), 1):
            axes = figure.add_subplot(lines, columns, number, projection="3d")
            broken = np.flatnonzero(np.isfinite(result.broken_time))
            triangles = result.model.mesh.points[result.model.topology.vertices[broken]]
            until = 1e3 * result.frames[-1].time_s
            look = {"cmap": shades("plasma", 0.0, 0.88), "norm": Normalize(0.0, until)}
            in_space(axes, triangles, 1e3 * result.broken_time[broken], box, look)
            axes.view_init(elev=24.0, azim=35.0)
            axes.set_box_aspect(np.ptp(box[:, [0, 2, 1]], axis=0), zoom=0.95)
            axes.set_title(f"{name}: {_area(result):.1f} m² of cracks")
        drawn = axes.collections[0]
        bar = {"location": "bottom", "shrink": 0.5, "aspect": 40}
        figure.colorbar(drawn, ax=figure.axes, label="time of breaking [ms]", **bar)


def _area(result):
    return float(result.crack_area()["crack_area_m2"].iloc[-1])


def draw_peaks(path, runs, table):
    """Peak velocity behind and beside the round over distance; bars over meshes at one place."""
    found = {name: peaks(result, middle_of(design)) for name, (design, result) in runs.items()}
    with picture(path, 1, 2, size=(9.6, 4.4), sharey=True) as (figure, panels):
        for axes, place in zip(panels, ("beside", "behind")):
            for (name, (distance, speed, behind, beside)), colour in zip(found.items(), COLOURS):
                chosen = (behind if place == "behind" else beside) & (distance > FITTED[0])
                axes.plot(distance[chosen], speed[chosen], ".", ms=1.5, alpha=0.2, color=colour)
                axes.plot(*_medians(distance[chosen], speed[chosen]), lw=2.5, color=colour)
                row = table.loc[name]
                value, bar = row[f"{place}_m_s"], row[f"{place}_m_s_bar"]
                look = {"fmt": "o", "ms": 7, "capsize": 5, "color": colour, "mec": "white"}
                axes.errorbar(PLACE, value, bar if bar == bar else None, label=name, **look)
            axes.set(xscale="log", yscale="log", title=f"{place} the round")
            axes.set(xlabel="distance from the charges [m]", xticks=(1, 2, 3))
        panels[0].set_ylabel("peak velocity [m/s]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=6)


def _medians(distance, speed):
    """Middle of each distance that holds bodies, in even ratios, and the median speed there."""
    edges = np.geomspace(FITTED[0], distance.max(), 9)
    place = np.clip(np.searchsorted(edges, distance) - 1, 0, len(edges) - 2)
    held = np.unique(place)
    medians = [np.median(speed[place == one]) for one in held]
    return np.sqrt(edges[held] * edges[held + 1]), medians


def draw_energy(path, table):
    """What the work of the gas went into, a bar a design; hatched: the spread over meshes."""
    with picture(path, size=(8.4, 1.4 + 0.65 * len(table))) as (figure, axes):
        shares = 100.0 * table[[f"{part}_share" for part in SHADES]].to_numpy().T
        bars = 100.0 * np.nan_to_num(table[[f"{part}_share_bar" for part in SHADES]].to_numpy().T)
        ends = shares.cumsum(axis=0)
        for share, end, (part, colour) in zip(shares, ends, SHADES.items()):
            axes.barh(table.index, share, left=end - share, color=colour, label=part)
        for end, bar in zip(ends, bars):
            axes.barh(table.index, 2.0 * bar, left=end - bar, **HATCHED)
        axes.set(xlabel="share of the work of the gas [%]", xlim=(0.0, None))
        axes.invert_yaxis()
        figure.legend(loc="outside upper center", ncols=6)


def film_section(path, result):
    """A film of the bodies about the middle height, coloured by speed; the tunnel is above."""
    model = result.model
    chosen = np.flatnonzero(np.abs(model.centre[:, 1] - MIDDLE[1]) < BAND)
    edges = speed_edges(result.frames)
    norm = BoundaryNorm(edges, len(edges), extend="min")
    with moving_picture(path, (4.0, 3.6), 125) as (figure, shoot):
        axes = figure.subplots()
        drawn = PolyCollection([], cmap=shades("magma_r", 0.04, 0.9, len(edges)), norm=norm)
        drawn.set(linewidth=0.2, edgecolor="#00000050")
        axes.add_collection(drawn)
        axes.set(aspect="equal", xlabel="x [m]", ylabel="z [m]", **PART)
        bar = figure.colorbar(drawn, ax=axes, label="speed [m/s]", aspect=25)
        bar.ax.set_yticks(edges, [f"{value:g}" for value in edges])
        for frame in result.frames:
            faces = displaced(model, frame, MAGNIFY)[chosen][:, LOCAL_FACES].reshape(-1, 3, 3)
            seen = _from_below(faces)
            drawn.set_verts(faces[seen][..., [0, 2]])
            drawn.set_array(frame.speed[chosen[seen // 4]])
            axes.set_title(f"t = {1e3 * frame.time_s:.2f} ms, displacement × {MAGNIFY:g}")
            shoot()


def _from_below(faces):
    """Faces (n, 3, 3) that look down, the nearest to a viewer below last."""
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    seen = np.flatnonzero(normal[:, 1] < 0.0)
    return seen[np.argsort(-faces[seen, :, 1].mean(axis=1), kind="stable")]
