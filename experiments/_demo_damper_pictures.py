"""Pictures and caption of ``demo_damper``: a container with particles beside an empty one."""

import os

import numpy as np

from ca_damper.plot import Box, DrawnBox, moving_picture
from taichi_dem.kit.files import write_csv, write_text
from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, styles_of
from taichi_dem.kit.plot_style import picture as png

#: Ends of the colour scale as a share of the larger container's largest speed.
SCALE = 1.2
#: The spring hangs from the base, this far over a box in its middle [mm]; its coils, half width and
#: straight ends [mm], which reach over the steps of a staggered box.
HANGS, COILS, HALF, LEAD = 75.0, 9, 7.0, 6.0


def picture(folder, runs, o, filling, options):
    """Write the curves, their table and the animation; runs: history, Cycles and frames by name."""
    full, empty = (series(runs[title][0], o) for title in ("full", "empty"))
    table = {**full, "x_empty_mm": empty["x_mm"], "energy_empty_mJ": empty["energy_mJ"]}
    write_csv(os.path.join(folder, "motion.csv"), table)
    title, colour = counted(options.particles), styles_of([filling.label])[filling.label].colour
    plot_motion(os.path.join(folder, "motion.png"), title, full, empty, filling)
    omega = 2.0 * np.pi * options.frequency * o.natural_frequency
    fastest = SCALE * omega * max(float(cycles.amplitude[0]) for _, cycles, _ in runs.values())
    box = Box.of_spheres(filling) if options.filling == "spheres" else Box.of_automaton(filling)
    films = runs["full"][2], runs["empty"][2]
    animate_motion(os.path.join(folder, "damper.gif"), title, box, films, fastest, colour)


def series(history, o):
    """Time, displacement and energies of a run, by column name."""
    held = o.stiffness * (history["x"] - history["y"]) ** 2
    return {
        "time_s": history["time_s"],
        "x_mm": 1e3 * history["x"],
        "energy_mJ": 0.5e3 * (o.mass * history["v"] ** 2 + held),
        "particles_mJ": 1e3 * history["energy"],
    }


def counted(particles):
    """Number of particles in words."""
    return f"{particles} particle{'' if particles == 1 else 's'}"


def plot_motion(path, title, full, empty, filling):
    """Displacement and energy over time, with particles and without; title: the particles."""
    style, bare = styles_of([filling.label])[filling.label], STYLES["empty"].label
    look, own = {"color": GREY, "linewidth": 0.8, "label": bare}, {"color": style.colour}
    with png(path, 2, 1, size=(8.6, 5.6), sharex=True) as (_, (motion, energy)):
        motion.plot(empty["time_s"], empty["x_mm"], **look)
        words = f"{style.label}, {title}"
        motion.plot(full["time_s"], full["x_mm"], linewidth=0.9, label=words, **own)
        motion.set(ylabel="displacement of\nthe container [mm]")
        energy.plot(empty["time_s"], empty["energy_mJ"], color=GREY, ls="--", label=bare)
        energy.plot(full["time_s"], full["energy_mJ"], label=f"container with {title}", **own)
        energy.plot(full["time_s"], full["particles_mJ"], color=BLACK, label="the particles alone")
        energy.set(xlabel="time [s]", ylabel="energy [mJ]", ylim=(0.0, None))
        energy.set_xlim(0.0, full["time_s"][-1])
        for axes in (motion, energy):
            axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def animate_motion(path, title, box, films, fastest, colour):
    """The full and the empty container on their springs, and their displacement, as a GIF.

    films: frames of both, at the same times. fastest: ends of the colour scale [m/s].
    """
    swing = 1.1 * max(abs(frame.x) for frames in films for frame in frames)
    # The empty container moves as smoothly as the structure: its box is not staggered.
    plain, shift = Box(box.width, box.height, box.diameter), 1.35 * box.width
    with moving_picture(path, (4.0, 3.0)) as (figure, shoot):
        bench, curve = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        hung = Hung(bench, box, fastest, shift), Hung(bench, plain, fastest, 0.0)
        frame_bench(bench, box, shift, swing, title)
        dots = draw_curves(curve, {title: colour, "empty": GREY}, films, swing)
        bar = {"location": "bottom", "aspect": 30, "pad": 0.02}
        words = "vertical speed of particles [m/s]"
        figure.colorbar(hung[0].drawn.particles, ax=bench, label=words, **bar)
        for shots in zip(*films):
            for one, dot, frame in zip(hung, dots, shots):
                one.show(frame)
                dot.set_data([frame.time_s - films[0][0].time_s], [1e3 * frame.x])
            shoot()


