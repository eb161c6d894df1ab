"""How much lower is the peak with free grains than with the same grains fixed?

    python experiments/damper_response.py                       # about four minutes on two cores
    python experiments/damper_response.py --fillings dem,ca_static,ca_landing  # those of the paper
    python experiments/damper_response.py --quick
    python experiments/damper_response.py --accuracy 1%         # the peaks alone, with error bars
    python experiments/damper_response.py --accuracy 5% --budget filling --fillings dem

Figs. 3 and 11 of the paper. Fixed grains, drawn beside free ones, detune the structure as much:
what free ones take off that peak is damping. Expect 30 of them to leave 0.76, 0.48 and 0.34 of it
on a base that moves by 0.3, 0.6 and 1.2 mm. Then come the peaks by number of grains and a sweep up
and down, the state carried on, which shows where two motions are possible.
The paper's automaton has landing impulses alone, ca_landing; static contact, ca_static, moves its
peak as that of the spheres. Every number, frequency and seed is a scene; bars and bands are lowest
and highest of the seeds, lines their median.

With --accuracy, the program finds place and height of the peaks to this share of their value. It
chooses frequencies, steps, seeds and cycles, whatever the other options say, and prints each answer
with its error bar and cost. With --budget filling it also runs grains of the other kind. Nothing
else is run then.

Responses and sweeps save themselves at their end, on Ctrl-C, and as often as --checkpoint-every
says; the same command with --resume continues and repeats nothing.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

import ca_damper as ca
from ca_damper.plot.curves import picture_damping, picture_hysteresis, picture_peaks
from ca_damper.runs.response import OUTSIDE, Grid
from taichi_dem.kit import study
from taichi_dem.kit.study import number, several, whole

NAME = "damper_response"
#: 33 ratios f/f0, every 0.005 where the peaks of 0 to 50 particles lie.
COARSE = ([0.80, 0.84, 0.87, 0.89], [1.04, 1.06, 1.09, 1.12])
RATIOS = np.round(np.concatenate([COARSE[0], np.arange(0.90, 1.0201, 0.005), COARSE[1]]), 4)
#: Of both fillings [kg].
PARTICLE_MASS = ca.Spheres().particle_mass
#: Those of the paper with and without static contact.
PAPER = [ca.Automaton(ca.Paper(word)) for word in ("all", "landing")]
#: The fillings compared, by label.
FILLINGS = {filling.label: filling for filling in (ca.Spheres(), ca.Automaton(), *PAPER)}
#: Number of grains beside fixed ones, and amplitude of the base of their curves [m].
SHOWN, BASE = 30, ca.Oscillator().base_amplitude
NUMBERS = several(whole(0, 160))
SETTINGS = {
    "fillings": (["dem", "ca_place"], ["dem", "ca_place"], several(str), ", ".join(FILLINGS)),
    "particles": ([10, 20, 30, 40, 50], [10, 30], NUMBERS, "default 10,20,30,40,50"),
    "seeds": (5, 2, whole(1, 1000), "seeds of the automata, default 5"),
    "dem_seeds": (1, 1, whole(1, 1000), "seeds of the spheres, default 1"),
    "transient": (150, 20, whole(0, 100000), "cycles before those measured, default 150"),
    "measured": (20, 5, whole(1, 1000), "cycles measured, default 20"),
    "dem_dt": (None, None, number(0, 1), "step of the spheres [s], default 2e-5"),
    "ca_dt": (None, None, number(0, 1), "step of the automata [s], default 1e-4"),
    "sweep_particles": ([10, 50], [10], NUMBERS, "numbers of particles swept, default 10,50"),
    "sweep_seeds": (2, 1, whole(1, 1000), "seeds of the sweep, default 2"),
    "ratios": (RATIOS, RATIOS[::4]),
    # Amplitudes of the base [m] over which free and fixed grains are compared.
    "bases": ((0.15e-3, 0.3e-3, BASE, 0.9e-3, 1.2e-3, 1.8e-3), (0.3e-3, BASE, 1.2e-3)),
}


def options_parser():
    """Options of this experiment."""
    made = study.parser(NAME, __doc__, settings=SETTINGS)
    study.add_checkpoints(made)
    study.add_accuracy(made, "the peaks", "filling")
    return made


def run(options):
    """Measure all fillings, write tables and pictures."""
    for label in options.fillings:
        if label not in FILLINGS:
            raise ca.InputError(f"fillings must be some of {', '.join(FILLINGS)}, got {label!r}")
    if options.accuracy is not None:
        return run_to_accuracy(options)
    if options.resume and not any(Path(options.out).glob("*.checkpoint")):
        raise ca.InputError(f"resume must be left out: there is no checkpoint in {options.out}")
    jobs = {label: jobs_of(FILLINGS[label], options) for label in options.fillings}
    folder = study.begin(options)
    responses, strengths, sweeps = {}, {}, {}
    for label, (response, strength, sweep) in jobs.items():
        responses[label] = made(ca.frequency_response, response, f"{label}_response", options)
        strengths[label] = made(ca.frequency_response, strength, f"{label}_bases", options)
        sweeps[label] = made(ca.sweep_up_and_down, sweep, f"{label}_sweep", options)
    write_tables(responses, sweeps, folder)
    shares = {label: (one.amplitudes, shares_of(one)) for label, one in strengths.items()}
    curves = {label: one[options.bases.index(BASE)] for label, one in strengths.items()}
    picture_damping(folder / "response.png", curves, shares, (SHOWN, SHOWN * PARTICLE_MASS))
    picture_peaks(folder / "peaks.png", responses, PARTICLE_MASS)
    picture_hysteresis(folder / "hysteresis.png", sweeps)
    peaks = peaks_of(responses)
    print(peaks.to_string(index=False, float_format="{:.4g}".format, na_rep=OUTSIDE), "\n")
    figures = figures_of(peaks, responses, sweeps)
    for label, (bases, share) in shares.items():
        for base, values in zip(bases, share):
            figures[f"peak_share_{label}_{1e6 * base:.0f}um"] = float(np.median(values)), "1"
    runs = (*responses.values(), *(one[0] for one in strengths.values()), *sweeps.values())
    study.finish(options, NAME, figures, [one.report for one in runs])


def shares_of(strength):
    """Peaks with free grains over those with the same grains fixed, (amplitudes, seeds)."""
    fixed = [one.oscillator.peak(SHOWN * PARTICLE_MASS)[1] for one in strength]
    return strength.peaks()[1][:, 0] / np.array(fixed)[:, None]


def run_to_accuracy(options):
    """Find the peaks to an accuracy; print and write the answers."""
    study.check_accuracy(options)
    folder, rows, figures = study.begin(options), [], {}
    asked = [ca.goals.peak_ratio(), ca.goals.peak_rms()]
    for label in options.fillings:
        for n in options.particles:
            job = {"particles": n, "goal": asked, "tolerance": options.accuracy}
            job["sources"] = study.accuracy_sources(options)
            with ca.ProgressBar(f"{label}, {n} particles") as bar:
                answers = ca.solve_response(FILLINGS[label], **job, progress=bar)
            for answer in answers:
                study.show_answer(f"{label}, {n} particles", answer)
                rows.append(((label, n), answer))
            end, (ratio, rms) = f"{label}_N{n}", answers
            figures[f"peak_ratio_{end}"] = ratio.value, "1"
            figures[f"peak_ratio_error_{end}"] = ratio.error, "1"
            figures[f"peak_rms_mm_{end}"] = 1e3 * rms.value, "mm"
            figures[f"peak_rms_error_mm_{end}"] = 1e3 * rms.error, "mm"
            figures[f"cpu_seconds_{end}"] = rms.plan.seconds, "s"
    study.write_accuracy(folder, ("filling", "particles"), rows)
    study.finish(options, NAME, figures, 0.0)


def jobs_of(filling, options):
    """Arguments of both responses and of the sweep; InputError for those that would be refused."""
    dt, seeds = options.ca_dt, options.seeds
    if filling.label == "dem":
        dt, seeds = options.dem_dt, options.dem_seeds
    response = options.particles, seeds, options.transient
    sweep = options.sweep_particles, options.sweep_seeds, max(1, options.transient // 3)
    shared = {"filling": filling, "ratios": options.ratios, "dt": dt}
    for particles, *_ in (response, sweep):
        Grid(particles=particles, seeds=1, oscillator=None, **shared)
    shared["measured_cycles"] = options.measured
    strength = SHOWN, min(seeds, 2), options.transient
    names = "particles", "seeds", "transient_cycles"
    made = [{**shared, **dict(zip(names, one))} for one in (response, strength, sweep)]
    near = [ratio for ratio in options.ratios if COARSE[0][-1] < ratio < COARSE[1][0]]
    made[1].update(base_amplitude=options.bases, ratios=near)
    return made


def made(work, arguments, name, options):
    """What work(**arguments) gives, under a progress bar, with a checkpoint of its own."""
    kept = study.checkpoint_of(options, name, may_be_new=True)
    with ca.ProgressBar(name.replace("_", " ")) as bar:
        return work(**arguments, **kept, progress=bar)


def write_tables(responses, sweeps, folder):
    """CSV of every scene, of the peaks, of the sweeps; the cost of each response as JSON."""
    rows = []
    for label, response in responses.items():
        response.write_csv(folder / f"response_{label}.csv")
        response.report.write(folder / f"report_{label}.json")
        sweeps[label].up.write_csv(folder / f"sweep_up_{label}.csv")
        sweeps[label].down.write_csv(folder / f"sweep_down_{label}.csv")
        for particles, ratio, rms in zip(response.particles, *response.peaks()):
            rows += [(label, particles, *row) for row in zip(response.seeds, ratio, 1e3 * rms)]
    study.write_rows(folder / "peaks.csv", rows, "filling particles seed peak_ratio peak_rms_mm")


def peaks_of(responses):
    """Table of the peaks beside those of a rigid mass, medians over seeds."""
    rows = []
    for label, response in responses.items():
        for n, ratios, rms in zip(response.particles, *response.peaks()):
            rigid_ratio, rigid = response.oscillator.peak(n * PARTICLE_MASS)
            found = {"peak_ratio": np.median(ratios), "rigid_ratio": rigid_ratio}
            found.update(peak_rms_mm=1e3 * np.median(rms), rigid_rms_mm=1e3 * rigid)
            found.update(lowest_mm=1e3 * rms.min(), highest_mm=1e3 * rms.max())
            rows.append({"filling": label, "particles": n, **found})
    return pd.DataFrame(rows)


def figures_of(peaks, responses, sweeps):
    """Peaks, largest hysteresis of each filling beyond chance, and the seconds of its runs."""
    figures = {}
    for row in peaks.itertuples():
        end = f"{row.filling}_N{row.particles}"
        figures[f"peak_ratio_{end}"] = row.peak_ratio, "1"
        figures[f"peak_rms_mm_{end}"] = row.peak_rms_mm, "mm"
    for label, sweep in sweeps.items():
        seen = np.where(sweep.shows_hysteresis, np.abs(sweep.hysteresis.mean(axis=2)), 0.0)
        for n, most in zip(sweep.up.particles, seen.max(axis=1)):
            figures[f"hysteresis_{label}_N{n}"] = float(most), "1"
        spent = responses[label].report.run_seconds + sweep.report.run_seconds
        figures[f"run_seconds_{label}"] = spent, "s"
    return figures


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
