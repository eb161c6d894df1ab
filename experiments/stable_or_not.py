"""What happens below and above the stable step, and what does the account of energy say?

A bonded bar is struck on its left end; its step is 0.9 and 1.3 times the stable one. With dashpots
they set the limit; without them the springs do, at a step about thirty times longer. Below the
limit the energy balance closes. Above it neighbours spin against each other; the spin grows by the
same factor every step, until the program ends the run and says where and why.

    python experiments/stable_or_not.py
    python experiments/stable_or_not.py --quick     # dashpots only

Displacements are magnified 15,000 times. The limits are those of the worst body and err on the safe
side. Writes stable_or_not.png, steps.csv, history_*.csv and summary.json to
results/stable_or_not/.
"""

import sys
import warnings
from functools import partial
from types import SimpleNamespace

import numpy as np

import taichi_dem as dem
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLUE, RED, picture
from taichi_dem.mesh.shapes import bar
from taichi_dem.observers import macro_steps
from taichi_dem.plot.series import positive
from taichi_dem.plot.view import View, draw_bodies, frame_block
from taichi_dem.simulate import result_of

NAME = "stable_or_not"
SETTINGS = {
    "peak": (1e6, 1e6, study.number(0, 1e8), "peak pressure of the blow [Pa], default 1e6"),
    "limits": (("bond_dashpot", "bond_stiffness"), ("bond_dashpot",)),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Steps as shares of the limit, with their colours; simulated time [s], and looks on the way.
SHARES, SAMPLES = {0.9: BLUE, 1.3: RED}, 200
UNTIL = {"bond_dashpot": 4e-5, "bond_stiffness": 2e-4}
BAR = bar(0.4, 0.1, (8, 2, 2))
#: Steps before the first look: until then the blow has given too little for the account to close.
EARLY = 5
#: View that shows two sides and the struck end, and magnification of displacements.
SEEN, MAGNIFY = (-0.35, 0.45, 1.0), 1.5e4
VIEWS = {"frame": dem.RunView.frame, "energy": dem.RunView.energy_balance}
VIEWS.update(time=lambda view: view.time_s, spin=lambda view: view.motion()["spin"][:, 0])
TABLE = study.Table(
    limited_by=("limit", "limited by"),
    share_of_limit=("share", "step / limit", "g"),
    step_s=("step", "step [s]", ".3g"),
    diverged=(lambda made: int(bool(made.sentence)), "", "", "1"),
    reached_s=(lambda made: float(made.time[-1]), "reached [s]", ".3g", "s"),
    unexplained=(lambda made: float(made.residual[-1]), "unexplained / put in", ".2g", "1"),
    sentence=("sentence",),
)


def strike(limit, share, peak):
    """Strike the bar on its left end, with a share of the limit as the step, as far as it goes.

    With an entry a look: spin of every body about the bar [rad/s], and residual, energy that the
    account cannot explain over that put in by then.
    """
    blow = dem.effects.GasPressure("left", peak=peak, rise=5e-6, decay_ratio=2.0)
    damping = [dem.effects.BondDamping()] if limit == "bond_dashpot" else []
    step, until = share * longest_step(limit), UNTIL[limit]
    evenly = {round(macro_steps(until, step) * k / SAMPLES) for k in range(1, SAMPLES + 1)}
    when = dem.At([step * mark for mark in sorted({0, *(s for s in evenly if s >= EARLY)})])
    seen = dem.Collector(when, **VIEWS)
    looks = {"samples": 1, "title": f"{share:g} x the limit of {limit}", "observers": [seen]}
    scene = dem.Scene(BAR, dem.CONCRETE, [blow, *damping])
    with warnings.catch_warnings():
        # That the step is above its limit is what the picture shows.
        warnings.filterwarnings("ignore", "the step of .* above the longest")
        result = result_of(dem.simulate, scene, method=dem.Uniform(step), until=until, **looks)
    if result.diverged:
        seen.observe(seen.view)
    given, found = np.abs([[row["load_work"], row["residual"]] for row in seen.rows["energy"]]).T
    made = {"limit": limit, "share": share, "step": step, "sentence": result.diverged}
    made.update(result=result, frames=seen.rows["frame"], spin=seen["spin"], time=seen["time"])
    return SimpleNamespace(**made, residual=found / np.where(given > 0.0, given, np.inf))


def longest_step(limit):
    """Longest safe step of the bar's worst body [s], by what sets it."""
    scene = dem.Scene(BAR, dem.CONCRETE, [dem.effects.BondDamping()])
    return float(dem.step_report(scene).limits[limit].min())


def draw(path, runs):
    """Both bars at their ends, coloured by spin, over their accounts of energy."""
    end = max(float(made.time[-1]) for made in runs if made.sentence)
    most = 0.5 * max(np.abs(made.spin).max() for made in runs)
    with picture(path, 0, size=(5.0, 3.6), dpi=300) as (figure, _):
        *panels, account = figure.subplot_mosaic("01;22", height_ratios=(1, 1.3)).values()
        for axes, made in zip(panels, runs):
            draw_bar(axes, made, end, most)
            draw_account(account, made, SHARES[made.share])
        account.set_title("colour: spin", loc="center")
        account.set(xlabel="time [µs]", ylabel="unexplained energy\n/ energy put in [1]")
        account.set(xlim=(0.0, 1.05e6 * end), yscale="log", ylim=(1e-5, 1e5))


def draw_bar(axes, made, now, most):
    """The bar at a time [s], or where its run ended, with colours up to a spin [rad/s]."""
    row, model = int(np.searchsorted(made.time, now * (1.0 + 1e-9))) - 1, made.result.model
    look = {"axis": SEEN, "magnify": MAGNIFY, "cmap": "PuOr", "clim": (-most, most)}
    draw_bodies(axes, model, made.frames[row], made.spin[row], **look)
    frame_block(axes, View(SEEN), model, 0.02)
    axes.set_axis_off()
    look = {"loc": "center", "color": SHARES[made.share], "fontweight": "bold"}
    axes.set_title(f"{made.share:g} × stable step", **look)


def draw_account(axes, made, colour):
    """Unexplained energy over time, and that the program ended the run."""
    axes.plot(1e6 * made.time, positive(made.residual), color=colour, lw=3.0)
    if made.sentence:
        place = 1e6 * made.time[-1], made.residual[-1]
        axes.text(*place, "stopped  ", ha="right", va="center")


def run(options):
    """Strike the bar with every step, compare, picture."""
    folder = study.begin(options)
    runs = [strike(limit, share, options.peak) for limit in options.limits for share in SHARES]
    rows = TABLE.rows(runs)
    TABLE.show(rows)
    for made in runs:
        print(made.sentence or "done")
        columns = {"time_s": made.time, "unexplained_over_put_in": made.residual}
        write_csv(folder / f"history_{made.limit}_{made.share:g}.csv", columns)
    study.write_rows(folder / "steps.csv", rows)
    draw(folder / f"{NAME}.png", runs[: len(SHARES)])
    figures = {f"limit_{limit}_s": (longest_step(limit), "s") for limit in UNTIL}
    for row in rows:
        figures.update(TABLE.figures(row, "{limited_by}_{share_of_limit:g}_{key}"))
    study.finish(options, NAME, figures, [made.result.report for made in runs])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
