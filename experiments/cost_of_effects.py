"""What does each effect cost, and what does the result lose without it?

    python experiments/cost_of_effects.py          # about four minutes on two cores
    python experiments/cost_of_effects.py --quick

The paper's block is blasted with its effects added one by one, and left out one by one; so is a
response curve of the damper, by spheres and by the automaton.

- What an effect costs: CPU seconds of a step with and without it from the same states. States of
  the run with all effects are put into every other scene; all scenes take turns in one process, in
  random order, until the 95 % interval of the ratio is small or the most rounds are made. It tells
  how well these states are timed; they stand for equal parts of the run. Contacts of another kind
  begin from states of their own run, as their lists have to be as old.
- What else it takes: every scene also runs in a process of its own with an empty cache of kernels:
  memory of all fields, CPU seconds before the first step, size of the compiled kernels.
- What it is good for: the displacement of the hole and the broken faces, or the response, of those
  runs.

An effect that is left out of a scene must cost nothing: an elastic block is timed against a step
stripped by hand. And of some scenes the shortest list of effects that serves is known: what all
effects cost there is listed too.

Writes effects.png, blast.csv, damper.csv, lists.csv and summary.json to results/cost_of_effects/.
"""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from _effects_costs import KNOWN_LISTS, ORDER, costs_of_blast
from _effects_damper import damper_costs
from _effects_pictures import picture_effects
from _effects_runs import absent, blast, damper
from _effects_tables import (
    CONTACTS,
    LAST_BIT,
    figures_of,
    list_rows,
    overhead_of_auto,
    row_of,
    show,
    show_lists,
)
from taichi_dem.kit import study
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "cost_of_effects"
#: What cannot stay without it.
ALONG = {"body_contact": ("sticking_friction",)}
SETTINGS = {
    "until": (2.5e-4, 1e-4, study.number(0, 1), "simulated time of the blast [s], 2.5e-4"),
    "repeats": (1, 1, study.whole(1, 100), "of every run in a process of its own, 1"),
    "rounds": (60, 10, study.whole(1, 10_000), "most rounds of turns from the same states, 60"),
    "half_width": (0.01, 0.02, study.number(0, 1), "of the 95 % interval of a cost, 0.01"),
    "states": (8, 4),
    "substeps": (16, 8),
    "lists": ((*KNOWN_LISTS,), ("blast",)),
    "certified": (5e-4, 1e-4),
    "chance": (True, False),
    "ratios": ((0.88, 0.91, 0.94, 0.96, 0.98, 1.0, 1.03), (0.92, 0.98)),
    "cycles": ((60, 20), (10, 4)),
    "left_out": (ORDER, ("body_contact",)),
    "added": (ORDER, ()),
    "again": (100, 20),
    "contacts": (CONTACTS, {}),
}
#: Substeps that the elastic block is timed over at a time, and fewest rounds of turns.
SUBSTEPS, FEWEST = 150, 8
ALL = "all effects"
STEPS = {"blast": 4e-7, "spheres": 3e-5, "automaton": 1e-4}
#: Steps of a damper from a state, about a tenth of a cycle.
TENTH = {"spheres": 600, "automaton": 180}
#: Scenes of a filling by its options: as it is, then with an effect left out of it, or added.
FILLINGS = {
    "spheres": {
        "spheres as they are": {},
        "friction of spheres": {"friction": 0.0},
        "friction at walls": {"wall_friction": 0.0},
        "rotation": {"rotation": True},
    },
    "automaton": {
        "automaton as they are": {},
        "static contact": {"accounting": "landing+ejection"},
        "ejection and static contact": {"accounting": "landing"},
    },
}
#: Of these in the quick job, where every scene compiles in a process of its own.
QUICK_FILLINGS = {"spheres": ("spheres as they are", "friction of spheres")}
SEEDS, PARTICLES = (1, 2), 30
#: Threads are processes side by side.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def run(options):
    """Measure, then write and print."""
    folder = study.begin(options)
    calls = {**blasts(options), **dampers(options)}
    workers = options.threads or min(2, os.cpu_count() or 1)
    with ProgressBar("compiling, measuring") as bar:
        results = study.call_rounds(calls, options.repeats, workers, bar.count)
    with ProgressBar("comparing") as bar:
        known = costs_of(cost_jobs(options, calls, results), workers, bar.count)
    elastic = study.call_in_process(absent, substeps=SUBSTEPS, repeats=options.again)
    tables = tables_of(calls, results, known)
    rows = [row for filling in fillings(options) for row in tables[filling]]
    study.write_rows(folder / "blast.csv", tables["blast"])
    study.write_rows(folder / "damper.csv", rows)
    picture_effects(folder / "effects.png", tables)
    show(
        tables["blast"],
        "The blast: cost of a step, what leaving effects out spares, and what it changes",
    )
    show(rows, "The damper: peak of the response [mm]; first rows: what two seeds may differ by")
    listed = list_rows(known["lists"])
    study.write_rows(folder / "lists.csv", listed)
    show_lists(listed)
    compiling = sum(found[0].get("compile_s", 0.0) for found in results.values())
    figures = {**figures_of(tables, elastic), **overhead_of_auto(listed)}
    # What comes from another process has lists for tuples.
    figures.update({key: tuple(found) for key, found in known["certificate"].items()})
    study.finish(options, NAME, figures, compiling)


