"""What does each effect cost, and what does the result lose without it?

    python experiments/cost_of_effects.py          # about five minutes on two cores
    python experiments/cost_of_effects.py --quick

The paper's block is blasted with its effects added one by one, and left out one by one; so is a
response curve of the damper, by spheres and by the automaton. Every run is a process of its own
with an empty cache of kernels, then with a full one for the repeats: CPU seconds of a step (least
of the repeats), memory of all fields, CPU seconds before the first step, size of the compiled
kernels. Beside it: the displacement of the hole and the broken faces, or the response. An effect
that is left out of a scene must cost nothing: an elastic block is timed against a step stripped
by hand.

Writes effects.png, blast.csv, damper.csv and summary.json to results/cost_of_effects/.
"""

import os
import sys

import numpy as np

from _damper_response import distance
from _effects_jobs import Job, run_all
from _effects_picture import picture_effects
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import (
    figure,
    finish,
    main,
    number,
    parser,
    show_rows,
    take_defaults,
    whole,
    write_rows,
)

NAME = "cost_of_effects"
#: Effects in the order in which they are added; the load is always there.
ORDER = ("bond_damping", "softening", "shear_slip", "sphere_contact", "friction")
#: What cannot stay without it.
ALONG = {"sphere_contact": ("friction",)}
ALL = "all effects"
STEP = 4e-7
FULL = {
    "until": 2.5e-4,
    "repeats": 3,
    "ratios": (0.88, 0.91, 0.94, 0.96, 0.98, 1.0, 1.03),
    "cycles": (60, 20),
    "left_out": ORDER,
    "added": ORDER,
    "again": 100,
}
QUICK = {
    "until": 1e-4,
    "repeats": 1,
    "ratios": (0.92, 0.96, 1.0),
    "cycles": (15, 5),
    "left_out": ("sphere_contact", "friction"),
    "added": (),
    "again": 40,
}
#: Substeps that the elastic block is timed over at a time.
SUBSTEPS = 150
LAST_BIT = "all effects, last bit of the load changed"
PARTICLES, SEEDS = 30, (1, 2)
#: What is left out of a filling, or added to it: in words, and as options.
SPHERES = (
    ("friction of spheres", {"friction": 0.0}),
    ("friction at walls", {"wall_friction": 0.0}),
    ("rotation", {"rotation": True}),
)
AUTOMATON = (
    ("static contact", {"accounting": "landing+ejection"}),
    ("ejection and static contact", {"accounting": "landing"}),
)
#: Step of a filling [s], and its variants.
FILLINGS = {"spheres": (3e-5, SPHERES), "automaton": (1e-4, AUTOMATON)}
ADDED = ("rotation",)
VARIANTS = tuple(label for label, _ in SPHERES + AUTOMATON)
COSTS = (
    *("step_ms", "step_ms_most", "run_s"),
    *("spared_percent", "spared_least_percent", "spared_most_percent"),
    *("memory_MB", "before_first_step_s", "compiled_kB"),
)
HIDDEN = ("group", "failed", "run_s", "spared_least_percent", "spared_most_percent")


def options_parser():
    """Options of this experiment; threads: processes side by side."""
    made = parser(NAME, __doc__)
    made.add_argument("--until", type=number(0, 1), help="simulated time of the blast [s], 2.5e-4")
    made.add_argument("--repeats", type=whole(1, 100), help="of every run, 3")
    return made


def run(options):
    """Measure, then write and print."""
    take_defaults(options, FULL, QUICK)
    output_folder(options.out)
    jobs = [*blast_jobs(options), *damper_jobs(options), absent_job(options)]
    workers = options.threads or min(2, os.cpu_count() or 1)
    with ProgressBar("measuring") as bar:
        seconds = run_all(jobs, options.repeats, workers, options.arch, bar)
    blast, damper = blast_rows(jobs), damper_rows(jobs)
    write_rows(os.path.join(options.out, "blast.csv"), blast)
    write_rows(os.path.join(options.out, "damper.csv"), damper)
    picture(blast, damper, os.path.join(options.out, "effects.png"))
    show(blast, "The blast: hole's displacement [mm] and broken faces")
    show(damper, "The damper: peak of the response [mm]; first rows: what two seeds may differ by")
    compiling = sum(job.first.get("compile_s", 0.0) for job in jobs)
    finish(options, NAME, figures_of(jobs, blast, damper), (compiling, seconds))


