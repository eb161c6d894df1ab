"""How much do grains damp over amplitude and gap, and how to use it?

A driven container gives loss c / (N m w) and apparent mass / (N m) of the grains, which depend on
its peak acceleration in g and on the gap by its amplitude: below 1 g grains lie still and only add
mass. Times the mass ratio N m / M, half of the loss is the damping ratio that a structure gains.
The table for finite-element codes, for every acceleration and gap, has the dashpot and the mass of
these grains, too. As a check they are put into a plain oscillator: expect its peak within 5 % of
that of the structure with grains, whatever the base's amplitude.

Where automaton and spheres differ, over frequency and without gravity too, shows damper_trust.py.

    python experiments/damper_maps.py            # three minutes on one core
    python experiments/damper_maps.py --particles 20

Writes chart.png, equivalent.csv, check.csv and summary.json to results/damper_maps/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

import ca_damper as ca
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, WINE, picture
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_maps"
SETTINGS = {
    "particles": (30, 30, study.whole(1, 100), "grains of the chart, 30"),
    # Clearances of the chart in diameters; accelerations of the chart and of the check.
    "gaps": ((1, 2, 3, 4, 6, 8, 12, 16), (2, 6)),
    "levels": (14, 5),
    "fine": (40, 16),
    "bases": ((0.2, 0.3, 0.45, 0.6, 0.9, 1.2, 1.8), (0.3, 0.6, 1.2)),
    "response": (np.arange(0.93, 1.0201, 0.005), np.arange(0.94, 1.001, 0.01)),
    "cycles": ((100, 50), (20, 10)),
    "seeds": (2, 1),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
FILLING, OWN, GRAVITY = ca.Automaton(), ca.Oscillator(), 9.81
#: Accelerations of the chart and of the check [g]; mass ratios of the table.
CHART, CHECK, MASS_RATIOS = (0.7, 10.0), (0.1, 6.0), (0.02, 0.05, 0.1)
CYCLES = "transient_cycles", "measured_cycles"


def driven(options, levels, progress, **box):
    """A map over accelerations [g] at the natural frequency of the structure."""
    omega = 2.0 * np.pi * OWN.natural_frequency
    axes = {"amplitudes": levels * GRAVITY / omega**2, "frequencies": OWN.natural_frequency}
    axes |= {"particles": options.particles, "seeds": options.seeds, "progress": progress}
    return ca.damper_map(FILLING, **axes, **dict(zip(CYCLES, options.cycles)), **box)


def equivalent(made):
    """Rows of the table for finite-element codes: means over the seeds."""
    omega, rows = float(made.omega[0, 0]), []
    mass = float(made.mass.ravel()[0])
    for gap, loss, share in zip(made.gaps[:, 0], made.loss[:, 0], made.mass_share[:, 0]):
        for size, c, m in zip(made.amplitudes, loss[:, 0].mean(-1), share[:, 0].mean(-1)):
            row = {"acceleration_g": size * omega**2 / GRAVITY, "gap_over_amplitude": gap / size}
            row.update(amplitude_m=size, gap_m=gap, loss=c, mass_share=m)
            row.update(dashpot_N_s_m=c * mass * omega, added_mass_kg=m * mass)
            row.update({f"damping_ratio_at_{100 * r:g}_percent": 0.5 * r * c for r in MASS_RATIOS})
            rows.append(row)
    return pd.DataFrame(rows)


def peak_of_equivalent(made, base):
    """Peak RMS [m] of an oscillator with the dashpot and mass of the grains at its amplitude.

    The largest amplitude A that some frequency sustains: |K + i w C| y0 >= A |K - (M + m) w^2 +
    i w (C + c)|, c and m by the acceleration of A at w.
    """
    amplitude = np.linspace(made.amplitudes[0], made.amplitudes[-1], 4000)[:, None]
    omega = 2.0 * np.pi * OWN.natural_frequency * np.linspace(0.85, 1.05, 400)
    level, mass = amplitude * omega**2, float(made.mass.ravel()[0])
    known = np.array(made.amplitudes) * float(made.omega[0, 0]) ** 2
    loss, share = (one[0, 0, :, 0].mean(-1) for one in (made.loss, made.mass_share))
    damping = OWN.damping + np.interp(level, known, loss) * mass * omega
    heavy = OWN.mass + np.interp(level, known, share) * mass
    held = np.abs(OWN.stiffness - heavy * omega**2 + 1j * omega * damping)
    pushed = base * np.abs(OWN.stiffness + 1j * omega * OWN.damping)
    kept = (pushed >= amplitude * held).any(axis=1)
    return float(amplitude[kept].max()) / np.sqrt(2.0)


def check(options, made, progress):
    """Peaks of the structure with grains and of the equivalent oscillator, a row a base."""
    job = {"particles": options.particles, "ratios": options.response, "seeds": options.seeds}
    job["base_amplitude"] = [1e-3 * base for base in options.bases]
    job |= {**dict(zip(CYCLES, options.cycles)), "progress": progress}
    peaks = ca.frequency_response(FILLING, **job).peaks()[1][:, 0]
    plain = [peak_of_equivalent(made, base) for base in job["base_amplitude"]]
    found = {"grains_mm": 1e3 * peaks.mean(axis=1), "equivalent_mm": 1e3 * np.array(plain)}
    table = pd.DataFrame({"base_mm": options.bases, **found})
    return table.assign(error_percent=100.0 * (table.equivalent_mm / table.grains_mm - 1.0))


def draw(path, table, checked):
    """Loss and apparent mass over acceleration and gap, and the check."""
    shown = {"loss": ("loss c / (N m ω)", "viridis"), "mass_share": ("mass / (N m)", "cividis")}
    with picture(path, 1, 3, (13.5, 4.8)) as (_, axes):
        for axis, (name, (words, colours)) in zip(axes, shown.items()):
            x, y = np.log10(table.acceleration_g), np.log10(table.gap_over_amplitude)
            drawn = axis.tricontourf(x, y, table[name], levels=10, cmap=colours)
            lines = axis.tricontour(x, y, table[name], levels=drawn.levels[::2], colors="white")
            axis.clabel(lines, fontsize=9)
            for side, ticks in (("x", (1, 2, 3, 5, 10)), ("y", (0.1, 0.3, 1, 3, 10, 30))):
                getattr(axis, f"set_{side}ticks")(np.log10(ticks), [f"{one:g}" for one in ticks])
            axis.set(title=words, xlabel="peak acceleration [g]", ylabel="gap / amplitude [1]")
            axis.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))
        axes[2].plot(checked.base_mm, checked.grains_mm, "P", ms=11, color=WINE, label="grains")
        label = "plain oscillator with their dashpot and mass"
        axes[2].plot(checked.base_mm, checked.equivalent_mm, color=BLACK, lw=2.0, label=label)
        words = f"check: within {checked.error_percent.abs().max():.1f} %"
        axes[2].set(title=words, xlabel="amplitude of the base [mm]", ylim=(0.0, None))
        axes[2].set_ylabel("peak RMS of the structure [mm]")
        axes[2].legend()


def run(options):
    """Map, tabulate, check, picture."""
    folder, cell = study.begin(options), FILLING.width
    with ProgressBar("chart") as bar:
        levels = np.geomspace(*CHART, options.levels)
        chart = driven(options, levels, bar, clearances=[cell * gap for gap in options.gaps])
    with ProgressBar("own box") as bar:
        own = driven(options, np.geomspace(*CHECK, options.fine), bar)
    with ProgressBar("check") as bar:
        checked = check(options, own, bar)
    table = equivalent(chart)
    table.to_csv(folder / "equivalent.csv", index=False)
    checked.to_csv(folder / "check.csv", index=False)
    print(checked.to_string(index=False, float_format="{:.3g}".format), "\n")
    draw(folder / "chart.png", table, checked)
    best = table.loc[table.loss.idxmax()]
    figures = {"largest_loss": (float(best.loss), "1")}
    figures["largest_loss_at_g"] = float(best.acceleration_g), "g"
    figures["largest_loss_at_gap"] = float(best.gap_over_amplitude), "1"
    figures["largest_error_percent"] = float(checked.error_percent.abs().max()), "%"
    study.finish(options, NAME, figures, [*chart.reports, *own.reports], see="chart.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
