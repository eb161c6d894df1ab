"""Response of the damped structure over frequency: spheres and three automata (Figs. 3 and 11).

    python experiments/damper_response.py                       # about six minutes on two cores
    python experiments/damper_response.py --fillings ca_static  # the best automaton: a minute
    python experiments/damper_response.py --quick

Every particle number, frequency and seed is a scene; all scenes of a filling run as one batch.
Bands are the lowest and highest of the seeds, lines their median. A rigid mass of the particles'
weight is drawn for scale: what the particles take off its peak is damping, what they shift beside
it is apparent mass. A sweep up and down, the state carried on, shows where two motions are
possible.

Responses and sweeps save themselves at their end, on Ctrl-C, and as often as --checkpoint-every
says; the same command with --resume goes on from there and repeats nothing.
"""

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ca_damper import Automaton, Response, Spheres, Sweep, frequency_response, sweep_up_and_down
from ca_damper.plot import picture_hysteresis, picture_measures, picture_responses
from ca_damper.response import Grid
from taichi_dem import InputError
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import (
    add_checkpoints,
    checkpoint_of,
    figure,
    finish,
    main,
    number,
    parser,
    print_table,
    several,
    take_defaults,
    whole,
    write_rows,
)

NAME = "damper_response"
#: 33 ratios f/f0, every 0.005 where the peaks of 0 to 50 particles lie.
COARSE = ([0.80, 0.84, 0.87, 0.89], [1.04, 1.06, 1.09, 1.12])
RATIOS = np.round(np.concatenate([COARSE[0], np.arange(0.90, 1.0201, 0.005), COARSE[1]]), 4)
#: Of both fillings [kg].
PARTICLE_MASS = Spheres().particle_mass
FULL = {
    "particles": [10, 20, 30, 40, 50],
    "fillings": ["dem", "ca_landing", "ca_ejection", "ca_static"],
    "seeds": 5,
    "dem_seeds": 1,
    "transient": 150,
    "measured": 20,
    "sweep_particles": [10, 50],
    "sweep_seeds": 2,
    "ratios": RATIOS,
}
QUICK = {
    **FULL,
    "particles": [10, 30],
    "seeds": 2,
    "transient": 20,
    "measured": 5,
    "sweep_particles": [10],
    "sweep_seeds": 1,
    "ratios": RATIOS[::4],
}


@dataclass
class Measured:
    """A filling's response and sweep, and the seconds they took."""

    response: Response
    sweep: Sweep
    compile_seconds: float
    run_seconds: float

    def peaks(self):
        """Rows of the response: particles, ratios of the peaks and their RMS [m], by seed."""
        return zip(self.response.particles, *self.response.peaks())


def fillings():
    """The fillings compared, by label."""
    made = [Spheres()]
    made += [Automaton(accounting=word) for word in ("landing", "landing+ejection", "all")]
    return {filling.label: filling for filling in made}


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__)
    made.add_argument("--fillings", type=several(str), help=", ".join(FULL["fillings"]))
    made.add_argument("--particles", type=several(whole(0, 160)), help="numbers, 10,20,30,40,50")
    made.add_argument("--seeds", type=whole(1, 1000), help="of the automata, 5")
    made.add_argument("--dem-seeds", type=whole(1, 1000), help="of the spheres, 1")
    made.add_argument("--transient", type=whole(0, 100000), help="cycles left out, 150")
    made.add_argument("--measured", type=whole(1, 1000), help="cycles measured, 20")
    made.add_argument("--dem-dt", type=number(0, 1), help="step of the spheres [s], 2e-5")
    made.add_argument("--ca-dt", type=number(0, 1), help="step of the automata [s], 1e-4")
    made.add_argument("--sweep-particles", type=several(whole(0, 160)), help="swept, 10,50")
    made.add_argument("--sweep-seeds", type=whole(1, 1000), help="swept, 2")
    add_checkpoints(made)
    return made


def run(options):
    """Measure all fillings, write tables and pictures."""
    take_defaults(options, FULL, QUICK)
    known = fillings()
    for label in options.fillings:
        if label not in known:
            raise InputError(f"fillings must be some of {', '.join(known)}, got {label!r}")
    if options.resume and not any(Path(options.out).glob("checkpoint_*.npz")):
        raise InputError(f"resume must be left out: there is no checkpoint in {options.out}")
    jobs = {label: jobs_of(known[label], options) for label in options.fillings}
    output_folder(options.out)
    measured = {label: measure(label, *pair, options) for label, pair in jobs.items()}
    write_tables(measured, options.out)
    responses = {label: one.response for label, one in measured.items()}
    sweeps = {label: one.sweep for label, one in measured.items()}
    paths = {k: os.path.join(options.out, f"{k}.png") for k in ("response", "measures")}
    picture_responses(paths["response"], responses, PARTICLE_MASS)
    picture_measures(paths["measures"], responses, PARTICLE_MASS)
    picture_hysteresis(os.path.join(options.out, "hysteresis.png"), sweeps)
    print_peaks(measured)
    finish(options, NAME, figures_of(measured), measured.values())


