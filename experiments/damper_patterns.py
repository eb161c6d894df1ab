"""How do the particles move in a shaken container, by automaton and by spheres?

20 and 40 particles over one cycle of a container that moves by +-4 cells (24 mm) at 6 Hz, whatever
the particles do (Komatsuzaki et al., Figs. 9 and 10). Expect particles that the floor throws up,
that come apart in the air and are caught again. The automaton's swing further than the spheres, as
its ceiling takes down a whole cluster when one particle of it touches, and up to a tenth of a
cycle earlier.

    python experiments/damper_patterns.py                  # about half a minute
    python experiments/damper_patterns.py --amplitude 10 --accounting landing

Writes patterns_20.png, patterns_40.png, cycle.png, patterns.gif, cycles.csv, particles.csv and
summary.json to results/damper_patterns/.
"""

import os
import sys
from dataclasses import dataclass

import numpy as np

from _cli import figure, main, number, parser, print_table, whole, write_summary
from ca_damper import Automaton, Batch, SceneTable, Spheres, film, plot
from ca_damper.automaton import ACCOUNTINGS
from ca_damper.progress import Stages
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.plot_style import STYLES
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "damper_patterns"
QUICK = {"transient": 5, "cycles": 1, "seeds": 2}
FULL = {"transient": 30, "cycles": 4, "seeds": 5}
PARTICLES = (20, 40)
TITLES = {"ca": "automaton", "dem": "spheres"}
#: Frames a cycle of the animation and the measures; the pictures show every fourth of them.
FRAMES, SHOWN = 32, 4
#: Step of the automaton [s], and steps of the spheres within one.
CA_DT, STEPS_IN_ONE = 1e-4, 5
#: Ends of the colour scale as a share of the container's largest speed.
SCALE = 1.2


@dataclass(frozen=True, eq=False)
class Shaken:
    """Scenes of a filling in the shaken container: its Box, its Batch, and what was filmed.

    frames: particles -> cycles of all seeds, the first seed's first, each a tuple of Frames.
    """

    box: plot.Box
    frames: dict
    seeds: int
    batch: Batch

    @property
    def filling(self):
        """Label of the filling."""
        return self.batch.filling.label

    def measures(self, particles):
        """Arrays (cycles of all seeds, frames) by name; heights [mm] and shares of the particles.

        height_mm: mean over the particles, in the room, less that of particles at rest on the
        floor of a container in its middle. above_floor_mm: the same over the container's floor.
        floor, ceiling: share of the particles less than half a diameter away from it.
        """
        rows = [[self._measure(frame) for frame in cycle] for cycle in self.frames[particles]]
        names = ("height_mm", "above_floor_mm", "floor", "ceiling")
        return dict(zip(names, np.moveaxis(np.array(rows), 2, 0)))

    def _measure(self, frame):
        below, above = self.box.gaps(frame.position)
        near = 0.5 * self.box.diameter
        over = below.mean()
        high = 1e3 * (self.box.lift(frame.x) + over)
        return high, 1e3 * over, (below < near).mean(), (above < near).mean()


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__)
    made.add_argument("--amplitude", type=number(0, 100), default=24.0, help="[mm], 24")
    made.add_argument("--frequency", type=number(0.5, 100), default=6.0, help="[Hz], 6")
    made.add_argument("--accounting", choices=ACCOUNTINGS, default="all", help="all")
    made.add_argument("--dt", type=number(0, 1), help="spheres' step [s], 2e-5")
    made.add_argument("--seeds", type=whole(1, 100), help="starts that are averaged, 5")
    return made


def shaken_batch(filling, dt, seeds, options):
    """Batch of all numbers of particles and seeds; InputError for a step that cannot be meant."""
    particles, seed = np.repeat(PARTICLES, seeds), np.tile(np.arange(seeds) + 1, len(PARTICLES))
    table = SceneTable(particles, seed, dt, options.frequency, 1e-3 * options.amplitude)
    return Batch(filling, table, mount="base", measured_cycles=0)


