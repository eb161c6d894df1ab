"""Particles over one cycle of the container (Komatsuzaki et al., Figs. 9 and 10)."""

import os

import numpy as np

from ca_damper.plot import DrawnBox, frame_panel, moving_picture
from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, area_key, line_key, picture, styles_of

#: The pictures show every fourth frame; a container slower than this share of its fastest gets no
#: arrow; ends of the colour scale as a share of the container's largest speed.
SHOWN, SLOW, SCALE = 4, 0.1, 1.2
SPEED = "vertical speed of particles [m/s]"


def draw_all(folder, films, measures, phase, options):
    """Frames of one cycle for each number of particles, an animation, the measures over the cycle.

    films: (particles, name of the filling) -> (Box, frames of a cycle), as many frames in each.
    measures: by the same keys, as ``damper_patterns.measured``. phase: of the frames [cycles].
    """
    amplitude = 1e-3 * options.amplitude
    fastest = 2.0 * np.pi * options.frequency * amplitude
    for particles in dict.fromkeys(particles for particles, _ in films):
        rows = {name: film for (number, name), film in films.items() if number == particles}
        path = os.path.join(folder, f"patterns_{particles}.png")
        plot_patterns(path, rows, amplitude, fastest)
    animate_patterns(os.path.join(folder, "patterns.gif"), films, amplitude, fastest)
    plot_cycle(os.path.join(folder, "cycle.png"), phase, measures, options.amplitude)


def plot_patterns(path, rows, amplitude, fastest):
    """A row of frames for every filling, from left to right through one cycle.

    The cycle begins when the container passes its middle upwards; arrows show its velocity.
    amplitude: of the container [m]. fastest: its largest speed [m/s].
    """
    count = len(next(iter(rows.values()))[1][::SHOWN])
    size = (1.14 * count + 0.9, 2.45 * len(rows) + 0.3)
    with picture(path, len(rows), count, size=size, squeeze=False) as (figure, panels):
        for line, (name, (box, frames)) in zip(panels, rows.items()):
            for k, (axes, frame) in enumerate(zip(line, frames[::SHOWN])):
                frame_panel(axes, box, amplitude, margin=9.0)
                drawn = DrawnBox(axes, box, SCALE * fastest)
                drawn.show(frame)
                mark_motion(axes, box, box.lift(frame.x), np.cos(2.0 * np.pi * k / count))
            look = {"rotation": 90, "ha": "right", "va": "center", "transform": line[0].transAxes}
            line[0].text(-0.08, 0.5, styles_of(rows)[name].label, **look)
        words = "one cycle of the container; arrows: its velocity, where it is not slow"
        figure.supxlabel(words, fontsize=9)
        for axes, frame in zip(panels[0], frames[::SHOWN]):
            axes.set_title(f"{1e3 * (frame.time_s - frames[0].time_s):.0f} ms", loc="center")
        figure.colorbar(drawn.particles, ax=panels, label=SPEED, aspect=45, pad=0.01)


def mark_motion(axes, box, lift, share):
    """An arrow beside the box for the container's velocity; share: of its largest."""
    reach, beside = 14.0 * share, 1e3 * box.width + 7.0
    middle = 1e3 * (0.5 * box.height + lift)
    look = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    if abs(share) > SLOW:
        ends = (beside, middle + reach), (beside, middle - reach)
        axes.annotate("", *ends, arrowprops=look, annotation_clip=False)


def animate_patterns(path, films, amplitude, fastest):
    """The boxes of all fillings side by side through one cycle, as a GIF below a megabyte."""
    with moving_picture(path, (4.0, 2.6)) as (figure, shoot):
        panels, drawn = figure.subplots(1, len(films)), []
        for axes, ((particles, name), (box, _)) in zip(panels, films.items()):
            frame_panel(axes, box, amplitude)
            title = STYLES[name].label.replace(", ", ",\n")
            axes.set_title(f"{title}\n{particles} particles", loc="center")
            drawn.append(DrawnBox(axes, box, SCALE * fastest))
        bar = {"location": "bottom", "aspect": 40, "pad": 0.02}
        figure.colorbar(drawn[0].particles, ax=panels.tolist(), label=SPEED, **bar)
        for shots in zip(*(frames for _, frames in films.values())):
            for one, frame in zip(drawn, shots):
                one.show(frame)
            shoot()


def plot_cycle(path, phase, measures, amplitude):
    """Mean height of the particles and how many touch floor and ceiling, over one closed cycle."""
    numbers = list(dict.fromkeys(particles for particles, _ in measures))
    styles = styles_of([name for _, name in measures])
    time, closed = np.linspace(0.0, 1.0, 200), np.append(phase, 1.0)
    shape = {"size": (4.2 * len(numbers) + 0.6, 5.7), "sharex": True, "sharey": "row"}
    with picture(path, 2, len(numbers), squeeze=False, **shape) as (figure, panels):
        for top, particles in zip(panels[0], numbers):
            motion = amplitude * np.sin(2.0 * np.pi * time)
            top.plot(time, motion, color=GREY, linestyle=":", label="container")
            top.set_title(f"{particles} particles")
        for (particles, name), one in measures.items():
            draw_measures(panels[:, numbers.index(particles)], closed, one, styles[name])
        for axes in panels[1]:
            axes.set(xlabel="phase of the container [cycles]", xlim=(0.0, 1.0), ylim=(0.0, None))
        panels[0, 0].set_ylabel("mean height in the room\nless that at rest [mm]")
        panels[1, 0].set_ylabel("particles that touch [%]")
        ends = {"-": "floor", "--": "ceiling"}
        keys = [line_key(words, color=BLACK, ls=line) for line, words in ends.items()]
        panels[1, 0].legend(handles=keys, loc="upper right")
        keys, _ = panels[0, 0].get_legend_handles_labels()
        keys.append(area_key("± standard deviation of the cycles", fc=GREY, alpha=0.3))
        figure.legend(handles=keys, loc="outside upper left", ncols=len(keys))


def draw_measures(panels, phase, one, style):
    """Curves of a filling: means over the cycles, and the spread of the height between them."""
    height, spread = (getattr(one["height_mm"], word)(axis=0) for word in ("mean", "std"))
    height, spread = np.append(height, height[0]), np.append(spread, spread[0])
    panels[0].plot(phase, height, color=style.colour, label=style.label)
    band = {"color": style.colour, "alpha": 0.18, "linewidth": 0}
    panels[0].fill_between(phase, height - spread, height + spread, **band)
    for end, line in (("floor", "-"), ("ceiling", "--")):
        share = 100.0 * one[end].mean(axis=0)
        panels[1].plot(phase, np.append(share, share[0]), color=style.colour, linestyle=line)
