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

import os
import sys
from dataclasses import dataclass

import numpy as np

from _cli import figure, main, number, parser, whole, write_summary
from ca_damper import Automaton, Batch, Empty, Oscillator, SceneTable, Spheres, film, plot
from ca_damper.progress import Stages
from taichi_dem.kit.files import output_folder, write_csv, write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "demo_damper"
QUICK = {"begin": 10, "measured": 5}
FULL = {"begin": 40, "measured": 20}
FILLINGS = {
    "automaton": (Automaton, plot.Box.of_automaton),
    "spheres": (Spheres, plot.Box.of_spheres),
}
#: Cycles of the animation, the first ones, and frames in each; samples a cycle of the curves.
SHOWN, FRAMES, SAMPLES = 3, 13, 40
#: Ends of the colour scale as a share of the larger container's largest speed.
SCALE = 1.2


@dataclass(frozen=True, eq=False)
class Run:
    """A shaken container: history by name, measured Cycles, frames of the animation, Batch."""

    history: dict
    cycles: object
    frames: tuple
    batch: Batch


def options_parser():
    """Options of this demonstration."""
    made = parser(NAME, __doc__)
    made.add_argument("--particles", type=whole(0, 160), default=30, help="0 to 160, 30")
    made.add_argument(
        "--frequency", type=number(0.2, 3), default=1.0, help="of the base, by the container's, 1"
    )
    made.add_argument("--amplitude", type=number(0, 10), default=0.6, help="of the base [mm], 0.6")
    made.add_argument("--filling", choices=FILLINGS, default="automaton", help="automaton")
    made.add_argument("--dt", type=number(0, 1), help="step [s], 1e-4 or 2e-5 of spheres")
    made.add_argument("--seed", type=whole(0, 2**31 - 1), default=1, help="of the first places, 1")
    return made


def hung_batch(filling, particles, oscillator, options, measured):
    """Batch of one container; InputError for a step that cannot be meant."""
    o, dt = oscillator, options.dt or FILLINGS[options.filling][0]().default_dt
    structure = (o.base_amplitude, o.mass, o.stiffness, o.damping)
    frequency = options.frequency * o.natural_frequency
    table = SceneTable(particles, options.seed, dt, frequency, *structure)
    return Batch(filling, table, measured_cycles=measured)


def swing(batch, settings, progress):
    """Let a container swing, film its first cycles and measure the last; returns a Run."""
    batch.start("empty")
    steps = int(batch.steps_per_cycle[0])
    parts = np.cumsum([SHOWN, settings["begin"] - SHOWN, settings["measured"]])
    tell = Stages(progress, parts / parts[-1])
    sample, frame = steps // SAMPLES, steps // FRAMES
    shown = film(batch, SHOWN * steps, sample_every=sample, frame_every=frame, progress=tell)
    later = film(batch, (settings["begin"] - SHOWN) * steps, sample_every=sample, progress=tell)
    cycles = batch.run(0, settings["measured"], tell)
    parts = zip(shown.history.values(), later.history.values())
    columns = [np.concatenate([early, late])[:, 0] for early, late in parts]
    history = dict(zip(shown.history, columns))
    return Run(history, cycles, shown.frames[0][: SHOWN * FRAMES], batch)


def run(options):
    """Let both containers swing, compare, picture."""
    settings = QUICK if options.quick else FULL
    oscillator = Oscillator(base_amplitude=1e-3 * options.amplitude)
    filling = FILLINGS[options.filling][0]()
    jobs = {"full": (filling, options.particles), "empty": (Empty(), 0)}
    batches = {
        title: hung_batch(*job, oscillator, options, settings["measured"])
        for title, job in jobs.items()
    }
    output_folder(options.out)
    runs = {}
    for title, batch in batches.items():
        with ProgressBar(f"{title} container") as progress:
            runs[title] = swing(batch, settings, progress)
    figures = figures_of(runs["full"], runs["empty"], oscillator)
    picture(runs["full"], runs["empty"], oscillator, filling, options)
    write_summary(
        options.out,
        NAME,
        figures,
        compile_seconds=sum(made.batch.compile_seconds for made in runs.values()),
        run_seconds=sum(made.batch.run_seconds for made in runs.values()),
    )
    sentences = caption(figures, filling, oscillator, options)
    write_text(os.path.join(options.out, "caption.txt"), " ".join(sentences) + "\n")
    print("\n".join(sentences))
    report = runs["full"].batch.report()
    report.write(os.path.join(options.out, "report.json"))
    print(f"\n{report}")
    print(f"\nAnimation, curves and table are in {options.out}")


