"""Particles over one cycle of the container (Komatsuzaki et al., Figs. 9 and 10)."""

import numpy as np

from ca_damper.plot import DrawnBox, frame_panel, moving_picture
from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, area_key, line_key, picture, styles_of

#: The pictures show every fourth frame; a container slower than this share of its fastest gets no
#: arrow; ends of the colour scale as a share of the container's largest speed.
SHOWN, SLOW, SCALE = 4, 0.1, 1.2
SPEED = "vertical speed of particles [m/s]"


def plot_patterns(path, rows, amplitude, fastest):
    """A row of frames for every filling, from left to right through one cycle.

    rows: name of the filling -> (Box, frames), evenly over the cycle, which begins when the
    container passes its middle upwards; arrows show its velocity. amplitude: of the container [m].
    fastest: its largest speed [m/s].
    """
    rows = {name: (box, frames[::SHOWN]) for name, (box, frames) in rows.items()}
    count = len(next(iter(rows.values()))[1])
    size = (1.14 * count + 0.9, 2.45 * len(rows) + 0.3)
    with picture(path, len(rows), count, size=size, squeeze=False) as (figure, panels):
        for line, (name, (box, frames)) in zip(panels, rows.items()):
            for k, (axes, frame) in enumerate(zip(line, frames)):
                frame_panel(axes, box, amplitude, margin=9.0)
                drawn = DrawnBox(axes, box, SCALE * fastest)
                drawn.show(frame)
                mark_motion(axes, box, box.lift(frame.x), np.cos(2.0 * np.pi * k / count))
            look = {"rotation": 90, "ha": "right", "va": "center", "transform": line[0].transAxes}
            line[0].text(-0.08, 0.5, styles_of(rows)[name].label, **look)
        words = "one cycle of the container; arrows: its velocity, where it is not slow"
        figure.supxlabel(words, fontsize=9)
        for axes, frame in zip(panels[0], frames):
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


def animate_patterns(path, shots, amplitude, fastest):
    """The boxes of all fillings side by side through one cycle, as a GIF below a megabyte.

    shots: particles -> name of the filling -> (Box, frames), as many frames in each.
    """
    boxes = [
        (f"{STYLES[name].label}\n{particles} particles".replace(", ", ",\n"), box, frames)
        for particles, rows in shots.items()
        for name, (box, frames) in rows.items()
    ]
    with moving_picture(path, (4.0, 2.6)) as (figure, shoot):
        panels, drawn = figure.subplots(1, len(boxes)), []
        for axes, (title, box, _) in zip(panels, boxes):
            frame_panel(axes, box, amplitude)
            axes.set_title(title, loc="center")
            drawn.append(DrawnBox(axes, box, SCALE * fastest))
        bar = {"location": "bottom", "aspect": 40, "pad": 0.02}
        figure.colorbar(drawn[0].particles, ax=panels.tolist(), label=SPEED, **bar)
        for shots in zip(*(frames for *_, frames in boxes)):
            for one, frame in zip(drawn, shots):
                one.show(frame)
            shoot()


def plot_cycle(path, cycles, amplitude):
    """Mean height of the particles and how many touch floor and ceiling, over one cycle.

    cycles: particles -> name of the filling -> dict of phase (0 to 1), height_mm (in the room),
    spread_mm, floor and ceiling (shares of the particles). amplitude: of the container [mm].
    """
    time = np.linspace(0.0, 1.0, 200)
    shape = {"size": (4.2 * len(cycles) + 0.6, 5.7), "sharex": True, "sharey": "row"}
    with picture(path, 2, len(cycles), squeeze=False, **shape) as (figure, panels):
        for (top, bottom), (particles, fillings) in zip(panels.T, cycles.items()):
            motion = amplitude * np.sin(2.0 * np.pi * time)
            top.plot(time, motion, color=GREY, linestyle=":", label="container")
            for name, cycle in fillings.items():
                style = styles_of(fillings)[name]
                phase, height, spread = (cycle[k] for k in ("phase", "height_mm", "spread_mm"))
                top.plot(phase, height, color=style.colour, label=style.label)
                band = {"color": style.colour, "alpha": 0.18, "linewidth": 0}
                top.fill_between(phase, height - spread, height + spread, **band)
                for end, line in (("floor", "-"), ("ceiling", "--")):
                    bottom.plot(phase, 100.0 * cycle[end], color=style.colour, linestyle=line)
            top.set_title(f"{particles} particles")
            bottom.set(xlabel="phase of the container [cycles]", xlim=(0.0, 1.0), ylim=(0.0, None))
        panels[0, 0].set_ylabel("mean height in the room\nless that at rest [mm]")
        panels[1, 0].set_ylabel("particles that touch [%]")
        ends = {"-": "floor", "--": "ceiling"}
        keys = [line_key(words, color=BLACK, ls=line) for line, words in ends.items()]
        panels[1, 0].legend(handles=keys, loc="upper right")
        keys, _ = panels[0, 0].get_legend_handles_labels()
        keys.append(area_key("± standard deviation of the cycles", fc=GREY, alpha=0.3))
        figure.legend(handles=keys, loc="outside upper left", ncols=len(keys))
