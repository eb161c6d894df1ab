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

import os
import sys
from dataclasses import dataclass

import numpy as np

from _cli import figure, main, number, parser, print_table
from _demo import conclude
from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    effects,
    quality_report,
)
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar
from taichi_dem.output.record import Recorder
from taichi_dem.plot.shaken import film_shaken, picture_energy
from taichi_dem.simulation import macro_steps

NAME = "demo_step_too_large"
#: Steps as shares of the limit, by what sets it; the first is safe, the second just too large.
QUICK = {"dashpots": (0.9, 1.3)}
FULL = {"dashpots": (0.9, 1.3, 2.0), "springs": (0.9, 1.1, 1.3)}
#: Simulated time [s]; samples and pictures on the way.
UNTIL = {"dashpots": 4e-5, "springs": 2e-4}
SAMPLES, FRAMES = 200, 40
#: Steps before the first sample: until then the blow has given too little for the account to close.
UNHEEDED = 5


@dataclass(frozen=True, eq=False)
class Struck:
    """A run.

    limit: what sets it; share: of it that the step [s] has. frames: snapshots; speeds: of the
    fastest corner of every body in them [m/s], (frames, bodies). account: at every time [s].
    sentence: what the program said, "" when the run reached its end.
    """

    limit: str
    share: float
    step: float
    simulation: Simulation
    frames: tuple
    speeds: np.ndarray
    time: np.ndarray
    account: tuple
    sentence: str

    @property
    def residual(self):
        """Energy that the account cannot explain over that put in by then, at every time."""
        given = np.array([abs(row["load_work"]) for row in self.account])
        found = np.array([abs(row["residual"]) for row in self.account])
        return found / np.where(given > 0.0, given, np.inf)


def options_parser():
    """Options of this demonstration."""
    made = parser(NAME, __doc__)
    made.add_argument("--peak", type=number(0, 1e8), default=1e6, help="of the blow [Pa], 1e6")
    return made


def struck_bar(limit, peak):
    """The scene: a bar under a short blow on its left end, with or without dashpots."""
    blow = effects.GasPressure("left", peak=peak, rise=5e-6, decay_ratio=2.0)
    damping = [effects.BondDamping()] if limit == "dashpots" else []
    return Scene(bar(0.4, 0.1, (8, 2, 2)), CONCRETE, [blow, *damping])


def limits(mesh):
    """Longest safe step [s] of the worst body, by what sets it."""
    report = quality_report(mesh, CONCRETE)
    return {
        "dashpots": float(report.dashpot_step_s.min()),
        "springs": float(report.spring_step_s.min()),
    }


def strike(limit, share, peak):
    """Run the bar with a share of the limit as its step, to its end or as far as it goes."""
    scene = struck_bar(limit, peak)
    step = share * limits(scene.mesh)[limit]
    last, sentence = macro_steps(UNTIL[limit], step), ""
    with ProgressBar(f"{share:g} x the limit of {limit}") as shown:
        simulation = Simulation(scene, Uniform(step))
        recorder, speeds, times, account = Recorder(simulation, None), [], [], []
        simulation.start()
        for mark in marks(last):
            try:
                simulation.advance_to(mark)
            except SimulationDiverged as diverged:
                sentence = str(diverged)
            recorder.snapshot()
            speeds.append(corner_speeds(simulation))
            times.append(simulation.time_s)
            account.append(simulation.energy_balance.account())
            shown.at(mark / last)
            if sentence:
                break
    found = tuple(recorder.frames), np.array(speeds), np.array(times), tuple(account)
    return Struck(limit, share, step, simulation, *found, sentence)


def marks(last):
    """Steps at which a run of so many is sampled, and looked at by the program."""
    evenly = {round(last * k / SAMPLES) for k in range(1, SAMPLES + 1)}
    return sorted({0, *(step for step in evenly if step >= UNHEEDED)})


def corner_speeds(simulation):
    """Bound of the speed of every body's corners [m/s]: that of its centre and of its spin."""
    motion, radius = simulation.state.motion(), simulation.model.body_radius
    return np.linalg.norm(motion["velocity"], axis=1) + radius * np.linalg.norm(
        motion["spin"], axis=1
    )


def run(options):
    """Strike the bar with every step, compare, picture."""
    settings = QUICK if options.quick else FULL
    output_folder(options.out)
    runs = [
        strike(limit, share, options.peak) for limit, shares in settings.items() for share in shares
    ]
    print_runs(runs)
    picture(runs, options)
    simulations = [made.simulation for made in runs]
    conclude(options, NAME, figures_of(runs), caption(runs), simulations)


def caption(runs):
    """What to see, with the program's own words."""
    left, right = (
        f"steps of {1e9 * made.step:.0f} ns, {made.share:g} times what the {made.limit} bear: "
        f"{ended(made)}"
        for made in runs[:2]
    )
    return f"The same blow on the same bar. Left: {left}. Right: {right}."


def ended(made):
    """How a run ended, in words."""
    steps, missed = round(made.time[-1] / made.step), made.residual[-1]
    missed = f"{100 * missed:.2g} % of" if missed < 1.0 else f"{missed:.2g} times"
    if not made.sentence:
        return f"{missed} the energy put in is unexplained after {steps} steps"
    return (
        "neighbours shake against each other, ever more, until the program ends the run after "
        f"{steps} steps, when {missed} the energy put in has come from nowhere: "
        f'"{made.sentence}"'
    )


def print_runs(runs):
    """The runs as a table, and every sentence word for word."""
    rows = [
        (
            made.limit,
            f"{made.share:g}",
            f"{made.step:.3g}",
            f"{float(made.time[-1]):.3g}",
            f"{made.residual[-1]:.2g}",
            "diverged" if made.sentence else "done",
        )
        for made in runs
    ]
    header = ["limited by", "step / limit", "step [s]", "reached [s]", "unexplained / put in"]
    print_table(rows, [*header, "end"])
    print("\nWhat the program said:")
    for made in runs:
        if made.sentence:
            print(f"  {made.limit}, {made.share:g}: {made.sentence}")
    print()


def figures_of(runs):
    """Figures for summary.json."""
    figures = {}
    for limit, step in limits(runs[0].simulation.scene.mesh).items():
        figures[f"limit_{limit}_s"] = figure(step, "s")
    for made in runs:
        key = f"{made.limit}_{made.share:g}"
        figures[f"{key}_diverged"] = figure(int(bool(made.sentence)), "1")
        figures[f"{key}_reached_s"] = figure(float(made.time[-1]), "s")
        figures[f"{key}_unexplained"] = figure(float(made.residual[-1]), "1")
    return figures


def picture(runs, options):
    """Write the energy pictures, their tables and the film."""

    def at(name):
        return os.path.join(options.out, name)

    for made in runs:
        columns = {"time_s": made.time, "unexplained_over_put_in": made.residual}
        write_csv(at(f"history_{made.limit}_{made.share:g}.csv"), columns)
    rows = {
        "limited_by": [made.limit for made in runs],
        "share_of_limit": [made.share for made in runs],
        "step_s": [made.step for made in runs],
        "reached_s": [float(made.time[-1]) for made in runs],
        "sentence": [made.sentence for made in runs],
    }
    write_csv(at("steps.csv"), rows)
    picture_energy(at("energy.png"), runs)
    film_shaken(at("shaken.gif"), runs[0], runs[1], FRAMES)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
