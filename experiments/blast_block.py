"""How does the full block break, 3 m deep as in the experiment, which the paper could not afford?

The paper's scene on a block of 2 m by 2 m by 3 m with a hole through its depth, dashpots solved
together. The paper expects more than a month of its rule for such a block; here a step of 20,000
tetrahedra takes about 20 ms of one core and 1 ms of the blast 2500 steps, a minute or two. Expect
cracks as in the flat block at mid depth, more of them towards the ends, which are free; and peak
velocities that fall with a power of the distance from the hole, between the 1/2 of a cylindrical
wave without losses and the 1.5 to 2 of measured blasts, as the dashpots take most of the work. The
power is fitted to bodies nearer to the hole than to any free side: elsewhere the wave comes back.

    python experiments/blast_block.py                          # 20,000 tetrahedra
    python experiments/blast_block.py --tetrahedra 100000      # a quarter of an hour or more
    python experiments/blast_block.py --resume --until 2e-3    # go on from where it ended

Gmsh makes the mesh, once a folder. Without it 15 mirrored copies of the paper's flat block stand in
(14,490 tetrahedra); ``make mesh`` installs it.

Writes cracks.png, peaks.png, energy.png, history.csv, peaks.csv, mesh, ParaView series and
summary.json to results/blast_block/; a run saves itself as blast_fracture.py does.
"""

import os
import resource
import sys
import time

import numpy as np

from _blast import blast_parser, paper_effects, print_quality
from _deep_block import has_gmsh, made_block, stacked_block
from taichi_dem import CONCRETE, Every, ImplicitDashpots, Scene, plot, read_mesh, simulate
from taichi_dem.kit.allocation import field_bytes
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, picture
from taichi_dem.kit.progress.progress import time_left
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import (
    add_checkpoints,
    checkpoint_of,
    figure,
    finish,
    main,
    number,
    take_defaults,
    whole,
)
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.output.hole_monitor import HoleMonitor
from taichi_dem.plot.deep import plot_deep_cracks

NAME = "blast_block"
QUICK = {"until": 1e-4, "samples": 20, "frames": 1}
FULL = {"until": 1e-3, "samples": 200, "frames": 10}
STEP = 4e-7
#: Copies of the flat block that stand in for a mesh by Gmsh, and in a quick run.
COPIES, QUICK_COPIES = 15, 3
#: Radii of the hole from which on the fall of peak velocities is fitted.
FROM_RADII = 4.0
RADIUS = 0.025
#: Shares of the way at which a line is printed.
LINES = 10


def options_parser():
    """Options of this experiment."""
    made = blast_parser(NAME, __doc__)
    # Without it, Gmsh makes one.
    made.set_defaults(mesh=None)
    made.add_argument("--tetrahedra", type=whole(2000, 2000000), help="about how many, 20000")
    made.add_argument("--until", type=number(0, 1), help="simulated time [s], 1e-3")
    made.add_argument("--samples", type=whole(1, 1000000), help="rows of the time series, 200")
    made.add_argument("--frames", type=whole(1, 10000), help="snapshots, 10")
    add_checkpoints(made)
    return made


def mesh_of(options):
    """The mesh asked for; says so where mirrored copies stand in for one by Gmsh."""
    if options.mesh:
        return in_space_order(read_mesh(options.mesh))
    if options.tetrahedra is None and (options.quick or not has_gmsh()):
        copies = QUICK_COPIES if options.quick else COPIES
        print(f"{copies} mirrored copies of the paper's block; --tetrahedra N asks Gmsh for a mesh")
        return stacked_block(copies)
    count = options.tetrahedra or 20000
    output_folder(options.out)
    return made_block(os.path.join(options.out, f"block_{count}.msh"), count)


class Lines:
    """Observer that prints a line every tenth of the way: time per step, time left, memory."""

    def __init__(self, until):
        self.until, self.when, self.last = until, Every(time_s=until / LINES), (0.0, 0.0)

    def observe(self, view):
        """Print the line."""
        now, (time_s, seconds) = (view.time_s, view.wall_seconds), self.last
        if now[0] > time_s:
            step_s = (now[1] - seconds) * STEP / (now[0] - time_s)
            left = time_left(step_s * max(0.0, self.until - now[0]) / STEP)
            words = f"t = {1e3 * now[0]:.3f} ms, {1e3 * step_s:.3g} ms a step, {left}"
            fields = f"{1e-6 * field_bytes():.0f} MB of fields"
            print(f"{words}, {fields}, {memory_mb():.0f} MB in all", flush=True)
        self.last = now


def memory_mb():
    """Most memory that the process has taken so far [MB]."""
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / (1e6 if sys.platform == "darwin" else 1e3)


