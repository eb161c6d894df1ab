"""How does a block of concrete break when a hole in it is blasted?

The main job: the scene of Konno et al., section 4, from mesh to crack picture. Expect a crushed
zone at the hole, cracks that run out from it, and a wedge pushed out of the free face on the right.

    python experiments/blast_fracture.py                  # about half a minute, most of it pictures
    python experiments/blast_fracture.py --until 1e-3     # cracks through to the other faces
    python experiments/blast_fracture.py --method multirate --l 1e-8    # the paper's: three minutes

A run saves itself in checkpoint.npz at its end, on Ctrl-C, and as often as --checkpoint-every says;
the same command with --resume goes on from there, also with a larger --until.

Dashpots are solved together unless another method is asked for; blast_methods.py compares them.

Writes pictures, an animation, history.csv, bonds.csv (when each bond broke), the mesh used, CSV of
all that is plotted, summary.json and a ParaView series (paraview/blast_fracture.pvd) to
results/blast_fracture/.
"""

import os
import sys

import numpy as np

from _blast import (
    EFFECTS,
    blast_parser,
    explicit_limited,
    level_shares,
    multirate_controlled,
    print_quality,
)
from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Multirate,
    Scene,
    SimulationDiverged,
    Uniform,
    plot,
    read_mesh,
    simulate,
)
from taichi_dem.kit.files import write_csv
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

NAME = "blast_fracture"
#: Method by name: how it is made of the largest step and the displacement limit l; its largest step
#: [s], l [m].
METHODS = {
    "implicit": (lambda dt0, distance: ImplicitDashpots(dt0), 4e-7, None),
    "limited": (lambda dt0, distance: explicit_limited(dt0), 2.5e-8, None),
    "controlled": (lambda dt0, distance: multirate_controlled(dt0), 8e-8, None),
    "multirate": (lambda dt0, distance: Multirate(dt0, distance), 1e-8, 1e-7),
    "multirate_drifted": (lambda dt0, distance: Multirate(dt0, distance, "drifted"), 1e-8, 1e-7),
    "uniform": (lambda dt0, distance: Uniform(dt0, distance), 1e-8, 1e-7),
    "fixed": (lambda dt0, distance: Uniform(dt0), 1e-8, None),
}
DEFAULT = [name for name in EFFECTS if name != "gravity"]
QUICK = {"until": 8e-5, "frames": 6, "samples": 20}
FULL = {"until": 5e-4, "frames": 40, "samples": 200}


def options_parser():
    """Options of this experiment."""
    made = blast_parser(NAME, __doc__)
    made.add_argument("--until", type=number(0, 1), help="simulated time [s], 5e-4")
    made.add_argument("--method", choices=METHODS, default="implicit")
    made.add_argument("--dt0", type=number(0, 1), help="largest step [s], by method")
    made.add_argument(
        "--l", type=number(0, 1), help="the paper's way of a body in a step [m], 1e-7"
    )
    made.add_argument("--with", dest="added", default="", help="effects to add, by comma")
    made.add_argument("--without", default="", help="effects to leave out, by comma")
    made.add_argument("--frames", type=whole(1, 10000), help="snapshots, 40")
    made.add_argument("--samples", type=whole(1, 1000000), help="rows of the time series, 200")
    add_checkpoints(made)
    return made


def chosen_effects(added, without):
    """Names of the effects to run with; InputError for a name that is none."""
    lists = [[name for name in text.split(",") if name] for text in (added, without)]
    for name in (*lists[0], *lists[1]):
        if name not in EFFECTS:
            raise InputError(f"effect must be one of {', '.join(EFFECTS)}, got {name!r}")
    return [name for name in (*DEFAULT, *lists[0]) if name not in lists[1]]


def chosen_method(name, dt0, distance):
    """Method of a name with its own step and way, or those asked for."""
    make, own_dt0, own_distance = METHODS[name]
    if distance is not None and own_distance is None:
        paper = ", ".join(key for key, (_, _, way) in METHODS.items() if way is not None)
        raise InputError(f"l must be left out unless method is one of {paper}, got {distance:g}")
    return make(dt0 or own_dt0, distance or own_distance)


def build_scene(options):
    """Mesh, concrete and the chosen effects."""
    names = dict.fromkeys(chosen_effects(options.added, options.without))
    return Scene(read_mesh(options.mesh), CONCRETE, [EFFECTS[name]() for name in names])


