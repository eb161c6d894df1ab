"""Films of a shaken container as curves over one cycle: mean height, particles at either end."""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.report.measures import first_harmonic
from taichi_dem.kit.plot_style import BLACK, GREY, area_key, line_key, picture, styles_of
from taichi_dem.kit.validation import FileName


@dataclass(frozen=True, eq=False)
class FilmMeasures:
    """Measures of the particles in every frame of filmed cycles; arrays (cycles, frames).

    height_mm: mean over the particles, in the room, less that of particles at rest on the floor of
    a container in its middle. above_floor_mm: the same over the container's floor. floor, ceiling:
    share of the particles less than half a diameter away from it. phase: of the frames [cycles].
    """

    phase: np.ndarray
    height_mm: np.ndarray
    above_floor_mm: np.ndarray
    floor: np.ndarray
    ceiling: np.ndarray

    @classmethod
    def of(cls, box: Any, cycles: Any, phase: Any) -> Any:
        """Measures of a Box with at least one particle; cycles: each a list of record.Frame."""
        rows, near = [], 0.5 * box.diameter
        for frame in itertools.chain(*cycles):
            below, above = box.gaps(frame.position)
            over = below.mean()
            heights = 1e3 * (box.lift(frame.x) + over), 1e3 * over
            rows.append((*heights, (below < near).mean(), (above < near).mean()))
        return cls(phase, *np.array(rows).T.reshape(4, len(cycles), len(phase)))

    @property
    def mean_height_mm(self) -> Any:
        """Mean of height_mm over the cycles, (frames,)."""
        return self.height_mm.mean(axis=0)

    def swing(self) -> Any:
        """Amplitude [mm] of the mean height, and its lag [degrees] behind the container."""
        return first_harmonic(self.phase, self.mean_height_mm)


def picture_cycle(path: FileName, measures: Any, amplitude: float) -> None:
    """Mean height of the particles and how many touch floor and ceiling, over one closed cycle.

    measures: by title of a panel, FilmMeasures by label of the filling. amplitude: of the container
    [mm].
    """
    styles, time = styles_of(next(iter(measures.values()))), np.linspace(0.0, 1.0, 200)
    shape = {"size": (2.85 * len(measures) + 0.6, 5.7), "sharex": True, "sharey": "row"}
    with picture(path, 2, len(measures), squeeze=False, **shape) as (figure, panels):
        for top, bottom, (title, fillings) in zip(*panels, measures.items()):
            motion = amplitude * np.sin(2.0 * np.pi * time)
            top.plot(time, motion, color=GREY, linestyle=":", label="container")
            top.set_title(title)
            for label, one in fillings.items():
                _draw_measures(top, bottom, one, styles[label])
            bottom.set(xlabel="phase of the container [cycles]", xlim=(0.0, 1.0), ylim=(0.0, None))
        panels[0, 0].set_ylabel("mean height in the room\nless that at rest [mm]")
        panels[1, 0].set_ylabel("particles that touch [%]")
        ends = {"-": "floor", "--": "ceiling"}
        keys = [line_key(words, color=BLACK, ls=line) for line, words in ends.items()]
        panels[1, 0].legend(handles=keys, loc="upper right")
        keys, _ = panels[0, 0].get_legend_handles_labels()
        keys.append(area_key("± standard deviation of the cycles", fc=GREY, alpha=0.3))
        figure.legend(handles=keys, loc="outside upper left", ncols=2)


def _draw_measures(top, bottom, one, style):
    """Curves of a filling: means over the cycles, and the spread of the height between them."""
    # The cycle is closed: it ends as it begins.
    phase, ends = np.append(one.phase, 1.0), {"-": one.floor, "--": one.ceiling}
    height, spread = (_closed(over(one.height_mm, axis=0)) for over in (np.mean, np.std))
    look = {"color": style.colour, "marker": style.marker, "ms": 4}
    top.plot(phase, height, label=style.label, **look)
    band = {"color": style.colour, "alpha": 0.18, "linewidth": 0}
    top.fill_between(phase, height - spread, height + spread, **band)
    for line, share in ends.items():
        percent = 100.0 * _closed(share.mean(axis=0))
        bottom.plot(phase, percent, linestyle=line, **look)


def _closed(values):
    return np.append(values, values[:1])
