"""How sure is a crack? The probability of each face to break over 100 perturbed blasts.

One blast gives one crack pattern, but no block is known exactly. Here each blast has another mesh
and another strength. Mesh points are moved by 0.1 % of the shortest edge, as cracks should not
depend on the arbitrary mesh. Strength and fracture energy scatter by 5 %, as those of concrete do
from cast to cast. The block, its hole and the gas pressure stay the same. Expect the crushed zone
and the main cracks in all blasts, about one broken face in three in some blasts only, and a
displacement of the hole that is known to 4 %.

    python experiments/blast_ensemble.py                      # 100 blasts on all cores
    python experiments/blast_ensemble.py --scatter 0          # other meshes alone
    python experiments/blast_ensemble.py --members 1000       # adds to finished blasts

``sweep`` runs the blasts in parallel, one process per core. Finished blasts are kept, and the same
command runs the missing ones. Writes probability.png, displacement.png, probability.csv (each
face), displacement.csv, members.csv (each blast) and summary.json to results/blast_ensemble/.
"""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize

import taichi_dem as dem
from _blast import BLOCK_STEP, blast_parser
from _drawing import crossings
from taichi_dem import effects
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, ORANGE, picture
from taichi_dem.observers import macro_steps
from taichi_dem.plot.view import (
    JOINT,
    STONE,
    View,
    draw_lines,
    draw_stone,
    frame_block,
    shades,
    traces,
)
from taichi_dem.state.model import Model

NAME = "blast_ensemble"
SETTINGS = {
    "members": (100, 4, study.whole(2, 100000), "number of blasts, default 100"),
    "until": (5e-4, 8e-5, study.number(0, 1), "simulated time [s], default 5e-4"),
    "samples": (20, 8, study.whole(1, 99), "samples of the hole's displacement, default 20"),
    "jitter": (1e-3, 1e-3, study.number(0, 0.05, open_low=False), "share of edges, default 0.001"),
    "scatter": (0.05, 0.05, study.number(0, 0.2, open_low=False), "of the strength, default 0.05"),
    "seed": (0, 0, study.whole(0, 2**31), "seed of the ensemble, default 0"),
}
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)
#: Name of a result: displacement of the hole at a sample [mm].
HOLE = "hole_mm_{:02d}"
#: Edges of a tetrahedron by its corners, and share of blasts between the borders of the band.
EDGES, BAND = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]], 0.9


def blast(row):
    """Blast a block whose mesh and strength differ a little from the given ones, by a seed.

    Returns the number of broken faces, the displacement of the hole at each sample, and for each
    bond, as a text of ones and zeros, whether it broke.
    """
    random = np.random.default_rng(row["seed"])
    mesh = moved(dem.read_mesh(row["mesh"]), row["jitter"], random)
    material = stronger(dem.CONCRETE, 1.0 + row["scatter"] * random.standard_normal())
    scene = dem.Scene(mesh, material, "auto", loads=[effects.GasPressure()])
    given = {"until": row["until"], "samples": row["samples"], "progress": None}
    result = dem.simulate(scene, method=dem.ImplicitDashpots(BLOCK_STEP), **given)
    hole = result.series["hole_radial_displacement_mm"].tolist()
    broken = "".join("01"[one] for one in (~np.isnan(result.broken_time)).astype(int))
    moves = {HOLE.format(k): value for k, value in enumerate(hole)}
    return {"broken_faces": result.report.broken_faces, **moves, "broken": broken}


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


def over_time(moves, until, samples):
    """Mean, standard deviation and band of the hole's displacement [mm], (samples, blasts)."""
    steps = dem.Every(samples=1).marks(macro_steps(until, BLOCK_STEP), BLOCK_STEP, samples)
    low, high = np.quantile(moves, [0.5 - 0.5 * BAND, 0.5 + 0.5 * BAND], axis=1)
    return {
        "time_ms": 1e3 * BLOCK_STEP * np.array(sorted({0, *steps})),
        **{"mean_mm": moves.mean(axis=1), "sd_mm": moves.std(axis=1, ddof=1)},
        **{"low_mm": low, "high_mm": high},
    }


def draw_displacement(path, columns, last):
    """Mean and band of the displacement over time, and its distribution at the end [mm]."""
    with picture(path, 1, 2, (9.0, 3.6), width_ratios=(1.6, 1.0)) as (_, (left, right)):
        words = f"{100 * BAND:.0f} % of the blasts"
        band = columns["low_mm"], columns["high_mm"]
        left.fill_between(columns["time_ms"], *band, color=BLUE, alpha=0.25, lw=0, label=words)
        left.plot(columns["time_ms"], columns["mean_mm"], color=BLUE, label="mean")
        left.set(xlabel="time [ms]", ylabel="displacement of the hole [mm]", xlim=(0.0, None))
        left.set_ylim(0.0, None)
        left.legend(loc="upper left")
        right.hist(last, bins="auto", color=ORANGE, edgecolor="white")
        right.axvline(last.mean(), color=BLACK, label="mean")
        right.set(xlabel="displacement of the hole at the end [mm]", ylabel="blasts [1]")
        right.margins(y=0.25)
        right.legend(loc="upper right")


def draw_probability(path, model, probability):
    """Faces by their probability to break (bond_count,): on the front, and half-way through."""
    view, mesh = View(), model.mesh
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    middle = 0.5 * float(low[2] + high[2])
    # On the front, edges by the most probable face that ends there: traces are of the least.
    falling = np.where(probability > 0.0, -probability, np.nan)
    body, ends, least = traces(mesh, model.topology, view, falling)
    edges = view.project(mesh.points[mesh.tetrahedra][body[:, None], ends])
    segments, which = crossings(mesh.points[model.topology.vertices], 2, middle)
    segments, found = view.project(segments), probability[which]
    whole = np.array([low, (high[0], low[1], 0.0), high, (low[0], high[1], 0.0)])[:, :2]
    with picture(path, 1, 2, size=(9.0, 4.1), sharey=True) as (figure, (front, inside)):
        draw_stone(front, view, model)
        drawn = draw_faces(front, edges, -least)
        front.set(title="On the front face", ylabel=view.labels()[1])
        inside.add_collection(PolyCollection([whole], facecolor=STONE, edgecolor=JOINT))
        inside.add_collection(LineCollection(segments, colors=JOINT, linewidth=0.4))
        draw_faces(inside, segments[found > 0.0], found[found > 0.0])
        inside.set_title(f"In the section at z = {middle:.3g} m")
        for axes in (front, inside):
            frame_block(axes, view, model)
            axes.set_xlabel(view.labels()[0])
        words = "probability of a face to break [1]"
        figure.colorbar(drawn, ax=[front, inside], label=words, shrink=0.85, aspect=25)


def draw_faces(axes, segments, probability):
    """Lines by probability, dark where it is high and on top."""
    order = np.argsort(probability, kind="stable")
    look = {"cmap": shades("viridis_r", 0.1, 1.0), "norm": Normalize(0.0, 1.0), "linewidth": 1.6}
    return draw_lines(axes, segments[order], probability[order], **look)


def run(options):
    """Blast, count, draw, print."""
    mesh, at = dem.read_mesh(options.mesh), study.output_paths(options.out)
    mesh.group_faces("hole")
    names = ("mesh", "jitter", "scatter", "until", "samples")
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
    moves = np.array([table[name][ended] for name in table if name.startswith(HOLE[:8])])
    columns, last = over_time(moves, options.until, options.samples), moves[-1]
    write_csv(at("displacement.csv"), columns)
    draw_displacement(at("displacement.png"), columns, last)
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
