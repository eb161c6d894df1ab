"""Pictures of the lessons, as PNG in memory, in the common style; drawn on the engine's thread."""

import textwrap

import numpy as np

from _grains import FILLING, PICTURES, RATIOS
from _needs import SHOWN as INSTANTS
from _time_step import METHODS, SHOWN, STEPS, WORDS
from ca_damper.plot import Box, DrawnBox, frame_panel
from taichi_dem.kit.plot_style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    RED,
    STYLES,
    png_of,
    seconds,
    styled,
    styles_of,
)
from taichi_dem.plot.bodies import draw_bodies

_LOOKS = {name: (style.colour, style.marker) for name, style in styles_of(METHODS).items()}
_COLOUR = STYLES[FILLING.label].colour
#: Of the displacement of the struck bar.
_MAGNIFY = 1500.0


def picture_time_step(answer):
    """The bar on its way, its far end over time, and error over cost of every step; PNG bytes."""
    with styled(0, size=(10.0, 6.0)) as (figure, _):
        grid = figure.add_gridspec(2, 2, height_ratios=(0.5, 1.0))
        _struck(figure, figure.add_subplot(grid[0, :]), answer)
        _far_end(figure.add_subplot(grid[1, 0]), answer)
        _price(figure.add_subplot(grid[1, 1]), answer)
        return png_of(figure)


def _struck(figure, axes, answer):
    """The bar coloured by velocity when the wave is on its way, or the sentence of its end."""
    motion, truth = answer.chosen.motion, answer.truth.motion
    top = 1e3 * float(np.abs(truth["velocity"][:, 0]).max())
    shown, high = motion or truth, answer.model.mesh.points.max(axis=0)
    look = {"magnify": _MAGNIFY, "limits": (-top, top), "colours": "RdBu_r"}
    drawn = draw_bodies(axes, answer.model, shown, 1e3 * shown["velocity"][:, 0], **look)
    drawn.set_alpha(None if motion else 0.15)
    axes.set(xlim=(-0.02, high[0] + 0.03), ylim=(-0.02, high[1] + 0.02), xlabel="x [m]", yticks=[])
    axes.spines["left"].set_visible(False)
    figure.colorbar(drawn, ax=axes, label="velocity\n[mm/s]", aspect=8, pad=0.01)
    if motion:
        now = f"t = {1e3 * answer.time[SHOWN]:.2f} ms"
        axes.set_title(f"{now}, displacement × {_MAGNIFY:g}")
        return
    axes.set_title("the run did not get there")
    words = textwrap.fill(answer.chosen.sentence.split(";")[0], 60)
    look = {"ha": "center", "va": "center", "color": RED, "weight": "bold"}
    axes.text(0.5 * high[0], 0.5 * high[1], words, **look)


def _far_end(axes, answer):
    """Displacement of the far end, of the truth and of the chosen run."""
    colour, _ = _LOOKS[answer.method]
    time, label = 1e3 * answer.time, f"{seconds(answer.chosen.step)} a step"
    axes.plot(time, 1e6 * answer.truth.moved, color=GREY, lw=4.0, alpha=0.5, label="truth")
    axes.plot(time, 1e6 * answer.chosen.moved, color=colour, label=label)
    axes.set(xlabel="time [ms]", ylabel="far end moved by [µm]", title=WORDS[answer.method])
    axes.legend(loc="upper left")


def _price(axes, answer):
    """Error over seconds at every step of the methods tried so far, the chosen one ringed."""
    axes.set(xscale="log", yscale="log", xlim=(7e-4, 1.0), ylim=(3e-8, 3.0))
    axes.axhspan(1.0, 3.0, color="0.94", lw=0, label="× diverged: its cost, but no error")
    axes.axhline(1e-2, color=GREY, ls=":", lw=1.0, label="error of 1 %")
    for method, strikes in answer.ladders.items():
        colour, mark = _LOOKS[method]
        good = [(m.seconds, m.error(answer.truth)) for m in strikes if not m.sentence]
        axes.plot(*zip(*good), mark, ls="-", color=colour, ms=5, lw=1.2, label=WORDS[method])
        # A run that failed at once would have taken as long as the finest, by its steps.
        cost = [strikes[0].seconds * STEPS[0] / m.step for m in strikes if m.sentence]
        height = 1.15 * 1.25 ** (1.5 * list(METHODS).index(method))
        axes.plot(cost, [height] * len(cost), "x", color=colour, ms=5, mew=1.4)
    chosen = answer.chosen
    if not chosen.sentence:
        place = chosen.seconds, chosen.error(answer.truth)
        axes.plot(*place, "o", ms=14, mfc="none", mec=BLACK, mew=1.5)
        look = {"textcoords": "offset points", "weight": "bold"}
        axes.annotate(seconds(chosen.step), place, (10, 8), **look)
    axes.set(xlabel="CPU time of one core [s]", ylabel="largest error of the far end [1]")
    axes.set_title("lower left is better")
    axes.legend(loc="lower left")


def picture_grains(answer):
    """Response, energy a cycle, and the box through one cycle; PNG bytes."""
    with styled(0, size=(10.0, 6.2)) as (figure, _):
        grid = figure.add_gridspec(2, 1, height_ratios=(1.0, 1.15))
        above = grid[0].subgridspec(1, 2, width_ratios=(1.7, 1.0))
        _response(figure.add_subplot(above[0]), answer)
        _energy(figure.add_subplot(above[1]), answer)
        _boxes(figure, grid[1].subgridspec(1, PICTURES), answer)
        return png_of(figure)