def picture(blast, damper, path):
    """Bars: what an effect costs, and what changes without it."""
    parts = [("Blast of the paper's block", verdicts(blast), _chance(blast) or 0.0)]
    for group in FILLINGS:
        own = [row for row in damper if row["group"] == group]
        parts.append((f"Damper, {group}", verdicts(own), own[0]["change_percent"]))
    picture_effects(path, parts)


def _chance(blast):
    """What a change of the load's last bit changes [%], None where that was not tried."""
    return next((row["change_percent"] for row in blast if row["scene"] == LAST_BIT), None)


def blast_jobs(options):
    """All effects, without each, and from the load alone up to all; none of them twice."""
    wanted = {ALL: ORDER}
    for name in options.left_out:
        gone = (name, *ALONG.get(name, ()))
        wanted[f"without {' and '.join(gone)}"] = tuple(e for e in ORDER if e not in gone)
    wanted["gas pressure alone"] = ()
    wanted.update({f"up to {name}": ORDER[: k + 1] for k, name in enumerate(options.added)})
    first = {}
    for label, names in wanted.items():
        first.setdefault(names, label)
    common = {"until": options.until, "step": STEP}
    jobs = [(label, names, 0) for names, label in first.items()]
    jobs += [(LAST_BIT, ORDER, 1)] if options.repeats > 1 else []
    return [
        Job("blast", label, "blast", {"names": ["gas_pressure", *names], "ulps": ulps, **common})
        for label, names, ulps in jobs
    ]


def damper_jobs(options):
    """Both fillings as they are, and with each effect left out or added."""
    common = {"particles": PARTICLES, "seeds": SEEDS}
    common.update(ratios=options.ratios, cycles=options.cycles)
    return [
        Job(
            filling,
            label,
            "damper",
            {**common, "filling": filling, "step": step, "options": chosen},
        )
        for filling, (step, variants) in FILLINGS.items()
        for label, chosen in ((f"{filling} as they are", {}), *variants)
    ]


def absent_job(options):
    """An elastic block as composed and as stripped by hand."""
    arguments = {"substeps": SUBSTEPS, "repeats": options.again}
    return Job("absent", "elastic block", "absent", arguments)


def blast_rows(jobs):
    """A row of the table for every blast."""
    blasts = [job for job in jobs if job.group == "blast"]
    rows = [_cost_row(job, blasts[0]) for job in blasts]
    for row, job in zip(rows, blasts):
        row["hole_mm"] = None if job.failed else job.first["hole_mm"]
        row["broken_faces"] = None if job.failed else job.first["broken"]
        # Of the first effect that is left out, in the complete scene.
        name = row["scene"].replace("without ", "").split()[0]
        share = blasts[0].first.get("shares", {}).get(name)
        row["energy_percent"] = None if share is None else 100.0 * share
        wanted, found = rows[0]["hole_mm"], row["hole_mm"]
        change = None if job.failed else 100.0 * abs(found - wanted) / abs(wanted)
        row["change_percent"] = change
    return rows


def damper_rows(jobs):
    """A row for every response curve; the change is the distance to that of the full filling.

    The floor is half of the distance of two seeds: what the mean over them may owe to chance.
    """
    rows = []
    for group in FILLINGS:
        curves = [job for job in jobs if job.group == group]
        whole_curve = _curve(curves[0])
        for job in curves:
            row = _cost_row(job, curves[0])
            curve = _curve(job)
            row["peak_mm"] = None if job.failed else float(curve.max())
            row["change_percent"] = None if job.failed else 100.0 * distance(curve, whole_curve)
            rows.append(row)
        one, other = curves[0].first["rms_mm"]
        rows[-len(curves)]["change_percent"] = 50.0 * distance(one, other)
    return rows


