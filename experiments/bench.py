"""How fast is it? Rates of both packages, the papers' problems, and the first wait.

    make bench                          # about 8 minutes on two quiet cores
    python experiments/bench.py --quick # a minute

Figures are CPU time of one core unless they say otherwise, with --arch cuda time of the wall;
compile time apart. Median of repeats, and their spread; candidates of one part take turns.

The floors of the machine are measured between the parts: a copy in memory and in the cache, and
multiplications and additions, by one core. A figure that states its least work stands as a share of
its floor: the time of that work at these rates over the time it took.

Writes bench.json to results/, adds a line to bench_history.jsonl there, and draws bench.png: all
figures over the commits that have been measured on such a processor.
"""

import json
import os
import sys
import time
from dataclasses import asdict

import _bench_blast
import _bench_block
import _bench_damper
import _bench_start
from _bench_figure import Figure
from _bench_history import add_run, draw_history, record_of
from taichi_dem.kit import runtime, study
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.study.floors import MULTIPLY_ADD, Floors

NAME = "bench"
#: Functions that yield figures; quick: fewer of them, shorter jobs.
PARTS = (_bench_damper.measure, _bench_start.measure, _bench_blast.measure, _bench_block.measure)


def options_parser():
    """Options of this script."""
    return study.parser(NAME, __doc__, out="results", threads=1, summary="bench.json")


def run(options):
    """Measure, print, write; the keys NAME_seconds of bench.json are medians."""
    started, folder = time.perf_counter(), output_folder(options.out)
    figures = measured(options.quick)
    # Floors are the figures with such a unit.
    rates = {one.name: 1e9 * one.middle for one in figures if one.unit in ("GB/s", "GFlop/s")}
    rows = [row_of(one, one.share(rates)) for one in figures]
    header = ["figure", "median", "spread", "unit", "bound", "then", "share of the floor"]
    study.print_table(rows, header)
    write_json(os.path.join(folder, "bench.json"), figures, rates)
    history = os.path.join(folder, "bench_history.jsonl")
    runs = add_run(history, record_of(figures, rates, options.quick))
    draw_history(os.path.join(folder, "bench.png"), runs)
    seconds = time.perf_counter() - started
    print(f"measured in {seconds:.0f} s; bench.json, bench.png, bench_history.jsonl in {folder}")


def measured(quick):
    """All figures, those of the floors first."""
    floors, rates, figures = Floors(), {}, []

    def measure_floors():
        for name, rate in floors.measure().items():
            rates.setdefault(name, []).append(1e-9 * rate)

    measure_floors()
    for measure in PARTS:
        for one in measure(quick):
            print(f"  {one.name}: {one.middle:.3g} {one.unit}", flush=True)
            figures.append(one)
        measure_floors()
    units = {MULTIPLY_ADD: "GFlop/s"}
    return [Figure(name, units.get(name, "GB/s"), one) for name, one in rates.items()] + figures


def row_of(one, share):
    """Cells of a figure in the table."""
    spread = f"{min(one.values):.3g} .. {max(one.values):.3g}"
    of_floor = "" if share is None else f"{100 * share:.3g} %"
    return one.name, f"{one.middle:.3g}", spread, one.unit, one.bound, one.then, of_floor


def write_json(path, figures, rates):
    """Write all figures; keys at the top are the medians of those that are waits."""
    shown = [
        {**dict(zip(("name", "unit", "values", "bound"), one)), "share_of_floor": one.share(rates)}
        for one in figures
    ]
    keys = {one.name: one.middle for one in figures if one.name.endswith("_seconds")}
    place = {"processor": study.processor(), "versions": study.versions()}
    content = {"figures": shown, **keys, **place, **asdict(runtime.settings())}
    write_text(path, json.dumps(content, indent=1))


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
