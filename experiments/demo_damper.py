"""What does a handful of particles in a box do to its vibration?

A container hangs on a spring and is shaken; the particles in it fly, fall and hit its walls.
Beside it hangs an empty one. Both begin as the empty one swings for good, so that one sees what
the particles take. Try other numbers of particles, frequencies (1 is where the empty container
swings most) and amplitudes of the shaking base.

    python experiments/demo_damper.py                                  # ten seconds
    python experiments/demo_damper.py --particles 60 --frequency 0.95
    python experiments/demo_damper.py --filling spheres --amplitude 1.2

Writes damper.gif, motion.png, motion.csv, caption.txt and summary.json to results/demo_damper/.
"""

import sys
from functools import partial

import numpy as np

from ca_damper import Automaton, Batch, Empty, Oscillator, SceneTable, Spheres, film
from ca_damper.plot import Box, Hanging, film_hanging
from ca_damper.progress import Stages
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv, write_text
from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, picture, styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "demo_damper"
FILLINGS = {"automaton": Automaton, "spheres": Spheres}
SETTINGS = {
    "particles": (30, 30, study.whole(0, 160), "0 to 160, 30"),
    "frequency": (1.0, 1.0, study.number(0.2, 3), "by the container's, 1"),
    "amplitude": (0.6, 0.6, study.number(0, 10), "of the base [mm], 0.6"),
    "filling": ("automaton", "automaton", study.one_of(FILLINGS), "automaton"),
    "dt": (None, None, study.number(0, 1), "step [s], 1e-4 or 2e-5 of spheres"),
    "seed": (1, 1, study.whole(0, 2**31 - 1), "of the first places, 1"),
    "begin": (40, 10),
    "measured": (20, 5),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Cycles of the animation, the first ones, and frames in each; samples a cycle of the curves.
SHOWN, FRAMES, SAMPLES = 3, 13, 40


class Swing:
    """A container that swings: columns over time, measured Cycles, frames of the first cycles."""

    def __init__(self, title, batch, begin, measured, o):
        batch.start("empty")
        steps, ends = int(batch.steps_per_cycle[0]), np.array([SHOWN, begin, begin + measured])
        with ProgressBar(f"{title} container") as progress:
            tell = Stages(progress, ends / ends[-1])
            every = {"sample_every": steps // SAMPLES, "progress": tell}
            early = film(batch, SHOWN * steps, frame_every=steps // FRAMES, **every)
            late = film(batch, (begin - SHOWN) * steps, **every)
            self.cycles = batch.run(0, measured, tell)
        self.frames = early.frames[0][: SHOWN * FRAMES]
        history = {k: np.concatenate([v, late.history[k]])[:, 0] for k, v in early.history.items()}
        self.columns = {
            "time_s": history["time_s"],
            "x_mm": 1e3 * history["x"],
            "energy_mJ": 1e3 * o.energy(history["x"], history["v"], history["y"]),
            "particles_mJ": 1e3 * history["energy"],
        }


def figures_of(cycles, empty, o):
    """Amplitude of the container with particles and without; their power and apparent mass."""
    figures = {
        "amplitude_mm": (1e3 * cycles.amplitude, "mm"),
        "amplitude_empty_mm": (1e3 * empty.amplitude, "mm"),
        "amplitude_left": (cycles.amplitude / empty.amplitude, "1"),
        "rms_mm": (1e3 * cycles.rms, "mm"),
        "power_mW": (1e3 * cycles.complex_power.real, "mW"),
        "apparent_damping_N_s_m": (cycles.apparent_damping, "N s/m"),
        "apparent_mass_g": (1e3 * cycles.apparent_mass, "g"),
        "damping_ratio": (cycles.damping_ratio(o.mass, o.stiffness, o.damping), "1"),
        "damping_ratio_empty": ([o.damping_ratio], "1"),
        "loss_factor": (cycles.loss_factor(o.mass), "1"),
    }
    return {name: (float(value[0]), unit) for name, (value, unit) in figures.items()}


def write(at, full, empty, filling, options, omega):
    """Write the curves, their table and the animation; omega: of the base [rad/s]."""
    names = {"x_empty_mm": "x_mm", "energy_empty_mJ": "energy_mJ"}
    bare = {name: empty.columns[column] for name, column in names.items()}
    write_csv(at("motion.csv"), {**full.columns, **bare})
    title, style = counted(options.particles), styles_of([filling.label])[filling.label]
    plot_motion(at("motion.png"), title, full.columns, empty.columns, style)
    fastest = 1.2 * omega * max(float(one.cycles.amplitude[0]) for one in (full, empty))
    box = Box.of(filling)
    # The empty container moves as smoothly as the structure: its box is not staggered.
    smooth = Hanging("empty", Box(box.width, box.height, box.diameter), empty.frames, GREY)
    film_hanging(
        at("damper.gif"), [smooth, Hanging(title, box, full.frames, style.colour)], fastest
    )


def counted(particles):
    """Number of particles in words."""
    return f"{particles} particle{'' if particles == 1 else 's'}"


def plot_motion(path, title, full, empty, style):
    """Displacement and energy over time, with particles and without; title: the particles."""
    bare, own = {"color": GREY, "lw": 0.8, "label": STYLES["empty"].label}, {"color": style.colour}
    time, own_title = full["time_s"], f"container with {title}"
    with picture(path, 2, 1, size=(8.6, 5.6), sharex=True) as (_, (motion, energy)):
        motion.plot(time, empty["x_mm"], **bare)
        motion.plot(time, full["x_mm"], lw=0.9, label=f"{style.label}, {title}", **own)
        motion.set(ylabel="displacement of\nthe container [mm]", xlim=(0.0, time[-1]))
        energy.plot(time, empty["energy_mJ"], ls="--", **bare)
        energy.plot(time, full["energy_mJ"], label=own_title, **own)
        energy.plot(time, full["particles_mJ"], color=BLACK, label="the particles alone")
        energy.set(xlabel="time [s]", ylabel="energy [mJ]", ylim=(0.0, None))
        for axes in (motion, energy):
            axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def sentences(figures, filling, oscillator, options):
    """The comparison in words."""
    value = {name: one for name, (one, _) in figures.items()}
    own, mass = oscillator.natural_frequency, 1e3 * oscillator.mass
    load = 1e3 * options.particles * filling.particle_mass
    return (
        f"The container weighs {mass:g} g and swings by itself at {own:.2f} Hz.",
        f"Its base shakes it at {options.frequency * own:.2f} Hz, by {options.amplitude:g} mm up "
        "and down.",
        f"Empty, it then swings by {value['amplitude_empty_mm']:.3g} mm.",
        f"With {counted(options.particles)} ({load:g} g, {100.0 * load / mass:.0f} % of its mass) "
        f"it swings by {value['amplitude_mm']:.3g} mm: {100.0 * value['amplitude_left']:.3g} % of "
        "that.",
        *(taken(value) if options.particles else ()),
    )


def taken(value):
    """Power and apparent mass of the particles in words; value: of the figures, by name."""
    takes = value["power_mW"] > 0.0
    power, damping = abs(value["power_mW"]), value["apparent_damping_N_s_m"]
    return (
        f"The particles {'take' if takes else 'give'} {power:.2g} mW {'from' if takes else 'to'} "
        f"it, as a dashpot of {damping:.2g} N s/m would: the damping ratio is "
        f"{value['damping_ratio']:.2g} instead of {value['damping_ratio_empty']:.2g}.",
        f"In the swing they weigh as much as {value['apparent_mass_g']:.1f} g fixed to it.",
    )


def run(options):
    """Let the full and the empty container swing, compare, picture."""
    filling, o = FILLINGS[options.filling](), Oscillator(base_amplitude=1e-3 * options.amplitude)
    frequency, measured = options.frequency * o.natural_frequency, options.measured
    shaken = options.dt or filling.default_dt, frequency
    shaken += o.base_amplitude, o.mass, o.stiffness, o.damping
    batches = {}
    for title, one, particles in (("full", filling, options.particles), ("empty", Empty(), 0)):
        table = SceneTable(particles, options.seed, *shaken)
        batches[title] = Batch(one, table, measured_cycles=measured)
    at = study.output_paths(options.out)
    full, empty = (Swing(*pair, options.begin, measured, o) for pair in batches.items())
    figures = figures_of(full.cycles, empty.cycles, o)
    write(at, full, empty, filling, options, 2.0 * np.pi * frequency)
    words, report = sentences(figures, filling, o, options), batches["full"].report()
    report.write(at("report.json"))
    write_text(at("caption.txt"), " ".join(words) + "\n")
    print(*words, f"\n{report}", sep="\n")
    study.finish(options, NAME, figures, batches.values(), show=False)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
