"""How sure is a crack? The probability of each face to break over 100 perturbed blasts.

One blast gives one pattern of cracks, and nobody knows a block well enough to say that it is the
one. Each blast here has another mesh, whose points are moved by 0.1 % of the shortest edge there
(the cut into elements is arbitrary, and cracks should not hang on it), and another strength: that
of concrete scatters by 5 % from cast to cast, and fracture energy with it. The block, its hole and
the gas stay. Expect the crushed zone and the main cracks in all blasts, about one broken face in
three in some of them only, and a displacement of the hole that is known to 4 %.

    python experiments/blast_ensemble.py                      # 100 blasts on all cores
    python experiments/blast_ensemble.py --scatter 0          # the mesh alone: what chance makes
    python experiments/blast_ensemble.py --members 1000       # goes on from those that are there

Blasts run side by side by ``sweep``, a process a core; those that are finished are kept, and the
same command runs what is missing. Writes probability.png, displacement.png, probability.csv (each
face), displacement.csv, members.csv (each blast), caption.txt and summary.json to
results/blast_ensemble/.
"""

import sys
from functools import partial

import numpy as np

from _blast import blast_parser
from _blast_ensemble import blast, draw_displacement, hole_moves, over_time
from _crack_sections import plot_crack_probability
from taichi_dem import CONCRETE, InputError, read_mesh, sweep
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.state.model import Model

NAME = "blast_ensemble"
SETTINGS = {
    "members": (100, 4, study.whole(2, 100000), "blasts, 100"),
    "until": (5e-4, 8e-5, study.number(0, 1), "simulated time [s], 5e-4"),
    "samples": (20, 8, study.whole(1, 99), "times at which the hole is looked at, 20"),
    "jitter": (1e-3, 1e-3, study.number(0, 0.05, open_low=False), "of points by edge, 0.001"),
    "scatter": (0.05, 0.05, study.number(0, 0.2, open_low=False), "of the strength, 0.05"),
    "seed": (0, 0, study.whole(0, 2**31), "of all blasts, 0"),
}
options_parser = partial(blast_parser, NAME, __doc__, (), settings=SETTINGS)


def run(options):
    """Blast, count, draw, print."""
    mesh = read_mesh(options.mesh)
    mesh.group_faces("hole")
    at = study.output_paths(options.out)
    names = ("mesh", "jitter", "scatter", "until", "samples")
    rows = [{name: getattr(options, name) for name in names} for _ in range(options.members)]
    # A second process would compile as well, which takes longer than four blasts.
    workers = 1 if options.quick else options.threads
    kept = {"out": at("members"), "workers": workers, "seed": options.seed}
    table = sweep(blast, rows, **kept)
    ended = table["error"] == ""
    if ended.sum() < 2:
        raise InputError(f"two blasts must end well, got: {table['error'][~ended].iloc[0]}")
    model = Model(mesh, CONCRETE, ())
    broken = np.array([[*text] for text in table["broken"][ended]]) == "1"
    moves = hole_moves(table, ended)
    columns = over_time(moves, options.until, options.samples)
    write(at, table, model, broken, columns)
    plot_crack_probability(at("probability.png"), model, broken.mean(axis=0))
    draw_displacement(at("displacement.png"), columns, moves[-1])
    figures = figures_of(broken, moves[-1])
    figures["failed_members"] = (int((~ended).sum()), "1")
    told = {"caption": caption(figures), "see": "probability.png"}
    study.finish(options, NAME, figures, seconds_of(table), **told)


def seconds_of(table):
    """Seconds of compiling, which is what blasts took beyond the usual one, and of running."""
    seconds = table["seconds"]
    compiling = float(np.maximum(0.0, seconds - np.median(seconds)).sum())
    return compiling, float(seconds.sum()) - compiling


def figures_of(broken, last):
    """Figures for summary.json: of faces, and of the hole's displacement at the end [mm]."""
    counts, shares = broken.sum(axis=1), broken.mean(axis=0)
    return {
        "members": (len(broken), "1"),
        "faces_in_all": (int((shares == 1.0).sum()), "1"),
        "faces_in_some": (int(((shares > 0.0) & (shares < 1.0)).sum()), "1"),
        "broken_faces_mean": (float(counts.mean()), "1"),
        "broken_faces_sd": (float(counts.std(ddof=1)), "1"),
        "hole_displacement_mean_mm": (float(last.mean()), "mm"),
        "hole_displacement_sd_mm": (float(last.std(ddof=1)), "mm"),
    }


def write(at, table, model, broken, columns):
    """Write all that is plotted, and each blast."""
    table.to_csv(at("members.csv"), index=False)
    write_csv(at("displacement.csv"), columns)
    top, middle = model.topology, model.mesh.points[model.topology.vertices].mean(axis=1)
    places = {f"{axis}_m": middle[:, k] for k, axis in enumerate("xyz")}
    bodies = {"body": top.master, "other_body": top.slave}
    write_csv(at("probability.csv"), {**bodies, **places, "probability": broken.mean(axis=0)})


def caption(figures):
    """What the pictures show, in words."""
    found = {name: value for name, (value, _) in figures.items()}
    return (
        f"Probability of each face to break in {found['members']} blasts with other meshes and "
        f"strengths: {found['faces_in_all']} faces break in all of them, {found['faces_in_some']} "
        f"in some. The hole opens by {found['hole_displacement_mean_mm']:.3g} mm with a standard "
        f"deviation of {found['hole_displacement_sd_mm']:.2g} mm."
    )


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
