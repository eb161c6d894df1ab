"""One blast of an ensemble, and the pictures of ``blast_ensemble.py``."""

from dataclasses import replace

import numpy as np

from _blast import BLOCK_STEP
from taichi_dem import CONCRETE, Every, ImplicitDashpots, Scene, effects, read_mesh, simulate
from taichi_dem.kit.plot_style import BLACK, BLUE, ORANGE, picture
from taichi_dem.observers import macro_steps

#: Name of a result: displacement of the hole at a sample [mm].
HOLE = "hole_mm_{:02d}"
#: Share of members between the borders of the band.
BAND = 0.9


def blast(row):
    """Blast a block whose mesh and strength differ a little from the given ones, by a seed.

    Returns the number of broken faces, the displacement of the hole at each sample, and for each
    bond, as a text of ones and zeros, whether it broke.
    """
    random = np.random.default_rng(row["seed"])
    mesh = moved(read_mesh(row["mesh"]), row["jitter"], random)
    material = stronger(CONCRETE, 1.0 + row["scatter"] * random.standard_normal())
    scene = Scene(mesh, material, "auto", loads=[effects.GasPressure()])
    given = {"until": row["until"], "samples": row["samples"], "progress": None}
    result = simulate(scene, method=ImplicitDashpots(BLOCK_STEP), **given)
    hole = result.series["hole_radial_displacement_mm"].tolist()
    broken = "".join("01"[one] for one in (~np.isnan(result.broken_time)).astype(int))
    moves = {HOLE.format(k): value for k, value in enumerate(hole)}
    return {"broken_faces": result.report.broken_faces, **moves, "broken": broken}


def moved(mesh, jitter, random):
    """The mesh with points moved at random, the block's flat sides staying flat.

    jitter: standard deviation of each coordinate, by the shortest edge at its point.
    """
    points = mesh.points
    edges = mesh.tetrahedra[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]].reshape(-1, 2)
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


def hole_moves(table, ended):
    """Displacement of the hole [mm] in the blasts that ended well, (samples, blasts)."""
    return np.array([table[name][ended] for name in table if name.startswith(HOLE[:8])])


def over_time(moves, until, samples):
    """Columns over time: mean, standard deviation and band of the hole's displacement."""
    steps = Every(samples=1).marks(macro_steps(until, BLOCK_STEP), BLOCK_STEP, samples)
    low, high = np.quantile(moves, [0.5 - 0.5 * BAND, 0.5 + 0.5 * BAND], axis=1)
    return {
        "time_ms": 1e3 * BLOCK_STEP * np.array(sorted({0, *steps})),
        "mean_mm": moves.mean(axis=1),
        "sd_mm": moves.std(axis=1, ddof=1),
        "low_mm": low,
        "high_mm": high,
    }


def draw_displacement(path, columns, last):
    """Mean and band of the displacement over time, and its distribution at the end.

    last: displacement of each member at the end [mm].
    """
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
