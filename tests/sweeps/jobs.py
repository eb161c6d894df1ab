"""Functions that the sweeps of tests run, and their tables; other processes import them."""

import os
import signal
import sys
from pathlib import Path

from ca_damper import RigidMass, frequency_response
from taichi_dem import InputError, SimulationDiverged, parameter_grid, runtime


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
    """A frequency response: what a kernel computes."""
    _dies_once(row)
    response = frequency_response(
        RigidMass(), particles=[row["particles"]], ratios=[row["ratio"]], seeds=[row["seed"]],
        start="rigid", transient_cycles=5, measured_cycles=3, progress=None,
    )  # fmt: skip
    return {"rms_m": response.rms.mean(), "amplitude_m": response.amplitude.mean()}


def _dies_once(row):
    """The process of one row is killed, unless the file of the row says that it was."""
    if row["particles"] == 2 and not os.path.exists(row["killed"]):
        Path(row["killed"]).touch()
        os.kill(os.getpid(), signal.SIGKILL)


def damper_rows(folder, killed=False):
    """Eight rows of ``damper``; killed: whether the process of the third is killed."""
    mark = Path(folder, "killed")
    mark.unlink(missing_ok=True) if killed else mark.touch()
    return parameter_grid(particles=[0, 2, 5, 9], ratio=[0.9, 0.97], killed=[str(mark)])


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
    if row["how"] == "bug":
        return {"x": row["not there"]}
    if row["how"] == "mute":
        raise Mute(1, 2)
    if row["how"] == "exits":
        sys.exit("no such option")
    if row["how"] == "interrupts":
        raise KeyboardInterrupt
    if row["how"] == "leaves":
        os._exit(79)
    if row["how"] == "no file":
        raise InputError("no file \udc80\0")
    if row["how"] == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    return {"x": 1.0} if row["how"] == "well" else row["how"]


#: Ways of ``bad`` that raise what ends a process or cannot reach another one, and what is said.
RAISED = ["mute", "exits", "interrupts", "well"]
SAID = [
    "Mute: its text cannot be read: KeyError",
    "SystemExit: no such option",
    "KeyboardInterrupt",
    "",
]


def odd(row):
    """Return what no table can hold, by the row."""
    return {"list": {"x": [1.0]}, "name": {"how": 1.0}, "key": {1: 1.0}, "none": None}[row["how"]]
