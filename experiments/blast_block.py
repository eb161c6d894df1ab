"""How does the full block of the experiment break, 3 m deep, which was too costly for the paper?

The scene is the paper's, on a block of 2 m by 2 m by 3 m with a hole through its depth; dashpots
are solved together. The paper estimates more than a month for such a block by its rule. Here a step
of 20,000 tetrahedra takes about 20 ms of one core, and 1 ms of the blast takes 2500 steps, a minute
or two. Expect cracks as in the flat block at mid depth, and more cracks towards the free ends.
Expect peak velocities that fall with a power of the distance between 1/2 (a cylindrical wave
without losses) and 1.5 to 2 (measured blasts), as the dashpots take most of the work. The power is
fitted to bodies nearer to the hole than to any free side: elsewhere the wave is reflected.

    python experiments/blast_block.py                          # 20,000 tetrahedra
    python experiments/blast_block.py --tetrahedra 100000      # a longer run
    python experiments/blast_block.py --resume --until 2e-3    # continue that run

Gmsh makes the mesh, once a folder; ``make mesh`` installs Gmsh. Without it, 15 mirrored copies of
the paper's flat block are used (14,490 tetrahedra).

Writes cracks.png, peaks.png, energy.png, history.csv, peaks.csv, mesh, ParaView series and
summary.json to results/blast_block/; a run saves itself as blast_fracture.py does.
"""

import os
import sys
from functools import partial
from importlib.util import find_spec

import numpy as np
from matplotlib.colors import Normalize

from cases.blast import (
    BLOCK_STEP,
    FROM_RADII,
    HOLE_RADIUS,
    blast_parser,
    paper_effects,
    run_options,
)
from cases.meshes import crossings, mirrored_copies
from make_meshes import block_with_hole
from taichi_dem import CONCRETE, PAPER_BLOCK, ImplicitDashpots, Scene, read_mesh, simulate
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import picture
from taichi_dem.kit.provenance import peak_memory_mb
from taichi_dem.mesh.shapes import in_space_order
from taichi_dem.output.hole_monitor import hole_of
from taichi_dem.plot.view import draw_lines, shades

NAME = "blast_block"
SETTINGS = {
    "tetrahedra": (None, None, study.whole(2000, 2000000), "about this many, default 20000"),
    "until": (1e-3, 1e-4, study.number(0, 1), "simulated time [s], default 1e-3"),
    "samples": (200, 20, study.whole(1, 1000000), "rows of the time series, default 200"),
    "frames": (10, 1, study.whole(1, 10000), "number of snapshots, default 10"),
    # Copies of the flat block that stand in for a mesh by Gmsh.
    "copies": (15, 3),
}
#: Sizes of elements at the hole and far from it [m] at a scale of one, the paper's at the hole.
SIZE_HOLE, SIZE_FAR = 0.055, 0.22
#: Scales of both, and the tetrahedra that Gmsh then makes of a block 3 m deep: measured.
SCALES, COUNTS = (1.9, 1.0, 0.585), (4537, 21038, 93490)
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS, mesh=None, saves=True)


def mesh_of(options):
    """The mesh asked for; says so where mirrored copies stand in for one by Gmsh."""
    if options.mesh:
        return read_mesh(options.mesh)
    if options.tetrahedra is None and (options.quick or not find_spec("gmsh")):
        words = f"{options.copies} mirrored copies of the paper's block"
        print(f"{words}; --tetrahedra N asks Gmsh for a mesh")
        return mirrored_copies(read_mesh(PAPER_BLOCK), options.copies)
    tetrahedra = options.tetrahedra or 20000
    path = study.output_paths(options.out)(f"block_{tetrahedra}.msh")
    if not os.path.exists(path):
        # Between measured numbers the scale of the sizes is a power of the number.
        k = 0 if tetrahedra < COUNTS[1] else 1
        power = np.log(SCALES[k + 1] / SCALES[k]) / np.log(COUNTS[k + 1] / COUNTS[k])
        scale = float(SCALES[k] * (tetrahedra / COUNTS[k]) ** power)
        block_with_hole(path, depth=3.0, size_hole=scale * SIZE_HOLE, size_far=scale * SIZE_FAR)
    return read_mesh(path)


