"""The container as it is drawn: its walls, its particles, and where it stands in the room."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize

from ca_damper.report.record import Frame, inner_size
from taichi_dem.kit.plot_style import BLACK, BLUE, RED

#: Vertical speed of particles: falling, at rest, rising.
SPEEDS = LinearSegmentedColormap.from_list("speeds", [RED, "#F2EFE6", BLUE])


@dataclass(frozen=True)
class Box:
    """Inside of the container: width and height [m], and the diameter of a particle [m].

    The automaton's box is ``staggered``: every other column, the first of them too, stands half a
    cell higher. By the rules of the paper it moves ``by_cells``.
    """

    width: float
    height: float
    diameter: float
    staggered: bool = False
    by_cells: bool = False

    @classmethod
    def of_automaton(cls, automaton: Any) -> Any:
        """Of an Automaton."""
        return cls(*inner_size(automaton), True, automaton.rules == "paper")

    @classmethod
    def of_spheres(cls, spheres: Any) -> Any:
        """Of Spheres."""
        return cls(*inner_size(spheres))

    @classmethod
    def of(cls, filling: Any) -> Any:
        """Of an Automaton or Spheres."""
        return (cls.of_automaton if hasattr(filling, "columns") else cls.of_spheres)(filling)

    def lift(self, x: Any) -> Any:
        """Height of the box [m] when the container is displaced by x [m]."""
        cell = self.diameter
        return np.floor(np.asarray(x) / cell + 0.5) * cell if self.by_cells else np.asarray(x)

    def floor_at(self, horizontal: Any) -> Any:
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

    def __init__(self, axes: Any, box: "Box", fastest: float, offset: float = 0.0):
        self.box, self.offset = box, offset
        (self.walls,) = axes.plot([], [], color=BLACK, linewidth=1.2, solid_joinstyle="miter")
        size = 1e3 * box.diameter
        self.particles = EllipseCollection(
            [size], [size], [0.0], units="xy", offsets=np.zeros((0, 2)),
            offset_transform=axes.transData, cmap=SPEEDS, norm=Normalize(-fastest, fastest),
            edgecolor=BLACK, linewidth=0.4,
        )  # fmt: skip
        axes.add_collection(self.particles)

    def show(self, frame: Frame) -> None:
        """Draw a ``record.Frame``."""
        shift = np.array([self.offset, self.box.lift(frame.x)])
        walls = 1e3 * (self.box.outline() + shift)
        self.walls.set_data(walls[:, 0], walls[:, 1])
        self.particles.set_offsets(1e3 * (frame.position + shift))
        self.particles.set_array(frame.velocity[:, 1])
        if frame.diameter is not None:
            self.particles.set_widths(1e3 * frame.diameter)
            self.particles.set_heights(1e3 * frame.diameter)


def frame_panel(axes: Any, box: "Box", amplitude: float, margin: float = 3.0) -> None:
    """Limits of a panel in which the box moves by an amplitude [m]; equal scales, no axes."""
    top = 1e3 * (box.height + amplitude) + margin
    if box.staggered:
        top += 0.5e3 * box.diameter
    axes.set(xlim=(-margin, 1e3 * box.width + margin), ylim=(-1e3 * amplitude - margin, top))
    axes.set_aspect("equal")
    axes.set_axis_off()
