"""Blast the paper's block of concrete from its hole, and draw how it breaks.

Expect a crushed zone at the hole, cracks that run out from it, and a wedge at the free face.

    python -m taichi_dem demo
    python -m taichi_dem demo --out mine         # pictures and tables into ./mine
    python -m taichi_dem demo --all-pictures     # also energy, pressure, since when effects act

Writes cracks.png, blast.gif, view.html (the block turns and plays), tables, the mesh used,
summary.json and a ParaView series to results/blast_demo/.
"""

from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from taichi_dem.effects import GasPressure
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.study.entries import Entry
from taichi_dem.materials import CONCRETE
from taichi_dem.mesh.files import read_mesh
from taichi_dem.meshes import PAPER_BLOCK
from taichi_dem.methods import ImplicitDashpots
from taichi_dem.output.record import write_bodies
from taichi_dem.report.effects import Certificate
from taichi_dem.result import Result
from taichi_dem.scene import Scene
from taichi_dem.simulate import simulate

NAME = "blast_demo"
SETTINGS = {
    "until": (5e-4, 8e-5, study.number(0, 1), "simulated time [s], default 5e-4"),
    "frames": (40, 6, study.whole(1, 10000), "number of snapshots, default 40"),
    "samples": (200, 20, study.whole(1, 1000000), "rows of the time series, default 200"),
}
_ENTRY = Entry(
    name=NAME,
    part="",
    question="How does a block of concrete break when a hole in it is blasted?",
    look="",
    time="30",
    quick="26",
    pictures=("cracks.png", "view.html", "blast.gif"),
    figures=("hole_radial*", "monitor*", "broken_faces", "ledger*", "injected*"),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program on a command line, that of the process by default; returns its exit code."""
    parser = study.parser(NAME, __doc__, ("auto", "resident", "parallel"), SETTINGS)
    parser.prog, parser.entry = "python -m taichi_dem demo", _ENTRY
    study.add_pictures(parser)
    return study.main(run, parser, arguments)


def run(options: Namespace) -> None:
    """Blast the block, draw it, print the report and the figures."""
    scene = Scene(read_mesh(PAPER_BLOCK), CONCRETE, "auto", loads=[GasPressure()])
    names = ("until", "driver", "samples", "frames")
    given: dict[str, Any] = {name: getattr(options, name) for name in names}
    method = ImplicitDashpots(4e-7)
    result = simulate(scene, method=method, title="blasting", output=options.out, **given)
    study.show_report(options, result.report)
    draw = partial(picture, result, options)
    study.finish(options, NAME, figures_of(result), [result.report], draw=draw)


def figures_of(result: Result) -> dict[str, tuple]:
    """Figures of a blast for summary.json, beside the paper's where it names one."""
    history, report = result.series, result.report
    paper_mm = 1.93 if abs(report.until_s - 5e-4) < 1e-9 else None
    per_ms = report.run_cpu_seconds / (1e3 * report.until_s)
    moved = {
        f"{place}_displacement_mm": (float(history[f"{place}_displacement_mm"][-1]), "mm", paper)
        for place, paper in (("hole_radial", None), ("monitor", paper_mm))
        if f"{place}_displacement_mm" in history
    }
    # Of a scene without contact nothing is injected.
    spent = {
        name: (1e-3 * float(history[column][-1]), "kJ")
        for name, column in (("gas_work_kJ", "gas_work_J"), ("injected_kJ", "injected_J"))
        if column in history
    }
    shared = report.interpenetration
    if shared is not None:
        spent["most_shared_percent"] = 100.0 * shared.share, "%"
        spent["deeply_shared_pairs"] = shared.deep, "1"
    return {
        **moved,
        **spent,
        "broken_faces": (report.broken_faces, "1"),
        "ledger_residual_fraction": (report.energy_residual_fraction, "1"),
        "linear_momentum_error": (report.linear_momentum_error, "1"),
        "angular_momentum_error": (report.angular_momentum_error, "1"),
        "smallest_step_s": (float(history["smallest_step_s"].min()), "s", 4e-11),
        "contact_evaluations": (report.contact_evaluations, "1"),
        "seconds_per_simulated_ms": (per_ms, "s", 2702 * 60 / 0.5),
        **figures_of_certificate(report.certificate),
    }


def figures_of_certificate(certificate: Certificate | None) -> dict[str, tuple]:
    """What acted only where needed: evaluations spared, time asleep."""
    if certificate is None:
        return {}
    return {
        "fracture_evaluations_ratio": (certificate.law_ratio, "1"),
        "asleep_percent": (100.0 * certificate.asleep, "%"),
    }


def picture(result: Result, options: Namespace) -> None:
    """Write bodies.csv, and draw a blast as the options of ``study.add_pictures`` ask."""
    at = study.output_paths(options.out)
    write_bodies(at("bodies.csv"), result.frames)
    if options.pictures == "no":
        return
    result.plot.cracks(magnify=3.0, path=at("cracks.png"))
    result.plot.film(at("blast.gif"), magnify=3.0)
    result.show(at("view.html"), open_browser=False)
    if options.pictures == "all":
        _picture_more(result, at)


def _picture_more(result, at):
    """Draw what does not answer the question, and write all that is plotted."""
    # Imported here, so that matplotlib loads only where a picture is drawn.
    from taichi_dem.plot.series import level_columns, level_shares, plot_levels
    from taichi_dem.plot.tables import plot_columns

    frames, drawn = result.frames, result.plot
    for gas in (load for load in result.model.loads if isinstance(load, GasPressure)):
        time_s = np.linspace(0.0, 1.1 * gas.duration, 400)
        pressure = gas.pressure_at(time_s)
        curve = {"time_s": time_s, "pressure_Pa": pressure}
        plot_columns(at("pressure.png"), curve, ["pressure_Pa"])
        write_csv(at("pressure.csv"), {"time_s": time_s, "pressure_pa": pressure})
    drawn.history(path=at("history.png"))
    drawn.energy(path=at("energy.png"))
    if result.acting_since:
        drawn.acting(path=at("acting.png"))
    shares = level_shares([frame.level for frame in frames])
    times = np.array([frame.time_s for frame in frames])
    if shares.shape[1] > 1:
        drawn.steps(path=at("steps.png"))
        plot_levels(at("levels.png"), times, shares, result.method.dt0)
        write_csv(at("levels.csv"), {"time_s": times, **level_columns(shares)})
