"""How fast is it? Rates of both packages, the papers' problems, and the first wait.

    make bench                          # about 12 minutes on two quiet cores
    python experiments/bench.py --quick # a minute

Figures are CPU time of one core unless they say otherwise, and wall time with --arch cuda, without
compiling. They are medians of repeats, with their spread; candidates of one part take turns.

Between the parts, the floors of the machine are measured on one core: copies in memory and in
cache, multiplications and additions. A figure with a known least work is given as a share of its
floor: the time of that work at these rates over the measured time.

The table also has what other programs take, measured on another machine: bench.md.

Writes bench.json and bench.md to results/, adds a line to bench_history.jsonl there, and draws
bench.png: all figures over the commits measured on such a processor.
"""

import json
import os
import sys
import textwrap
import time
from dataclasses import asdict

from _bench import TIMES, Figure, blast, damper
from _bench_block import block, growth
from _bench_others import OTHERS
from _bench_waits import waits
from taichi_dem.kit import runtime, study
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.plot_style import BLACK, BLUE, line_key, picture
from taichi_dem.kit.provenance import commit, git
from taichi_dem.kit.study.floors import MULTIPLY_ADD, Floors

NAME = "bench"
#: Functions that yield figures; quick: fewer of them, shorter jobs.
PARTS = (damper, waits, blast, block, growth)
#: Columns of the table; the floor: the time that memory and arithmetic need over the time taken.
HEADER = ("work", "ours", "spread", "unit", "wanted", "of the floor", "others'", "times", "by")
#: Runs with the same of these can be compared.
ALIKE = ("processor", "arch", "threads", "quick")
#: Panels in a row; height of one and of what is around them, and width of a page [inch].
COLUMNS, HEIGHT, AROUND, WIDTH = 5, 1.13, 1.1, 7.0
#: Sizes of letters [pt], and letters in a line of a title.
TITLE, SMALL, LINE = 7.0, 6.5, 24
#: Most commits of a picture, the latest ones.
MOST = 12
#: Colour and marker of a share of the floor, and of a figure over its first one.
SHARE, SPEED = "share of the machine's floor", "speed over that of the first run shown"
LOOKS = {SHARE: {"color": BLUE, "marker": "o"}, SPEED: {"color": BLACK, "marker": "s"}}
#: Names of the code that are parts of names of figures, in words.
WORDS = {
    "paper_uniform": "uniform",
    "paper_multirate": "multirate",
    "multirate_controlled": "controlled",
    "explicit_limited": "limited",
    "l = 1e-07 m": "l = 0.1 µm",
    "l = 1e-08 m": "l = 0.01 µm",
    "0.8 us": "0.8 µs",
}


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
    study.print_table(rows, HEADER)
    write_text(os.path.join(folder, "bench.md"), study.markdown_of(HEADER, rows))
    keys = {one.name: one.middle for one in figures if one.name.endswith("_seconds")}
    place = {"processor": study.processor(), "versions": study.versions()}
    shown = [
        {**dict(zip(("name", "unit", "values", "bound"), one)), "share_of_floor": one.share(rates)}
        for one in figures
    ]
    content = {"figures": shown, **keys, **place, **asdict(runtime.settings())}
    write_text(os.path.join(folder, "bench.json"), json.dumps(content, indent=1))
    history = os.path.join(folder, "bench_history.jsonl")
    draw_history(os.path.join(folder, "bench.png"), add_run(history, figures, rates, options.quick))
    seconds = time.perf_counter() - started
    print(f"measured in {seconds:.0f} s; bench.md, bench.json, bench.png are in {folder}")


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
    theirs = compared(one) if one.name in OTHERS else ("", "", "")
    return one.name, f"{one.middle:.3g}", spread, one.unit, one.bound, of_floor, *theirs


