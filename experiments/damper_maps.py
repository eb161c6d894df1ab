"""How much do grains damp, over amplitude and frequency, and what does theory say?

The container is driven as A sin(w t), whatever the grains do. First without gravity over the
amplitude, beside the theory of collect and collide: grains fly as one block between floor and lid
and lose all of their relative motion at each wall. Expect the loss to jump at A = gap / pi to 4 in
units of N m A^2 w^2 and to fall slowly after it. Then with gravity over amplitude and frequency:
below A w^2 = g grains lie still and are mere mass; the loss is largest where they are thrown
once a cycle, from about twice that on. A quick run leaves the rules of the paper out.

    python experiments/damper_maps.py            # two minutes
    python experiments/damper_maps.py --particles 20

Writes collect_and_collide.png, maps.png, a CSV of each map and summary.json to
results/damper_maps/.
"""

import sys
from functools import partial

import numpy as np

from _damper_maps import picture_jump, picture_maps
from ca_damper import Automaton, Spheres, damper_map
from taichi_dem.kit import study
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "damper_maps"
SETTINGS = {
    "particles": (30, 30, study.whole(1, 120), "grains of the maps with gravity, 30"),
    "block": (40, 40, study.whole(10, 120), "grains without gravity, 40"),
    "seeds": (3, 1, study.whole(1, 100), "of each scene, 3"),
    # Amplitudes by gap / pi; amplitudes by those of g; frequencies [Hz].
    "ratios": (17, 7),
    "levels": (12, 5),
    "frequencies": (10, 4),
    "cycles": (60, 25),
    # Spheres, and the automaton by the rules of the paper and of place.
    "fillings": ((Spheres, partial(Automaton, rules="paper"), Automaton), (Spheres, Automaton)),
}
#: Base motion without gravity [Hz], and ranges of the axes.
WEIGHTLESS_HZ, RATIOS = 6.0, (0.6, 1.4)
HERTZ, MILLIMETRES = (5.0, 40.0), (0.1, 10.0)
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def run(options):
    """Map all fillings without and with gravity, compare, picture."""
    folder, half = study.begin(options), options.cycles // 2
    few = {
        "seeds": options.seeds,
        "transient_cycles": half,
        "measured_cycles": options.cycles - half,
    }
    jumps, maps = {}, {}
    for make in options.fillings:
        weightless, heavy = make(gravity=0.0), make(gravity=9.8)
        label = heavy.label
        gap = 96e-3 - 6e-3 * options.block / 10
        sizes = gap / np.pi * np.linspace(*RATIOS, options.ratios)
        with ProgressBar(f"{label} without gravity") as bar:
            axes = {"amplitudes": sizes, "frequencies": WEIGHTLESS_HZ, "particles": options.block}
            jumps[label] = damper_map(weightless, **axes, **few, progress=bar)
        with ProgressBar(f"{label} with gravity") as bar:
            axes = {"particles": options.particles, "frequencies": hertz(options)}
            axes["amplitudes"] = 1e-3 * np.geomspace(*MILLIMETRES, options.levels)
            maps[label] = damper_map(heavy, **axes, **few, progress=bar)
    for name, made in (("weightless", jumps), ("gravity", maps)):
        for label, one in made.items():
            one.write_csv(folder / f"{name}_{label}.csv")
    picture_jump(folder / "collect_and_collide.png", jumps)
    picture_maps(folder / "maps.png", maps, 9.8)
    reports = [report for one in (*jumps.values(), *maps.values()) for report in one.reports]
    study.finish(options, NAME, figures_of(jumps, maps), reports, see="collect_and_collide.png")


def hertz(options):
    """Frequencies of the maps [Hz]."""
    return np.geomspace(*HERTZ, options.frequencies)


def figures_of(jumps, maps):
    """Amplitude of the jump by that of the theory, plateau by it, and largest loss of the maps."""
    figures = {}
    for label, made in jumps.items():
        energy, ratios = made.energy[0, 0, :, 0].mean(axis=-1), np.pi * np.array(made.amplitudes)
        ratios = ratios / made.gaps[0, 0]
        theory = made.theory.energy[0, 0]
        flat = ratios > 1.05
        figures[f"jump_ratio_{label}"] = (jump_of(ratios, energy), "1")
        figures[f"plateau_share_{label}"] = (float((energy / theory)[flat].mean()), "1")
    for label, made in maps.items():
        loss = made.loss[0, 0].mean(axis=-1)
        where = np.unravel_index(np.argmax(loss), loss.shape)
        level = made.amplitudes[where[0]] * (2.0 * np.pi * made.frequencies[where[1]]) ** 2 / 9.8
        figures[f"largest_loss_{label}"] = (float(loss.max()), "1")
        figures[f"largest_loss_at_g_{label}"] = (float(level), "g")
    return figures


def jump_of(ratios, energy):
    """Where the energy passes half of its largest value for good, from below; None if nowhere."""
    low = np.flatnonzero(energy < 0.5 * energy.max())
    if not len(low) or low[-1] == len(energy) - 1:
        return None
    k = low[-1]
    share = (0.5 * energy.max() - energy[k]) / (energy[k + 1] - energy[k])
    return float(ratios[k] + share * (ratios[k + 1] - ratios[k]))


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
