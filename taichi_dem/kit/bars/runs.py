"""What a search asks of runs: the contract that each package fulfils."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.bars.budget import Source, named_sources
from taichi_dem.kit.validation import SMALLEST, between, positive

#: Seeds at most.
_MANY = 96


@dataclass(frozen=True)
class Question:
    """Goals to a tolerance, which share their runs. sources: of error, which are measured."""

    goals: tuple[Any, ...]
    tolerance: float = 0.01
    confidence: float = 0.95
    budget_s: float = math.inf
    sources: tuple[str, ...] = ("step",)


def checked_question(
    goals: tuple[Any, ...],
    known: Sequence[str],
    *,
    tolerance: float,
    confidence: float,
    budget_s: float | None,
    sources: Iterable[str],
) -> Question:
    """A question as a user gives it; known: sources of error that can be measured."""
    return Question(
        goals,
        between("tolerance", tolerance, SMALLEST, 1.0),
        between("confidence", confidence, SMALLEST, math.nextafter(1.0, 0.0)),
        math.inf if budget_s is None else positive("budget_s", budget_s),
        named_sources(sources, known),
    )


class BudgetSpent(Exception):
    """The next runs would exceed the budget. needed: time of all runs with them [s]."""

    def __init__(self, needed: float):
        super().__init__(needed)
        self.needed = needed


class BaseRuns(ABC):
    """Runs of a question by level of the step, which is halved from one to the next, and by seed.

    seconds, count: CPU time of all so far [s], and their number. cost: of one run, by level [s].
    failure: why the last one that diverged did. averaged: whether the mean over seeds is asked for.
    divides: whether seeds with a few outcomes get an answer each. seeds, few: at first, and by
    which chance is judged at least. order: of the error of smooth runs.
    """

    seconds, count, failure, order = 0.0, 0, "", 1.0
    averaged, divides, seeds, few = False, True, 1, 6
    #: What a run that differs by chance is, and does where there are several outcomes.
    run, ends = "run", "that differ by chance had {} outcomes"

    def __init__(self) -> None:
        self.cost: dict[float, float] = {}

    @abstractmethod
    def sample(self, goal: Any, level: float, count: int) -> np.ndarray:
        """Values of so many seeds at a level, (seeds that did not diverge, places)."""

    @abstractmethod
    def step(self, level: float) -> float:
        """Step at a level [s]."""

    @abstractmethod
    def nearby(self, level: float) -> float:
        """Level at which a smooth run is made again, with little more steps than at a level."""

    @abstractmethod
    def eventful(self, level: float) -> bool:
        """Whether chance may decide anything at a level."""

    @abstractmethod
    def in_words(self, level: float, count: int) -> str:
        """Method and step."""

    @abstractmethod
    def result(self, goal: Any, level: float, count: int) -> Any:
        """Result of so many seeds at a level."""

    def names(self, count: int) -> Sequence[int]:
        """So many seeds."""
        return range(count)

    def more(self, count: int) -> int | None:
        """Seeds that narrow a bar by chance, beyond so many; None where none do."""
        return min(_MANY, 2 * count) if count < _MANY else None

    def is_smooth(self, goal: Any) -> bool:
        """Whether a goal changes smoothly where chance decides nothing."""
        return goal.kind == "value"

    def least(self, goal: Any, coarse: float, fine: float) -> float:
        """Change between two levels, as a share, below which values may agree by luck."""
        return 0.0

    def is_whole(self, goal: Any, level: float) -> bool:
        """Whether a goal is a whole number that a finer run may change by one."""
        return False

    def rounding(self, goal: Any) -> float:
        """Error of the machine of a goal that is truly zero."""
        return 0.0

    def is_calm(self, coarse: float, fine: float, tolerance: float) -> bool:
        """Whether two levels agree so well that chance cannot have decided anything."""
        return False

    def solver(self, goal: Any, level: float) -> float | None:
        """Error of sweeps that end early; None where there are none."""
        return None

    def sampling(self, goal: Any, level: float, count: int) -> Any:
        """Half-width by what is left of a start, and by frequencies around a peak."""
        return 0.0

    def resolve(self, goal: Any) -> bool:
        """Narrow the bar by sampling; whether that is possible."""
        return False

    def beside(self, level: float, last: float, affords: Any) -> Iterable[Source]:
        """Sources of error that no shorter step reduces, measured at a level."""
        return ()

    def doubts(self, goal: Any, levels: Sequence[float], bar: Any, affords: Any) -> Iterable[str]:
        """Reasons to doubt the runs at levels."""
        return ()

    def state(self) -> dict[str, Any]:
        """What has to be set back where the budget ends the next round."""
        return {}

    def parting(self, level: float, tolerance: float) -> float:
        """Time from which on runs that differ by one rounding separate [s]; infinite for never."""
        return math.inf

    @abstractmethod
    def release(self) -> None:
        """Give back what other questions can use."""
