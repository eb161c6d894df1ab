"""How sure is a crack? The probability of each face to break over 100 perturbed blasts.

One blast gives one crack pattern, but no block is known exactly. Here each blast has another mesh
and another strength. Mesh points are moved by 0.1 % of the shortest edge, as cracks should not
depend on the arbitrary mesh. Strength and fracture energy scatter by 5 %, as those of concrete do
from cast to cast. The block, its hole and the gas pressure stay the same. Expect the crushed zone
and the main cracks in all blasts, about one broken face in three in some blasts only, and a
displacement of the hole that is known to 4 %.

    python experiments/blast_ensemble.py                      # 100 blasts on all cores
    python experiments/blast_ensemble.py --scatter 0          # other meshes alone
    python experiments/blast_ensemble.py --spread 0.1         # strength from bond to bond as well
    python experiments/blast_ensemble.py --members 1000       # adds to finished blasts

``sweep`` runs the blasts in parallel, one process per core. Finished blasts are kept, and the same
command runs the missing ones. Writes probability.png, probability.csv (each face), members.csv
(each blast) and summary.json to results/blast_ensemble/.
"""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle

import taichi_dem as dem
from cases.blast import BLOCK_STEP, blast_parser
from cases.meshes import crossings
from taichi_dem import effects
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import picture
from taichi_dem.plot.view import JOINT, STONE, View, draw_lines, frame_block, shades
from taichi_dem.state.model import Model

NAME = "blast_ensemble"
SETTINGS = {
    "members": (100, 4, study.whole(2, 100000), "number of blasts, default 100"),
    "until": (5e-4, 8e-5, study.number(0, 1), "simulated time [s], default 5e-4"),
    "jitter": (1e-3, 1e-3, study.number(0, 0.05, open_low=False), "share of edges, default 0.001"),
    "scatter": (0.05, 0.05, study.number(0, 0.2, open_low=False), "of the strength, default 0.05"),
    "spread": (0.0, 0.1, study.number(0, 0.3, open_low=False), "from bond to bond, default 0"),
    "seed": (0, 0, study.whole(0, 2**31), "seed of the ensemble, default 0"),
}
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)
#: Edges of a tetrahedron by its corners.
EDGES = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]


def blast(row):
    """Blast a block whose mesh and strength differ a little from the given ones, by a seed.

    Returns the number of broken faces, the displacement of the hole [mm], and for each bond, as a
    text of ones and zeros, whether it broke.
    """
    random = np.random.default_rng(row["seed"])
    mesh = moved(dem.read_mesh(row["mesh"]), row["jitter"], random)
    material = stronger(dem.CONCRETE, 1.0 + row["scatter"] * random.standard_normal())
    material = replace(material, strength_spread=row["spread"])
    gas, seed = effects.GasPressure(), row["seed"] % 2**31
    scene = dem.Scene(mesh, material, "auto", loads=[gas], seed=seed)
    given = {"until": row["until"], "samples": 1, "progress": None}
    result = dem.simulate(scene, method=dem.ImplicitDashpots(BLOCK_STEP), **given)
    hole = float(result.series["hole_radial_displacement_mm"][-1])
    broken = "".join("01"[one] for one in (~np.isnan(result.broken_time)).astype(int))
    return {"broken_faces": result.report.broken_faces, "hole_mm": hole, "broken": broken}


def moved(mesh, jitter, random):
    """The mesh with points moved at random, the block's flat sides staying flat.

    jitter: standard deviation of each coordinate, by the shortest edge at its point.
    """
    points, edges = mesh.points, mesh.tetrahedra[:, EDGES].reshape(-1, 2)
    lengths = np.linalg.norm(np.diff(points[edges], axis=1)[:, 0], axis=1)
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, edges.ravel(), np.repeat(lengths, 2))
    on_side = (points == points.min(axis=0)) | (points == points.max(axis=0))
    shift = jitter * shortest[:, None] * random.standard_normal(points.shape)
    return replace(mesh, points=np.where(on_side, points, points + shift))


