"""What shakes and what breaks, when holes in a tunnel face are fired, and does a cut help?

Rock of 4 m x 4 m x 3 m behind a plane face, open in front, with quiet boundaries elsewhere. Six
holes with the same charge stand in four designs: straight into full rock, as a V cut, beside a slot
that was cut before, and around an empty hole. Expect the V to throw out most, the free faces of
slot and empty hole to let more rock move at a charge, and peak velocities to fall with the power
1.3 to 1.9 of the distance, as they do near blasts in hard rock.

Each design runs on several meshes of two sizes. A bar is the 95 % range of the mean over meshes of
the finer size, and the difference to the coarser one; what lies within it is "not distinguished".
Rock and gas are assumed (granite; the pulse of the first paper's block), delays at 1/20 of real
ones.

    python experiments/tunnel_face.py --quick                    # two designs, one mesh: no bars
    python experiments/tunnel_face.py                            # needs gmsh: make mesh
    python experiments/tunnel_face.py --near 0.03                # 50,000 tetrahedra and more
    python experiments/tunnel_face.py --holes holes.csv          # beside the parallel holes
    python experiments/tunnel_face.py --delay 2.5e-4 --exponent 1.4   # one by one; gas expands

A row of holes.csv is a hole: x_m, y_m, length_m, and by choice angle_deg, charge_from_m, delay_s,
diameter_m (docs/tunnel.md). Writes cracks.png, peaks.png, energy.png, section.gif, runs.csv,
designs.csv, receivers.csv and summary.json to results/tunnel_face/.
"""

import itertools
import sys
from pathlib import Path

import pandas as pd

import _tunnel
import taichi_dem as dem
from _tunnel_pictures import draw_cracks, draw_energy, draw_peaks, film_section
from _tunnel_table import COMPARED, compared, price, with_bars
from taichi_dem.kit import study
from taichi_dem.kit.provenance import peak_memory_mb
from taichi_dem.observers import write_receivers
from taichi_dem.step_control import StepControl

NAME = "tunnel_face"
FOUR = ("parallel", "V cut", "slot 0.4 m", "burn cut")
DESIGNS = study.several(study.one_of(_tunnel.designs()))
SETTINGS = {
    "designs": (FOUR, _tunnel.QUICK, DESIGNS, "of tunnel rounds (docs/tunnel.md)"),
    "near": (0.09, None, study.number(0, 0.5), "edge of elements at the holes [m], 0.09"),
    "meshes": (4, 1, study.whole(1, 100), "meshes of each design and size, 4"),
    "until": (2e-3, 8e-4, study.number(0, 1), "simulated time [s], 2e-3"),
    "delay": (0.0, 0.0, study.number(0, 1e-2, open_low=False), "between heights of holes [s], 0"),
    "exponent": (0.0, 0.0, study.number(0, 5, open_low=False), "of gas that expands; 0: none"),
    "frames": (32, 16, study.whole(1, 1000), "of the film, 32"),
}
#: The coarser size of elements over the finer one.
COARSER = 1.4
#: Each body has a step of its own, as those at the holes are a tenth as large as the others.
METHOD = dem.Multirate(
    1.6e-6, 1e-4, control=StepControl(safety=0.3, dashpot_floor=1e-7), dashpot="limited"
)


def options_parser():
    """Options of this experiment."""
    made = study.parser(NAME, __doc__, settings=SETTINGS)
    made.add_argument("--holes", help="CSV file of holes, run beside the parallel ones")
    return made


def fired(row):
    """Design and result of a row: name of a design, edge near its holes, number of its mesh."""
    design, near = _tunnel.design_of(row), row["near_m"]
    mesh = _tunnel.mesh_of(design, near, row["mesh"]) if near else _tunnel.kept_mesh(row["design"])
    looks = {"until": row["until_s"], "samples": 200, "frames": row["frames"]}
    looks["observers"] = [dem.Receivers(_tunnel.RECEIVERS)]
    scene = _tunnel.scene_of(mesh, design, row["gas_exponent"])
    return design, dem.simulate(scene, method=METHOD, title=row["design"], **looks)


def shot(row):
    """What is measured of the run of a row."""
    return _tunnel.measured(*fired(row))


def rows_of(options):
    """Rows of all runs; the first mesh of each design, of the finer size, comes first."""
    names = ("parallel", _tunnel.YOURS) if options.holes else options.designs
    near = options.near or (_tunnel.QUICK_NEAR if options.holes else 0.0)
    fixed = {"delay_s": options.delay, "until_s": options.until, "frames": options.frames}
    own = {"holes": options.holes} if options.holes else {}
    fixed |= {"gas_exponent": options.exponent, **own}
    sizes = [near, COARSER * near] if options.meshes > 1 else [near]
    numbers = itertools.product(range(options.meshes), sizes, names)
    return [{"design": d, "near_m": n, "mesh": k, **fixed} for k, n, d in numbers]


def runs_of(options):
    """Table of all runs, and design and result of the first run of each design by its name.

    Those are drawn; the others run side by side, and the same command runs what is missing.
    """
    rows = rows_of(options)
    for row in rows:
        _tunnel.design_of(row)
    count = len({row["design"] for row in rows})
    drawn, others = rows[:count], rows[count:]
    found = []
    if others:
        files = filter(None, (_tunnel.__file__, options.holes))
        version = "".join(Path(file).read_text() for file in files)
        where = {"out": study.begin(options) / "runs", "workers": options.threads}
        found.append(dem.sweep(shot, others, version=version, **where))
        for sentence in found[0]["error"][found[0]["error"] != ""]:
            raise dem.InputError(sentence)
    first = {row["design"]: fired(row) for row in drawn}
    rows = [{**row, **_tunnel.measured(*first[row["design"]])} for row in drawn]
    return pd.concat([pd.DataFrame(rows), *found]), first


def write(options, rows, first, table):
    """Write tables and pictures; see the head of this file."""
    folder = study.begin(options)
    rows.to_csv(folder / "runs.csv", index=False)
    table.to_csv(folder / "designs.csv")
    draw_cracks(folder / "cracks.png", first)
    draw_peaks(folder / "peaks.png", first, table)
    draw_energy(folder / "energy.png", table)
    film_section(folder / "section.gif", first.get("V cut", [*first.values()][-1])[1])
    received = {
        f"{name} {place}": one
        for name, (_, result) in first.items()
        for place, one in result.receivers.items()
    }
    write_receivers(folder / "receivers.csv", received)


def run(options):
    """Fire all designs, draw, print."""
    rows, first = runs_of(options)
    table = with_bars(rows)
    study.print_table(compared(table), ["", *table.index])
    write(options, rows, first, table)
    meshes, seconds = price(rows)
    figures = {
        f"{design.replace(' ', '_')}_{name}": (table.loc[design, name], unit)
        for design in table.index
        for name, unit in COMPARED.items()
    }
    figures |= {"meshes_for_5_percent": (meshes, "1"), "seconds_for_5_percent": (seconds, "s")}
    figures["tetrahedra"] = int(rows.tetrahedra.max()), "1"
    figures["memory_MB"] = peak_memory_mb(), "MB"
    study.finish(options, NAME, figures, [result.report for _, result in first.values()])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