def figures_of(full, empty, oscillator):
    """What the particles do to the container."""
    o, cycles = oscillator, full.cycles
    damping_ratio = cycles.damping_ratio(o.mass, o.stiffness, o.damping)
    figures = {
        "amplitude_mm": (1e3 * cycles.amplitude, "mm"),
        "amplitude_empty_mm": (1e3 * empty.cycles.amplitude, "mm"),
        "amplitude_left": (cycles.amplitude / empty.cycles.amplitude, "1"),
        "rms_mm": (1e3 * cycles.rms, "mm"),
        "power_mW": (1e3 * cycles.complex_power.real, "mW"),
        "apparent_damping_N_s_m": (cycles.apparent_damping, "N s/m"),
        "apparent_mass_g": (1e3 * cycles.apparent_mass, "g"),
        "damping_ratio": (damping_ratio, "1"),
        "damping_ratio_empty": (np.array([o.damping_ratio]), "1"),
        "loss_factor": (cycles.loss_factor(o.mass), "1"),
    }
    return {name: figure(float(value[0]), unit) for name, (value, unit) in figures.items()}


def series(made, oscillator):
    """Time, displacement and energies of a run, by column name."""
    h, o = made.history, oscillator
    held = o.stiffness * (h["x"] - h["y"]) ** 2
    return {
        "time_s": h["time_s"],
        "x_mm": 1e3 * h["x"],
        "energy_mJ": 0.5e3 * (o.mass * h["v"] ** 2 + held),
        "particles_mJ": 1e3 * h["energy"],
    }


def counted(particles):
    """Number of particles in words."""
    return f"{particles} particle{'' if particles == 1 else 's'}"


def picture(full, empty, oscillator, filling, options):
    """Write the curves, their table and the animation."""
    curves, bare = series(full, oscillator), series(empty, oscillator)
    title = counted(options.particles)
    path = os.path.join(options.out, "motion.png")
    plot.plot_motion(path, title, curves, bare, filling=filling.label)
    columns = {"x_empty_mm": bare["x_mm"], "energy_empty_mJ": bare["energy_mJ"]}
    write_csv(os.path.join(options.out, "motion.csv"), {**curves, **columns})
    omega = 2.0 * np.pi * options.frequency * oscillator.natural_frequency
    fastest = SCALE * omega * max(float(made.cycles.amplitude[0]) for made in (full, empty))
    box = FILLINGS[options.filling][1](filling)
    path = os.path.join(options.out, "damper.gif")
    moving = (full.frames, empty.frames)
    plot.animate_motion(path, title, box, *moving, fastest, filling=filling.label)


def caption(figures, filling, oscillator, options):
    """What one sees, a sentence an entry."""
    value = {name: item["value"] for name, item in figures.items()}
    own = oscillator.natural_frequency
    load = 1e3 * options.particles * filling.particle_mass
    share = 0.1 * load / oscillator.mass
    return (
        f"The container weighs {1e3 * oscillator.mass:g} g and swings by itself at {own:.2f} Hz.",
        f"Its base shakes it at {options.frequency * own:.2f} Hz, by {options.amplitude:g} mm up "
        "and down.",
        f"Empty, it then swings by {value['amplitude_empty_mm']:.3g} mm.",
        f"With {counted(options.particles)} ({load:g} g, {share:.0f} % of its mass) it swings by "
        f"{value['amplitude_mm']:.3g} mm: {100.0 * value['amplitude_left']:.3g} % of that.",
        *(taken(value) if options.particles else ()),
    )


def taken(value):
    """What particles do to the container, a sentence an entry; value: of the figures, by name."""
    takes = value["power_mW"] > 0.0
    power, damping = abs(value["power_mW"]), value["apparent_damping_N_s_m"]
    return (
        f"The particles {'take' if takes else 'give'} {power:.2g} mW {'from' if takes else 'to'} "
        f"it, as a dashpot of {damping:.2g} N s/m would: the damping ratio is "
        f"{value['damping_ratio']:.2g} instead of {value['damping_ratio_empty']:.2g}.",
        f"In the swing they weigh as much as {value['apparent_mass_g']:.1f} g fixed to it.",
    )


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
