"""How fast is it? Rates of both packages, the papers' problems, and the first wait.

    make bench                          # on a quiet machine
    python experiments/bench.py --quick # fewer figures

Figures are CPU time of one core unless they say otherwise, and wall time with --arch cuda, without
compiling. They are medians of repeats, with their spread; candidates of one part take turns.

Between the parts, the floors of the machine are measured on one core: copies in memory and in
cache, multiplications and additions. A figure with a known least work is given as a share of its
floor: the time of that work at these rates over the measured time.

The table also has what other programs take, measured on other machines, and the change since the
last run in this folder of the same kind on such a processor. Writes it to bench.md, all figures to
bench.json, and adds a line to bench_history.jsonl, in results/.
"""

import json
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path

from _bench import Figure, blast, damper
from _bench_block import block, growth
from _bench_others import OTHERS
from _bench_waits import waits
from taichi_dem.kit import runtime, study
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.provenance import commit, git
from taichi_dem.kit.study.floors import MULTIPLY_ADD, Floors

NAME = "bench"
#: Functions that yield figures; quick: fewer of them, shorter jobs.
PARTS = (damper, waits, blast, block, growth)
#: Columns of the table; the floor: the time that memory and arithmetic need over the time taken.
HEADER = ["work", "ours", "spread", "unit", "change", "wanted", "of the floor"]
HEADER += ["others'", "times", "by"]


def options_parser():
    """Options of this script."""
    return study.parser(NAME, __doc__, folder="", threads=1, summary="bench.json")


def run(options):
    """Measure, print, write; the keys NAME_seconds of bench.json are medians."""
    started, folder = time.perf_counter(), output_folder(options.out)
    figures = measured(options.quick)
    # Floors are the figures with such a unit.
    rates = {one.name: 1e9 * one.middle for one in figures if one.unit in ("GB/s", "GFlop/s")}
    history, place = os.path.join(folder, "bench_history.jsonl"), place_of(options.quick)
    before = medians_before(history, place)
    rows = [row_of(one, one.share(rates), before.get(one.name)) for one in figures]
    study.print_table(rows, HEADER)
    write_text(os.path.join(folder, "bench.md"), study.markdown_of(HEADER, rows))
    keys = {one.name: one.middle for one in figures if one.name.endswith("_seconds")}
    shown = [
        {**dict(zip(("name", "unit", "values", "bound"), one)), "share_of_floor": one.share(rates)}
        for one in figures
    ]
    made_by = {"processor": study.processor(), "versions": study.versions()}
    content = {"figures": shown, **keys, **made_by, **asdict(runtime.settings())}
    write_text(os.path.join(folder, "bench.json"), json.dumps(content, indent=1))
    add_run(history, figures, place)
    seconds = time.perf_counter() - started
    print(f"measured in {seconds:.0f} s; bench.md and bench.json are in {folder}")


def measured(quick):
    """All figures, those of the floors first."""
    floors, rates, figures = Floors(), {}, []

    def measure_floors():
        for name, rate in floors.measure().items():
            rates.setdefault(name, []).append(1e-9 * rate)

    measure_floors()
    for measure in PARTS:
        with ProgressBar(measure.__name__) as bar:
            bar.at(0.0)
            for one in measure(quick):
                print(f"  {one.name}: {one.middle:.3g} {one.unit}", flush=True)
                figures.append(one)
        measure_floors()
    units = {MULTIPLY_ADD: "GFlop/s"}
    return [Figure(name, units.get(name, "GB/s"), one) for name, one in rates.items()] + figures


def row_of(one, share, before):
    """Cells of a figure in the table; before: its median in an earlier run, if any."""
    change = f"{100.0 * (one.middle / before - 1.0):+.0f} %" if before else ""
    spread = f"{min(one.values):.3g} .. {max(one.values):.3g}"
    of_floor = "" if share is None else f"{100 * share:.3g} %"
    theirs = compared(one) if one.name in OTHERS else ("", "", "")
    measured_here = one.name, f"{one.middle:.3g}", spread, one.unit, change, one.bound, of_floor
    return *measured_here, *theirs


def compared(one):
    """Cells of another program's figure: its value, how many times as fast ours is, and by whom."""
    value, program, source = OTHERS[one.name]
    times = value / one.middle if one.is_time else one.middle / value
    return f"{value:g}", f"{times:.2g}", f"{program} ({source})"


def place_of(quick):
    """What is alike of runs that can be compared."""
    settings = runtime.settings()
    return [study.processor(), settings.arch, settings.threads, quick]


def medians_before(path, place):
    """Medians by name of the last run in the history of such a place, none where there is none."""
    runs = Path(path).read_text(encoding="utf-8").splitlines() if os.path.exists(path) else ()
    alike = [run for run in map(json.loads, runs) if run.get("place") == place]
    return alike[-1]["medians"] if alike else {}


def add_run(path, figures, place):
    """Add a run to the history, a line each."""
    last = {
        "commit": commit() + ("+" if git("status", "--porcelain", "-uno") else ""),
        "date": time.strftime("%Y-%m-%d %H:%M"),
        "place": place,
        "medians": {one.name: one.middle for one in figures},
    }
    with open(path, "a", encoding="utf-8") as file:
        file.write(json.dumps(last) + "\n")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