def blasts(options):
    """All effects, without each, and from the load alone up to all; none of them twice."""
    scenes = {ORDER: ALL}
    for name in options.left_out:
        gone = (name, *ALONG.get(name, ()))
        scenes[tuple(e for e in ORDER if e not in gone)] = f"without {' and '.join(gone)}"
    scenes[()] = "gas pressure alone"
    for k, name in enumerate(options.added):
        scenes.setdefault(ORDER[: k + 1], f"up to {name}")
    shared = {"until": options.until, "step": STEPS["blast"], "ulps": 0}
    calls = {
        scene: (blast, {**shared, "names": ["gas_pressure", *names]})
        for names, scene in scenes.items()
    }
    for scene, contact in options.contacts.items():
        calls[scene] = blast, {**shared, "names": ["gas_pressure", *ORDER[:3], *contact]}
    if options.chance:
        calls[LAST_BIT] = blast, {**calls[ALL][1], "ulps": 1}
    return calls


def fillings(options):
    """Scenes of FILLINGS that are asked for."""
    chosen = QUICK_FILLINGS if options.quick else FILLINGS
    return {name: {scene: FILLINGS[name][scene] for scene in chosen[name]} for name in chosen}


def dampers(options):
    """Each filling as it is, and with each effect left out or added."""
    shared = {"particles": PARTICLES, "seeds": SEEDS}
    shared.update(ratios=options.ratios, cycles=options.cycles)
    return {
        scene: (damper, {"filling": filling, "step": STEPS[filling], "options": chosen, **shared})
        for filling, scenes in fillings(options).items()
        for scene, chosen in scenes.items()
    }


def cost_jobs(options, calls, results):
    """Functions and arguments that give costs of a step: of the blast and its lists, the fillings.

    Scenes whose own run failed are left out.
    """
    good = {scene: calls[scene] for scene, runs in results.items() if "failed" not in runs[0]}
    blown = {
        scene: call["names"][1:]
        for scene, (work, call) in good.items()
        if work is blast and scene != LAST_BIT
    }
    shared = {"half_width": options.half_width, "states": options.states}
    shared["rounds"] = FEWEST, options.rounds
    stepped = {"until": options.until, "step": STEPS["blast"], "substeps": options.substeps}
    asked = {"scenes": blown, "lists": options.lists, "certified": options.certified}
    jobs = {"blast": (costs_of_blast, {**asked, **stepped, **shared})}
    for filling, scenes in fillings(options).items():
        asked = {"filling": filling, "cycles": options.cycles, "substeps": TENTH[filling], **shared}
        asked["scenes"] = {scene: chosen for scene, chosen in scenes.items() if scene in good}
        table = {"particles": PARTICLES, "seeds": SEEDS, "ratios": options.ratios}
        asked["table"] = {**table, "step": STEPS[filling], "measured_cycles": options.cycles[1]}
        jobs[filling] = damper_costs, asked
    return jobs


def costs_of(jobs, workers, progress):
    """Costs by group and scene, each job in a process of its own; of the blast also its lists."""
    found = {}
    with ThreadPoolExecutor(workers) as pool:
        turns = {
            name: pool.submit(study.call_in_process, work, **arguments)
            for name, (work, arguments) in jobs.items()
        }
        for done, (name, turn) in enumerate(turns.items(), start=1):
            found[name] = turn.result()
            progress(done, len(jobs))
    return {**found, **found["blast"]}


def tables_of(calls, results, known):
    """Rows of each group, the first of them complete."""
    tables, complete = {}, {}
    for scene, repeats in results.items():
        group = calls[scene][1].get("filling", "blast")
        complete.setdefault(group, (scene, repeats))
        row = row_of(group, scene, repeats, complete[group], known[group])
        tables.setdefault(group, []).append(row)
    return tables


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
