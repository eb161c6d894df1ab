"""Where does the automaton agree with spheres and with exact solutions, and where not?

Cases with a value that is known, exact or by the spheres: the swing of grains in a container that
is thrown up and down, the impact damper, loss and apparent mass at small amplitudes, the plug that
grains form without gravity, the peaks of the damped structure, and whether a motion lasts. Each is
run with the rules of the paper and with those of place. Expect the rules of place within the range
that is wanted in every row. The picture says where to trust either, over acceleration, frequency
and filling: how far the impedance that the container feels is from that of the spheres. A quick
run leaves out the peaks of the structure and the swing of few grains.

    python experiments/damper_validity.py                 # about five minutes on two cores
    python experiments/damper_validity.py --quick

Writes trust.png, validity.csv, trust.csv, validity.md and summary.json to
results/damper_validity/.
"""

import sys
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from _damper_validity import (
    IMPACT_CELLS,
    JUMP,
    Effort,
    exact_impact_rms,
    impact_rms,
    impedance_apart,
    jump_amplitude,
    late_by_early,
    loss_and_mass,
    mean_height,
    peak_of,
    plug_energy,
    swing_apart,
)
from ca_damper import Automaton, Spheres
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, picture, styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "damper_validity"
SETTINGS = {
    "seeds": (16, 4, study.whole(1, 1000), "starts that are averaged, 16"),
    "transient": (150, 25),
    "cycles": (20, 6),
    "long": (2000, 200),
    # Numbers of grains that swing, cycles of them that are filmed; those whose peaks are sought.
    "swings": ((40, 20, 5), (40,)),
    "filmed": (8, 4),
    "peaks": ((30, 50), ()),
    "jump": (JUMP, JUMP[::2]),
    "frequencies": ([4.0, 6.0, 10.0, 16.0, 25.0, 40.0, 64.0], [6.0, 50.0]),
    "accelerations": ([0.8, 1.2, 1.5, 2.0, 3.0, 5.0, 8.0], [1.5, 3.0]),
    "grains": ([5, 10, 30, 50], [10, 30]),
}
#: Fillings by column: rules of the first edition, of place, and the spheres; their steps [s].
FILLINGS = {
    "paper": (Automaton(rules="paper"), 1e-4),
    "place": (Automaton(), 1e-4),
    "dem": (Spheres(), 2e-5),
}
#: Numbers of grains that swing, with the gap, swing and lag that are wanted [mm, mm, degrees]: of
#: five grains the gap bounds the swing too.
SWINGS = {40: (2.5, 1.0, 8.0), 20: (2.5, 1.0, 8.0), 5: (3.0, 4.2, 5.0)}
#: Frequencies f/f0 among which peaks are sought.
RATIOS = np.arange(0.93, 1.0001, 0.005)
#: Shares at which the colours of the picture change.
SHADES = (0.0, 0.05, 0.1, 0.2, 0.4, 1.0)
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


class Row(NamedTuple):
    """A row of the table: value by spheres or exact, by both rules, and the range wanted."""

    key: str
    words: str
    unit: str
    exact: float
    paper: float
    place: float
    low: float
    high: float

    @property
    def met(self):
        """Whether the rules of place are within the range."""
        return bool(self.low <= self.place <= self.high)


def run(options):
    """Measure all rows and the map; write the table and the picture."""
    folder, rows = study.begin(options), []
    effort = Effort(options.seeds, options.transient, options.cycles)
    parts = (swing_rows, impact_rows, loss_rows, plug_rows, peak_rows, lasting_rows)
    with ProgressBar("rows and map") as progress:
        for k, part in enumerate(parts):
            progress.at(k / (len(parts) + 1))
            rows += part(options, effort)
        apart = trust(options, effort)
    study.print_table([cells_of(row) for row in rows], HEADER)
    print()
    study.write_rows(folder / "validity.csv", [{**row._asdict(), "met": row.met} for row in rows])
    write_text(folder / "validity.md", page_of(rows))
    write_trust(folder / "trust.csv", options, apart)
    picture_trust(folder / "trust.png", options, apart)
    study.finish(options, NAME, figures_of(rows, apart), effort.made)