def compared(one):
    """Cells of another program's figure: its value, how many times as fast ours is, and by whom."""
    value, program, source = OTHERS[one.name]
    times = value / one.middle if one.is_time else one.middle / value
    return f"{value:g}", f"{times:.2g}", f"{program} ({source})"


def add_run(path, figures, rates, quick):
    """Add a run to the history; returns the latest run of each commit that can be compared to it.

    rates: of the floors, in bytes and operations a second.
    """
    settings = runtime.settings()
    last = {
        "commit": commit() + ("+" if git("status", "--porcelain", "-uno") else ""),
        "date": time.strftime("%Y-%m-%d %H:%M"),
        **{"processor": study.processor(), "arch": settings.arch, "threads": settings.threads},
        "quick": quick,
        "medians": {one.name: one.middle for one in figures},
        "units": {one.name: one.unit for one in figures},
        "shares": {one.name: one.share(rates) for one in figures if one.work and rates},
        "floors": rates,
    }
    with open(path, "a+", encoding="utf-8") as file:
        file.write(json.dumps(last) + "\n")
        file.seek(0)
        runs = [json.loads(line) for line in file]
    alike = [run for run in runs if all(run[name] == last[name] for name in ALIKE)]
    return list({run["commit"]: run for run in alike}.values())[-MOST:]


def draw_history(path, runs):
    """Draw all figures of the last run over the commits that have been measured like it."""
    names = [*runs[-1]["medians"]]
    rows = -(-len(names) // COLUMNS)
    shape = {"size": (WIDTH, AROUND + HEIGHT * rows), "sharex": True, "squeeze": False}
    with picture(path, rows, COLUMNS, **shape) as (figure, axes):
        # The first row is the one with gaps, so that the last one has commits below each column.
        gap = rows * COLUMNS - len(names)
        for axis in axes[0, COLUMNS - gap :]:
            axis.set_axis_off()
        for axis, name in zip((*axes[0, : COLUMNS - gap], *axes[1:].ravel()), names):
            draw_figure(axis, name, runs)
        keys = [line_key(label, ms=4, lw=1.0, **look) for label, look in LOOKS.items()]
        words = f"Last value in the titles; commits below; on {runs[-1]['processor']}"
        look = {"title": words, "alignment": "left", "title_fontsize": TITLE + 1.0}
        figure.legend(handles=keys, loc="outside upper left", ncols=2, **look)


def draw_figure(axis, name, runs):
    """One figure over the runs, in percent; its last median in the title."""
    last = runs[-1]
    kind, kept = (SHARE, "shares") if name in last["shares"] else (SPEED, "medians")
    places, values = zip(*((k, run[kept][name]) for k, run in enumerate(runs) if name in run[kept]))
    if kind == SPEED:
        less_is_better = last["units"][name] in TIMES
        values = [values[0] / now if less_is_better else now / values[0] for now in values]
    values = [100.0 * one for one in values]
    axis.plot(places, values, ms=3, lw=1.0, **LOOKS[kind])
    axis.set(ylim=(0.0, 1.25 * max(values)), xlim=(-0.5, len(runs) - 0.5))
    axis.set_xticks(range(len(runs)), [f"@{run['commit']}" for run in runs], rotation=90)
    axis.locator_params(axis="y", nbins=3)
    axis.tick_params(labelsize=SMALL, length=2.0)
    axis.set_ylabel("[%]", fontsize=SMALL, labelpad=1.0)
    value, unit = last["medians"][name], last["units"][name].replace("1", "")
    words = f"{value:,.0f} {unit}" if value >= 1000.0 else f"{value:.3g} {unit}".strip()
    for code, plain in WORDS.items():
        name = name.replace(code, plain)
    title = f"{name.replace('_seconds', '').replace('_', ' ')}: {words}"
    # It begins where the numbers of the axis do [pt].
    look = {"textcoords": "offset points", "va": "bottom", "fontsize": TITLE}
    axis.annotate(textwrap.fill(title, LINE), (0, 1), (-26, 2), "axes fraction", **look)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
