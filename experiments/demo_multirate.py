"""Do steps that differ by body change the response to an impact?

A fragment hits the free end of a bonded bar. One run has one step for all bodies, as short as the
fastest needs; the other has a step for each body, dt0 / 2^k, by the same rule: no body moves
further than l in a step. Short steps spread into the bar with the wave. The displacement of both
ends is the same; only the number of evaluations differs.

    python experiments/demo_multirate.py
    python experiments/demo_multirate.py --speed 5

Writes blow.png, blow.csv and summary.json to results/demo_multirate/.
"""

import sys
from functools import partial
from types import SimpleNamespace

import numpy as np

import taichi_dem as dem
from cases.blast import BLAST_DRIVERS, run_costs
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import GREY, line_key, picture, styles_of
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.plot.series import (
    draw_level_shares,
    level_shares,
)
from taichi_dem.simulate import run_simulation

NAME = "demo_multirate"
#: All methods; the first is what the others are compared with.
METHODS = {
    "uniform": dem.Uniform,
    "held": dem.Multirate,
    "drifted": partial(dem.Multirate, neighbour="drifted"),
}
SETTINGS = {
    "speed": (20.0, 20.0, study.number(1, 50), "speed of the fragment [m/s], default 20"),
    "methods": (tuple(METHODS), ("uniform", "held")),
    "until": (2e-4, 4e-5),
}
options_parser = partial(study.parser, NAME, __doc__, BLAST_DRIVERS, settings=SETTINGS)
DT0, DISTANCE = 4e-8, 5e-8
#: Bar and fragment [m], and the gap between them.
LENGTH, WIDTH, CELLS = 0.9, 0.1, (18, 2, 2)
FRAGMENT, GAP = 0.1, 2e-5
SAMPLES = 80
TABLE = study.Table(
    method=("name", "method"),
    evaluations=(lambda made: int(made.evaluations[-1]), "evaluations", ",", "1"),
    fewer_evaluations=("fewer", "fewer by", ".2f", "1"),
    struck_um=(lambda made: 1e6 * float(made.struck[-1]), "struck end [um]", ".2f", "um"),
    difference=("difference", "difference", ".3f%", "1"),
    broken_faces=("result.report.broken_faces", "broken", "", "1"),
    residual=("result.report.energy_residual_fraction", "residual", ".2g%", "1"),
    cpu_s=("result.report.run_cpu_seconds", "CPU [s]", ".2f"),
)


def hit(name, options):
    """Let the fragment hit the bar, with a method; returns what is measured, an entry a frame.

    struck, far: mean way of the bar's ends away from the fragment [m].
    """
    parts = {
        "bar": (bar(LENGTH, WIDTH, CELLS), (0.0, 0.0, 0.0)),
        "fragment": (bar(FRAGMENT, WIDTH, (2, 2, 2)), (LENGTH + GAP, 0.0, 0.0)),
    }
    bonds = [dem.effects.BondDamping(), dem.effects.Softening(), dem.effects.ShearSlip()]
    acting = [*bonds, dem.effects.BodyContact(), dem.effects.StickingFriction()]
    scene = dem.Scene(placed_together(parts), dem.CONCRETE, acting)
    made = dem.Simulation(scene, METHODS[name](DT0, DISTANCE), options.driver)
    place, model = made.model.centre, made.model
    speed = np.outer(place[:, 0] > LENGTH, (-options.speed, 0.0, 0.0))
    made.state.set_motion(place, velocity=speed)
    cost, style = run_costs(), styles_of([name])[name]
    looks = {"samples": SAMPLES, "frames": SAMPLES, "observers": [cost], "title": style.label}
    result = run_simulation(made, until=options.until, **looks)
    struck, far = (
        -np.array([frame.displacement[bodies, 0].mean() for frame in result.frames])
        for bodies, _ in (
            faces_of_group(model.mesh, model.topology, group) for group in ("bar_right", "bar_left")
        )
    )
    return SimpleNamespace(
        **{"name": name, "style": style, "result": result, "struck": struck, "far": far},
        levels=np.array([frame.level for frame in result.frames]),
        evaluations=cost["evaluations"],
    )


def picture_blow(path, impacts, time):
    """Motion of the ends, evaluations, and share of bodies on each level of the second method."""
    other = impacts[1]
    with picture(path, 2, 2, size=(9.0, 6.0), sharex=True) as (_, ((way, work), (share, words))):
        for impact in impacts:
            look = {"color": impact.style.colour, "ls": impact.style.line}
            way.plot(time, 1e6 * impact.struck, **look)
            way.plot(time, 1e6 * impact.far, lw=0.8, **look)
            work.plot(time, 1e-6 * impact.evaluations, label=impact.style.label, **look)
        way.set(xlabel="time [µs]", ylabel="displacement [µm]", title="result")
        work.set(xlabel="time [µs]", ylabel="evaluations of bonds and pairs [10⁶]")
        work.set(title="cost", xlim=(0.0, time[-1]))
        words.set_axis_off()
        # There are no numbers below the right one, as words has no axes.
        for axes in (way, work):
            axes.tick_params(labelbottom=True)
        ends = {"struck end (thick)": 1.5, "far end (thin)": 0.8}
        way.legend(handles=[line_key(words, color=GREY, lw=width) for words, width in ends.items()])
        key = words.legend(*work.get_legend_handles_labels(), loc="upper left", handlelength=4.0)
        draw_level_shares(words, share, time, level_shares(other.levels), DT0, "lower left")
        words.add_artist(key)
        share.set(xlabel="time [µs]", title=f"steps: {other.style.label}")


def run(options):
    """Hit the bar with every method, compare, picture."""
    at = study.output_paths(options.out)
    impacts = [hit(name, options) for name in options.methods]
    base, time_s, columns = impacts[0], impacts[0].result.series["time_s"], {}
    for one in impacts:
        one.fewer = float(base.evaluations[-1] / one.evaluations[-1])
        one.difference = float(np.abs(one.struck - base.struck).max() / np.abs(base.struck).max())
        columns.update({f"struck_{one.name}_m": one.struck, f"far_{one.name}_m": one.far})
        columns[f"evaluations_{one.name}"] = one.evaluations
    write_csv(at("blow.csv"), {"time_s": time_s, **columns})
    rows = TABLE.rows(impacts)
    TABLE.show(rows)
    picture_blow(at("blow.png"), impacts, 1e6 * time_s)
    figures = {}
    for row in rows:
        figures.update(TABLE.figures(row, "{method}_{key}"))
    for key in ("fewer_evaluations", "difference"):
        del figures[f"{base.name}_{key}"]
    study.finish(options, NAME, figures, [impact.result.report for impact in impacts])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
