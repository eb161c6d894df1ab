"""How fast is it? Rates of both packages, the papers' problems, and the first wait.

    make bench                          # a quarter of an hour; writes results/bench.json
    python experiments/bench.py --quick # a minute

Figures are CPU time of one core unless they say otherwise, with --arch cuda time of the wall;
compile time apart. Median of repeats, and their spread.
"""

import json
import os
import sys
from dataclasses import asdict

import numpy as np

import _bench_blast
import _bench_block
import _bench_damper
from _cli import main, parser, print_table, processor, versions
from taichi_dem import runtime
from taichi_dem.kit.files import output_folder, write_text

NAME = "bench"


def run(options):
    """Measure, print, write."""
    results = []
    output_folder(options.out)

    def note(name, unit, values, bound):
        results.append({"name": name, "unit": unit, "values": values, "bound": bound})
        print(f"  {name}: {np.median(values):.3g} {unit}", flush=True)

    for part in (_bench_damper, _bench_blast, _bench_block):
        part.measure(note, options.quick)
    print_table(
        [_row(result) for result in results], ["figure", "median", "spread", "unit", "bound"]
    )
    content = {"figures": results, "processor": processor(), "versions": versions()}
    content.update(asdict(runtime.settings()))
    text = json.dumps(content, indent=1)
    path = os.path.join(options.out, "bench.json")
    write_text(path, text)
    print(f"written to {path}")


def _row(result):
    values = result["values"]
    spread = f"{min(values):.3g} .. {max(values):.3g}"
    return [result["name"], f"{np.median(values):.3g}", spread, result["unit"], result["bound"]]


if __name__ == "__main__":
    made = parser(NAME, __doc__)
    made.set_defaults(out="results", threads=1)
    sys.exit(main(run, made))
