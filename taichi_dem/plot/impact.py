"""A fragment hits a bar: bodies by their step, motion of the ends, evaluations of each method.

An impact has: name (of its method), result, model, frames, time [s], struck and far [m]
(displacements of the bar's ends), levels (frames, bodies) and evaluations; one entry a frame.
"""

import matplotlib
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from taichi_dem.kit.plot_style import BLACK, GREY, picture, seconds, styles_of
from taichi_dem.plot.bodies import FilmedBodies
from taichi_dem.plot.film import moving_picture

#: Of the displacement in the film.
_MAGNIFY = 40.0


def picture_impact(path, impacts, dt0):
    """Motion of the ends, evaluations, and share of bodies on each level of the second method."""
    styles = styles_of([impact.name for impact in impacts])
    with picture(path, 1, 3, size=(12.0, 3.6)) as (figure, (way, work, share)):
        for impact, style in zip(impacts, styles.values()):
            look = {"color": style.colour, "linestyle": style.line}
            time = 1e6 * impact.time
            way.plot(time, 1e6 * impact.struck, label=style.label, **look)
            way.plot(time, 1e6 * impact.far, linewidth=0.8, **look)
            work.plot(time, 1e-6 * impact.evaluations, label=style.label, **look)
        way.set(xlabel="time [µs]", ylabel="displacement [µm]", title="the answer")
        work.set(xlabel="time [µs]", ylabel="evaluations of bonds and pairs [10⁶]")
        work.set(title="the price")
        handles, labels = work.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower left", ncols=len(impacts))
        ends = [way.plot([], [], color=GREY, lw=width)[0] for width in (1.5, 0.8)]
        way.legend(ends, ["struck end (thick)", "far end (thin)"], loc="upper left")
        levels = impacts[1].levels
        top = int(levels.max()) + 1
        shares = np.array([np.bincount(row, minlength=top) / len(row) for row in levels])
        areas = share.stackplot(1e6 * impacts[1].time, 100.0 * shares.T, colors=_shades(top))
        share.set(xlabel="time [µs]", ylabel="share of bodies [%]", ylim=(0.0, 100.0))
        share.set(
            title=f"steps: {styles[impacts[1].name].label}", xlim=(0.0, 1e6 * impacts[1].time[-1])
        )
        names = [seconds(dt0 / 2.0**level) for level in range(top)]
        figure.legend(areas[::-1], names[::-1], title="step", loc="outside right center")


def film_impact(path, base, other, dt0, count):
    """Both bars by their bodies' steps, and how far the struck end moves. count: of frames."""
    styles = styles_of([base.name, other.name])
    top = int(max(base.levels.max(), other.levels.max())) + 1
    with moving_picture(path, (4.0, 3.8), 120) as (figure, shoot):
        panels = figure.subplots(3, 1, height_ratios=(1.0, 1.0, 1.25))
        blocks = [_Block(axes, impact, top) for axes, impact in zip(panels, (base, other))]
        both = panels[:2].tolist()
        words = f"step of a body; displacement × {_MAGNIFY:g}\nthick line: mean of the struck end"
        look = {"location": "bottom", "aspect": 40, "label": words}
        bar = figure.colorbar(blocks[0].drawn, ax=both, **look)
        bar.ax.set_xticks(np.arange(top), [seconds(dt0 / 2.0**k) for k in range(top)])
        bar.ax.minorticks_off()
        way = panels[2]
        lines = []
        for style in styles.values():
            look = {"color": style.colour, "linestyle": style.line, "label": style.label}
            lines += way.plot([], [], **look)
        highest = 1e6 * max(base.struck.max(), other.struck.max())
        way.set(xlim=(0.0, 1e6 * base.time[-1]), ylim=(-0.05 * highest, 1.1 * highest))
        way.set(xlabel="time [µs]", ylabel="displacement of\nthe struck end [µm]")
        way.legend(loc="lower right")
        for row in np.linspace(0, len(base.time) - 1, count).round().astype(int):
            for block, impact, line in zip(blocks, (base, other), lines):
                block.show_row(row)
                line.set_data(1e6 * impact.time[: row + 1], 1e6 * impact.struck[: row + 1])
            shoot()


def _shades(count):
    return matplotlib.colormaps["magma_r"](np.linspace(0.04, 0.9, max(2, count)))


class _Block(FilmedBodies):
    """Bar and fragment from the side, coloured by level."""

    def __init__(self, axes, impact, top):
        points = impact.model.mesh.points
        self.impact, self.name = impact, styles_of([impact.name])[impact.name].label
        end = points[impact.model.mesh.group_faces("bar_right")]
        self.end, self.height = end.mean(axis=(0, 1))[0], (points[:, 1].min(), points[:, 1].max())
        (self.edge,) = axes.plot([], [], color=BLACK, linewidth=1.6)
        norm = BoundaryNorm(np.arange(top + 1) - 0.5, top)
        look = {"cmap": ListedColormap(_shades(top)[:top]), "norm": norm}
        look.update(linewidth=0.25, edgecolor=GREY)
        super().__init__(axes, impact.model, _MAGNIFY, (0.08, 0.02, 0.03, 0.03), **look)

    def show_row(self, row):
        """Show a frame by its number."""
        frame, impact = self.impact.frames[row], self.impact
        broken = impact.result.broken_time <= frame.time_s
        self.show(frame, frame.level.astype(float), broken)
        self.edge.set_data([self.end - _MAGNIFY * impact.struck[row]] * 2, self.height)
        count = f"{1e-6 * impact.evaluations[row]:.1f} million evaluations"
        self.axes.set_title(f"{self.name}:\n{count} after {1e6 * frame.time_s:.0f} µs")
