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

from _cli import (
    add_checkpoints,
    checkpoint_of,
    figure,
    main,
    number,
    parser,
    print_figures,
    print_table,
    several,
    whole,
    write_summary,
)
from ca_damper import Automaton, Response, Spheres, Sweep, frequency_response, sweep_up_and_down
from ca_damper.plot.response import picture_hysteresis, picture_measures, picture_responses
from ca_damper.response import Grid
from taichi_dem import InputError
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "damper_response"
#: 33 ratios f/f0, every 0.005 where the peaks of 0 to 50 particles lie.
RATIOS = np.unique(
    np.round(
        np.concatenate(
            [[0.80, 0.84, 0.87, 0.89], np.arange(0.90, 1.0201, 0.005), [1.04, 1.06, 1.09, 1.12]]
        ),
        4,
    )
)
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
}
QUICK = {
    **FULL,
    "particles": [10, 30],
    "seeds": 2,
    "transient": 20,
    "measured": 5,
    "sweep_particles": [10],
    "sweep_seeds": 1,
}
QUICK_RATIOS = RATIOS[::4]


@dataclass(frozen=True)
class Measured:
    """A filling's responses, its sweep, and the seconds they took."""

    response: Response
    sweep: Sweep
    compile_s: float
    run_s: float


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
    for name, value in (QUICK if options.quick else FULL).items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    chosen = chosen_fillings(options.fillings)
    check_resume(options)
    for filling in chosen.values():
        check(filling, options)
    output_folder(options.out)
    measured = {label: measure(filling, options) for label, filling in chosen.items()}
    write_tables(measured, options.out)
    picture_all(measured, options.out)
    figures = figures_of(measured)
    write_summary(
        options.out,
        NAME,
        figures,
        compile_seconds=sum(one.compile_s for one in measured.values()),
        run_seconds=sum(one.run_s for one in measured.values()),
    )
    print_peaks(measured)
    print()
    print_figures(figures)
    print(f"\nPictures and tables are in {options.out}")


def chosen_fillings(labels):
    """Fillings by label; InputError for a label that is none."""
    known = fillings()
    for label in labels:
        if label not in known:
            raise InputError(f"fillings must be some of {', '.join(known)}, got {label!r}")
    return {label: known[label] for label in labels}


def check(filling, options):
    """InputError for what either job of a filling would refuse after the others have run."""
    ratios = QUICK_RATIOS if options.quick else RATIOS
    dt = options.dem_dt if filling.label == "dem" else options.ca_dt
    for particles in (options.particles, options.sweep_particles):
        Grid(filling, particles, ratios, 1, None, dt)


