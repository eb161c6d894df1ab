"""Pictures of responses over frequency, and of filmed grains over one cycle: curves."""

import itertools
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from ca_damper.report.measures import first_harmonic
from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, area_key, line_key, picture, styles_of
from taichi_dem.kit.validation import FileName, choice

_SHADES = colormaps["viridis"]
_FINE = 400


def picture_damping(path: FileName, curves: Any, shares: Any, fixed: tuple[int, float]) -> None:
    """Response of free and of fixed grains in one frame, and how their peaks compare."""
    (count, mass), first = fixed, next(iter(curves.values()))
    heavy = {"color": BLACK, "lw": 2.2, "label": f"the same {count} grains, fixed"}
    with picture(path, 1, 2, (9.2, 4.6), width_ratios=(3, 2)) as (figure, (curve, share)):
        for label, style in styles_of(curves).items():
            size, values = shares[label]
            _bars(share, 1e3 * np.array(size), values, np.median(values, axis=1), style, 6)
            rms = 1e3 * curves[label].rms[0]
            _bars(curve, first.ratios, rms, np.median(rms, axis=1), style, 4)
        own, fine = first.oscillator, np.linspace(first.ratios[0], first.ratios[-1], _FINE)
        curve.plot(fine, 1e3 * own.rms(fine * own.natural_frequency, mass), **heavy)
        _draw_empty(curve, own, first.ratios)
        words = f"{count} grains on a base that moves by ±{1e3 * own.base_amplitude:g} mm"
        curve.set(title=words, ylim=(0.0, None))
        share.axhline(1.0, **heavy)
        share.set(title="what free grains leave of the peak", xlabel="amplitude of the base [mm]")
        share.set(ylabel="peak / peak with fixed grains [1]", ylim=(0.0, 1.08))
        figure.legend(*curve.get_legend_handles_labels(), loc="outside upper left", ncols=4)


def _draw_curves(axis, response, rows=None):
    """Median over seeds as lines, lowest and highest as bands; the empty container dotted."""
    for k in range(len(response.particles)) if rows is None else rows:
        label = f"{response.particles[k]} particles"
        _band(axis, response.ratios, 1e3 * response.rms[k], _shade(response, k), label)
    _draw_empty(axis, response.oscillator, response.ratios)


def _draw_empty(axis, oscillator, ratios):
    fine = np.linspace(min(ratios), max(ratios), _FINE)
    look = {"color": STYLES["empty"].colour, "ls": ":", "label": STYLES["empty"].label}
    axis.plot(fine, 1e3 * oscillator.rms(fine * oscillator.natural_frequency), **look)
    axis.set(xlabel="frequency f / f$_0$ [1]", ylabel="RMS displacement [mm]")


def _band(axis, x, values, colour, label):
    """values: (points, seeds)."""
    axis.plot(x, np.median(values, axis=1), color=colour, label=label)
    axis.fill_between(x, values.min(axis=1), values.max(axis=1), color=colour, alpha=0.25, lw=0)


def _bars(axis, x, values, middle, style, size):
    """values: (points, seeds), of which the bars go from lowest to highest."""
    ends = [middle - values.min(axis=1), values.max(axis=1) - middle]
    look = {"marker": style.marker, "ms": size, "color": style.colour, "lw": 1.2}
    axis.errorbar(x, middle, yerr=ends, label=style.label, **look)


def _columns(figure, handles):
    return max(1, min(5, len(handles), int(figure.get_figwidth() / 1.8)))


def _band_key():
    return area_key("lowest to highest seed", fc=GREY, alpha=0.3)


def _shade(response, k):
    return _SHADES(0.1 + 0.8 * k / max(1, len(response.particles) - 1))