def shake(batch, box, settings, progress):
    """Shake the container through a transient, then film some cycles; returns a Shaken."""
    batch.start()
    count = settings["transient"] + settings["cycles"]
    tell = Stages(progress, np.arange(settings["transient"], count + 1) / count)
    batch.run(settings["transient"], 0, tell)
    steps = int(batch.steps_per_cycle[0])
    frames = {count: [] for count in PARTICLES}
    for _ in range(settings["cycles"]):
        every = steps // FRAMES
        shot = film(batch, steps, sample_every=steps, frame_every=every, progress=tell)
        for count, cycle in zip(batch.table.column("particles").tolist(), shot.frames):
            frames[count].append(cycle[:FRAMES])
    return Shaken(box, frames, settings["seeds"], batch)


def run(options):
    """Shake both fillings, compare, picture."""
    settings = dict(QUICK if options.quick else FULL)
    settings["seeds"] = options.seeds or settings["seeds"]
    automaton, spheres = Automaton(accounting=options.accounting), Spheres()
    boxes = {"ca": plot.Box.of_automaton(automaton), "dem": plot.Box.of_spheres(spheres)}
    jobs = {"ca": (automaton, CA_DT), "dem": (spheres, options.dt or CA_DT / STEPS_IN_ONE)}
    batches = {name: shaken_batch(*job, settings["seeds"], options) for name, job in jobs.items()}
    output_folder(options.out)
    runs = {}
    for name, batch in batches.items():
        with ProgressBar(TITLES[name]) as progress:
            runs[name] = shake(batch, boxes[name], settings, progress)
    measures = {
        particles: {name: made.measures(particles) for name, made in runs.items()}
        for particles in PARTICLES
    }
    phase = phases(runs["ca"].batch)
    picture(runs, measures, phase, options)
    write_tables(runs, measures, phase, options.out)
    figures = figures_of(measures, phase)
    write_summary(
        options.out,
        NAME,
        figures,
        compile_seconds=sum(made.batch.compile_seconds for made in runs.values()),
        run_seconds=sum(made.batch.run_seconds for made in runs.values()),
    )
    show(figures, options)


