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

import _step_too_large as shown
from taichi_dem import (
    CONCRETE,
    At,
    RunView,
    Scene,
    SimulationDiverged,
    Uniform,
    Watch,
    effects,
    quality_report,
    simulate,
)
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import finish, main, number, parser
from taichi_dem.mesh.shapes import bar
from taichi_dem.simulation import macro_steps

NAME = "demo_step_too_large"
#: Steps as shares of the limit, by what sets it; the first is safe, the second just too large.
QUICK = {"dashpots": (0.9, 1.3)}
FULL = {"dashpots": (0.9, 1.3, 2.0), "springs": (0.9, 1.1, 1.3)}
#: Simulated time [s], looks on the way.
UNTIL, SAMPLES = {"dashpots": 4e-5, "springs": 2e-4}, 200
BAR = bar(0.4, 0.1, (8, 2, 2))
#: Steps before the first look: until then the blow has given too little for the account to close.
UNHEEDED = 5


def options_parser():
    """Options of this demonstration."""
    made = parser(NAME, __doc__)
    made.add_argument("--peak", type=number(0, 1e8), default=1e6, help="of the blow [Pa], 1e6")
    return made


def struck_bar(limit, peak):
    """The scene: a bar under a short blow on its left end, with or without dashpots."""
    blow = effects.GasPressure("left", peak=peak, rise=5e-6, decay_ratio=2.0)
    damping = [effects.BondDamping()] if limit == "dashpots" else []
    return Scene(BAR, CONCRETE, [blow, *damping])


def strike(limit, share, peak):
    """Run the bar with a share of the limit as its step, to its end or as far as it goes."""
    scene = struck_bar(limit, peak)
    step = share * longest_step(limit)
    when = At([step * mark for mark in marks(macro_steps(UNTIL[limit], step))])
    energy = {"energy": RunView.energy_balance, "frame": RunView.frame}
    seen = Watch(when, time=lambda view: view.time_s, speed=shown.corner_speed, **energy)
    with ProgressBar(f"{share:g} x the limit of {limit}") as bar_shown:
        looks = {"samples": 1, "progress": bar_shown, "observers": [seen]}
        try:
            result = simulate(scene, method=Uniform(step), until=UNTIL[limit], **looks)
        except SimulationDiverged as diverged:
            result = diverged.result
            seen.observe(seen.view)
    return shown.Struck(limit, share, step, seen, result)


def longest_step(limit):
    """Longest safe step of the bar's worst body [s], by what sets it."""
    report = quality_report(BAR, CONCRETE)
    return float({"dashpots": report.dashpot_step_s, "springs": report.spring_step_s}[limit].min())


def marks(last):
    """Steps at which a run of so many is sampled, and looked at by the program."""
    evenly = {round(last * k / SAMPLES) for k in range(1, SAMPLES + 1)}
    return sorted({0, *(step for step in evenly if step >= UNHEEDED)})


def run(options):
    """Strike the bar with every step, compare, picture."""
    cases = (QUICK if options.quick else FULL).items()
    output_folder(options.out)
    runs = [strike(limit, share, options.peak) for limit, shares in cases for share in shares]
    shown.print_runs(runs)
    shown.write(runs, options.out)
    figures = shown.figures_of(runs, {limit: longest_step(limit) for limit in UNTIL})
    reports = [made.result.report for made in runs]
    finish(options, NAME, figures, reports, caption=shown.caption(runs))


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