def stronger(material, factor):
    """The material with strength, cohesion and fracture energy times a factor."""
    names = ("tensile_strength", "cohesion", "fracture_energy")
    return replace(material, **{name: factor * getattr(material, name) for name in names})


def draw_probability(path, model, probability):
    """Faces in the section half-way through by their probability to break (bond_count,)."""
    view, mesh = View(), model.mesh
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    middle = 0.5 * float(low[2] + high[2])
    segments, which = crossings(mesh.points[model.topology.vertices], 2, middle)
    segments, found = view.project(segments), probability[which]
    # Dark and on top where it is high.
    order = np.argsort(found, kind="stable")[(found == 0.0).sum() :]
    look = {"cmap": shades("viridis_r", 0.1, 1.0), "norm": Normalize(0.0, 1.0), "linewidth": 1.6}
    with picture(path, size=(5.6, 4.4)) as (figure, axes):
        axes.add_patch(Rectangle(low[:2], *(high - low)[:2], facecolor=STONE, edgecolor=JOINT))
        axes.add_collection(LineCollection(segments, colors=JOINT, linewidth=0.4))
        drawn = draw_lines(axes, segments[order], found[order], **look)
        frame_block(axes, view, model)
        axes.set(xlabel=view.labels()[0], ylabel=view.labels()[1])
        axes.set_title(f"In the section at z = {middle:.3g} m")
        figure.colorbar(drawn, ax=axes, label="probability of a face to break [1]", aspect=25)


def run(options):
    """Blast, count, draw, print."""
    mesh, at = dem.read_mesh(options.mesh), study.output_paths(options.out)
    mesh.group_faces("hole")
    names = ("mesh", "jitter", "scatter", "spread", "until")
    rows = [{name: getattr(options, name) for name in names} for _ in range(options.members)]
    # A second process would compile as well, which takes longer than four blasts.
    workers = 1 if options.quick else options.threads
    version = f"{BLOCK_STEP} {Path(options.mesh).read_text(errors='replace')}"
    where = {"out": at("members"), "workers": workers}
    table = dem.sweep(blast, rows, seed=options.seed, version=version, **where)
    table.to_csv(at("members.csv"), index=False)
    ended = table["error"] == ""
    if ended.sum() < 2:
        raise dem.InputError(f"two blasts must end well, got: {table['error'][~ended].iloc[0]}")
    broken = np.array([[*text] for text in table["broken"][ended]]) == "1"
    last = table["hole_mm"][ended].to_numpy()
    model, counts, shares = Model(mesh, dem.CONCRETE, ()), broken.sum(axis=1), broken.mean(axis=0)
    top, middle = model.topology, mesh.points[model.topology.vertices].mean(axis=1)
    places = {f"{axis}_m": middle[:, k] for k, axis in enumerate("xyz")}
    faces = {"body": top.master, "other_body": top.slave, **places, "probability": shares}
    write_csv(at("probability.csv"), faces)
    draw_probability(at("probability.png"), model, shares)
    figures = {
        "members": (len(broken), "1"),
        "faces_in_all": (int((shares == 1.0).sum()), "1"),
        "faces_in_some": (int(((shares > 0.0) & (shares < 1.0)).sum()), "1"),
        "broken_faces_mean": (float(counts.mean()), "1"),
        "broken_faces_sd": (float(counts.std(ddof=1)), "1"),
        "hole_displacement_mean_mm": (float(last.mean()), "mm"),
        "hole_displacement_sd_mm": (float(last.std(ddof=1)), "mm"),
        "failed_members": (int((~ended).sum()), "1"),
    }
    # Compiling is what blasts took beyond the usual one.
    seconds = table["seconds"]
    compiling = float(np.maximum(0.0, seconds - np.median(seconds)).sum())
    spent = compiling, float(seconds.sum()) - compiling
    study.finish(options, NAME, figures, spent, see="probability.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
