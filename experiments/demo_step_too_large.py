"""What goes wrong when the step is too large, and what does the program say?

A bonded bar is struck on one end, with steps a little below and above what its bonds bear: with
dashpots the limit is theirs, without them it is that of the springs, some thirty times longer.
Below, the energy account closes whatever the step. Above, a shaking from body to body grows by the
same factor every step, out of nothing, until the program ends the run and says where and why.

    python experiments/demo_step_too_large.py             # half a minute
    python experiments/demo_step_too_large.py --quick     # dashpots only

The limits are those of the worst body and err on the safe side, so the smallest step that
diverges lies a little above. Writes shaken.gif, energy.png, steps.csv, history_*.csv and
summary.json to results/demo_step_too_large/.
"""

import sys
import textwrap
from functools import partial
from types import SimpleNamespace

import numpy as np

import taichi_dem as dem
from _drawing import FilmedRun, film_runs
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, GREEN, GREY, ORANGE, RED, picture, seconds
from taichi_dem.mesh.shapes import bar
from taichi_dem.observers import macro_steps
from taichi_dem.plot.series import positive
from taichi_dem.simulate import result_of

NAME = "demo_step_too_large"
SETTINGS = {
    "peak": (1e6, 1e6, study.number(0, 1e8), "of the blow [Pa], 1e6"),
    # Steps as shares of the limit; the first is safe, the second just too large.
    "shares": (
        {"dashpots": (0.9, 1.3, 2.0), "springs": (0.9, 1.1, 1.3)},
        {"dashpots": (0.9, 1.3)},
    ),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Simulated time [s], looks on the way.
UNTIL, SAMPLES = {"dashpots": 4e-5, "springs": 2e-4}, 200
BAR = bar(0.4, 0.1, (8, 2, 2))
#: Steps before the first look: until then the blow has given too little for the account to close.
UNHEEDED = 5
TABLE = study.Table(
    limited_by=("limit", "limited by"),
    share_of_limit=("share", "step / limit", "g"),
    step_s=("step", "step [s]", ".3g"),
    diverged=(lambda made: int(bool(made.sentence)), "", "", "1"),
    reached_s=(lambda made: float(made.time[-1]), "reached [s]", ".3g", "s"),
    unexplained=(lambda made: float(made.residual[-1]), "unexplained / put in", ".2g", "1"),
    end=(lambda made: "diverged" if made.sentence else "done", "end"),
    sentence=("sentence",),
)
#: Looks of the runs of a limit; axes of the unexplained energy.
LOOKS = ((GREEN, "-"), (ORANGE, "--"), (RED, "-."))
UNEXPLAINED = {"yscale": "log", "ylim": (1e-5, 1e4)}


def strike(limit, share, peak):
    """Strike the bar on its left end, with a share of the limit as the step, as far as it goes.

    With an entry a look: speeds, bounds of the speed of every body's corners [m/s], and residual,
    energy that the account cannot explain over that put in by then.
    """
    blow = dem.effects.GasPressure("left", peak=peak, rise=5e-6, decay_ratio=2.0)
    damping = [dem.effects.BondDamping()] if limit == "dashpots" else []
    step, until = share * longest_step(limit), UNTIL[limit]
    evenly = {round(macro_steps(until, step) * k / SAMPLES) for k in range(1, SAMPLES + 1)}
    when = dem.At([step * mark for mark in sorted({0, *(s for s in evenly if s >= UNHEEDED)})])
    views = {"energy": dem.RunView.energy_balance, "frame": dem.RunView.frame}
    seen = dem.Collector(when, time=lambda view: view.time_s, speed=corner_speed, **views)
    looks = {"samples": 1, "title": f"{share:g} x the limit of {limit}", "observers": [seen]}
    scene = dem.Scene(BAR, dem.CONCRETE, [blow, *damping])
    result = result_of(dem.simulate, scene, method=dem.Uniform(step), until=until, **looks)
    if result.diverged:
        seen.observe(seen.view)
    terms = [[row["load_work"], row["residual"]] for row in seen.rows["energy"]]
    given, found = np.abs(terms).T
    return SimpleNamespace(
        **{"limit": limit, "share": share, "step": step, "name": f"{share:g} × limit"},
        **{"result": result, "sentence": result.diverged, "frames": seen.rows["frame"]},
        **{"time": seen["time"], "speeds": seen["speed"]},
        residual=found / np.where(given > 0.0, given, np.inf),
    )


def corner_speed(view):
    """Bound of the speed of every body's corners [m/s]."""
    motion = view.motion()
    spin = view.model.body_radius * np.linalg.norm(motion["spin"], axis=1)
    return np.linalg.norm(motion["velocity"], axis=1) + spin


def longest_step(limit):
    """Longest safe step of the bar's worst body [s], by what sets it."""
    limits = dem.step_report(dem.Scene(BAR, dem.CONCRETE, [dem.effects.BondDamping()])).limits
    return float(limits["bond_dashpot" if limit == "dashpots" else "bond_stiffness"].min())


def picture_energy(path, runs, said):
    """Energy that the account cannot explain over time, a panel a limit; the sentences below."""
    limits = list(dict.fromkeys(made.limit for made in runs))
    size = (4.3 * len(limits) + 0.6, 3.4 + 0.55 * len(said))
    shape = {"squeeze": False, "sharey": True}
    with picture(path, 1, len(limits), size, **shape) as (figure, panels):
        for axes, limit in zip(panels[0], limits):
            own = [made for made in runs if made.limit == limit]
            for made, (colour, dashes) in zip(own, LOOKS):
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
        figure.supxlabel(words, x=0.02, ha="left", fontsize=8.5)


def film(path, safe, bad, count=40, held=8):
    """A safe run and a diverging one; count: of pictures, the last ones of which are held."""
    end, fastest, runs = float(bad.time[-1]), float(safe.speeds.max()), []
    for made, (colour, _) in zip((safe, bad), LOOKS):
        titles = [f"{made.name}, t = {1e6 * time:.1f} µs" for time in made.time]
        shown = made.result, made.frames, made.speeds, titles
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
        **{"cmap": "YlOrRd", "norm": "log", "clim": (1e-4 * fastest, 1e2 * fastest)},
    )


def run(options):
    """Strike the bar with every step, compare, picture."""
    at, cases = study.output_paths(options.out), options.shares.items()
    runs = [strike(limit, share, options.peak) for limit, shares in cases for share in shares]
    rows = TABLE.rows(runs)
    TABLE.show(rows)
    said = [f"{made.limit}, {made.name}: “{made.sentence}”" for made in runs if made.sentence]
    print("What the program said:", *said, "", sep="\n")
    for made in runs:
        columns = {"time_s": made.time, "unexplained_over_put_in": made.residual}
        write_csv(at(f"history_{made.limit}_{made.share:g}.csv"), columns)
    study.write_rows(at("steps.csv"), rows)
    picture_energy(at("energy.png"), runs, said)
    film(at("shaken.gif"), *runs[:2])
    figures = {f"limit_{limit}_s": (longest_step(limit), "s") for limit in UNTIL}
    for row in rows:
        figures.update(TABLE.figures(row, "{limited_by}_{share_of_limit:g}_{key}"))
    study.finish(options, NAME, figures, [made.result.report for made in runs])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