def jobs_of(filling, options):
    """Arguments of the response and of the sweep; InputError for those that would be refused."""
    spheres = filling.label == "dem"
    shared = {
        "filling": filling,
        "ratios": options.ratios,
        "dt": options.dem_dt if spheres else options.ca_dt,
    }
    response = {"particles": options.particles, "transient_cycles": options.transient}
    response["seeds"] = options.dem_seeds if spheres else options.seeds
    sweep = {"particles": options.sweep_particles, "seeds": options.sweep_seeds}
    sweep["transient_cycles"] = max(1, options.transient // 3)
    for job in (response, sweep):
        Grid(particles=job["particles"], seeds=1, oscillator=None, **shared)
        job.update(shared, measured_cycles=options.measured)
    return response, sweep


def measure(label, response, sweep, options):
    """Response and sweep of one filling by their arguments."""
    made = Measured(None, None, 0.0, 0.0)
    jobs = {"response": (frequency_response, response), "sweep": (sweep_up_and_down, sweep)}
    for name, (work, arguments) in jobs.items():
        kept = checkpoint_of(options, f"checkpoint_{label}_{name}")
        # Jobs not begun before the interruption have no file.
        if options.resume and not os.path.exists(kept["resume"]):
            kept["resume"] = None
        setattr(made, name, timed(made, f"{label} {name}", work, {**arguments, **kept}))
    return made


def timed(made, title, work, arguments):
    """Result of work(**arguments) under a progress bar; adds its seconds to those of made."""
    started, told = time.perf_counter(), [0.0]
    with ProgressBar(title) as bar:

        def progress(present):
            if present.phase == "running":
                told[0] = present.seconds
            bar(present)

        found = work(progress=progress, **arguments)
    made.compile_seconds += time.perf_counter() - started - told[0]
    made.run_seconds += told[0]
    return found


def write_tables(measured, folder):
    """CSV of every scene, of the peaks, of the sweeps; the cost of each response as JSON."""
    rows = []
    for label, one in measured.items():
        one.response.write_csv(os.path.join(folder, f"response_{label}.csv"))
        one.response.report.write(os.path.join(folder, f"report_{label}.json"))
        one.sweep.up.write_csv(os.path.join(folder, f"sweep_up_{label}.csv"))
        one.sweep.down.write_csv(os.path.join(folder, f"sweep_down_{label}.csv"))
        for particles, ratio, rms in one.peaks():
            by_seed = zip(one.response.seeds, ratio, 1e3 * rms)
            rows += [(label, particles, *row) for row in by_seed]
    names = "filling particles seed peak_ratio peak_rms_mm"
    write_rows(os.path.join(folder, "peaks.csv"), rows, names)


def figures_of(measured):
    """Median over seeds of where each curve peaks and how high; hysteresis; seconds."""
    figures = {}
    for label, one in measured.items():
        for particles, ratio, rms in one.peaks():
            key = f"{label}_N{particles}"
            figures[f"peak_ratio_{key}"] = figure(float(np.median(ratio)), "1")
            figures[f"peak_rms_mm_{key}"] = figure(1e3 * float(np.median(rms)), "mm")
        for particles, hysteresis in zip(one.sweep.up.particles, one.sweep.hysteresis):
            largest = float(np.abs(hysteresis).max())
            figures[f"hysteresis_{label}_N{particles}"] = figure(largest, "1")
        figures[f"run_seconds_{label}"] = figure(one.run_seconds, "s")
    return figures


def print_peaks(measured):
    """Print the peaks beside those of a rigid mass."""
    rows = []
    for label, one in measured.items():
        for particles, ratio, rms in one.peaks():
            rigid_ratio, rigid = one.response.oscillator.peak(particles * PARTICLE_MASS)
            middle, low, high = 1e3 * np.median(rms), 1e3 * rms.min(), 1e3 * rms.max()
            place = f"{np.median(ratio):.4f}", f"{rigid_ratio:.4f}"
            height = f"{middle:.2f}", f"{low:.2f} .. {high:.2f}", f"{1e3 * rigid:.2f}"
            rows.append((label, particles, *place, *height))
    header = ["filling", "N", "peak f/f0", "rigid", "peak RMS [mm]", "seeds", "rigid [mm]"]
    print_table(rows, header)
    print()


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