def plot_deep_cracks(path, result, hole):
    """Broken faces of the block at rest, cut by two planes, by time of breaking.

    hole: point on the hole's axis (3,) [m], which runs along z; the planes are half-way along it,
    and through it.
    """
    mesh, topology = result.model.mesh, result.model.topology
    broken_time, time_s = result.broken_time, result.frames[-1].time_s
    broken = np.flatnonzero(broken_time <= time_s)
    # The latest first: early ones, near the hole, stay visible.
    broken = broken[np.argsort(-broken_time[broken], kind="stable")]
    triangles, time_ms = mesh.points[topology.vertices[broken]], 1e3 * broken_time[broken]
    box = np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    look = {"cmap": shades("plasma", 0.0, 0.88), "norm": Normalize(0.0, 1e3 * time_s)}
    with picture(path, 1, 2, size=(7.2, 3.9), width_ratios=(1.0, 0.8)) as (figure, panels):
        figure.suptitle(f"{len(broken)} broken faces at {1e3 * time_s:.3g} ms")
        for axes, normal, place in zip(panels, (2, 1), (box[:, 2].mean(), hole[1])):
            segments, which = crossings(triangles, normal, place)
            across = [0, 1 if normal == 2 else 2]
            flat = segments[..., across]
            lines = draw_lines(axes, flat, time_ms[which], linewidth=1.3, **look)
            names = [f"{'xyz'[k]} [m]" for k in across]
            axes.set(xlim=box[:, 0], ylim=box[:, across[1]], xlabel=names[0], ylabel=names[1])
            axes.set(aspect="equal", title=f"Section at {'xyz'[normal]} = {place:.3g} m")
            axes.locator_params(nbins=5)
            axes.spines[["top", "right"]].set_visible(True)
            axes.grid(False)
        figure.colorbar(lines, ax=panels, label="time of breaking [ms]", shrink=0.8, aspect=25)


def run(options):
    """Run, picture, print."""
    scene = Scene(in_space_order(mesh_of(options)), CONCRETE, paper_effects())
    method = ImplicitDashpots(BLOCK_STEP)
    result = simulate(scene, method=method, title="blasting", **run_options(options))
    at = study.output_paths(options.out)
    report, fall = result.report, result.attenuation("hole", HOLE_RADIUS)
    plot_deep_cracks(at("cracks.png"), result, hole_of(result.model, "hole").axis_point)
    result.plot.attenuation("hole", nearest=FROM_RADII, path=at("peaks.png"))
    result.plot.energy(path=at("energy.png"))
    peaks = {"distance_radii": fall.distance, "peak_speed_m_s": fall.speed}
    write_csv(at("peaks.csv"), {**peaks, "nearer_to_hole": fall.inner.astype(int)})
    step_ms = 1e3 * report.run_cpu_seconds / report.substeps
    moved = float(result.series["hole_radial_displacement_mm"][-1])
    study.show_report(options, report)
    figures = {
        "tetrahedra": (report.body_count, "1"),
        "broken_faces": (report.broken_faces, "1"),
        "ppv_exponent": (fall.power_law(FROM_RADII)[0], "1"),
        "hole_radial_displacement_mm": (moved, "mm"),
        "ms_a_step": (step_ms, "ms"),
        "seconds_per_simulated_ms": (1e-6 * step_ms / BLOCK_STEP, "s"),
        "memory_MB": (peak_memory_mb(), "MB"),
        "ledger_residual_fraction": (report.energy_residual_fraction, "1"),
        "linear_momentum_error": (report.linear_momentum_error, "1"),
    }
    study.finish(options, NAME, figures, [report], see="cracks.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
