"""What every experiment keeps to: a quick run in a process of its own, and how bad input ends."""

import csv
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from PIL import Image

from tests import arch
from tests.processes import users_environment

FOLDER = Path(__file__).resolve().parents[2] / "experiments"
READER = Path(__file__).resolve().parents[1] / "figures.py"
NO_EXPERIMENTS = ("make_meshes", "bench", "gallery")
NAMES = sorted(
    path.stem
    for path in FOLDER.glob("*.py")
    if not path.stem.startswith("_") and path.stem not in NO_EXPERIMENTS
)


def start(name, *arguments, report=None):
    """Run an experiment in a process of its own; two threads, output in pipes.

    report: file for what its figures lack, see ``tests.figures``.
    """
    everywhere = ["--threads", "2", "--arch", arch.chosen()]
    reader = [] if report is None else [str(READER), str(report)]
    line = [sys.executable, *reader, str(FOLDER / f"{name}.py"), *everywhere, *map(str, arguments)]
    options = {"capture_output": True, "text": True, "timeout": 1800}
    return subprocess.run(line, env=users_environment(), **options)


def figure_report(folder):
    """File of what the figures lack of a quick run in a folder."""
    return folder.parent / f"{folder.name}_figures.json"


def quick_runs(names):
    """A fixture of the quick runs of experiments: (name, folder, finished process)."""

    @pytest.fixture(scope="module", params=names)
    def quick(request, quick_run):
        return request.param, *quick_run(request.param)

    return quick


def is_figure(value):
    """A finite number, a name, or null where there is nothing to tell."""
    return value is None or isinstance(value, str) or math.isfinite(value)


def rows_of(path):
    """Rows of a CSV file as dicts of strings."""
    with open(path, newline="") as handle:
        return list(csv.DictReader(handle))


def assert_refused(code, captured, folder, *words):
    """Bad input: exit code 2, one sentence with these words, nothing written."""
    assert code == 2
    assert len(captured.err.splitlines()) == 1, captured.err
    assert "Traceback" not in captured.err
    for word in words:
        assert word in captured.err
    assert not os.path.exists(folder), "something was written"


@pytest.mark.slow
class QuickRun:
    """The contract; a test file names it TestQuickRun, with ``quick`` and what it expects.

    "{folder}" in a file's name stands for the name of the folder.
    """

    figures: ClassVar[dict] = {}
    files: ClassVar[dict] = {}

    def test_quick_run_succeeds_and_keeps_the_pipe_clean(self, quick):
        _, _, done = quick
        assert done.returncode == 0, done.stderr
        # No progress bar, no colours, no banner: nothing but where the paper's rules may fail.
        lines = done.stderr.splitlines()
        assert all("rules 'paper' of the automaton are known to fail" in line for line in lines)
        assert "\x1b" not in done.stdout
        assert "\r" not in done.stdout
        assert len(done.stdout.splitlines()) > 5
        # Two spaces part the cells of a table.
        assert not re.search(r"(^|  )(nan|None)(  |$)", done.stdout, re.MULTILINE)

    def test_quick_run_leaves_its_files_whole(self, quick):
        name, folder, _ = quick
        for file in (*self.files.get(name, ()), "summary.json"):
            assert (folder / file.format(folder=folder.name)).is_file(), file
        assert not list(folder.rglob("*.part*"))

    def test_summary_keeps_the_contract(self, quick):
        name, folder, _ = quick
        summary = json.loads((folder / "summary.json").read_text())
        assert summary["experiment"] == name
        assert set(summary) >= {"experiment", "figures", "machine", "versions", "seconds"}
        assert set(summary["seconds"]) == {"compile", "run"}
        assert min(summary["seconds"].values()) > 0.0
        assert {"taichi", "numpy", "python"} <= set(summary["versions"])
        assert summary["quick"] is True
        assert set(summary["figures"]) >= self.figures.get(name, set())
        for figure in summary["figures"].values():
            assert set(figure) == {"value", "unit", "paper"}
            assert is_figure(figure["value"]), figure

    def test_figures_say_what_they_show(self, quick):
        name, folder, _ = quick
        report = json.loads(figure_report(folder).read_text())
        assert report["figures"] > 0 or not list(folder.glob("*.png")), name
        assert report["defects"] == []

    def test_pictures_are_neither_tiny_nor_empty(self, quick):
        _, folder, _ = quick
        for path in folder.glob("*.png"):
            with Image.open(path) as image:
                assert 400 <= image.width <= 2500, path.name
                assert 300 <= image.height <= 2500, path.name
                # A blank canvas has one colour.
                assert len(np.unique(np.asarray(image.convert("L")))) > 20, path.name
        for path in folder.glob("*.gif"):
            with Image.open(path) as image:
                assert 2 <= image.n_frames <= 41
                assert max(image.size) <= 400
            assert path.stat().st_size < 1_000_000
