"""Which box of grains damps a structure best, how sure is that, and what does it cost to know?

Mass and greatest box are given; number and size of the grains and the clearance are sought. The
automaton searches, spheres confirm its winner and shift clearance, mass and size by an error of
manufacture, one at a time. Then spheres search too: expect the same optimum within the bars, for at
least five times the CPU time, compiling left out. A quick run looks at three boxes and heights
between them, and spheres do not search.

    python experiments/best_damper.py
    python experiments/best_damper.py --base 3   # thrown hard: spheres cost 1.7 times as much

Writes best.png, best.csv, best_spheres.csv and summary.json to results/best_damper/.
"""

import sys
from functools import partial

import numpy as np

from ca_damper import Oscillator, Spheres, best_damper
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, picture, styles_of
from taichi_dem.kit.study import number, several, whole

NAME = "best_damper"
SETTINGS = {
    "base": (0.6, 0.6, number(0.0, 100.0), "amplitude of the base [mm], 0.6"),
    "mass": (6.0, 6.0, number(0.0, 86.0), "of all grains [g], 6"),
    "box": ([60.0, 96.0],) * 2 + (several(number(0.0, 1e4)), "width, height at most [mm], 60,96"),
    "particles": ([5, 10, 20, 30, 50], [10], several(whole(1, 160)), "numbers, 5,10,20,30,50"),
    "tolerance": (0.1, 0.1, number(0.0, 0.5), "error of manufacture, 0.1"),
    "seeds": (3, 2, whole(2, 1000), "of the bars, 3"),
    "heights": (5, 3),
    "cycles": ((60, 15), (15, 5)),
    "both": (True, False),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def search(options, filling=None):
    """The best damper for the options, by a filling."""
    asked = {name: getattr(options, name) for name in ("particles", "tolerance", "seeds")}
    asked |= {"heights": options.heights, "cycles": options.cycles, "filling": filling}
    box = tuple(1e-3 * one for one in options.box)
    return best_damper(
        Oscillator(), 1e-3 * options.base, mass=1e-3 * options.mass, box=box, **asked
    )


def draw(path, found):
    """Peak over clearance by each filling that searched, and the errors of manufacture."""
    with picture(path, 1, len(found) + 1, (4.4 * (len(found) + 1), 4.6)) as (figure, axes):
        for axis, (label, best) in zip(axes, found.items()):
            draw_search(
                axis, best, f"{styles_of([label])[label].label}: {best.search_seconds:.0f} s"
            )
            axis.sharey(axes[0])
        axes[0].set_ylabel("largest RMS over the frequencies [mm]")
        first = next(iter(found.values()))
        values = {"as designed": first.confirmed, **first.errors}
        rows = np.arange(len(values))[::-1]
        middle, error = 1e3 * np.array([(one.mean, one.error) for one in values.values()]).T
        axes[-1].barh(rows, middle, xerr=error, color=styles_of(["dem"])["dem"].colour, alpha=0.7)
        axes[-1].set_yticks(rows, list(values))
        axes[-1].axvline(1e3 * first.fixed, color=BLACK, lw=2.0)
        axes[-1].axvline(1e3 * first.without, color=BLACK, lw=1.0, ls=":")
        axes[-1].set(title="the automaton's winner, by spheres", xlabel="largest RMS [mm]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=8)


def draw_search(axis, best, title):
    """Boxes of a first look, a line a number of grains; the winner on it, and its value by more."""
    for count, rows in best.table().groupby("particles"):
        axis.plot(1e3 * rows.clearance_m, 1e3 * rows.value_m, "o-", ms=4, label=f"{count} grains")
    place, looked = 1e3 * best.grains.clearance, 1e3 * dict(best.tried)[best.grains]
    bar = 1e3 * np.array([best.value.mean, best.value.error])
    look = {"color": BLACK, "zorder": 5}
    axis.plot(place, looked, "*", ms=13, label="the best", **look)
    axis.errorbar(place, *bar, fmt="s", ms=4, capsize=9, label="by more seeds and cycles", **look)
    axis.axhline(1e3 * best.fixed, color=BLACK, lw=2.0, label="fixed")
    axis.axhline(1e3 * best.without, color=BLACK, lw=1.0, ls=":", label="without")
    axis.set(title=title, xlabel="clearance [mm]", ylim=(0.0, None))


def figures_of(found):
    """The optimum of each filling, its bar and what it cost."""
    figures = {}
    for label, best in found.items():
        figures[f"particles_{label}"] = best.grains.particles, "1"
        figures[f"clearance_mm_{label}"] = 1e3 * best.grains.clearance, "mm"
        figures[f"peak_mm_{label}"] = 1e3 * best.value.mean, "mm"
        figures[f"peak_error_mm_{label}"] = 1e3 * best.value.error, "mm"
        figures[f"search_seconds_{label}"] = best.search_seconds, "s"
    first = next(iter(found.values()))
    figures["confirmed_mm"] = 1e3 * first.confirmed.mean, "mm"
    figures["confirmed_error_mm"] = 1e3 * first.confirmed.error, "mm"
    figures["worst_of_manufacture_mm"] = 1e3 * max(one.mean for one in first.errors.values()), "mm"
    figures["fixed_mm"] = 1e3 * first.fixed, "mm"
    figures["without_mm"] = 1e3 * first.without, "mm"
    if len(found) > 1:
        seconds = [best.search_seconds for best in found.values()]
        figures["times_faster"] = seconds[1] / seconds[0], "1"
    return figures


def run(options):
    """Search by the automaton, confirm, search by spheres, picture."""
    folder = study.begin(options)
    found = {"ca_place": search(options)}
    found["ca_place"].write_csv(folder / "best.csv")
    print(found["ca_place"])
    if options.both:
        found["dem"] = search(options, Spheres())
        found["dem"].write_csv(folder / "best_spheres.csv")
        print(f"\nby spheres: {found['dem']}")
    draw(folder / "best.png", found)
    study.finish(options, NAME, figures_of(found), 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
