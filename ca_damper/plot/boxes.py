"""Drawings of the container: in rows of frames, side by side, and on its spring."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize

from ca_damper.report.record import SceneFrame, inner_size
from taichi_dem.kit.plot_style import (
    BLACK,
    BLUE,
    RED,
    STYLE,
    filming,
    picture,
    styles_of,
    write_gif,
)
from taichi_dem.kit.progress import drawing
from taichi_dem.kit.validation import FileName

#: Vertical speed of particles: falling, at rest, rising.
SPEEDS = LinearSegmentedColormap.from_list("speeds", [RED, "#F2EFE6", BLUE])
_SPEED = "vertical speed of particles [m/s]"
#: A container slower than this share of its fastest gets no arrow; ends of the colour scale as a
#: share of the container's largest speed.
_SLOW, _SCALE = 0.1, 1.2
#: The spring hangs from the base, this far over a box in its middle [mm]; its coils, half width and
#: straight ends [mm], which reach over the steps of a staggered box.
_HANGS, _COILS, _HALF, _LEAD = 75.0, 9, 7.0, 6.0
#: Letters of animations, which are drawn with so many dots per inch.
_DPI = 100
_SMALL = {**STYLE, "font.size": 7.5, "axes.titlesize": 7.5, "axes.labelsize": 7.0}
_SMALL |= dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), 6.5)


@dataclass(frozen=True)
class BoxSize:
    """Inside of the container: width and height [m], and the diameter of a particle [m]."""

    width: float
    height: float
    diameter: float
    staggered: bool = False
    by_cells: bool = False

    @classmethod
    def of(cls, filling: object) -> Any:
        """Of an Automaton or Spheres."""
        rules = getattr(filling, "rules", None)
        by_cells = rules is not None and rules.by_cells
        return cls(*inner_size(filling), rules is not None, by_cells)

    def lift(self, x: object) -> Any:
        """Height of the box [m] when the container is displaced by x [m]."""
        cell = self.diameter
        return np.floor(np.asarray(x) / cell + 0.5) * cell if self.by_cells else np.asarray(x)

    def floor_at(self, horizontal: object) -> Any:
        """Height of the floor [m] at places counted from the left wall [m]."""
        column = np.floor(np.asarray(horizontal) / self.diameter)
        return 0.5 * self.diameter * (self.staggered & (column % 2 == 0))

    def gaps(self, position: np.ndarray) -> Any:
        """Room below and above each particle [m], two arrays, for positions (particles, 2) [m]."""
        height = position[:, 1] - 0.5 * self.diameter - self.floor_at(position[:, 0])
        return height, self.height - self.diameter - height

    def outline(self) -> Any:
        """Corners of the walls [m], (n, 2), a closed line."""
        edges = np.array([0.0, self.width])
        if self.staggered:
            edges = np.arange(0.0, self.width + 0.5 * self.diameter, self.diameter)
        across = np.repeat(edges, 2)[1:-1]
        floor = np.repeat(self.floor_at(edges[:-1] + 0.5 * self.diameter), 2)
        below = np.column_stack([across, floor])
        above = below + np.array([0.0, self.height])
        return np.concatenate([below, above[::-1], below[:1]])


class DrawnBox:
    """Walls and particles in a panel, in millimetres; ``show`` moves them."""

    def __init__(self, axes: Any, box: BoxSize, fastest: float, offset: float = 0.0):
        self.box, self.offset = box, offset
        (self.walls,) = axes.plot([], [], color=BLACK, linewidth=1.2, solid_joinstyle="miter")
        size = 1e3 * box.diameter
        self.particles = EllipseCollection(
            [size], [size], [0.0], units="xy", offsets=np.zeros((0, 2)),
            offset_transform=axes.transData, cmap=SPEEDS, norm=Normalize(-fastest, fastest),
            edgecolor=BLACK, linewidth=0.4,
        )  # fmt: skip
        axes.add_collection(self.particles)

    def show(self, frame: SceneFrame) -> None:
        """Draw a ``record.SceneFrame``."""
        shift = np.array([self.offset, self.box.lift(frame.x)])
        walls = 1e3 * (self.box.outline() + shift)
        self.walls.set_data(walls[:, 0], walls[:, 1])
        self.particles.set_offsets(1e3 * (frame.position + shift))
        self.particles.set_array(frame.velocity[:, 1])
        if frame.diameter is not None:
            self.particles.set_widths(1e3 * frame.diameter)
            self.particles.set_heights(1e3 * frame.diameter)


def frame_panel(axes: Any, box: BoxSize, amplitude: float, margin: float = 3.0) -> None:
    """Limits of a panel in which the box moves by an amplitude [m]; equal scales, no axes."""
    top = 1e3 * (box.height + amplitude) + margin
    if box.staggered:
        top += 0.5e3 * box.diameter
    axes.set(xlim=(-margin, 1e3 * box.width + margin), ylim=(-1e3 * amplitude - margin, top))
    axes.set_aspect("equal")
    axes.set_axis_off()


@contextlib.contextmanager
def _moving_picture(
    path: FileName, size: tuple[float, float], milliseconds: float = 60
) -> Iterator[Any]:
    """A figure and a function that takes it as the next frame; a GIF when the block ends well."""
    drawing(path)
    with filming(size, _DPI, _SMALL) as (figure, shoot, images):
        yield figure, shoot
    write_gif(path, images, milliseconds)


def picture_film_strips(
    path: FileName, films: Mapping[str, Any], amplitude: float, frequency: float
) -> None:
    """A row of frames for every filling, from left to right through one cycle of the container."""
    count = len(next(iter(films.values()))[1])
    size = 1.03 * count + 0.9, 2.3 * len(films) + 0.3
    fastest = 2.0 * np.pi * frequency * amplitude
    with picture(path, len(films), count, size=size, squeeze=False) as (figure, panels):
        for line, (name, (box, frames)) in zip(panels, films.items()):
            for k, (axes, frame) in enumerate(zip(line, frames)):
                frame_panel(axes, box, amplitude, margin=9.0)
                drawn = DrawnBox(axes, box, _SCALE * fastest)
                drawn.show(frame)
                _mark_motion(axes, box, box.lift(frame.x), np.cos(2.0 * np.pi * k / count))
            look = {"rotation": 90, "ha": "right", "va": "center", "transform": line[0].transAxes}
            line[0].text(-0.08, 0.5, styles_of(films)[name].label, **look)
        for axes, frame in zip(panels[0], frames):
            axes.set_title(f"{1e3 * (frame.time_s - frames[0].time_s):.0f} ms", loc="center")
        inside = f"{1e3 * box.width:.0f} × {1e3 * box.height:.0f} mm inside"
        arrows = "arrows: its velocity, where it is not slow"
        figure.supxlabel(f"one cycle of the container, {inside}; {arrows}", fontsize=9)
        figure.colorbar(drawn.particles, ax=panels, label=_SPEED, aspect=45, pad=0.01)


def _mark_motion(axes, box, lift, share):
    """An arrow beside the box for the container's velocity; share: of its largest."""
    reach, beside = 14.0 * share, 1e3 * box.width + 7.0
    middle = 1e3 * (0.5 * box.height + lift)
    look = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    if abs(share) > _SLOW:
        ends = (beside, middle + reach), (beside, middle - reach)
        axes.annotate("", *ends, arrowprops=look, annotation_clip=False)