def measure(filling, options):
    """Response and sweep of one filling."""
    spheres = filling.label == "dem"
    shared = {
        "ratios": QUICK_RATIOS if options.quick else RATIOS,
        "dt": options.dem_dt if spheres else options.ca_dt,
        "measured_cycles": options.measured,
    }
    response, one = timed(
        f"{filling.label} response",
        lambda progress: frequency_response(
            filling,
            particles=options.particles,
            seeds=options.dem_seeds if spheres else options.seeds,
            transient_cycles=options.transient,
            progress=progress,
            **kept(options, f"{filling.label}_response"),
            **shared,
        ),
    )
    sweep, two = timed(
        f"{filling.label} sweep",
        lambda progress: sweep_up_and_down(
            filling,
            particles=options.sweep_particles,
            seeds=options.sweep_seeds,
            transient_cycles=max(1, options.transient // 3),
            progress=progress,
            **kept(options, f"{filling.label}_sweep"),
            **shared,
        ),
    )
    return Measured(response, sweep, one[0] + two[0], one[1] + two[1])


def check_resume(options):
    """Raise InputError when there is nothing to go on from."""
    if options.resume and not any(Path(options.out).glob("checkpoint_*.npz")):
        raise InputError(f"resume must be left out: there is no checkpoint in {options.out}")


def kept(options, name):
    """Arguments checkpoint and resume of one of the jobs; those not begun yet have no file."""
    arguments = checkpoint_of(options, f"checkpoint_{name}")
    if options.resume and not os.path.exists(arguments["resume"]):
        arguments["resume"] = None
    return arguments


def timed(title, work):
    """What work(progress) returns, and its seconds: (to compile and set up, to run)."""
    started, told = time.perf_counter(), [0.0]
    with ProgressBar(title) as bar:

        def progress(present):
            if present.phase == "running":
                told[0] = present.seconds
            bar(present)

        made = work(progress)
    return made, (time.perf_counter() - started - told[0], told[0])


def write_tables(measured, folder):
    """CSV of every scene, of the peaks, of the sweeps; what each response cost as JSON."""
    peaks = {"filling": [], "particles": [], "seed": [], "peak_ratio": [], "peak_rms_mm": []}
    for label, one in measured.items():
        one.response.write_csv(os.path.join(folder, f"response_{label}.csv"))
        one.response.report.write(os.path.join(folder, f"report_{label}.json"))
        one.sweep.up.write_csv(os.path.join(folder, f"sweep_up_{label}.csv"))
        one.sweep.down.write_csv(os.path.join(folder, f"sweep_down_{label}.csv"))
        ratio, rms = one.response.peaks()
        for k, particles in enumerate(one.response.particles):
            for m, seed in enumerate(one.response.seeds):
                row = (label, particles, seed, float(ratio[k, m]), 1e3 * float(rms[k, m]))
                for name, value in zip(peaks, row):
                    peaks[name].append(value)
    write_csv(os.path.join(folder, "peaks.csv"), peaks)


def picture_all(measured, folder):
    """All pictures."""
    responses = {label: one.response for label, one in measured.items()}
    picture_responses(os.path.join(folder, "response.png"), responses, PARTICLE_MASS)
    picture_measures(os.path.join(folder, "measures.png"), responses, PARTICLE_MASS)
    sweeps = {label: one.sweep for label, one in measured.items()}
    picture_hysteresis(os.path.join(folder, "hysteresis.png"), sweeps)


def figures_of(measured):
    """Median over seeds of where each curve peaks and how high; hysteresis; seconds."""
    figures = {}
    for label, one in measured.items():
        ratio, rms = one.response.peaks()
        for k, particles in enumerate(one.response.particles):
            key = f"{label}_N{particles}"
            figures[f"peak_ratio_{key}"] = figure(float(np.median(ratio[k])), "1")
            figures[f"peak_rms_mm_{key}"] = figure(1e3 * float(np.median(rms[k])), "mm")
        for k, particles in enumerate(one.sweep.up.particles):
            largest = float(np.abs(one.sweep.hysteresis[k]).max())
            figures[f"hysteresis_{label}_N{particles}"] = figure(largest, "1")
        figures[f"run_seconds_{label}"] = figure(one.run_s, "s")
    return figures


def print_peaks(measured):
    """Peaks beside those of a rigid mass."""
    rows = []
    for label, one in measured.items():
        response = one.response
        ratio, rms = response.peaks()
        for k, particles in enumerate(response.particles):
            rigid_ratio, rigid_rms = response.oscillator.peak(particles * PARTICLE_MASS)
            low, high = 1e3 * rms[k].min(), 1e3 * rms[k].max()
            rows.append(
                (
                    label,
                    particles,
                    f"{np.median(ratio[k]):.4f}",
                    f"{rigid_ratio:.4f}",
                    f"{1e3 * np.median(rms[k]):.2f}",
                    f"{low:.2f} .. {high:.2f}",
                    f"{1e3 * rigid_rms:.2f}",
                )
            )
    header = ["filling", "N", "peak f/f0", "rigid", "peak RMS [mm]", "seeds", "rigid [mm]"]
    print_table(rows, header)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
