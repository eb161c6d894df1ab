"""Every exception of both packages reaches another process whole: kind, text and attributes."""

import copy
import importlib
import inspect
import pickle
import pkgutil

import pytest

import ca_damper
import taichi_dem
from ca_damper.accuracy.steady_runs import BudgetSpent
from taichi_dem.kit import timeout
from taichi_dem.kit.allocation import CapacityError
from taichi_dem.kit.checkpoint import Interrupted
from taichi_dem.kit.children import Terminated
from taichi_dem.kit.errors import InputError, Portable, SimulationDiverged
from taichi_dem.kit.likely_units import UnitWarning
from taichi_dem.kit.sweeps.job import Leave


def diverged():
    """As a run raises it: with what it found until then, and its advice."""
    error = SimulationDiverged("diverged at t = 1 s")
    error.result, error.advice = {"energy": [1.0, 2.0]}, {"step": 1e-6}
    return error


#: One of each kind, as the code makes it.
MADE = (
    diverged(),
    SimulationDiverged("no step is stable"),
    ca_damper.SimulationDiverged(
        "the scene diverged", scene={"seed": 3}, step=7, time_s=0.1, dt=1e-3, dt_allowed=1e-4
    ),
    InputError("seed must be a whole number, got 0.5"),
    CapacityError("this needs 9 GB of memory"),
    Interrupted(1e-3, "run.npz", 15),
    BudgetSpent(12.5),
    timeout._Ended(),
    Leave(),
    Terminated(15),
    Portable("words"),
    UnitWarning("peak is read in Pa, got 575: likely MPa is meant"),
)
WAYS = {
    **{f"pickle {k}": lambda error, k=k: pickle.loads(pickle.dumps(error, k)) for k in range(6)},
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


def exceptions_of(package):
    """Classes of exceptions that the modules of a package define, warnings among them."""
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not found.name.endswith("__main__"):
            for kind in vars(importlib.import_module(found.name)).values():
                if inspect.isclass(kind) and issubclass(kind, BaseException):
                    if kind.__module__.startswith(f"{package.__name__}."):
                        yield kind


def test_every_kind_is_tried():
    kinds = {kind for package in (taichi_dem, ca_damper) for kind in exceptions_of(package)}
    assert kinds == set(map(type, MADE))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("error", MADE, ids=lambda error: f"{type(error).__qualname__}: {error}")
def test_an_exception_survives(error, way):
    again = WAYS[way](error)
    assert type(again) is type(error) and again.args == error.args and str(again) == str(error)
    assert vars(again) == vars(error)
    assert dict(getattr(again, "advice", {})) == dict(getattr(error, "advice", {}))


def test_one_with_an_init_of_its_own_survives_too():
    class Named(InputError):
        def __init__(self, name, *, value):
            super().__init__(f"{name} must be 1, got {value}")
            self.value = value

    again = copy.deepcopy(Named("x", value=2))
    assert (str(again), again.value) == ("x must be 1, got 2", 2)
