"""Curves over time: energy, levels."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure

from taichi_dem.kit.plot_style import PURPLE, RED, picture, seconds
from taichi_dem.kit.validation import FileName
from taichi_dem.plot.view import shades

#: Energy terms from the bottom of the stack up, with colours and dashes: blue is held, orange lost
#: in bonds, purple in contacts; within a group they differ in lightness.
ENERGY_TERMS = {
    "kinetic_J": ("kinetic", "#08306B", "-"),
    "bond_strain_J": ("bond strain", "#3A87C2", "-"),
    "sphere_strain_J": ("contact strain", "#A6CEE8", "-"),
    "bond_dashpot_J": ("bond dashpots", "#FDBE85", "--"),
    "slip_J": ("slip", "#E6700F", "--"),
    "softening_J": ("softening", "#A63603", "--"),
    "release_J": ("release", "#5C1A00", "--"),
    "sphere_dashpot_J": ("contact dashpots", "#CDBDE3", "-."),
    "friction_J": ("friction", "#6F4FA0", "-."),
    "hysteresis_J": ("contact hysteresis", "#3F007D", "-."),
    "ground_dashpot_J": ("ground dashpots", "#8C8C8C", (0, (8, 2))),
}
_GIVEN = {
    "gas_work_J": ("gas work", "black", (0, (5, 1.5, 1, 1.5, 1, 1.5))),
    "injected_J": ("injected at release", PURPLE, ":"),
}


def _span(axes, time):
    """Limit an axis to the times there are; a run that ended at its start has but one."""
    axes.set_xlim(0.0, time[-1] if time[-1] > 0.0 else 1.0)


def plot_energy(result: Any, *, path: FileName | None = None) -> Figure:
    """Draw the terms of the energy balance over time, and what is unexplained."""
    history = result.series
    time = 1e3 * history["time_s"]
    present = {key: look for key, look in ENERGY_TERMS.items() if key in history}
    terms = {key: look for key, look in present.items() if np.abs(history[key]).max() > 0.0}
    options = {"sharex": True, "height_ratios": (3.2, 1)}
    with picture(path, 2, 2, size=(9.2, 5.6), **options) as (figure, panels):
        _stack(panels[0, 0], time, history, terms)
        _lines(panels[0, 1], time, history, terms)
        _unexplained(panels[1, 0], panels[1, 1], time, history)
        for axes in panels[1]:
            axes.set(xlabel="time [ms]")
            _span(axes, time)
        handles, labels = panels[0, 1].get_legend_handles_labels()
        figure.legend(handles[::-1], labels[::-1], loc="outside right upper")
    return figure


def _stack(axes, time, history, terms):
    values = [1e-3 * history[key] for key in terms]
    colours = [colour for _, colour, _ in terms.values()]
    axes.stackplot(time, values, colors=colours, edgecolor="white", linewidth=0.3)
    given = history["load_work_J"] + history["support_work_J"] + history["injected_J"]
    words = "work done + injected"
    axes.plot(time, 1e-3 * given, color="black", linestyle="--", linewidth=1.2, label=words)
    # Room for the legend above a work that rises early.
    top = 1.1 * axes.get_ylim()[1]
    axes.set(ylabel="energy [kJ]", title="Stored and dissipated, stacked", ylim=(None, top))
    axes.legend(handles=axes.lines, loc="upper left")


def _lines(axes, time, history, terms):
    given = {key: look for key, look in _GIVEN.items() if np.abs(history[key]).max() > 0.0}
    for key, (label, colour, line) in (*terms.items(), *given.items()):
        axes.plot(time, positive(history[key]), color=colour, label=label, linestyle=line)
    largest = max(1e-12, *(float(history[key].max()) for key in (*terms, *_GIVEN)))
    axes.set(yscale="log", ylim=(1e-6 * largest, 2.0 * largest))
    axes.set(ylabel="energy [J]", title="Every term of the account")


def positive(values: np.ndarray) -> np.ndarray:
    """Values for a logarithmic axis, NaN where there is nothing to show."""
    return np.where(values > 0.0, values, np.nan)


def _unexplained(axes, share_axes, time, history):
    """The residual, and its share of the work done so far, once there is some."""
    axes.plot(time, 1e-3 * history["residual_J"], color=RED)
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set(ylabel="unexplained\nenergy [kJ]")
    work = np.abs(history["load_work_J"]) + np.abs(history["support_work_J"])
    work = np.where(work > 1e-3 * work.max(), work, np.nan)
    share_axes.plot(time, 100.0 * np.abs(history["residual_J"]) / work, color=RED)
    share_axes.set(ylabel="unexplained\n[% of work so far]", ylim=(0.0, None))


def level_shades(count: int) -> Any:
    """Colours of so many levels, the coarsest first and lightest."""
    return shades("magma_r", 0.02, 0.92, max(2, count)).colors


def level_look(count: int) -> Any:
    """Arguments cmap and norm of a collection whose values are levels."""
    norm = BoundaryNorm(np.arange(count + 1) - 0.5, count)
    return {"cmap": ListedColormap(level_shades(count)[:count]), "norm": norm}


def level_names(dt0: float, count: int) -> Any:
    """Step of each level in words; dt0: of level 0 [s]."""
    return [seconds(dt0 / 2.0**level) for level in range(count)]


def draw_level_shares(
    owner: Any,
    axes: Any,
    time: np.ndarray,
    shares: np.ndarray,
    dt0: float,
    loc: str = "outside right center",
) -> None:
    """Share of bodies on each level over time, the coarsest at the bottom, with its legend."""
    count = shares.shape[1]
    areas = axes.stackplot(time, 100.0 * shares.T, colors=level_shades(count))
    axes.set(ylabel="share of bodies [%]", ylim=(0.0, 100.0))
    names = level_names(dt0, count)
    owner.legend(areas[::-1], names[::-1], title="step", loc=loc)


def level_shares(levels: Iterable[np.ndarray]) -> np.ndarray:
    """Share of bodies on each level: rows (sample, level) that sum to 1."""
    rows = [*levels]
    count = max(int(level.max()) for level in rows) + 1
    return np.array([np.bincount(level, minlength=count) / len(level) for level in rows])


def level_columns(shares: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a table, by name, of the result of ``level_shares``."""
    return {f"level_{k}": share for k, share in enumerate(shares.T)}


def plot_levels(path: FileName, time_s: np.ndarray, shares: np.ndarray, dt0: float) -> None:
    """Share of bodies on each level over time, the coarsest at the bottom."""
    time = 1e3 * np.asarray(time_s)
    with picture(path, size=(6.4, 3.6)) as (figure, axes):
        draw_level_shares(figure, axes, time, shares, dt0)
        axes.set(xlabel="time [ms]")
        _span(axes, time)
