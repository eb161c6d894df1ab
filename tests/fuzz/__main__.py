"""Random scenes of both packages, each run briefly, and a table of how they ended.

    python -m tests.fuzz --number 10000 --seed 0       # some twenty minutes on two cores
    python -m tests.fuzz --seed 4711 --number 1        # one scene again, with what it is

A scene depends on its seed alone. Exit code 1 if an end is unexplained: a crash, a hang, a
traceback, a warning of a library, or numbers that mechanics does not allow, without a word.
"""

import argparse
import itertools
import math
import sys
import time
from collections import defaultdict

from tests.fuzz.ends import ENDS, UNEXPLAINED
from tests.fuzz.workers import KINDS, ends, serve, trial_of

#: Seeds named for each way in which scenes ended without an explanation.
NAMED = 8


def options(arguments=None):
    """Options of the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--number", type=int, default=1000, help="of scenes, 1000")
    parser.add_argument("--seed", type=int, default=0, help="of the first scene, 0")
    parser.add_argument("--time-limit", type=float, default=5.0, help="of a scene [s], 5")
    parser.add_argument("--minutes", type=float, default=math.inf, help="no scene begins later")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time, 2")
    parser.add_argument("--kinds", default="", help="numbers of the kinds to draw, 0,3 say; all")
    parser.add_argument("--serve", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.number < 1 or given.seed < 0 or given.jobs < 1 or not given.time_limit > 0.0:
        parser.error("--number and --jobs must be at least 1, --seed 0, --time-limit positive")
    return given


def seeds_of(given):
    """As many seeds as asked for, of the kinds that are wanted."""
    kinds = {int(kind) for kind in given.kinds.split(",") if kind}
    wanted = (s for s in itertools.count(given.seed) if not kinds or s % len(KINDS) in kinds)
    return list(itertools.islice(wanted, given.number))


def table(found, seconds):
    """Lines of a table of ends by package-free name, with the seeds of those unexplained."""
    total = sum(map(len, found.values()))
    lines = [f"{total} scenes in {seconds:.0f} s, {total / max(seconds, 1e-9):.1f} a second"]
    for name in ENDS:
        lines.append(f"{len(found[name]):7d}  {100.0 * len(found[name]) / total:5.1f} %  {name}")
    kinds = defaultdict(list)
    for seed, words in found[UNEXPLAINED]:
        kinds["".join(c for c in words if not c.isdigit())[:60]].append((seed, words))
    for same in sorted(kinds.values(), key=len, reverse=True):
        seeds = " ".join(str(seed) for seed, _ in same[:NAMED])
        lines.append(f"unexplained {len(same)} times, by seeds {seeds}: {same[0][1]}")
    return lines


def main(given):
    """Run the scenes, show how far it is, print the table; returns the exit code."""
    found, began = defaultdict(list), time.monotonic()
    seeds, shown = seeds_of(given), began
    if given.number == 1:
        trial, _ = trial_of(given.seed)
        print(f"seed {given.seed}: {trial}")
    until = began + 60.0 * given.minutes
    for count, (seed, end) in enumerate(ends(seeds, given.jobs, given.time_limit, until), 1):
        found[end.name].append((seed, end.words))
        if end.name == UNEXPLAINED or given.number == 1:
            print(f"seed {seed}: {end.name}: {end.words}", flush=True)
        if time.monotonic() - shown > 30.0:
            shown = time.monotonic()
            print(f"{count} of {given.number} after {shown - began:.0f} s", flush=True)
    print("\n".join(table(found, time.monotonic() - began)))
    return int(bool(found[UNEXPLAINED]))


if __name__ == "__main__":
    asked = options()
    if asked.serve:
        serve(asked.serve, asked.time_limit)
    else:
        sys.exit(main(asked))
