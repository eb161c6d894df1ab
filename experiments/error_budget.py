"""Which source makes the error of an answer, and what does each cost to know?

An error bar holds only the sources that were measured. Three questions are asked with all sources
measured: how far a blast pushes the wall of its hole, how far an impact bends a notched beam, and
how far a damped mass swings at resonance. Runs at half the step measure step and chance; a run with
four times the rays measures the contact law; other meshes of the same size, with moved inner nodes,
measure the mesh; spheres measure the automaton. Expect the step, on which the runs are spent, to be
the smallest source, and the mesh or the contact the largest.

    python experiments/error_budget.py
    python experiments/error_budget.py --quick

Writes error_budget.png, error_budget.csv and summary.json to results/error_budget/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

import taichi_dem as dem
from _meshes import with_moved_nodes
from ca_damper import Automaton, solve_response
from ca_damper import goals as damper_goals
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, picture
from taichi_dem.mesh.mesh import with_cut
from taichi_dem.mesh.shapes import bar

NAME = "error_budget"
SETTINGS = {
    "until": (5e-4, 5e-5, study.number(0, 1), "simulated time of the blast [s], default 5e-4"),
    "meshes": (5, 2, study.whole(2, 50), "other meshes of each solid, default 5"),
    "beam": ((20, 4, 4), (10, 2, 2)),
    "beam_until": (2e-3, 5e-4),
    "particles": (20, 10),
    "damper_tolerance": (0.05, 0.5),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)
#: How far nodes are moved, as a share of the size of an element.
MOVED = 0.1
#: Beam: length and width [m], and blow on its top [Pa], over 0.1 ms.
BEAM, BLOW = (1.0, 0.2), 1e7
#: Least and largest share that is drawn [%].
SHARES = 1e-3, 1e3
ASKED = {"tolerance": 0.05, "sources": ("step", "contact", "mesh"), "progress": None}


def moved_meshes(mesh, count):
    """Meshes of the same solid: nodes that lie in no group of faces are moved."""
    element = (np.prod(np.ptp(mesh.points, axis=0)) / mesh.body_count) ** (1.0 / 3.0)
    most = np.full((len(mesh.points), 1), MOVED * element)
    for faces in mesh.groups.values():
        most[np.unique(faces)] = 0.0
    return [with_moved_nodes(mesh, most, seed) for seed in range(count)]


def solid(mesh, loads, until, goal, options, **cracks):
    """Answer about a solid of concrete, with all sources measured."""
    scene = dem.Scene(mesh, dem.CONCRETE, "auto", loads=loads, **cracks)
    others = moved_meshes(scene.mesh, options.meshes)
    return dem.solve(scene, until=until, goal=goal, meshes=others, **ASKED)


def blast(options):
    """Displacement of the hole of the paper's block."""
    mesh, loads = dem.read_mesh(dem.PAPER_BLOCK), [dem.effects.GasPressure()]
    return solid(mesh, loads, options.until, dem.goals.hole_displacement(), options)


def beam(options):
    """Displacement of the free end of a notched beam under a blow on its top."""
    mesh, middle = bar(*BEAM, options.beam), (0.5 * BEAM[0], 0.0, 0.0)
    mesh = with_cut(mesh, "notch", middle, (1, 0, 0), lambda x: x[:, 1] < 0.3 * BEAM[1])
    blow = dem.effects.GasPressure("top", peak=BLOW, rise=1e-4)
    loads, goal = [dem.effects.Fixed("left"), blow], dem.goals.displacement("right")
    return solid(mesh, loads, options.beam_until, goal, options, unbonded=["notch"])


def damper(options):
    """Swing at resonance of a mass with a box of grains, by the automaton and by spheres."""
    return solve_response(
        Automaton(),
        particles=options.particles,
        goal=damper_goals.rms_at(1.0),
        tolerance=options.damper_tolerance,
        sources=["filling"],
        progress=None,
    )


def rows_of(question, answer):
    """Rows of a table: each source as a share of the value, and its seconds."""
    table = answer.budget.reset_index()
    table["share_percent"] = 100.0 * table.error / abs(answer.value)
    return table.assign(question=question, value=answer.value, unit=answer.unit)


def draw(path, table):
    """Shares by source, a panel a question, with what each has cost."""
    questions = table.question.unique()
    with picture(path, 1, len(questions), (3.4 * len(questions), 2.8)) as (_, panels):
        for axes, question in zip(panels, questions):
            mine = table[(table.question == question) & (table.share_percent > 0.0)]
            axes.barh(mine.source, mine.share_percent, color=BLUE)
            for name, share, seconds in zip(mine.source, mine.share_percent, mine.cpu_s):
                words = f" {share:.2g} %, {seconds:.2g} s" if seconds else f" {share:.2g} %"
                axes.text(max(share, SHARES[0]), name, words, va="center", fontsize=7)
            axes.set(title=question, xlabel="half-width of the bar [%]", xscale="log")
            axes.set_xlim(SHARES)
            axes.invert_yaxis()


def run(options):
    """Ask the three questions, draw, print."""
    folder = study.begin(options)
    asked = {"hole of a blast": blast, "notched beam": beam, "damped mass": damper}
    found = {name: ask(options) for name, ask in asked.items()}
    table = pd.concat([rows_of(name, answer) for name, answer in found.items()])
    table.to_csv(folder / "error_budget.csv", index=False)
    for name, answer in found.items():
        print(f"{name}: {answer}\n")
    draw(folder / "error_budget.png", table)
    figures = {
        f"{row.question}_{row.source}_percent".replace(" ", "_"): (row.share_percent, "%")
        for row in table.itertuples()
    }
    study.finish(options, NAME, figures, 0.0, see="error_budget.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
