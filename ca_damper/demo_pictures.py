"""Pictures and text of the demonstration: a container with free particles beside a rigid mass."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ca_damper.oscillator import Oscillator
from ca_damper.runs.film import Film
from ca_damper.theory.decay import logarithmic_decrement
from taichi_dem.kit.display import counted
from taichi_dem.kit.files import write_csv

#: Cycles are counted down to this amplitude; decrements are means above and below two [mm].
LEVEL, _ABOVE, _BELOW = 10.0, 12.0, 6.0
#: Peak acceleration at which particles begin to leave the floor [m/s^2].
_G = 9.81


@dataclass(frozen=True, eq=False)
class Decay:
    """Decays of a filling from several starts of each number of particles."""

    counts: Sequence[int]
    amplitude: np.ndarray
    x: np.ndarray

    def _of(self, array: np.ndarray, count: int) -> np.ndarray:
        starts = len(array) // len(self.counts)
        first = starts * list(self.counts).index(count)
        return array[first : first + starts]

    def amplitudes(self, count: int) -> np.ndarray:
        """Median over the starts of the amplitude of every cycle [mm]."""
        return 1e3 * np.median(self._of(self.amplitude, count), axis=0)

    def cycles(self, count: int) -> int | None:
        """Cycles until the amplitude is below ``LEVEL``, a median; None where it stays above."""
        below = 1e3 * self._of(self.amplitude, count) < LEVEL
        ends = np.where(below.any(axis=1), below.argmax(axis=1), np.inf)
        middle = float(np.median(ends))
        return int(middle) if np.isfinite(middle) else None

    def decrements(self, count: int) -> tuple[float | None, float | None]:
        """Mean decrement above 12 mm and below 6 mm; None where no cycle is there."""
        decrements = [logarithmic_decrement(x) for x in self._of(self.x, count)]
        size, lost = (np.concatenate(arrays) for arrays in zip(*decrements))
        parts = (lost[1e3 * size > _ABOVE], lost[1e3 * size < _BELOW])
        above, below = (float(part.mean()) if len(part) else None for part in parts)
        return above, below


def threshold_mm() -> float:
    """Amplitude at which the peak acceleration of the empty container is 1 g [mm]."""
    return 1e3 * _G / (2.0 * np.pi * Oscillator().natural_frequency) ** 2


def figures_of(decays: Mapping[str, Decay], options: Namespace) -> dict[str, tuple]:
    """Cycles and decrements of every filling."""
    figures: dict[str, tuple] = {"amplitude_at_1g_mm": (threshold_mm(), "mm")}
    for label, decay in decays.items():
        for count in decay.counts:
            figures[f"cycles_{label}_N{count}"] = (decay.cycles(count), "1")
        ends = decay.decrements(options.particles)
        for side, value in zip(("above_12mm", "below_6mm"), ends):
            figures[f"decrement_{side}_{label}_N{options.particles}"] = (value, "1")
    return figures


def write_decays(path: str, decays: Mapping[str, Decay]) -> None:
    """Write the amplitudes of all cycles as a CSV file."""
    cycles = {"cycle": np.arange(1, 1 + decays["rigid"].amplitude.shape[1])}
    for label, decay in decays.items():
        for count in decay.counts:
            cycles[f"amplitude_mm_{label}_N{count}"] = decay.amplitudes(count)
    write_csv(path, cycles)


def draw_films(path: str, page: str | None, films: tuple[Film, Film], options: Namespace) -> None:
    """Write the animation, and the page that plays it, None for none."""
    # Imported here, so that matplotlib loads only where a picture is drawn.
    from ca_damper.plot.boxes import BoxSize, Hanging, film_hanging
    from ca_damper.plot.containers import show_containers
    from taichi_dem.kit.plot_style import GREY, styles_of

    filling = films[1].filling
    box, style = BoxSize.of(filling), styles_of([filling.label])[filling.label]
    # The rigid mass moves as smoothly as the structure: its box is not staggered.
    plain = BoxSize(box.width, box.height, box.diameter)
    (fixed,), (free,) = (film.frames for film in films)
    block = [_stacked(frame, plain) for frame in fixed]
    curves = [(film.history["time_s"][:, 0], film.history["x"][:, 0]) for film in films]
    pair = [
        Hanging(f"{options.particles} fixed", plain, block, GREY, curves[0]),
        Hanging(f"{options.particles} free", box, free, style.colour, curves[1]),
    ]
    speed = 1e-3 * options.amplitude * 2.0 * np.pi * Oscillator().natural_frequency
    film_hanging(path, pair, speed)
    if page:
        show_containers(pair, page, open_browser=False)


def _stacked(frame, box):
    """The frame of a rigid mass with its particles in rows on the floor of the box."""
    row, column = np.divmod(np.arange(len(frame.position)), round(box.width / box.diameter))
    return replace(frame, position=box.diameter * (np.column_stack([column, row]) + 0.5))


def plot_decay(path: str, decays: Mapping[str, Decay], count: int, top: float) -> None:
    """Amplitude over cycles of a number of particles, free and fixed; top: of the start [mm]."""
    from taichi_dem.kit.plot_style import BLACK, GREY, picture, styles_of

    with picture(path, size=(7.0, 4.6)) as (_, axes):
        axes.axhline(LEVEL, color=BLACK, linewidth=0.8)
        dotted = {"linestyle": ":", "label": "peak acceleration 1 g"}
        axes.axhline(threshold_mm(), color=BLACK, linewidth=1.2, **dotted)
        for label, style in styles_of(decays).items():
            sizes, ends = decays[label].amplitudes(count), decays[label].cycles(count)
            words, colour = style.label, style.colour
            if label == "rigid":
                words, colour = "fixed", GREY
            name = f"{counted(count, 'particle')}, {words}"
            look = {"marker": style.marker, "markersize": 4, "linewidth": 1.0, "label": name}
            axes.plot(np.arange(len(sizes)) + 0.5, sizes, color=colour, **look)
            if ends is not None:
                axes.text(ends + 1.0, 1.02 * LEVEL, f"{ends} cycles", color=colour, va="bottom")
        axes.set(
            yscale="log",
            xlabel="time [cycles of the empty container]",
            ylabel="amplitude [mm]",
            xlim=(0, 25),
        )
        axes.set_ylim(2.0, 1.1 * top)
        axes.set_yticks([2, 5, 10, 20, 30], ["2", "5", "10", "20", "30"])
        axes.yaxis.set_minor_formatter("")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def sentences(decays: Mapping[str, Decay], filling: Any, options: Namespace) -> tuple[str, ...]:
    """The comparison in words."""
    count, oscillator = options.particles, Oscillator()
    load, mass = 1e3 * count * filling.particle_mass, 1e3 * oscillator.mass
    share = f"{load:g} g, {100.0 * load / mass:.0f} % of its mass"
    decay, rigid = decays[filling.label], decays["rigid"]
    return (
        f"The container weighs {mass:g} g, has a natural frequency of "
        f"{oscillator.natural_frequency:.2f} Hz and is released at {options.amplitude:g} mm.",
        f"With {counted(count, 'particle')} ({share}) fixed in it, "
        f"{_until(rigid.cycles(count))}; with free ones, {_until(decay.cycles(count))}.",
        *_lost(decay.decrements(count), rigid.decrements(count)),
    )


def _until(cycles):
    """When the amplitude fell below the level."""
    if cycles is None:
        return f"it still swings by more than {LEVEL:g} mm at the end"
    return f"it swings by less than {LEVEL:g} mm after {counted(cycles, 'cycle')}"


def _lost(ends, rigid):
    """Decrements above and below the threshold, where there are some; rigid: of a fixed mass."""
    above, below = ends
    if above is None or below is None:
        return ()
    return (
        f"The logarithmic decrement is {above:.2g} above {_ABOVE:g} mm and {below:.2g} below "
        f"{_BELOW:g} mm, that of the fixed mass {rigid[1]:.2g}: particles leave the floor where "
        f"the peak acceleration is above about 1 g, which is at {threshold_mm():.1f} mm.",
    )