def phases(batch):
    """Phase of every frame [cycles]; whole steps miss even spacing by a trifle."""
    steps = int(batch.steps_per_cycle[0])
    return np.arange(FRAMES) * (steps // FRAMES) / steps


def harmonic(phase, values):
    """Amplitude and lag [degrees] behind the container of a quantity over a cycle."""
    angle = 2.0 * np.pi * phase
    columns = np.column_stack([np.ones_like(angle), np.sin(angle), np.cos(angle)])
    _, sine, cosine = np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(np.hypot(sine, cosine)), float(np.degrees(np.arctan2(-cosine, sine)))


def figures_of(measures, phase):
    """How high the particles swing and how late, by filling, and how far the fillings differ."""
    figures = {}
    for particles, fillings in measures.items():
        cycles = {name: one["height_mm"].mean(axis=0) for name, one in fillings.items()}
        swings = {name: harmonic(phase, cycle) for name, cycle in cycles.items()}
        for name, (amplitude, lag) in swings.items():
            end, floor = f"{name}_N{particles}", fillings[name]["floor"].mean(axis=0)
            figures[f"height_amplitude_mm_{end}"] = figure(amplitude, "mm")
            figures[f"height_lag_deg_{end}"] = figure(lag, "deg")
            above = float(fillings[name]["above_floor_mm"].mean())
            figures[f"height_above_floor_mm_{end}"] = figure(above, "mm")
            figures[f"floor_share_least_{end}"] = figure(float(floor.min()), "1")
            figures[f"floor_share_most_{end}"] = figure(float(floor.max()), "1")
        (ca, late), (dem, later) = swings["ca"], swings["dem"]
        turn = (late - later + 180.0) % 360.0 - 180.0
        figures[f"amplitude_difference_mm_N{particles}"] = figure(ca - dem, "mm")
        figures[f"lag_difference_deg_N{particles}"] = figure(turn, "deg")
        apart = float(np.sqrt(((cycles["ca"] - cycles["dem"]) ** 2).mean()))
        figures[f"height_difference_mm_N{particles}"] = figure(apart, "mm")
    return figures


def picture(runs, measures, phase, options):
    """Draw frames of one cycle, the measures over the cycle, and the animation."""

    def at(name):
        return os.path.join(options.out, name)

    amplitude = 1e-3 * options.amplitude
    fastest = SCALE * 2.0 * np.pi * options.frequency * amplitude
    rows = {}
    for particles in PARTICLES:
        lines = {
            made.filling: (made.box, made.frames[particles][0][::SHOWN])
            for name, made in runs.items()
        }
        plot.plot_patterns(at(f"patterns_{particles}.png"), lines, amplitude, fastest)
        for made in runs.values():
            title = STYLES[made.filling].label.replace(", ", ",\n")
            rows[f"{title}\n{particles} particles"] = made.box, made.frames[particles][0]
    plot.animate_patterns(at("patterns.gif"), rows, amplitude, fastest)
    cycles = {
        particles: {runs[name].filling: over_cycle(phase, one) for name, one in fillings.items()}
        for particles, fillings in measures.items()
    }
    time = np.linspace(0.0, 1.0, 200)
    container = time, options.amplitude * np.sin(2.0 * np.pi * time)
    plot.plot_cycle(at("cycle.png"), cycles, container)


def over_cycle(phase, measured):
    """Means over the cycles, and the spread of the height between them; closed to a whole cycle."""
    means = {name: values.mean(axis=0) for name, values in measured.items()}
    columns = {**means, "spread_mm": measured["height_mm"].std(axis=0)}
    closed = {name: np.append(values, values[0]) for name, values in columns.items()}
    return {"phase": np.append(phase, 1.0), **closed}


def write_tables(runs, measures, phase, folder):
    """The measures of every frame, and the places of all particles in the first cycle."""
    rows = []
    for particles in PARTICLES:
        for name, made in runs.items():
            one = measures[particles][name]
            for row, frames in enumerate(made.frames[particles]):
                start = row % made.seeds + 1, row // made.seeds
                for k, frame in enumerate(frames):
                    values = (one[key][row, k] for key in one)
                    rows.append((particles, name, *start, phase[k], 1e3 * frame.x, *values))
    names = ("particles", "filling", "seed", "cycle", "phase", "container_mm", *one)
    write_csv(os.path.join(folder, "cycles.csv"), dict(zip(names, zip(*rows))))
    rows = [
        (particles, name, phase[k], *1e3 * place, *velocity)
        for particles in PARTICLES
        for name, made in runs.items()
        for k, frame in enumerate(made.frames[particles][0])
        for place, velocity in zip(frame.position, frame.velocity)
    ]
    names = ("particles", "filling", "phase", "across_mm", "up_mm", "across_m_s", "up_m_s")
    write_csv(os.path.join(folder, "particles.csv"), dict(zip(names, zip(*rows))))


def show(figures, options):
    """Print the figures, a row each filling and number of particles."""
    columns = {
        "height_amplitude_mm": "swing [mm]",
        "height_lag_deg": "lag [deg]",
        "height_above_floor_mm": "above floor [mm]",
        "floor_share_least": "at floor, least",
        "floor_share_most": "at floor, most",
    }
    rows = []
    for particles in PARTICLES:
        for name, title in TITLES.items():
            values = (figures[f"{key}_{name}_N{particles}"]["value"] for key in columns)
            rows.append((particles, title, *(f"{value:.3g}" for value in values)))
    print("Mean height of the particles over one cycle")
    print_table(rows, ["particles", "filling", *columns.values()])
    print(f"\nPictures, animation and tables are in {options.out}")


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
