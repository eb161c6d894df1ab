"""Pictures and words of the demonstration: a container with particles beside an empty one."""

from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ca_damper.measures import Cycles
from ca_damper.oscillator import Oscillator
from ca_damper.plot import Box, Hanging, film_hanging
from ca_damper.viewer import show_containers
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, STYLES, picture, styles_of

#: Arrays by name.
Columns = Mapping[str, np.ndarray]


def figures_of(cycles: Cycles, empty: Cycles, o: Oscillator) -> dict[str, tuple[float, str]]:
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


def write(
    at: Callable[[str], str],
    full: Any,
    empty: Any,
    filling: Any,
    options: Namespace,
    omega: float,
) -> None:
    """Write the curves, their table and the animation.

    full, empty: a ``Swing`` each. omega: of the base [rad/s].
    """
    bare = {"x_empty_mm": empty.columns["x_mm"], "energy_empty_mJ": empty.columns["energy_mJ"]}
    write_csv(at("motion.csv"), {**full.columns, **bare})
    title, style = counted(options.particles), styles_of([filling.label])[filling.label]
    plot_motion(at("motion.png"), title, full.columns, empty.columns, style)
    fastest = 1.2 * omega * max(float(one.cycles.amplitude[0]) for one in (full, empty))
    box = Box.of(filling)
    # The empty container moves as smoothly as the structure: its box is not staggered.
    plain = Box(box.width, box.height, box.diameter)
    smooth = Hanging("empty", plain, empty.frames, STYLES["empty"].colour)
    pair = [smooth, Hanging(title, box, full.frames, style.colour)]
    film_hanging(at("damper.gif"), pair, fastest)
    show_containers(pair, at("view.html"), open_browser=False)


def counted(particles: int) -> str:
    """Number of particles in words."""
    return f"{particles} particle{'' if particles == 1 else 's'}"


def plot_motion(path: str, title: str, full: Columns, empty: Columns, style: Any) -> None:
    """Displacement and energy over time, with particles and without; title: the particles."""
    bare = {"color": STYLES["empty"].colour, "lw": 0.8, "label": STYLES["empty"].label}
    own = {"color": style.colour}
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


def sentences(
    figures: Mapping[str, tuple[float, str]],
    filling: Any,
    oscillator: Oscillator,
    options: Namespace,
) -> tuple[str, ...]:
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


def taken(value: Mapping[str, float]) -> tuple[str, ...]:
    """Power and apparent mass of the particles in words; value: of the figures, by name."""
    takes = value["power_mW"] > 0.0
    power, damping = abs(value["power_mW"]), value["apparent_damping_N_s_m"]
    return (
        f"The particles {'take' if takes else 'give'} {power:.2g} mW {'from' if takes else 'to'} "
        f"it, as a dashpot of {damping:.2g} N s/m would: the damping ratio is "
        f"{value['damping_ratio']:.2g} instead of {value['damping_ratio_empty']:.2g}.",
        f"In the swing they weigh as much as {value['apparent_mass_g']:.1f} g fixed to it.",
    )
