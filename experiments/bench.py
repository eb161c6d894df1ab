"""How fast is it? Rates of both packages, the paper's problem, and the first wait, in one table.

    make bench                          # on a quiet machine
    python experiments/bench.py --quick # fewer figures

Figures are CPU time of one core unless they say otherwise, and wall time with --arch cuda, without
compiling. They are medians of repeats, with the 95 % interval; candidates of one part take turns.

The table also has the change since the last run in this folder of the same kind on such a
processor. Adds a line with all of it to bench.jsonl in results/. ``backends.py`` has scenes of
growing size on all devices, ``bench_others.py`` other programs.
"""

import json
import sys
import time
from dataclasses import asdict

from _bench import PARTS
from taichi_dem.kit import runtime, study
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.provenance import git
from taichi_dem.kit.timing import median_interval

NAME = "bench"
HEADER = ["work", "median", "95 %", "unit", "change", "wanted"]


def options_parser():
    """Options of this script."""
    return study.parser(NAME, __doc__, folder="", threads=1)


def run(options):
    """Measure, print, and add a line to the history."""
    history, figures = study.begin(options) / "bench.jsonl", []
    for measure in PARTS:
        with ProgressBar(measure.__name__) as bar:
            bar.count(0, 1)
            for one in measure(options.quick):
                print(f"  {one.name}: {one.middle:.3g} {one.unit}", flush=True)
                figures.append(one)
    made_by = {"processor": study.processor(), "versions": study.versions()}
    made_by |= {"changed": bool(git("status", "--porcelain", "-uno")), "quick": options.quick}
    made_by |= {"date": time.strftime("%Y-%m-%d %H:%M"), **asdict(runtime.settings())}
    before = medians_before(history, made_by)
    study.print_table([row_of(one, before.get(one.name)) for one in figures], HEADER)
    medians = {one.name: one.middle for one in figures}
    with open(history, "a", encoding="utf-8") as file:
        shown = [one._asdict() for one in figures]
        file.write(json.dumps({**made_by, "medians": medians, "figures": shown}) + "\n")
    print(f"measured in {time.perf_counter() - options.started:.0f} s; added to {history}")


def row_of(one, before):
    """Cells of a figure in the table; before: its median in an earlier run, if any."""
    change = f"{100.0 * (one.middle / before - 1.0):+.0f} %" if before else ""
    middle, low, high = median_interval(one.values)
    return one.name, f"{middle:.3g}", f"{low:.3g} .. {high:.3g}", one.unit, change, one.wanted


def medians_before(path, made_by):
    """Medians by name of the last run in the history of such a place, none where there is none."""
    runs = path.read_text(encoding="utf-8").splitlines() if path.exists() else ()
    alike = "processor", "arch", "threads", "quick"
    for run in map(json.loads, reversed(runs)):
        if all(run[name] == made_by[name] for name in alike):
            return run["medians"]
    return {}


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
