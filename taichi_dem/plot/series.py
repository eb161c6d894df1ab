"""Curves over time: pressure, displacement, energy, levels."""

import numpy as np

from taichi_dem.plot.style import COLOURS, figure, save

_STORED = (
    ("kinetic_J", "kinetic"),
    ("bond_strain_J", "bond strain"),
    ("sphere_strain_J", "sphere strain"),
)
_SPENT = (
    ("bond_dashpot_J", "bond dashpots"),
    ("slip_J", "slip"),
    ("softening_J", "softening"),
    ("release_J", "release"),
    ("sphere_dashpot_J", "sphere dashpots"),
    ("friction_J", "friction"),
)


def plot_pressure(path, time_s, pressure_pa):
    """Pressure of the blast gas over time (Konno et al., Fig 11)."""
    fig, axes = figure(size=(5.6, 3.2))
    axes.plot(1e3 * np.asarray(time_s), 1e-6 * np.asarray(pressure_pa), color=COLOURS[1])
    axes.set(xlabel="time [ms]", ylabel="pressure [MPa]", title="Gas pressure on the hole")
    axes.set_ylim(bottom=0.0)
    save(fig, path)


def plot_energy(path, history):
    """Where the work of the gas went, stacked, and what the account cannot explain."""
    fig, (upper, lower) = figure(
        2, 1, size=(6.8, 6.2), sharex=True, gridspec_kw={"height_ratios": [3, 1]}
    )
    time = 1e3 * history["time_s"]
    terms = [term for term in (*_STORED, *_SPENT) if np.abs(history[term[0]]).max() > 0.0]
    upper.stackplot(
        time,
        [1e-3 * history[name] for name, _ in terms],
        labels=[label for _, label in terms],
        colors=COLOURS,
        alpha=0.85,
        linewidth=0,
    )
    given = history["load_work_J"] + history["support_work_J"] + history["injected_J"]
    upper.plot(time, 1e-3 * given, color="black", linestyle="--", label="work put in + injected")
    upper.set(ylabel="energy [kJ]", title="Energy account")
    upper.legend(loc="upper left", fontsize=8.5, frameon=False)
    scale = np.maximum(np.abs(history["load_work_J"]).max(), 1e-300)
    lower.plot(time, 100.0 * history["residual_J"] / scale, color=COLOURS[1])
    lower.axhline(0.0, color="black", linewidth=0.7)
    lower.set(xlabel="time [ms]", ylabel="residual\n[% of work]")
    save(fig, path)


def plot_history(path, history):
    """Displacement at the hole, broken faces and the smallest step over time."""
    fig, (top, middle, bottom) = figure(3, 1, size=(6.4, 6.8), sharex=True)
    time = 1e3 * history["time_s"]
    if "hole_radial_displacement_mm" in history:
        top.plot(time, history["hole_radial_displacement_mm"], label="mean of the hole's bodies")
        top.plot(time, history["monitor_displacement_mm"], label="body nearest to the free face")
        top.legend(frameon=False)
    top.set(ylabel="displacement [mm]", title="Motion, fracture and step over time")
    middle.step(time, history["broken_faces"], where="post", color=COLOURS[1])
    middle.set(ylabel="broken faces")
    bottom.step(time, history["smallest_step_s"], where="post", color=COLOURS[2])
    bottom.set(xlabel="time [ms]", ylabel="smallest step [s]", yscale="log")
    save(fig, path)


def plot_levels(path, time_s, shares, dt0):
    """Share of bodies on each level over time.

    shares: (sample_count, level_count), rows summing to 1. dt0: step of level 0 [s].
    """
    fig, axes = figure(size=(6.8, 4.0))
    labels = [f"{dt0 / 2.0**level:.2g} s" for level in range(shares.shape[1])]
    fade = np.linspace(0.92, 0.05, max(2, shares.shape[1]))
    colours = [(0.1 + 0.85 * f, 0.25 + 0.68 * f, 0.45 + 0.5 * f) for f in fade]
    axes.stackplot(1e3 * np.asarray(time_s), 100.0 * shares.T, labels=labels, colors=colours)
    axes.set(xlabel="time [ms]", ylabel="share of bodies [%]", title="Steps in use", ylim=(0, 100))
    place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    axes.legend(title="step", reverse=True, fontsize=8.5, frameon=False, **place)
    save(fig, path)


def plot_methods(path, series):
    """What each method spends over time, and how far its displacement lies from the uniform one.

    series: name -> columns with time_s, cpu_s, evaluations and monitor_displacement_mm.
    """
    fig, (left, right) = figure(1, 2, size=(9.6, 3.6))
    for colour, (name, made) in zip(COLOURS, series.items()):
        time = 1e3 * np.asarray(made["time_s"])
        left.plot(time, 1e-6 * np.asarray(made["evaluations"]), color=colour, label=name)
        right.plot(time, made["monitor_displacement_mm"], color=colour, label=name)
    left.set(xlabel="time [ms]", ylabel="evaluations [millions]", yscale="log")
    right.set(xlabel="time [ms]", ylabel="displacement [mm]")
    left.legend(frameon=False)
    save(fig, path)