def animate_films(
    path: FileName, films: Mapping[str, Any], amplitude: float, frequency: float
) -> None:
    """Containers side by side through one cycle, as a GIF below a megabyte."""
    fastest, drawn = 2.0 * np.pi * frequency * amplitude, []
    with _moving_picture(path, (4.0, 2.6)) as (figure, shoot):
        panels = figure.subplots(1, len(films), squeeze=False)[0]
        for axes, (title, (box, _)) in zip(panels, films.items()):
            frame_panel(axes, box, amplitude)
            axes.set_title(title, loc="center")
            drawn.append(DrawnBox(axes, box, _SCALE * fastest))
        bar = {"location": "bottom", "aspect": 40, "pad": 0.02}
        figure.colorbar(drawn[0].particles, ax=panels.tolist(), label=_SPEED, **bar)
        for shots in zip(*(frames for _, frames in films.values())):
            for drawing, frame in zip(drawn, shots):
                drawing.show(frame)
            shoot()


@dataclass(frozen=True)
class Hanging:
    """A container in a film: its name, its Box, its frames, and the curve beside it."""

    title: str
    box: BoxSize
    frames: Sequence[SceneFrame]
    colour: str
    curve: tuple[np.ndarray, np.ndarray] | None = None


def film_hanging(path: FileName, containers: Sequence[Hanging], fastest: float) -> None:
    """Write a GIF of containers side by side, with their displacement over time."""
    first = containers[0].frames
    # A container that diverged has frames without numbers.
    swing = 1.1 * np.nanmax([abs(frame.x) for hanging in containers for frame in hanging.frames])
    step = 1.35 * max(hanging.box.width for hanging in containers)
    with _moving_picture(path, (4.0, 3.0)) as (figure, shoot):
        bench, curve = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        hung = [
            _Hung(bench, hanging, fastest, k * step, swing) for k, hanging in enumerate(containers)
        ]
        bench.margins(0.02)
        bench.set_aspect("equal")
        bench.set_axis_off()
        bar = {"location": "bottom", "aspect": 30, "pad": 0.02}
        figure.colorbar(hung[0].drawn.particles, ax=bench, label=_SPEED, **bar)
        dots = [_curve(curve, hanging, first[0].time_s) for hanging in containers]
        curve.set(ylim=(-1e3 * swing, 1e3 * swing), xlabel="time [s]", ylabel="displacement [mm]")
        # Under the dots, which move: what lies over them is drawn again for each frame.
        curve.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0)).set_zorder(1)
        for shots in zip(*(hanging.frames for hanging in containers)):
            for hanging, dot, frame in zip(hung, dots, shots):
                hanging.show(frame)
                dot.set_data([frame.time_s - first[0].time_s], [1e3 * frame.x])
            shoot()


