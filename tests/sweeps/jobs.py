"""Functions that the sweeps of tests run, and their tables; other processes import them."""

import os
import signal
import sys
from pathlib import Path

import pandas

from ca_damper import RigidMass, frequency_response
from taichi_dem import InputError, SimulationDiverged, parameter_grid, runtime
from taichi_dem.kit.sweeps.jobs import jobs_of, run_job, table_of
from taichi_dem.kit.sweeps.table import checked_rows


def squared(row):
    """Cheap: a number and text."""
    return {"square": row["x"] ** 2, "word": f"x is {row['x']}"}


def where(row):
    """What a worker knows of itself."""
    return {"pid": os.getpid(), "threads": runtime.settings().threads}


def counted(row):
    """Leave a mark in a folder for each run."""
    Path(row["folder"], f"{row['x']}_{len(os.listdir(row['folder']))}").touch()
    return squared(row)


def marks(folder):
    """Runs of ``counted`` by x."""
    return sorted(int(path.name.split("_")[0]) for path in Path(folder).iterdir())


def damper(row):
    """A frequency response, which a kernel computes; the process of one row is killed once."""
    if row["particles"] == 2 and not os.path.exists(row["killed"]):
        Path(row["killed"]).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    response = frequency_response(
        RigidMass(), particles=[row["particles"]], ratios=[row["ratio"]], seeds=[row["seed"]],
        start="rigid", transient_cycles=5, measured_cycles=3, progress=None,
    )  # fmt: skip
    return {"rms_m": response.rms.mean(), "amplitude_m": response.amplitude.mean()}


def damper_rows(folder, killed=False):
    """Four rows of ``damper``; killed: whether the process of one is killed."""
    mark = Path(folder, "killed")
    mark.unlink(missing_ok=True) if killed else mark.touch()
    return parameter_grid(particles=[2, 9], ratio=[0.9, 0.97], killed=[str(mark)])


class Mute(Exception):
    """Other processes can neither make it, keep what it holds, nor read its text."""

    def __init__(self, one, other):
        super().__init__(one)
        self.other = lambda: other

    def __str__(self):
        raise KeyError(self.args[0])


def bad(row):
    """Fail in the way that the row says."""
    if row["how"] == "input":
        raise InputError("sand must be dry,\n got wet")
    if row["how"] == "diverged":
        raise SimulationDiverged("the run diverged at 1 s")
    if row["how"] == "mute":
        raise Mute(1, 2)
    if row["how"] == "exits":
        sys.exit("no such option")
    if row["how"] == "leaves":
        os._exit(79)
    return {"x": 1.0} if row["how"] == "well" else row["how"]


def by_loop(function, table, seed=0):
    """The table of a sweep by a plain loop in this process."""
    rows = checked_rows(table)
    each = jobs_of(function, rows, seed)
    return table_of(each, [run_job(function, job.row) for job in each], list(rows[0]))


def assert_same_bits(one, other):
    """All columns but those of the place agree, in order, name, type and bits."""
    place = ["commit", "machine", "seconds"]
    pandas.testing.assert_frame_equal(
        one.drop(columns=place), other.drop(columns=place), check_exact=True
    )
