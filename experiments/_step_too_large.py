"""Runs of ``demo_step_too_large.py``: what is seen of them, tables, pictures and words."""

import textwrap

import numpy as np

from _films import FilmedRun, film_runs
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, GREEN, GREY, ORANGE, RED, picture, seconds
from taichi_dem.kit.study import Table, write_rows
from taichi_dem.plot.series import positive

TABLE = Table(
    limited_by=("limit", "limited by"),
    share_of_limit=("share", "step / limit", "g"),
    step_s=("step", "step [s]", ".3g"),
    diverged=(lambda made: int(bool(made.sentence)), "", "", "1"),
    reached_s=(lambda made: float(made.time[-1]), "reached [s]", ".3g", "s"),
    unexplained=(lambda made: float(made.residual[-1]), "unexplained / put in", ".2g", "1"),
    end=(lambda made: "diverged" if made.sentence else "done", "end"),
    sentence=("sentence",),
)
#: Colours of the runs of a limit; axes of the unexplained energy.
COLOURS, DASHES = (GREEN, ORANGE, RED), ("-", "--", "-.")
UNEXPLAINED = {"yscale": "log", "ylim": (1e-5, 1e4)}


class Struck:
    """A run with a share of a limit as its step [s], to its end or as far as it goes.

    With an entry a look: speeds, bounds of the speed of every body's corners, (looks, bodies), and
    residual, energy that the account cannot explain over that put in by then. sentence: of the
    program where it ended the run, "" when it reached its end.
    """

    def __init__(self, limit, share, step, seen, result):
        self.limit, self.share, self.step, self.name = limit, share, step, f"{share:g} × limit"
        self.result, self.sentence = result, result.diverged
        self.time, self.frames, self.speeds = seen["time"], seen.rows["frame"], seen["speed"]
        terms = [[row["load_work"], row["residual"]] for row in seen.rows["energy"]]
        given, found = np.abs(terms).T
        self.residual = found / np.where(given > 0.0, given, np.inf)


def corner_speed(view):
    """Bound of the speed of every body's corners [m/s]."""
    motion = view.motion()
    spin = view.model.body_radius * np.linalg.norm(motion["spin"], axis=1)
    return np.linalg.norm(motion["velocity"], axis=1) + spin


def caption(runs):
    """What to see, with the program's own words."""
    left, right = (
        f"steps of {1e9 * made.step:.0f} ns, {made.share:g} times what the {made.limit} bear: "
        f"{ended(made)}"
        for made in runs[:2]
    )
    return f"The same blow on the same bar. Above: {left}. Below: {right}."


def ended(made):
    """How a run ended, in words."""
    steps, missed = round(made.time[-1] / made.step), made.residual[-1]
    missed = f"{100 * missed:.2g} % of" if missed < 1.0 else f"{missed:.2g} times"
    if not made.sentence:
        return f"{missed} the energy put in is unexplained after {steps} steps"
    return (
        "neighbours shake against each other, ever more, until the program ends the run after "
        f'{steps} steps, when {missed} the energy put in has come from nowhere: "{made.sentence}"'
    )


def write(runs, rows, at):
    """Write the tables of all that is plotted, the picture, and the film of the first two."""
    for made in runs:
        columns = {"time_s": made.time, "unexplained_over_put_in": made.residual}
        write_csv(at(f"history_{made.limit}_{made.share:g}.csv"), columns)
    names = ("limited_by", "share_of_limit", "step_s", "reached_s", "sentence")
    write_rows(at("steps.csv"), [{name: row[name] for name in names} for row in rows])
    picture_energy(at("energy.png"), runs)
    film(at("shaken.gif"), *runs[:2])


def picture_energy(path, runs):
    """Energy that the account cannot explain over time, a panel a limit; the sentences below."""
    limits = list(dict.fromkeys(made.limit for made in runs))
    said = [f"{m.limit}, {m.name}: “{m.sentence}”" for m in runs if m.sentence]
    size = (4.3 * len(limits) + 0.6, 3.4 + 0.55 * len(said))
    shape = 1, len(limits), size
    with picture(path, *shape, squeeze=False, sharey=True) as (drawn, panels):
        for axes, limit in zip(panels[0], limits):
            own = [made for made in runs if made.limit == limit]
            for made, colour, dashes in zip(own, COLOURS, DASHES):
                time, label = 1e6 * made.time, f"{made.name} = {seconds(made.step)}"
                axes.plot(time, positive(made.residual), color=colour, ls=dashes, label=label)
                if made.sentence:
                    axes.plot(time[-1], made.residual[-1], "X", color=colour, ms=7, clip_on=False)
            axes.axhline(1.0, color=GREY, ls=":", lw=1.0, label="all that was put in")
            axes.plot([], [], "X", color=BLACK, ms=7, ls="none", label="ended by the program")
            axes.set(title=f"limited by its {limit}", xlabel="time [µs]", **UNEXPLAINED)
            axes.legend(loc="upper right", title="step")
        panels[0, 0].set_ylabel("unexplained energy / energy put in [1]")
        words = "\n".join(textwrap.fill(text, 60 * len(limits)) for text in said)
        drawn.supxlabel(words, x=0.02, ha="left", fontsize=8.5)


def film(path, safe, bad, count=40, held=8):
    """A safe run and a diverging one; count: of pictures, the last ones of which are held."""
    end, fastest, runs = float(bad.time[-1]), float(safe.speeds.max()), []
    for made, colour in ((safe, GREEN), (bad, ORANGE)):
        titles = [f"{made.name}, t = {1e6 * time:.1f} µs" for time in made.time]
        shown = made.result.model, made.frames, made.speeds, titles
        runs.append(FilmedRun(*shown, positive(made.residual), made.name, colour))
    # Closer together towards the end, where all happens at once.
    moving = end * (1.0 - np.linspace(1.0, 0.0, count - held) ** 1.5)
    film_runs(
        *(path, runs, [*moving, *[end] * held]),
        words="speed of a body [m/s]",
        curve={"ylabel": "unexplained\nenergy /\nput in [1]", **UNEXPLAINED},
        magnify=6000.0,
        # Oblique enough to show two sides and the struck end.
        axis=(-0.35, 0.45, 1.0),
        footers=[""] * (count - held - 1) + [textwrap.fill(bad.sentence, 66)] * (held + 1),
        milliseconds=130,
        **{"cmap": "YlOrRd", "norm": "log", "clim": (1e-4 * fastest, 1e2 * fastest)},
    )
