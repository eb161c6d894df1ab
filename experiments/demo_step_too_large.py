"""What goes wrong when the step is too large, and what does the program say?

A bonded bar is struck on one end, with steps a little below and above what its bonds bear: with
dashpots the limit is theirs, without them it is that of the springs, some thirty times longer.
Below, the energy account closes whatever the step. Above, a shaking from body to body grows by the
same factor every step, out of nothing, until the program ends the run and says where and why.

    python experiments/demo_step_too_large.py             # half a minute
    python experiments/demo_step_too_large.py --quick     # dashpots only

The limits are those of the worst body and err on the safe side, so the smallest step that
diverges lies a little above. Writes shaken.gif, energy.png, steps.csv, history_*.csv and
summary.json to results/demo_step_too_large/.
"""

import sys
from functools import partial

import taichi_dem as dem
from _step_too_large import TABLE, Struck, caption, corner_speed, write
from taichi_dem.kit import study
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar
from taichi_dem.observers import macro_steps
from taichi_dem.simulate import result_of

NAME = "demo_step_too_large"
SETTINGS = {
    "peak": (1e6, 1e6, study.number(0, 1e8), "of the blow [Pa], 1e6"),
    # Steps as shares of the limit; the first is safe, the second just too large.
    "shares": (
        {"dashpots": (0.9, 1.3, 2.0), "springs": (0.9, 1.1, 1.3)},
        {"dashpots": (0.9, 1.3)},
    ),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Simulated time [s], looks on the way.
UNTIL, SAMPLES = {"dashpots": 4e-5, "springs": 2e-4}, 200
BAR = bar(0.4, 0.1, (8, 2, 2))
#: Steps before the first look: until then the blow has given too little for the account to close.
UNHEEDED = 5


def struck_bar(limit, peak):
    """The scene: a bar under a short blow on its left end, with or without dashpots."""
    blow = dem.effects.GasPressure("left", peak=peak, rise=5e-6, decay_ratio=2.0)
    damping = [dem.effects.BondDamping()] if limit == "dashpots" else []
    return dem.Scene(BAR, dem.CONCRETE, [blow, *damping])


def strike(limit, share, peak):
    """Run the bar with a share of the limit as its step, to its end or as far as it goes."""
    step, until = share * longest_step(limit), UNTIL[limit]
    when = dem.At([step * mark for mark in marks(macro_steps(until, step))])
    energy = {"energy": dem.RunView.energy_balance, "frame": dem.RunView.frame}
    seen = dem.Collector(when, time=lambda view: view.time_s, speed=corner_speed, **energy)
    with ProgressBar(f"{share:g} x the limit of {limit}") as bar_shown:
        looks = {"samples": 1, "progress": bar_shown, "observers": [seen]}
        method, scene = dem.Uniform(step), struck_bar(limit, peak)
        result = result_of(dem.simulate, scene, method=method, until=until, **looks)
    if result.diverged:
        seen.observe(seen.view)
    return Struck(limit, share, step, seen, result)


def longest_step(limit):
    """Longest safe step of the bar's worst body [s], by what sets it."""
    limits = dem.step_report(dem.Scene(BAR, dem.CONCRETE, [dem.effects.BondDamping()])).limits
    return float(limits["bond_dashpot" if limit == "dashpots" else "bond_stiffness"].min())


def marks(last):
    """Steps at which a run of so many is sampled, and looked at by the program."""
    evenly = {round(last * k / SAMPLES) for k in range(1, SAMPLES + 1)}
    return sorted({0, *(step for step in evenly if step >= UNHEEDED)})


def run(options):
    """Strike the bar with every step, compare, picture."""
    at, cases = study.output_paths(options.out), options.shares.items()
    runs = [strike(limit, share, options.peak) for limit, shares in cases for share in shares]
    rows = TABLE.rows(runs)
    TABLE.show(rows)
    said = [f"  {made.limit}, {made.share:g}: {made.sentence}" for made in runs if made.sentence]
    print("What the program said:", *said, "", sep="\n")
    write(runs, rows, at)
    figures = {f"limit_{limit}_s": (longest_step(limit), "s") for limit in UNTIL}
    for row in rows:
        figures.update(TABLE.figures(row, "{limited_by}_{share_of_limit:g}_{key}"))
    reports = [made.result.report for made in runs]
    study.finish(options, NAME, figures, reports, caption=caption(runs))


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
