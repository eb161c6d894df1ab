"""Pictures and words of ``demo_damper.py``: a container with particles beside an empty one."""

import numpy as np

from ca_damper.plot import Box, Hanging, film_hanging
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, picture, styles_of


def write(at, runs, o, filling, options):
    """Write the curves, their table and the animation; runs: history, Cycles and frames by name."""
    full, empty = (series(runs[title][0], o) for title in ("full", "empty"))
    table = {**full, "x_empty_mm": empty["x_mm"], "energy_empty_mJ": empty["energy_mJ"]}
    write_csv(at("motion.csv"), table)
    title, style = counted(options.particles), styles_of([filling.label])[filling.label]
    plot_motion(at("motion.png"), title, full, empty, style)
    omega = 2.0 * np.pi * options.frequency * o.natural_frequency
    fastest = 1.2 * omega * max(float(cycles.amplitude[0]) for _, cycles, _ in runs.values())
    box = Box.of_spheres(filling) if options.filling == "spheres" else Box.of_automaton(filling)
    # The empty container moves as smoothly as the structure: its box is not staggered.
    bare = Hanging("empty", Box(box.width, box.height, box.diameter), runs["empty"][2], GREY)
    shown = [bare, Hanging(title, box, runs["full"][2], style.colour)]
    film_hanging(at("damper.gif"), shown, fastest)


def series(history, o):
    """Time, displacement and energies of a run, by column name."""
    return {
        "time_s": history["time_s"],
        "x_mm": 1e3 * history["x"],
        "energy_mJ": 1e3 * o.energy(history["x"], history["v"], history["y"]),
        "particles_mJ": 1e3 * history["energy"],
    }


def counted(particles):
    """Number of particles in words."""
    return f"{particles} particle{'' if particles == 1 else 's'}"


def plot_motion(path, title, full, empty, style):
    """Displacement and energy over time, with particles and without; title: the particles."""
    bare, own = {"color": GREY, "lw": 0.8, "label": STYLES["empty"].label}, {"color": style.colour}
    with picture(path, 2, 1, size=(8.6, 5.6), sharex=True) as (_, (motion, energy)):
        motion.plot(empty["time_s"], empty["x_mm"], **bare)
        words = f"{style.label}, {title}"
        motion.plot(full["time_s"], full["x_mm"], lw=0.9, label=words, **own)
        motion.set(ylabel="displacement of\nthe container [mm]")
        energy.plot(empty["time_s"], empty["energy_mJ"], ls="--", **bare)
        energy.plot(full["time_s"], full["energy_mJ"], label=f"container with {title}", **own)
        energy.plot(full["time_s"], full["particles_mJ"], color=BLACK, label="the particles alone")
        energy.set(xlabel="time [s]", ylabel="energy [mJ]", ylim=(0.0, None))
        energy.set_xlim(0.0, full["time_s"][-1])
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
