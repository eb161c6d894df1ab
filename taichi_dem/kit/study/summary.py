"""Figures of a study, and the file summary.json that holds them with what made them."""

import json
import math
import os
import platform
import shlex
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from taichi_dem.kit import runtime
from taichi_dem.kit.files import write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.provenance import commit, processor
from taichi_dem.kit.study.look import print_figures, show_files
from taichi_dem.kit.terminal import show_paragraph
from taichi_dem.kit.version import __version__, taichi_version

#: A figure by its name, as of ``figure``; ``finish`` takes the arguments of that as well.
Figures = Mapping[str, dict]


def figure(value: Any, unit: str, paper: Any = None) -> dict:
    """One figure of summary.json; what was not measured is left out instead.

    value: None where it was looked for in vain; NaN and infinity, which JSON lacks, count as None.
    """
    if isinstance(value, float) and not math.isfinite(value):
        value = None
    return {"value": value, "unit": unit, "paper": paper}


def finish(
    options: Namespace,
    name: str,
    figures: Mapping[str, dict | tuple],
    runs: Iterable | tuple[float, float] | float,
    *,
    caption: str = "",
    see: str = "",
    draw: Callable[[], None] | None = None,
) -> None:
    """Write summary.json, and caption.txt where there is a caption; print them, and the pictures.

    figures: by name, as of ``figure``, or tuples of its arguments.
    runs: reports, objects with compile_seconds and run_seconds, or both sums as a pair of numbers;
    or those of compiling alone: all else since ``main`` began counts as running. see: the picture
    to look at first. draw: draws the pictures, once the figures are printed.
    """
    if isinstance(runs, float):
        runs = runs, time.perf_counter() - options.started - runs
    found = _seconds_of(runs) if isinstance(runs, tuple) else _figures_of(list(runs))
    made = {key: figure(*one) if isinstance(one, tuple) else one for key, one in figures.items()}
    write_summary(options.out, name, made, command=getattr(options, "command", ()), **found)
    entry = getattr(options, "entry", None)
    if made:
        print_figures(made, entry)
    if caption:
        write_text(os.path.join(options.out, "caption.txt"), caption + "\n")
        print()
        show_paragraph(caption)
    if draw:
        with ProgressBar(name):
            draw()
    first = (see, *(entry.pictures if entry else ()))
    show_files(options.out, getattr(options, "began", 0.0), first)


def _seconds_of(pair) -> dict[str, Any]:
    return dict(zip(("compile_seconds", "run_seconds"), pair))


def _figures_of(reports) -> dict[str, Any]:
    """Arguments of ``write_summary`` from the reports of runs."""
    names = "compile_seconds", "run_seconds"
    seconds = _seconds_of(sum(getattr(one, name) for one in reports) for name in names)
    known = [one.known_error for one in reports if getattr(one, "known_error", "")]
    return {**seconds, "known_errors": known}


def write_summary(
    folder: str,
    name: str,
    figures: Figures,
    *,
    compile_seconds: float,
    run_seconds: float,
    known_errors: Sequence[str] = (),
    command: Sequence[str] = (),
) -> None:
    """Write summary.json: figures, machine, versions, seconds, command; see ``figure``.

    known_errors: what reports say of the errors of their runs; equal ones are written once.
    command: words after "python", by default those of the experiment of that name. quick: whether
    it asked for the smaller job, which the gallery's texts do not describe.
    """
    settings: Any = runtime.settings()
    words = [*command] or [f"experiments/{name}.py", *sys.argv[1:]]
    machine = {"processor": processor(), "cores": os.cpu_count(), "arch": settings.arch}
    content = {
        "experiment": name,
        "figures": figures,
        "machine": {**machine, "threads": settings.threads, "system": platform.platform()},
        "versions": versions(),
        "known_errors": list(dict.fromkeys(known_errors)),
        "seconds": {"compile": compile_seconds, "run": run_seconds},
        "command": shlex.join(words),
        "quick": "--quick" in words,
    }
    write_text(os.path.join(folder, "summary.json"), json.dumps(content, indent=1))


def versions() -> dict[str, str]:
    """Versions of what computes, and the commit, "unknown" where there is none."""
    found = {"taichi": taichi_version(), "numpy": np.__version__, "taichi-dem": __version__}
    found["python"] = platform.python_version()
    found["commit"] = commit()
    return found
