"""Goals: outputs of a damper for ``solve_response``, which finds them to a tolerance.

A user-defined goal gets a Response of one particle number and returns a value or row a seed:

    largest_swing = Goal("largest swing", "m", lambda found: found.amplitude[0].max(0), "extreme")
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ca_damper.runs.response import Response
from taichi_dem.kit.bars.answer import BaseGoal
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import instance, positive, several, shown


@dataclass(frozen=True)
class Goal(BaseGoal):
    """Output of a damper that can be asked for with a tolerance.

    Parameters
    ----------
    name : str
        Name of the output.
    unit : str
        Unit of the output, ``"1"`` for none.
    function : callable
        Function of a Response of one particle number; returns (seeds,) or (seeds, places).
    kind : str, default "value"
        ``"value"``, ``"extreme"`` (at the peak) or ``"curve"`` (at each frequency).
    ratios : tuple of float, default ()
        Frequency ratios f/f0 [-] that the goal needs; none for an ``"extreme"``.
    """

    kinds: ClassVar[tuple[str, ...]] = ("value", "extreme", "curve")
    given: ClassVar[str] = "Response"

    ratios: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind == "extreme":
            if self.ratios:
                raise InputError(
                    "ratios of a goal must be left out of an 'extreme', whose frequencies are "
                    f"found, got {shown(self.ratios)}"
                )
            return
        ratios = several("ratios of a goal", self.ratios, positive)
        if any(a >= b for a, b in itertools.pairwise(ratios)):
            raise InputError(f"ratios of a goal must ascend, got {shown(self.ratios)}")
        object.__setattr__(self, "ratios", ratios)

    def values(self, response: Response) -> np.ndarray:
        """Values of a Response, shape (seeds, places).

        Parameters
        ----------
        response : Response
            Response of one particle number.
        """
        instance("response", response, Response)
        values = np.asarray(self.function(response), dtype=np.float64)
        if values.ndim not in (1, 2) or len(values) != len(response.seeds) or values.size == 0:
            raise InputError(
                f"function of the goal {self.name!r} must return one value or one row for each of "
                f"{counted(len(response.seeds), 'seed')}, got shape {values.shape}"
            )
        return values.reshape(len(values), -1)


def peak_ratio() -> Goal:
    """Frequency ratio f/f0 [-] at which the RMS displacement peaks."""
    return Goal("peak ratio", "1", lambda response: response.peaks()[0][0], "extreme")


def peak_rms() -> Goal:
    """Height of the peak of the RMS displacement [m]."""
    return Goal("peak RMS", "m", lambda response: response.peaks()[1][0], "extreme")


def rms_at(ratio: float) -> Goal:
    """RMS displacement [m] at a frequency ratio.

    Parameters
    ----------
    ratio : float
        Frequency ratio f/f0.
    """
    return _measure_at("RMS", "m", "rms", ratio)


def loss_factor_at(ratio: float) -> Goal:
    """Loss factor [-] at a frequency ratio.

    Parameters
    ----------
    ratio : float
        Frequency ratio f/f0.
    """
    return _measure_at("loss factor", "1", "loss_factor", ratio)


def apparent_mass_at(ratio: float) -> Goal:
    """Apparent mass [kg] of the filling at a frequency ratio.

    Parameters
    ----------
    ratio : float
        Frequency ratio f/f0.
    """
    return _measure_at("apparent mass", "kg", "apparent_mass", ratio)


def response_curve(ratios: Sequence[float] | np.ndarray) -> Goal:
    """RMS displacement [m] at each of some frequency ratios.

    Parameters
    ----------
    ratios : sequence of float or ndarray
        Ascending frequency ratios f/f0.
    """
    given = several("ratios", ratios, positive)
    return Goal("response curve", "m", lambda response: response.rms[0].T, "curve", given)


def _measure_at(name, unit, measure, ratio):
    """Goal of a measure of a Response at one frequency ratio."""
    place = positive("ratio", ratio)

    def found(response):
        return getattr(response, measure)[0, 0]

    return Goal(f"{name} at {place:g}", unit, found, "value", (place,))
