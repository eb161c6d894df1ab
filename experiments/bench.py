"""How fast is it? Rates of both packages, the papers' problems, and the first wait.

    make bench                          # about 25 minutes; writes results/bench.json
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
import _bench_start
from taichi_dem import runtime
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.study import main, parser, print_table, processor, versions

NAME = "bench"


def run(options):
    """Measure, print, write; the keys NAME_seconds of bench.json are medians."""
    folder = output_folder(options.out)
    results, rows, keys = [], [], {}
    for part in (_bench_damper, _bench_start, _bench_blast, _bench_block):
        for name, unit, values, bound in part.measure(options.quick):
            median = float(np.median(values))
            print(f"  {name}: {median:.3g} {unit}", flush=True)
            results.append({"name": name, "unit": unit, "values": values, "bound": bound})
            rows.append((name, f"{median:.3g}", _spread(values), unit, bound))
            keys.update({name: median} if name.endswith("_seconds") else {})
    print_table(rows, ["figure", "median", "spread", "unit", "bound"])
    content = {"figures": results, **keys, "processor": processor(), "versions": versions()}
    path = os.path.join(folder, "bench.json")
    write_text(path, json.dumps({**content, **asdict(runtime.settings())}, indent=1))
    print(f"written to {path}")


def _spread(values):
    return f"{min(values):.3g} .. {max(values):.3g}"


if __name__ == "__main__":
    made = parser(NAME, __doc__)
    made.set_defaults(out="results", threads=1)
    sys.exit(main(run, made))