def _curve(axes, hanging, begin):
    """Draw the displacement of a container; returns the dot for the present."""
    frames = zip(*((frame.time_s, frame.x) for frame in hanging.frames))
    time, moved = map(np.array, frames if hanging.curve is None else hanging.curve)
    axes.plot(time - begin, 1e3 * moved, color=hanging.colour, linewidth=0.9, label=hanging.title)
    return axes.plot([], [], "o", color=hanging.colour, markersize=4)[0]


class _Hung:
    """A box on a spring that hangs from the base."""

    def __init__(self, axes, hanging, fastest, offset, swing):
        self.drawn = DrawnBox(axes, hanging.box, fastest, offset)
        width, self.top = 1e3 * hanging.box.width, 1e3 * hanging.box.height
        left, below = 1e3 * offset, -1e3 * swing
        self.middle = left + 0.5 * width
        (self.spring,) = axes.plot([], [], color=BLACK, linewidth=0.9)
        (self.base,) = axes.plot([], [], color=BLACK, linewidth=3.0)
        axes.text(self.middle, below - 12.0, hanging.title, ha="center")
        axes.update_datalim([(left, below - 14.0), (left + width, self.top + _HANGS)])

    def show(self, frame):
        self.drawn.show(frame)
        top = self.top + _HANGS + 1e3 * frame.y
        bottom = self.top + 1e3 * self.drawn.box.lift(frame.x)
        along = [top, *np.linspace(top - _LEAD, bottom + _LEAD, 2 * _COILS), bottom]
        across = np.tile([0.0, _HALF, 0.0, -_HALF], _COILS)[: len(along)]
        across[-2:] = 0.0
        self.spring.set_data(self.middle + across, along)
        self.base.set_data([self.middle - 20.0, self.middle + 20.0], [top, top])
