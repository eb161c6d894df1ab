"""Pictures of responses over frequency: curves with bands over seeds, measures, hysteresis."""

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from ca_damper.oscillator import Oscillator
from taichi_dem.kit.plot_style import GREY, STYLES, area_key, picture, styles_of
from taichi_dem.kit.validation import FileName, choice

_SHADES = colormaps["viridis"]
_FINE = 400


def picture_responses(path: FileName, responses: Mapping[str, Any], particle_mass: float) -> None:
    """A panel a filling: RMS over frequency for every particle number (Figs. 3 and 11); the peaks.

    responses: Response by label. particle_mass [kg], for the rigid mass drawn for scale.
    """
    count = len(responses)
    columns = 2 if count < 4 else 3
    rows = (count + 2 + columns - 1) // columns
    size = (min(4.2, 9.2 / columns) * columns, 3.0 * rows)
    with picture(path, rows, columns, size, squeeze=False) as (figure, axes):
        panels = axes.ravel()
        for axis, (label, response) in zip(panels, responses.items()):
            _draw_curves(axis, response)
            axis.set_title(styles_of(responses)[label].label)
        _share_height(panels[:count])
        _legend_of_bands(figure, panels[0])
        _draw_peaks(panels[count], panels[count + 1], responses, particle_mass)
        for axis in panels[count + 2 :]:
            axis.set_axis_off()


def picture_compared(path: FileName, curves: Any, oscillator: Oscillator) -> None:
    """Curves of several fillings: mean over seeds as lines, their range as bars; empty dotted.

    curves: (ratios f/f0, RMS displacement [m] as (ratios, seeds)) by label.
    """
    styles = styles_of(curves)
    with picture(path, 1, 1, (7.0, 4.6)) as (_, axis):
        for label, (ratios, rms) in curves.items():
            _bars(axis, ratios, 1e3 * rms, 1e3 * rms.mean(axis=1), styles[label], 4)
        top = 1.15e3 * max(np.nanmax(rms) for _, rms in curves.values())
        _draw_empty(axis, oscillator, np.concatenate([ratios for ratios, _ in curves.values()]))
        axis.set(title="mean over seeds; bars: their range", ylim=(0.0, top))
        axis.legend()


def _draw_curves(axis, response, rows=None):
    """Median over seeds as lines, lowest and highest as bands; the empty container dotted.

    rows: which of the particle numbers; all if None.
    """
    for k in range(len(response.particles)) if rows is None else rows:
        label = f"{response.particles[k]} particles"
        _band(axis, response.ratios, 1e3 * response.rms[k], _shade(response, k), label)
    _draw_empty(axis, response.oscillator, response.ratios)


def _draw_empty(axis, oscillator, ratios):
    """The empty container over the range of the ratios; labels of both axes."""
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
    """Columns of a legend over the figure: as many as it has room for."""
    return max(1, min(5, len(handles), int(figure.get_figwidth() / 1.8)))


def _legend_of_bands(figure, axis):
    """Legend above all panels, made from one of them: what bands are is its last entry."""
    handles, _ = axis.get_legend_handles_labels()
    handles.append(_band_key())
    figure.legend(handles=handles, loc="outside upper center", ncols=_columns(figure, handles))


def _band_key():
    return area_key("lowest to highest seed", fc=GREY, alpha=0.3)


def _shade(response, k):
    return _SHADES(0.1 + 0.8 * k / max(1, len(response.particles) - 1))


def _share_height(panels):
    """The same height for all, without the peak of the empty container."""
    highest = max(np.nanmax(line.get_ydata()) for axis in panels for line in axis.lines[:-1])
    for axis in panels:
        axis.set_ylim(0.0, 1.08 * highest)


def _draw_peaks(place, height, responses, particle_mass=None):
    """Place and height of the peaks over the particle number; bars from seed to seed.

    particle_mass [kg]: of the rigid mass drawn for scale, None for none.
    """
    styles = styles_of(responses)
    for label, response in responses.items():
        ratio, rms = response.peaks()
        for axis, values in ((place, ratio), (height, 1e3 * rms)):
            middle = np.median(values, axis=1)
            _bars(axis, response.particles, values, middle, styles[label], 4.5)
    first = next(iter(responses.values()))
    if particle_mass is not None:
        rigid = [first.oscillator.peak(n * particle_mass) for n in first.particles]
        words = "rigid mass of the same weight"
        place.plot(first.particles, [r for r, _ in rigid], color=GREY, ls=":", label=words)
    place.set(title="place of the peak; bars: seeds", xlabel="particles N [1]")
    place.set_ylabel("f / f$_0$ of the peak [1]")
    height.set(title="its height; bars: seeds", xlabel="particles N [1]")
    height.set(ylabel="peak RMS displacement [mm]", ylim=(0, None))
    keys, labels = place.get_legend_handles_labels()
    height.figure.legend(keys, labels, loc="outside lower right", ncols=3)
    for axis in (place, height):
        axis.set_xticks(first.particles)


def picture_measures(path: FileName, responses: Mapping[str, Any], particle_mass: float) -> None:
    """Apparent mass and loss factor over frequency: a column a filling, a line a particle number.

    Apparent mass as a share of the particles' own: 1 for a rigid mass.
    """
    count = len(responses)
    size = (1.0 + 2.05 * count, 5.4)
    shape = {"squeeze": False, "sharex": True, "sharey": "row"}
    with picture(path, 2, count, size, **shape) as (figure, axes):
        for column, (label, response) in zip(axes.T, responses.items()):
            for k, particles in enumerate(response.particles):
                if particles > 0:
                    _draw_measures(column, response, k, particle_mass)
            column[0].set_title(_narrow(styles_of(responses)[label].label))
            column[0].axhline(1.0, color=GREY, ls=":", lw=1.0, label="rigid mass")
            column[1].set_xlabel("frequency f / f$_0$ [1]")
        axes[0, 0].set_ylabel("apparent mass /\nmass of the particles [1]")
        axes[1, 0].set_ylabel("loss factor [1]")
        _legend_of_bands(figure, axes[0, 0])


def _narrow(label):
    """A label in lines that a column of four has room for."""
    return textwrap.fill(label, 20)


def _draw_measures(column, response, k, particle_mass):
    particles, colour = response.particles[k], _shade(response, k)
    share = response.apparent_mass[k] / (particles * particle_mass)
    _band(column[0], response.ratios, share, colour, f"{particles} particles")
    _band(column[1], response.ratios, response.loss_factor[k], colour, None)


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
        for way, words, colour, mark in ways:
            look = {"color": colour, "marker": mark, "ms": 3, "label": words if seed == 0 else None}
            axis.plot(sweep.up.ratios, 1e3 * way.rms[k, :, seed], **look)


class ResponsePlots:
    """Pictures of a response.

    Each function returns a matplotlib figure, which a notebook shows, and writes it as PNG where a
    ``path`` is given (InputError where it cannot).

    Examples
    --------
    ::

        response.plot.curves(path="rms.png")
        response.plot.curves("loss_factor")
    """

    def __init__(self, response: Any):
        self._response = response

    def curves(self, measure: str = "rms", *, path: FileName | None = None) -> Figure:
        """Draw a measure over frequency: median over seeds, shaded from lowest to highest.

        Parameters
        ----------
        measure : str
            Name of a measure of the response; the RMS beside that of the empty container.
        path : str or path, optional
        """
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
        with picture(path, 1, 2, size=(8.4, 3.6)) as (figure, (place, height)):
            _draw_peaks(place, height, {self._response.label: self._response})
        return figure


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