def run(options):
    """Run, picture, print."""
    take_defaults(options, FULL, QUICK)
    method = chosen_method(options.method, options.dt0, options.l)
    scene = build_scene(options)
    print_quality(scene)
    try:
        with ProgressBar("blasting") as progress:
            result = simulate(
                scene,
                method=method,
                until=options.until,
                driver=options.driver,
                samples=options.samples,
                frames=options.frames,
                progress=progress,
                output=options.out,
                **checkpoint_of(options),
            )
    except SimulationDiverged as error:
        if error.result.frames:
            picture(error.result, options.out)
        raise
    picture(result, options.out)
    print(f"\n{result.report}\n")
    finish(options, NAME, figures_of(result), [result.report], see="cracks.png")


def figures_of(result):
    """Figures for summary.json, beside the paper's where it names one."""
    history, report = result.history, result.report
    paper_mm = 1.93 if abs(report.until_s - 5e-4) < 1e-9 else None
    per_ms = report.run_cpu_seconds / (1e3 * report.until_s)
    found = {
        "hole_radial_displacement_mm": (history.get("hole_radial_displacement_mm"), "mm"),
        "monitor_displacement_mm": (history.get("monitor_displacement_mm"), "mm", paper_mm),
        "broken_faces": (report.broken_faces, "1"),
        "ledger_residual_fraction": (report.energy_residual_fraction, "1"),
        "linear_momentum_error": (report.linear_momentum_error, "1"),
        "angular_momentum_error": (report.angular_momentum_error, "1"),
        "smallest_step_s": (float(history["smallest_step_s"].min()), "s", 4e-11),
        "contact_evaluations": (report.contact_evaluations, "1"),
        "seconds_per_simulated_ms": (per_ms, "s", 2702 * 60 / 0.5),
    }
    # Columns by their last row; a scene without a hole has none.
    found = {
        k: (float(v[-1]) if isinstance(v, np.ndarray) else v, *r) for k, (v, *r) in found.items()
    }
    return {name: figure(*one) for name, one in found.items() if one[0] is not None}


def picture(result, folder):
    """Draw and write everything that is plotted."""

    def at(name):
        return os.path.join(folder, name)

    _write_bodies(result, at("bodies.csv"))
    gas = [load for load in result.model.loads if load.name == "gas_pressure"]
    if gas:
        time_s = np.linspace(0.0, 1.1 * (gas[0].decay_ratio + 1.0) * gas[0].rise, 400)
        pressure = gas[0].pressure_at(time_s)
        plot.plot_pressure(at("pressure.png"), time_s, pressure, result.history["time_s"][-1])
        write_csv(at("pressure.csv"), {"time_s": time_s, "pressure_pa": pressure})
    frames, model, dt0 = result.frames, result.model, result.method.dt0
    plot.plot_history(at("history.png"), result.history)
    plot.plot_energy(at("energy.png"), result.history)
    plot.plot_cracks(at("cracks.png"), model, frames[-1], result.broken_time, magnify=3.0)
    shares, time_s = level_shares([f.level for f in frames]), [frame.time_s for frame in frames]
    if shares.shape[1] > 1:
        picked = np.unique(np.linspace(0, len(frames) - 1, 7).round().astype(int))
        picked = [frames[k] for k in picked]
        plot.plot_steps(at("steps.png"), model, picked[1:] or picked, dt0, result.broken_time)
        plot.plot_levels(at("levels.png"), time_s, shares, dt0)
        columns = {f"level_{k}": column for k, column in enumerate(shares.T)}
        write_csv(at("levels.csv"), {"time_s": time_s, **columns})
    plot.save_animation(at("blast.gif"), model, frames, result.broken_time, magnify=3.0)


def _write_bodies(result, path):
    frames, bodies = result.frames, result.model.body_count
    write_csv(
        path,
        {
            "time_s": np.repeat([frame.time_s for frame in frames], bodies),
            "body": np.tile(np.arange(bodies), len(frames)),
            "level": np.concatenate([frame.level for frame in frames]),
            "speed_m_s": np.concatenate([frame.speed for frame in frames]),
            "displacement_m": np.linalg.norm(
                np.concatenate([frame.displacement for frame in frames]), axis=1
            ),
        },
    )


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