def picture_peaks(path: FileName | None, responses: Any, particle_mass: Any = None) -> Figure:
    """Place and height of the peaks over the particle number; bars from seed to seed."""
    styles, first = styles_of(responses), next(iter(responses.values()))
    with picture(path, 1, 2, (9.2, 4.2)) as (figure, (place, height)):
        for label, response in responses.items():
            ratio, rms = response.peaks()
            for axis, values in ((place, ratio), (height, 1e3 * rms)):
                middle = np.median(values, axis=1)
                _bars(axis, response.particles, values, middle, styles[label], 4.5)
        if particle_mass is not None:
            rigid = np.array([first.oscillator.peak(n * particle_mass) for n in first.particles])
            look = {"color": BLACK, "ls": ":", "label": "fixed grains"}
            place.plot(first.particles, rigid[:, 0], **look)
            height.plot(first.particles, 1e3 * rigid[:, 1], **look)
        place.set(xlabel="particles N [1]", ylabel="f / f$_0$ of the peak [1]")
        height.set(xlabel="particles N [1]", ylabel="peak RMS displacement [mm]", ylim=(0, None))
        figure.legend(*place.get_legend_handles_labels(), loc="outside upper left", ncols=3)
        for axis in (place, height):
            axis.set_xticks(first.particles)
    return figure


def _narrow(label):
    return textwrap.fill(label, 20)


def picture_hysteresis(path: FileName | None, sweeps: Mapping[str, Any]) -> Figure:
    """Sweeps up and down, the state carried on: a column a filling, a row a particle number."""
    particles = next(iter(sweeps.values())).up.particles
    count = len(sweeps)
    size = (1.0 + 2.05 * count, 1.0 + 2.3 * len(particles))
    shape = {"squeeze": False, "sharex": True, "sharey": "row"}
    with picture(path, len(particles), count, size, **shape) as (figure, axes):
        for column, (label, sweep) in zip(axes.T, sweeps.items()):
            column[0].set_title(_narrow(styles_of(sweeps)[label].label))
            for k, axis in enumerate(column):
                _draw_ways(axis, sweep, k)
            column[-1].set_xlabel("frequency f / f$_0$ [1]")
        for k, axis in enumerate(axes[:, 0]):
            axis.set_ylabel(f"{particles[k]} particles:\nRMS displacement [mm]")
        handles, _ = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles=handles, loc="outside upper center", ncols=_columns(figure, handles))
    return figure


def _draw_ways(axis, sweep, k):
    """Each seed a line; up and down apart by colour and mark."""
    ways = (
        (sweep.up, "frequency rising", _SHADES(0.15), ">"),
        (sweep.down, "frequency falling", _SHADES(0.75), "<"),
    )
    for seed in range(len(sweep.up.seeds)):
        for values, words, colour, mark in ways:
            look = {"color": colour, "marker": mark, "ms": 3, "label": words if seed == 0 else None}
            axis.plot(sweep.up.ratios, 1e3 * values.rms[k, :, seed], **look)


class ResponsePlots:
    """Pictures of a response, as matplotlib figures; written as PNG where a ``path`` is given."""

    def __init__(self, response: Any):
        self._response = response

    def curves(self, measure: str = "rms", *, path: FileName | None = None) -> Figure:
        """Draw a measure over frequency: median over seeds, shaded from lowest to highest."""
        return self._curves(choice("measure", measure, self._response.units), path)

    def _curves(self, name, path=None, rows=None):
        """The same; rows: which of the particle numbers, all if None."""
        response = self._response
        with picture(path, size=(7.2, 4.0)) as (figure, axis):
            if name == "rms":
                # Without damping the empty container has no end at its natural frequency.
                with np.errstate(divide="ignore", invalid="ignore"):
                    _draw_curves(axis, response, rows)
                axis.set_ylim(0.0, None)
            else:
                for k, particles in enumerate(response.particles):
                    shade, values = _shade(response, k), getattr(response, name)[k]
                    _band(axis, response.ratios, values, shade, f"{particles} particles")
                words = f"{name.replace('_', ' ')} [{response.units[name]}]"
                axis.set(xlabel="frequency f / f$_0$ [1]", ylabel=words)
            _explain_curves(axis, response)
        return figure

    def peaks(self, *, path: FileName | None = None) -> Figure:
        """Draw place and height of the peaks over the particle number."""
        return picture_peaks(path, {self._response.label: self._response})