def swing_rows(options, effort):
    """Mean height of the grains in a container that moves by +-24 mm at 6 Hz."""
    for count in options.swings:
        wanted = SWINGS[count]
        # Five grains meet seldom, and their seeds differ most.
        seeds = (4 if count == 5 else 1) * effort.seeds
        few = {"transient": effort.transient // 5, "cycles": options.filmed}
        spent = replace(effort, seeds=seeds, **few)
        curves = {name: mean_height(*one, count, spent) for name, one in FILLINGS.items()}
        apart = [swing_apart(curves[name], curves["dem"]) for name in ("paper", "place")]
        for k, (key, words, unit) in enumerate(
            (
                ("gap_mm", "RMS gap of the mean height", "mm"),
                ("swing_mm", "swing of the mean height", "mm"),
                ("lag_deg", "lag of the mean height", "deg"),
            )
        ):
            low = 0.0 if k == 0 else -wanted[k]
            title = f"N = {count}, +-24 mm, 6 Hz: {words}, less that of spheres"
            yield Row(f"{key}_N{count}", title, unit, 0.0, *(a[k] for a in apart), low, wanted[k])


def both(measure, *arguments):
    """A measure by the rules of the paper and by those of place."""
    return [measure(*FILLINGS[name], *arguments) for name in ("paper", "place")]


def impact_rows(options, effort):
    """The impact damper, for which there is a closed form."""
    own = FILLINGS["place"][0]
    exact = exact_impact_rms(own.wall_restitution, IMPACT_CELLS * own.width)
    title = "impact damper, 0.1 M, clearance 12 mm, no gravity, at f0: RMS"
    yield Row("impact_rms_mm", title, "mm", exact, *both(impact_rms, effort), 1.04, 1.10)


def loss_rows(options, effort):
    """Loss and apparent mass of a low heap that is shaken at 50 Hz."""
    spent = replace(effort, cycles=3 * effort.cycles)
    for gravity, mass_range in ((2.0, (0.85, 1.15)), (5.0, None)):
        exact, *found = (
            loss_and_mass(*FILLINGS[name], gravity, spent) for name in ("dem", "paper", "place")
        )
        share = 0.10 if gravity == 2.0 else 0.15
        key, title = f"{gravity:.0f}g", f"N = 30, 50 Hz, {gravity:.0f} g"
        limits = (1.0 - share) * exact[0], (1.0 + share) * exact[0]
        values = exact[0], *(one[0] for one in found)
        yield Row(f"loss_{key}", f"{title}: loss c / (N m w)", "1", *values, *limits)
        limits = exact[1] - 0.05, exact[1] + 0.05
        if mass_range:
            limits = tuple(share * exact[1] for share in mass_range)
        values = exact[1], *(one[1] for one in found)
        yield Row(f"mass_{key}", f"{title}: apparent mass / (N m)", "1", *values, *limits)


def plug_rows(options, effort):
    """Energy of grains without gravity, which gather to a plug from some amplitude on."""
    spent = replace(effort, seeds=max(2, effort.seeds // 2), transient=30, cycles=10)
    amplitudes = np.concatenate([options.jump, [16e-3, 20e-3, 24e-3, 30e-3]])
    found = {name: plug_energy(*one, amplitudes, spent) for name, one in FILLINGS.items()}
    names, count = ("dem", "paper", "place"), len(options.jump)
    jump = [jump_amplitude(options.jump, found[name][:count]) for name in names]
    title = "no gravity, N = 40, 6 Hz"
    limits = 0.9 * jump[0], 1.1 * jump[0]
    yield Row("plug_jump_mm", f"{title}: amplitude of the jump", "mm", *jump, *limits)
    for k, amplitude in enumerate((16, 20, 24, 30), start=count):
        values = [float(found[name][k]) for name in names]
        # Before the jump grains take little, and how little is not asked for.
        limits = (0.85 * values[0], 1.15 * values[0]) if amplitude > 22 else (0.0, 1.0)
        words = f"{title}: energy a cycle / (N m A^2 w^2) at {amplitude} mm"
        yield Row(f"plug_energy_{amplitude}mm", words, "1", *values, *limits)


def peak_rows(options, effort):
    """Peaks of the damped structure."""
    spent = replace(effort, seeds=max(1, effort.seeds // 4))
    for count in options.peaks:
        dem = replace(effort, seeds=1)
        exact = peak_of(*FILLINGS["dem"], count, RATIOS, dem)
        found = both(peak_of, count, RATIOS, spent)
        limits = exact[0] - 0.003, exact[0] + 0.003
        values = exact[0], *(one[0] for one in found)
        yield Row(f"peak_ratio_N{count}", f"N = {count}: peak at f / f0", "1", *values, *limits)
        limits = 0.97 * exact[1], 1.03 * exact[1]
        values = exact[1], *(one[1] for one in found)
        yield Row(f"peak_rms_mm_N{count}", f"N = {count}: RMS at the peak", "mm", *values, *limits)


def lasting_rows(options, effort):
    """Whether a motion goes on: the response after a long time, over that after the transient."""
    spent = replace(effort, seeds=min(4, effort.seeds))
    values = both(late_by_early, spent, options.long)
    title = f"N = 10 near resonance: RMS after {options.long} cycles / that after {spent.transient}"
    yield Row("late_by_early_N10", title, "1", 1.0, *values, 0.97, 1.03)


def trust(options, effort):
    """Difference of the impedance from that of spheres, by number of grains and rules."""
    few = {"seeds": max(1, effort.seeds // 4), "transient": min(60, effort.transient)}
    spent = replace(effort, **few)
    axes = options.accelerations, options.frequencies
    return {count: impedance_apart(FILLINGS, count, *axes, spent) for count in options.grains}


HEADER = ("case", "spheres or exact", "paper", "place", "wanted", "met")


def cells_of(row):
    """Cells of the printed table."""
    unit = "" if row.unit == "1" else f" {row.unit}"
    wanted = f"{row.low:.3g} to {row.high:.3g}{unit}"
    numbers = [f"{value:.3g}{unit}" for value in (row.exact, row.paper, row.place)]
    return row.words, *numbers, wanted, "yes" if row.met else "no"


def page_of(rows):
    """The table in Markdown."""
    lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
    return "\n".join([*lines, *("| " + " | ".join(cells_of(row)) + " |" for row in rows)]) + "\n"


def figures_of(rows, apart):
    """Value by place, spheres or exact, first edition, and the range, of every row."""
    figures = {}
    for row in rows:
        parts = {"": row.place, "_exact": row.exact, "_paper": row.paper}
        parts.update({"_wanted_low": row.low, "_wanted_high": row.high})
        figures.update({f"{row.key}{end}": study.figure(x, row.unit) for end, x in parts.items()})
    figures["rows_met"] = study.figure(sum(row.met for row in rows), "1")
    figures["rows"] = study.figure(len(rows), "1")
    for name in ("paper", "place"):
        shares = np.concatenate([one[name].ravel() for one in apart.values()])
        figures[f"trusted_share_{name}"] = study.figure(float((shares < 0.2).mean()), "1")
    return figures


def write_trust(path, options, apart):
    """CSV of the map."""
    rows = [
        (count, name, gravity, frequency, shares[i, j])
        for count, by_name in apart.items()
        for name, shares in by_name.items()
        for i, gravity in enumerate(options.accelerations)
        for j, frequency in enumerate(options.frequencies)
    ]
    study.write_rows(path, rows, "particles rules acceleration_g frequency_Hz impedance_difference")


def picture_trust(path, options, apart):
    """A panel for each number of grains and rules: percent of difference, light is good."""
    labels = {name: styles_of([FILLINGS[name][0].label]) for name in ("paper", "place")}
    shape = {"size": (2.1 * len(apart) + 0.8, 6.4), "squeeze": False, "sharex": True}
    with picture(path, 2, len(apart), sharey=True, **shape) as (figure, panels):
        for row, name in zip(panels, labels):
            (style,) = labels[name].values()
            row[0].set_ylabel(f"{style.label}\nacceleration [g]")
            for axes, (count, shares) in zip(row, apart.items()):
                shade(axes, shares[name])
                axes.set_xticks(
                    range(len(options.frequencies)), map("{:g}".format, options.frequencies)
                )
                axes.set_yticks(
                    range(len(options.accelerations)), map("{:g}".format, options.accelerations)
                )
                axes.set_title(f"{count} grains")
        for axes in panels[-1]:
            axes.set_xlabel("frequency [Hz]")
        figure.suptitle("Difference of the impedance from that of spheres [%]")


def shade(axes, shares):
    """Cells of a map with their percent; white below 5 %, darker in steps."""
    level = np.digitize(shares, SHADES[1:])
    axes.imshow(level, cmap="YlOrRd", vmin=0, vmax=len(SHADES), origin="lower", aspect="auto")
    for (i, j), share in np.ndenumerate(shares):
        look = {"ha": "center", "va": "center", "fontsize": 8.5}
        look["color"] = "white" if level[i, j] > 0.6 * len(SHADES) else BLACK
        axes.text(j, i, f"{100.0 * min(share, 9.99):.0f}", **look)
    axes.grid(False)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