def _response(axes, answer):
    fine, empty = answer.without()
    _, rigid = answer.without(answer.share * answer.oscillator.mass)
    axes.plot(fine, 1e3 * empty, color=GREY, ls=":", label=STYLES["empty"].label)
    axes.plot(fine, 1e3 * rigid, color=GREY, ls="--", lw=1.0, label="grains glued to the floor")
    axes.plot(RATIOS, 1e3 * answer.rms, "o-", color=_COLOUR, ms=4, label=f"{answer.grains} grains")
    place = answer.ratio, 1e3 * answer.rms[answer.place]
    axes.plot(*place, "o", ms=12, mfc="none", mec=BLACK, mew=1.5)
    axes.set(xlabel="frequency of the base / own frequency of the empty box [1]", ylim=(0.0, None))
    axes.set(ylabel="RMS displacement [mm]", title="how far the box swings")
    axes.legend()


def _energy(axes, answer):
    shown = {"base gives": GREEN, "dashpot takes": GREY, "grains take": BLUE}
    values = [1e3 * value for value in answer.energy.values()]
    bars = axes.bar(list(shown), values, color=list(shown.values()))
    axes.bar_label(bars, fmt="%.3g", fontsize=8.5)
    axes.set(ylabel="energy a cycle [mJ]", title=f"at {answer.ratio:g} × own frequency")
    axes.margins(y=0.15)
    axes.axhline(0.0, color=BLACK, lw=0.8)
    axes.grid(False, axis="x")


def _boxes(figure, grid, answer):
    """The box at even parts of a cycle."""
    box = Box.of_automaton(FILLING)
    swing = max(abs(frame.x) for frame in answer.frames)
    fastest = max(0.05, 2.0 * np.pi * answer.frequency * answer.amplitude)
    panels = [figure.add_subplot(grid[k]) for k in range(PICTURES)]
    for k, (axes, frame) in enumerate(zip(panels, answer.frames)):
        frame_panel(axes, box, max(swing, 0.5 * box.diameter))
        drawn = DrawnBox(axes, box, fastest)
        drawn.show(frame)
        axes.set_title(f"{k}/{PICTURES} of a cycle", loc="center")
    words = "grains: blue rise, red fall [m/s]"
    figure.colorbar(drawn.particles, ax=panels, label=words, aspect=18, pad=0.01)


def picture_needs(answer):
    """The bar with all effects and with those chosen, and the cost of a step; PNG bytes."""
    with styled(0, size=(10.0, 4.4)) as (figure, _):
        grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 0.75))
        bars = []
        rows = {"all effects": answer.complete, "your choice": answer.chosen}
        for row, (name, outcome) in enumerate(rows.items()):
            for column, instant in enumerate(INSTANTS):
                bars.append(figure.add_subplot(grid[row, column]))
                drawn = _pulled(bars[-1], answer, outcome, instant)
                bars[-1].set_title(f"{name}, {instant}" if row == 0 else name, loc="center")
        words = f"moved to the right [mm], drawn × {_magnify(answer):.0f}"
        figure.colorbar(drawn, ax=bars, label=words, location="bottom", aspect=50, pad=0.02)
        _step_price(figure.add_subplot(grid[0, 2]), answer)
        _broken(figure.add_subplot(grid[1, 2]), answer)
        return png_of(figure)


def _magnify(answer):
    """So that the stroke looks like a twelfth of the bar, to one digit."""
    factor = answer.model.mesh.points[:, 0].max() / 12.0 / answer.stroke
    return float(f"{factor:.1g}")


def _pulled(axes, answer, outcome, instant):
    """The bar at an instant; words where the run did not get there."""
    stroke, model = answer.stroke, answer.model
    motion = outcome.motions.get(instant, answer.complete.motions.get(instant))
    moved = (motion["position"] - model.centre)[:, 0]
    look = {"magnify": _magnify(answer), "colours": "RdBu_r"}
    look.update(limits=(-1e3 * stroke, 1e3 * stroke), broken=outcome.broken)
    drawn = draw_bodies(axes, model, motion, 1e3 * moved, **look)
    axes.set(xlim=(-0.01, 0.34), ylim=(-0.04, 0.15))
    axes.set_axis_off()
    if instant not in outcome.motions:
        drawn.set_alpha(0.15)
        axes.text(0.15, 0.05, "the program ended the run", ha="center", color=RED, weight="bold")
    return drawn


def _step_price(axes, answer):
    """Time of a step of both, where it has been measured."""
    values = [1e6 * outcome.step_s for outcome in (answer.chosen, answer.complete)]
    axes.set(xlabel="time of a step [µs]", title="what it costs")
    if np.isfinite(values).all():
        _pair(axes, values, "%.3g")
    else:
        axes.set(xticks=[], yticks=[])
        axes.text(0.5, 0.5, "not measured yet: press the button", ha="center", va="center")


def _broken(axes, answer):
    _pair(axes, [int(made.broken.sum()) for made in (answer.chosen, answer.complete)], "%d")
    words = "one of both did not end"
    if answer.change is not None:
        words = f"bodies end {percent(answer.change)} elsewhere"
    axes.set(xlabel="broken bonds [1]", title=words)


def _pair(axes, values, form):
    """Two bars, of the choice and of all effects."""
    bars = axes.barh(["your choice", "all effects"], values, color=[BLUE, GREY], height=0.5)
    axes.bar_label(bars, fmt=form, padding=3)
    axes.set_xlim(0.0, 1.25 * max(values) or 1.0)
    axes.grid(False, axis="y")


def percent(share):
    """A share in words: 0.0123 -> 1.2 %, 1.44 -> 144 %."""
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
