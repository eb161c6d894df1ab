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
import sys
import time
from functools import partial
from importlib.util import find_spec

import numpy as np

from _blast import (
    BLOCK_STEP,
    FROM_RADII,
    HOLE_RADIUS,
    blast_parser,
    paper_effects,
    print_quality,
    run_options,
)
from _crack_sections import plot_deep_cracks
from _meshes import mirrored_copies
from make_meshes import block_with_hole
from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    Every,
    ImplicitDashpots,
    Scene,
    read_mesh,
    simulate,
)
from taichi_dem.kit import study
from taichi_dem.kit.allocation import field_bytes
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.progress.progress import time_left
from taichi_dem.kit.provenance import peak_memory_mb
from taichi_dem.mesh.joined import in_space_order
from taichi_dem.output.hole_monitor import HoleMonitor

NAME = "blast_block"
SETTINGS = {
    "tetrahedra": (None, None, study.whole(2000, 2000000), "about how many, 20000"),
    "until": (1e-3, 1e-4, study.number(0, 1), "simulated time [s], 1e-3"),
    "samples": (200, 20, study.whole(1, 1000000), "rows of the time series, 200"),
    "frames": (10, 1, study.whole(1, 10000), "snapshots, 10"),
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
        mesh = read_mesh(options.mesh)
    elif options.tetrahedra is None and (options.quick or not find_spec("gmsh")):
        words = f"{options.copies} mirrored copies of the paper's block"
        print(f"{words}; --tetrahedra N asks Gmsh for a mesh")
        mesh = mirrored_copies(read_mesh(PAPER_BLOCK), options.copies)
    else:
        mesh = made_block(study.output_paths(options.out), options.tetrahedra or 20000)
    return in_space_order(mesh)


def made_block(at, tetrahedra):
    """The block by Gmsh with about this many tetrahedra; from its file where that is there."""
    path = at(f"block_{tetrahedra}.msh")
    if not os.path.exists(path):
        scale = scale_for(tetrahedra)
        block_with_hole(path, depth=3.0, size_hole=scale * SIZE_HOLE, size_far=scale * SIZE_FAR)
    return read_mesh(path)


def scale_for(tetrahedra):
    """Scale of the element sizes for a number of tetrahedra: between measured ones, as a power."""
    k = 0 if tetrahedra < COUNTS[1] else 1
    power = np.log(SCALES[k + 1] / SCALES[k]) / np.log(COUNTS[k + 1] / COUNTS[k])
    return float(SCALES[k] * (tetrahedra / COUNTS[k]) ** power)


def figures_of(result, exponent):
    """Figures for summary.json."""
    report, history = result.report, result.series
    step_ms = 1e3 * report.run_cpu_seconds / report.substeps
    return {
        "tetrahedra": (report.body_count, "1"),
        "broken_faces": (report.broken_faces, "1"),
        "ppv_exponent": (exponent, "1"),
        "hole_radial_displacement_mm": (float(history["hole_radial_displacement_mm"][-1]), "mm"),
        "ms_a_step": (step_ms, "ms"),
        "seconds_per_simulated_ms": (1e-6 * step_ms / BLOCK_STEP, "s"),
        "memory_MB": (peak_memory_mb(), "MB"),
        "fields_MB": (1e-6 * field_bytes(), "MB"),
        "ledger_residual_fraction": (report.energy_residual_fraction, "1"),
        "linear_momentum_error": (report.linear_momentum_error, "1"),
    }


class ProgressLines:
    """Observer that prints a line every tenth of the way: time per step, time left, memory.

    until: simulated time at the end of the run [s].
    """

    def __init__(self, until):
        self.until, self.when = until, Every(time_s=until / 10)
        self._before = 0, 0.0

    def observe(self, view):
        """Print the line; none at the start of the run."""
        (step, seconds), self._before = self._before, (view.step, view.wall_seconds)
        if view.step > step:
            step_s = (view.wall_seconds - seconds) / (view.step - step)
            left = time_left(step_s * max(0.0, self.until - view.time_s) / view.method.dt0)
            words = f"t = {1e3 * view.time_s:.3f} ms, {1e3 * step_s:.3g} ms a step, {left}"
            fields = f"{1e-6 * field_bytes():.0f} MB of fields"
            print(f"{words}, {fields}, {peak_memory_mb():.0f} MB in all", flush=True)


def run(options):
    """Run, picture, print."""
    scene = Scene(mesh_of(options), CONCRETE, paper_effects())
    print_quality(scene)
    looks = {"title": "blasting", "observers": [ProgressLines(options.until)]}
    result = simulate(scene, method=ImplicitDashpots(BLOCK_STEP), **run_options(options), **looks)
    started = time.perf_counter()
    fall = result.attenuation("hole", HOLE_RADIUS)
    draw(result, fall, study.output_paths(options.out))
    figures = figures_of(result, fall.power_law(FROM_RADII)[0])
    figures["picture_seconds"] = (time.perf_counter() - started, "s")
    print(f"\n{result.report}\n")
    study.finish(options, NAME, figures, [result.report], see="cracks.png")


def draw(result, fall, at):
    """Draw and write everything that is plotted."""
    plot_deep_cracks(at("cracks.png"), result, HoleMonitor(result.model, "hole").axis_point)
    result.plot.attenuation("hole", nearest=FROM_RADII, path=at("peaks.png"))
    result.plot.energy(path=at("energy.png"))
    peaks = {"distance_radii": fall.distance, "peak_speed_m_s": fall.speed}
    write_csv(at("peaks.csv"), {**peaks, "nearer_to_hole": fall.inner.astype(int)})


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