def peaks(result):
    """Distance from the hole's axis over its radius, peak speed [m/s], and who is fitted.

    These are bodies nearer to the axis than to any outer side of the block; arrays (bodies,).
    """
    hole, centre = HoleMonitor(result.model, "hole"), result.model.centre
    away = centre - hole.axis_point
    away = np.linalg.norm(away - np.outer(away @ hole.axis, hole.axis), axis=1)
    points = result.model.mesh.points
    sides = np.minimum(centre - points.min(axis=0), points.max(axis=0) - centre).min(axis=1)
    return away / RADIUS, result.peak_speed, away < sides


def fitted(distance, speed, inner):
    """Exponent, and speed at one radius, of the power law of inner bodies, by least squares.

    NaN for both where there are fewer than ten of them.
    """
    taken = inner & (distance > FROM_RADII) & (speed > 0.0)
    if taken.sum() < 10:
        return np.nan, np.nan
    slope, level = np.polyfit(np.log(distance[taken]), np.log(speed[taken]), 1)
    return float(slope), float(np.exp(level))


def picture_peaks(path, distance, speed, inner, law):
    """Peak speed of every body over its distance from the hole, and the power law."""
    slope, level = law
    with picture(path, size=(6.6, 4.6)) as (_, axes):
        look = {"s": 4, "alpha": 0.4, "linewidths": 0}
        for chosen, colour, side in ((~inner, GREY, "a free side"), (inner, BLUE, "the hole")):
            words = f"bodies nearer to {side}"
            axes.scatter(distance[chosen], speed[chosen], color=colour, label=words, **look)
        ends = np.array([FROM_RADII, distance[inner].max()])
        fit, wave = level * ends**slope, (ends / ends[0]) ** -0.5
        axes.plot(ends, fit, color=BLACK, label=f"power {slope:.2f} (fitted)")
        words = "power -0.5 (cylindrical wave)"
        axes.plot(ends, fit[0] * wave, ":", color=BLACK, label=words)
        axes.set(xscale="log", yscale="log")
        axes.set(xlabel="distance from the axis / radius of the hole [1]")
        axes.set(ylabel="peak particle velocity [m/s]")
        positive = speed[speed > 0.0]
        axes.set_ylim(0.5 * np.percentile(positive, 0.1), 2.0 * positive.max())
        legend = axes.legend(loc="upper right", markerscale=4)
        for handle in legend.legend_handles:
            handle.set_alpha(1.0)


def figures_of(result, law):
    """Figures for summary.json."""
    report, history = result.report, result.history
    step_ms = 1e3 * report.run_cpu_seconds / report.substeps
    found = {
        "tetrahedra": (report.body_count, "1"),
        "broken_faces": (report.broken_faces, "1"),
        "ppv_exponent": (None if np.isnan(law[0]) else law[0], "1"),
        "hole_radial_displacement_mm": (float(history["hole_radial_displacement_mm"][-1]), "mm"),
        "ms_a_step": (step_ms, "ms"),
        "seconds_per_simulated_ms": (1e-6 * step_ms / STEP, "s"),
        "memory_MB": (memory_mb(), "MB"),
        "fields_MB": (1e-6 * field_bytes(), "MB"),
        "ledger_residual_fraction": (report.energy_residual_fraction, "1"),
        "linear_momentum_error": (report.linear_momentum_error, "1"),
    }
    return {name: figure(*one) for name, one in found.items()}


def run(options):
    """Run, picture, print."""
    take_defaults(options, FULL, QUICK)
    scene = Scene(mesh_of(options), CONCRETE, paper_effects())
    print_quality(scene)
    with ProgressBar("blasting") as bar:
        result = simulate(
            scene,
            method=ImplicitDashpots(STEP),
            until=options.until,
            driver=options.driver,
            samples=options.samples,
            frames=options.frames,
            progress=bar,
            observers=[Lines(options.until)],
            output=options.out,
            **checkpoint_of(options),
        )
    started = time.perf_counter()
    distance, speed, inner = peaks(result)
    law = fitted(distance, speed, inner)
    show(result, options.out, distance, speed, inner, law)
    report, figures = result.report, figures_of(result, law)
    figures["picture_seconds"] = figure(time.perf_counter() - started, "s")
    print(f"\n{report}\n")
    finish(options, NAME, figures, [report], see="cracks.png")


def show(result, folder, distance, speed, inner, law):
    """Draw and write everything that is plotted."""
    model, frame = result.model, result.frames[-1]
    hole = HoleMonitor(model, "hole").axis_point
    parts = model.mesh, model.topology, result.broken_time, frame.time_s, hole
    plot_deep_cracks(os.path.join(folder, "cracks.png"), *parts)
    picture_peaks(os.path.join(folder, "peaks.png"), distance, speed, inner, law)
    plot.plot_energy(os.path.join(folder, "energy.png"), result.history)
    columns = {
        "distance_radii": distance,
        "peak_speed_m_s": speed,
        "nearer_to_hole": inner.astype(int),
    }
    write_csv(os.path.join(folder, "peaks.csv"), columns)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
