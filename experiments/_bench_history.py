"""The history of the bench: a line a run, and a picture of all figures over the commits."""

import json
import os
import textwrap
import time

from _bench_figure import TIMES
from taichi_dem.kit import runtime, study
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, BLUE, line_key, picture
from taichi_dem.kit.provenance import commit, git

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


def record_of(figures, rates, quick):
    """What the history keeps of a run; rates: of the floors, in bytes and operations a second."""
    settings = runtime.settings()
    return {
        "commit": commit() + ("+" if git("status", "--porcelain", "-uno") else ""),
        "date": time.strftime("%Y-%m-%d %H:%M"),
        "processor": study.processor(),
        "arch": settings.arch,
        "threads": settings.threads,
        "quick": quick,
        "medians": {one.name: one.middle for one in figures},
        "units": {one.name: one.unit for one in figures},
        "shares": {one.name: one.share(rates) for one in figures if one.work and rates},
        "floors": rates,
    }


def add_run(path, record):
    """Add a run to the file of the history; returns all of its runs, the oldest first.

    Raises InputError where a line cannot be read.
    """
    lines = []
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            lines = file.read().splitlines()
    lines.append(json.dumps(record))
    write_text(path, "\n".join(lines) + "\n")
    return [run_of(path, number, line) for number, line in enumerate(lines, 1)]


def run_of(path, number, line):
    """The run in a line."""
    try:
        return json.loads(line)
    except ValueError as error:
        raise InputError(f"{path}, line {number}, must be a run in JSON: {error}") from None


def alike(runs):
    """Latest run of each commit, of those that can be compared with the last; in their order."""
    last = runs[-1]
    found = {}
    for run in runs:
        if all(run[name] == last[name] for name in ALIKE):
            found.pop(run["commit"], None)
            found[run["commit"]] = run
    return list(found.values())[-MOST:]


def draw_history(path, runs):
    """Draw all figures of the last run over the commits that have been measured like it."""
    runs = alike(runs)
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
    of_floor = name in runs[-1]["shares"]
    look = LOOKS[SHARE if of_floor else SPEED]
    places, values = zip(*(shares_of if of_floor else speeds_of)(name, runs))
    axis.plot(places, values, ms=3, lw=1.0, **look)
    axis.set(ylim=(0.0, 1.25 * max(values)), xlim=(-0.5, len(runs) - 0.5))
    axis.set_xticks(range(len(runs)), [f"@{run['commit']}" for run in runs], rotation=90)
    axis.locator_params(axis="y", nbins=3)
    axis.tick_params(labelsize=SMALL, length=2.0)
    axis.set_ylabel("[%]", fontsize=SMALL, labelpad=1.0)
    title = f"{words_of(name)}: {last_in_words(name, runs[-1])}"
    # It begins where the numbers of the axis do [pt].
    look = {"textcoords": "offset points", "va": "bottom", "fontsize": TITLE}
    axis.annotate(textwrap.fill(title, LINE), (0, 1), (-26, 2), "axes fraction", **look)


def shares_of(name, runs):
    """(Place, share of the floor [%]) of those runs that have a figure."""
    return [(k, 100.0 * run["shares"][name]) for k, run in enumerate(runs) if name in run["shares"]]


def speeds_of(name, runs):
    """(Place, speed over that of the first one [%]) of those runs that have a figure."""
    found = [(k, run["medians"][name]) for k, run in enumerate(runs) if name in run["medians"]]
    first = found[0][1]
    less_is_better = runs[-1]["units"][name] in TIMES
    return [(k, 100.0 * (first / now if less_is_better else now / first)) for k, now in found]


def words_of(name):
    """Name of a figure without names of the code."""
    for code, words in WORDS.items():
        name = name.replace(code, words)
    return name.replace("_seconds", "").replace("_", " ")


def last_in_words(name, run):
    """Median of a figure with its unit."""
    value, unit = run["medians"][name], run["units"][name].replace("1", "")
    return f"{value:,.0f} {unit}" if value >= 1000.0 else f"{value:.3g} {unit}".strip()