class Hung:
    """A box on a spring that hangs from the base."""

    def __init__(self, axes, box, fastest, offset):
        self.drawn = DrawnBox(axes, box, fastest, offset)
        self.middle, self.top = 1e3 * offset + 0.5e3 * box.width, 1e3 * box.height
        (self.spring,) = axes.plot([], [], color=BLACK, linewidth=0.9)
        (self.base,) = axes.plot([], [], color=BLACK, linewidth=3.0)

    def show(self, frame):
        """Draw a ``record.Frame``."""
        self.drawn.show(frame)
        top = self.top + HANGS + 1e3 * frame.y
        bottom = self.top + 1e3 * self.drawn.box.lift(frame.x)
        along = [top, *np.linspace(top - LEAD, bottom + LEAD, 2 * COILS), bottom]
        across = np.tile([0.0, HALF, 0.0, -HALF], COILS)[: len(along)]
        across[-2:] = 0.0
        self.spring.set_data(self.middle + across, along)
        self.base.set_data([self.middle - 20.0, self.middle + 20.0], [top, top])


def frame_bench(axes, box, shift, swing, title):
    """Limits of the panel of both boxes, and their names."""
    width, height, below = 1e3 * box.width, 1e3 * box.height, -1e3 * swing
    axes.set(xlim=(-3.0, 1e3 * shift + width + 3.0), ylim=(below - 14.0, height + HANGS + 6.0))
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.text(0.5 * width, below - 12.0, "empty", ha="center")
    axes.text(1e3 * shift + 0.5 * width, below - 12.0, title, ha="center")


def draw_curves(axes, colours, films, swing):
    """Displacement of each run; returns dots for the present. colours: by words, as the films."""
    dots = []
    for frames, (words, colour) in zip(films, colours.items()):
        time = [frame.time_s - frames[0].time_s for frame in frames]
        axes.plot(time, [1e3 * f.x for f in frames], color=colour, linewidth=0.9, label=words)
        dots += axes.plot([], [], "o", color=colour, markersize=4)
    axes.set(ylim=(-1e3 * swing, 1e3 * swing), xlabel="time [s]", ylabel="displacement [mm]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return dots


def write_caption(folder, figures, filling, oscillator, options):
    """Write the comparison in words to caption.txt; returns its sentences."""
    value = {name: item["value"] for name, item in figures.items()}
    own = oscillator.natural_frequency
    load = 1e3 * options.particles * filling.particle_mass
    share = 0.1 * load / oscillator.mass
    sentences = (
        f"The container weighs {1e3 * oscillator.mass:g} g and swings by itself at {own:.2f} Hz.",
        f"Its base shakes it at {options.frequency * own:.2f} Hz, by {options.amplitude:g} mm up "
        "and down.",
        f"Empty, it then swings by {value['amplitude_empty_mm']:.3g} mm.",
        f"With {counted(options.particles)} ({load:g} g, {share:.0f} % of its mass) it swings by "
        f"{value['amplitude_mm']:.3g} mm: {100.0 * value['amplitude_left']:.3g} % of that.",
        *(taken(value) if options.particles else ()),
    )
    write_text(os.path.join(folder, "caption.txt"), " ".join(sentences) + "\n")
    return sentences


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
