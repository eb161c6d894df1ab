"""An answer to a question that was asked with a tolerance: value, error bar, and its price."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import reduce
from typing import Any

import numpy as np

from taichi_dem.kit.display import by_fields, counted, in_brief

#: Digits that a number has, and unit of the last of them below which it is written with a power of
#: ten.
_MOST_DIGITS, _LEAST_UNIT = 17, 1e-15
#: Least power of ten that is a number.
_LEAST_POWER = -323
#: A number, or one for each place of a curve.
Values = float | np.ndarray


@dataclass(frozen=True)
class ErrorParts:
    """Half-widths of an error bar by source, in the unit of the value.

    Sources are independent: their squares add.

    Parameters
    ----------
    step : float or ndarray, default 0.0
        Error of the time step, in the unit of the value, as all.
    solver : float or ndarray, default 0.0
        Error of sweeps that end early, in the unit of the value.
    chance : float or ndarray, default 0.0
        Spread of runs that differ by one rounding or by their seeds, in the unit of the value.
    sampling : float or ndarray, default 0.0
        Error of the time over which a mean was taken, in the unit of the value.
    """

    step: Values = 0.0
    solver: Values = 0.0
    chance: Values = 0.0
    sampling: Values = 0.0

    @property
    def total(self) -> Values:
        """Half-width of the whole bar, in the unit of the value."""
        return _total([getattr(self, part.name) for part in fields(self)])

    def __repr__(self):
        return by_fields(self)

    def __str__(self):
        found = {part.name: largest(getattr(self, part.name)) for part in fields(self)}
        unit = 10.0 ** (_places(max(found.values())) if any(found.values()) else 0)
        shown = (f"{name} {rounded(value, unit)}" for name, value in found.items() if value > 0.0)
        return ", ".join(shown) or "no error found"


@dataclass(frozen=True)
class Expense:
    """Cost of one tolerance.

    Parameters
    ----------
    tolerance : float
        Half-width of the bar as a share of the value.
    seconds : float
        CPU time [s].
    measured : bool
        Whether it was spent, or is predicted from runs.
    """

    tolerance: float
    seconds: float
    measured: bool

    def __str__(self):
        how = "measured" if self.measured else "predicted"
        return f"{100.0 * self.tolerance:g} %: {self.seconds:.2g} s {how}"


@dataclass(frozen=True)
class Plan:
    """How an answer was found, and what it cost.

    Parameters
    ----------
    method : str
        Method in words, with its step.
    runs : int
        Number of runs of all kinds.
    pilot_s : float
        CPU time of the runs that chose the method and step [s].
    final_s : float
        CPU time of the runs that gave the answer [s].
    begin : int, default 0
        Level of the step at which a question of a similar scene may begin.
    parting_s : float, default math.inf
        Simulated time from which runs that differ by one rounding differ by more than was allowed
        [s]; infinite if never.
    """

    method: str
    runs: int
    pilot_s: float
    final_s: float
    begin: int = 0
    parting_s: float = math.inf

    @property
    def seconds(self) -> float:
        """CPU time of all runs [s]."""
        return self.pilot_s + self.final_s

    def __str__(self):
        words = f"{self.method}; {self.seconds:.2g} s, of which pilot {self.pilot_s:.2g} s"
        if math.isinf(self.parting_s):
            return words
        return f"{words}; runs that differ by one rounding part from {self.parting_s:.2g} s"


@dataclass(frozen=True, eq=False)
class Answer:
    """Value of a goal with its error bar.

    Parameters
    ----------
    goal : str
        Name of the goal.
    unit : str
        Unit of the value, ``"1"`` for none.
    value : float or ndarray
        A number, or one for each place of a curve, in the unit of the goal.
    parts : ErrorParts
        Half-widths of the error bar by source.
    tolerance : float
        Largest error that was allowed, as a share of the value.
    confidence : float
        Probability [-] with which the bar holds the true value.
    plan : Plan
        How the answer was found, and what it cost.
    result : object, optional
        Result of the finest run.
    cost_curve : sequence of Expense, optional
        What other tolerances would cost.
    shortfall : str, default ""
        Why the answer is not what was asked for, and what would help: the error is larger, or the
        run itself is in doubt. ``""`` where it is neither.

    Examples
    --------
    >>> answer = solve(scene, until=1e-4, goal=goals.hole_displacement())  # doctest: +SKIP
    >>> answer.value, answer.error, answer.reached  # doctest: +SKIP
    """

    goal: str
    unit: str
    value: Values
    parts: ErrorParts
    tolerance: float
    confidence: float
    plan: Plan
    result: Any = None
    cost_curve: Sequence[Expense] = field(default_factory=tuple)
    shortfall: str = ""

    @property
    def error(self) -> Values:
        """Half-width of the error bar, in the unit of the value."""
        return self.parts.total

    @property
    def certificate(self) -> Any:
        """Certificate of the finest run, of a scene with effects="auto"; else None."""
        return getattr(self.result, "certificate", None)

    @property
    def share(self) -> float:
        """Largest half-width as a share of the largest value; infinite where that is zero."""
        size = largest(self.value)
        error = largest(self.error)
        return error / size if size else math.inf if error else 0.0

    @property
    def reached(self) -> bool:
        """Whether the bar is as narrow as asked, and no run is in doubt."""
        return not self.shortfall

    def __repr__(self):
        return in_brief(self, self.goal, self._bar(), self.shortfall)

    def __str__(self):
        lines = [f"{self._bar()} ({self.parts}); {self.plan}", self.shortfall]
        lines += [f"warning: {need}" for need in self._needs()]
        return "\n".join(filter(None, lines))

    def _needs(self):
        """What the report of the finest run warns of; a Response has none."""
        return getattr(getattr(self.result, "report", None), "needs", ())

    def _bar(self):
        if isinstance(self.value, np.ndarray):
            count = counted(self.value.size, "value")
            return f"{count}, each to {largest(self.error):.2g} {self.unit}"
        size = largest(self.error)
        unit = 10.0 ** _places(size) if size else 0.0
        ends = f" {self.unit}" if self.unit != "1" else ""
        return f"{rounded(self.value, unit)} +- {rounded(size, unit)}{ends}"


def doubted(answer: Answer, *reasons: str) -> Answer:
    """The answer, which is not reached where there are reasons to doubt its run."""
    return replace(answer, shortfall="; ".join(filter(None, (answer.shortfall, *reasons))))


def _total(parts):
    """Root of the sum of squares, of numbers of any size."""
    # Not math.hypot, which gives NaN close to the largest number.
    with np.errstate(over="ignore"):
        total = reduce(np.hypot, parts)
    return total if isinstance(total, np.ndarray) else float(total)


def largest(values: Values) -> float:
    """Largest magnitude of a value or a curve."""
    return float(np.abs(values).max(initial=0.0))


def rounded(value: float, unit: float) -> str:
    """A number to a power of ten that its error leaves certain; to six digits for unit 0."""
    if unit == 0.0 or not math.isfinite(value):
        return f"{value:.6g}"
    if 0.0 < abs(value) < 1e-4 or not _LEAST_UNIT <= unit < 1e5:
        digits = math.floor(math.log10(abs(value)) - math.log10(unit)) + 1 if value else 1
        return f"{value:.{min(_MOST_DIGITS, max(1, digits))}g}"
    return f"{value:.{max(0, round(-math.log10(unit)))}f}"


def _places(error):
    """Power of ten of the second digit of an error, of the first where that is at least 3."""
    if not math.isfinite(error):
        return -math.inf
    power = max(_LEAST_POWER, math.floor(math.log10(error)))
    return power if error / 10.0**power >= 3.0 else power - 1