def _explain_curves(axis, response):
    """Marks where a curve is a point, legend, and what the bands are."""
    if len(response.ratios) == 1:
        for line in axis.lines:
            line.set_marker("o")
    handles, _ = axis.get_legend_handles_labels()
    if len(response.seeds) > 1:
        axis.set_title(f"median of {len(response.seeds)} seeds")
        handles.append(_band_key())
    axis.legend(handles=handles, loc="center left", bbox_to_anchor=(1.0, 0.5))


class SweepPlots:
    """Pictures of a sweep; functions as those of ``ResponsePlots``."""

    def __init__(self, sweep: Any):
        self._sweep = sweep

    def hysteresis(self, *, path: FileName | None = None) -> Figure:
        """Draw the RMS over frequency, up and down, each seed a line."""
        return picture_hysteresis(path, {self._sweep.up.label: self._sweep})


@dataclass(frozen=True, eq=False)
class FilmMeasures:
    """Measures of the particles in every frame of filmed cycles; arrays (cycles, frames)."""

    phase: np.ndarray
    height_mm: np.ndarray
    above_floor_mm: np.ndarray
    floor: np.ndarray
    ceiling: np.ndarray

    @classmethod
    def of(cls, box: Any, cycles: Any, phase: Any) -> Any:
        """Measures of a BoxSize with at least one particle; cycles: each a list of SceneFrame."""
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
    """Mean height of the particles and how many touch floor and ceiling, over one closed cycle."""
    styles, time = styles_of(next(iter(measures.values()))), np.linspace(0.0, 1.0, 200)
    shape = {"size": (2.85 * len(measures) + 0.6, 5.7), "sharex": True, "sharey": "row"}
    with picture(path, 2, len(measures), squeeze=False, **shape) as (figure, panels):
        for top, bottom, (title, fillings) in zip(*panels, measures.items()):
            motion = amplitude * np.sin(2.0 * np.pi * time)
            top.plot(time, motion, color=GREY, linestyle=":", label="container")
            top.set_title(title)
            for label, cycle in fillings.items():
                _draw_cycle(top, bottom, cycle, styles[label])
            bottom.set(xlabel="phase of the container [cycles]", xlim=(0.0, 1.0), ylim=(0.0, None))
        panels[0, 0].set_ylabel("mean height in the room\nless that at rest [mm]")
        panels[1, 0].set_ylabel("particles that touch [%]")
        ends = {"-": "floor", "--": "ceiling"}
        keys = [line_key(words, color=BLACK, ls=line) for line, words in ends.items()]
        panels[1, 0].legend(handles=keys, loc="upper right")
        keys, _ = panels[0, 0].get_legend_handles_labels()
        keys.append(area_key("± standard deviation of the cycles", fc=GREY, alpha=0.3))
        figure.legend(handles=keys, loc="outside upper left", ncols=2)


def _draw_cycle(top, bottom, cycle, style):
    """Curves of a filling: means over the cycles, and the spread of the height between them."""
    # The cycle is closed: it ends as it begins.
    phase, ends = np.append(cycle.phase, 1.0), {"-": cycle.floor, "--": cycle.ceiling}
    height, spread = (_closed(over(cycle.height_mm, axis=0)) for over in (np.mean, np.std))
    look = {"color": style.colour, "marker": style.marker, "ms": 4}
    top.plot(phase, height, label=style.label, **look)
    band = {"color": style.colour, "alpha": 0.18, "linewidth": 0}
    top.fill_between(phase, height - spread, height + spread, **band)
    for line, share in ends.items():
        percent = 100.0 * _closed(share.mean(axis=0))
        bottom.plot(phase, percent, linestyle=line, **look)


def _closed(values):
    return np.append(values, values[:1])