def _curve(job):
    """Mean over the seeds [mm], (ratios,)."""
    return np.mean(np.atleast_2d(job.first.get("rms_mm", np.nan)), axis=0)


def _cost_row(job, complete):
    """What a job cost, and what share of a step of the complete scene it spares."""
    row = {"group": job.group, "scene": job.label, "failed": job.failed}
    if job.failed:
        return {**row, **dict.fromkeys(COSTS)}
    timing = job.step_ms
    return {
        **row,
        "step_ms": timing.low,
        "step_ms_most": timing.high,
        "run_s": 1e-3 * timing.low * job.first["steps"],
        "spared_percent": 100.0 * (1.0 - timing.low / complete.step_ms.low),
        # From the slowest of its repeats beside the fastest of the others to the reverse.
        "spared_least_percent": 100.0 * (1.0 - timing.high / complete.step_ms.low),
        "spared_most_percent": 100.0 * (1.0 - timing.low / complete.step_ms.high),
        "memory_MB": job.first["memory_MB"],
        "before_first_step_s": job.first["compile_s"],
        "compiled_kB": job.compiled_kB,
    }


def verdicts(rows):
    """(name, cost [%] with its least and most, change [%]) for each effect left out or added."""
    found = []
    for row in rows:
        name = row["scene"].replace("without ", "")
        alone = row["scene"].startswith("without ") or name in VARIANTS
        if alone and not row["failed"]:
            costs = [row[f"spared_{key}percent"] for key in ("", "least_", "most_")]
            if name in ADDED:
                name, costs = f"{name} (added)", [-costs[0], -costs[2], -costs[1]]
            found.append((name, costs, row["change_percent"]))
    return found


def figures_of(jobs, blast, damper):
    """Overhead of what is absent; for each effect what it adds, and what its absence changes."""
    times = jobs[-1].first
    # Each against its neighbour in time: a machine is never equally fast for long.
    ratio = np.array(times["composed"]) / np.array(times["by_hand"])
    low, middle, high = 100.0 * (np.percentile(ratio, [25, 50, 75]) - 1.0)
    figures = {
        "overhead_absent_percent": figure(float(middle), "%"),
        "overhead_absent_low_percent": figure(float(low), "%"),
        "overhead_absent_high_percent": figure(float(high), "%"),
        "blast_seconds": figure(blast[0]["run_s"], "s"),
    }
    if _chance(blast) is not None:
        figures["blast_chance_percent"] = figure(_chance(blast), "%")
    for row in blast:
        if row["scene"].startswith("without "):
            name = row["scene"].split()[1]
            _add(figures, name, row, blast[0])
            change = None if row["failed"] else row["broken_faces"] - blast[0]["broken_faces"]
            figures[f"{name}_broken_faces_change"] = figure(change, "1")
    for row in damper:
        if row["scene"] in VARIANTS:
            complete = next(r for r in damper if r["group"] == row["group"])
            _add(figures, f"{row['group']}_{row['scene'].replace(' ', '_')}", row, complete)
    return figures


def _add(figures, name, row, complete):
    """Seconds, memory and kernels that an effect adds, and the change of the result."""
    sign = -1.0 if row["scene"] in ADDED else 1.0
    for key, unit in (("run_s", "s"), ("memory_MB", "MB"), ("compiled_kB", "kB")):
        more = None if row["failed"] else sign * (complete[key] - row[key])
        figures[f"{name}_{'seconds' if key == 'run_s' else key}"] = figure(more, unit)
    what = "displacement" if row["group"] == "blast" else "response"
    figures[f"{name}_{what}_change_percent"] = figure(row["change_percent"], "%")


def show(rows, title):
    """Print the rows that did not fail, and why the others did."""
    print(f"\n{title}")
    names = [name for name in rows[0] if name not in HIDDEN]
    cells = [{name: _cell(row[name]) for name in names} for row in rows]
    show_rows(cells, {name: (name, "") for name in names})
    for row in rows:
        if row["failed"]:
            print(f"{row['scene']}: {row['failed']}")


def _cell(value):
    return value if isinstance(value, (str, int, type(None))) else f"{value:.3g}"


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
