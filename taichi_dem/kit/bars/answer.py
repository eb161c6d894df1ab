"""Question with a tolerance, and its answer: value, error bar and cost."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import reduce
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from taichi_dem.kit.bars.budget import Source, table
from taichi_dem.kit.bars.chance import mean_and_deviation, share_error, t_quantile
from taichi_dem.kit.display import Worded, by_fields, counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, shown, word

if TYPE_CHECKING:
    import pandas as pd

#: A number, or one for each place of a curve.
Values = float | np.ndarray


@dataclass(frozen=True)
class BaseGoal:
    """Name, unit, function and kind of an output."""

    kinds: ClassVar[tuple[str, ...]]
    given: ClassVar[str]

    name: str
    unit: str
    function: Callable[[Any], Any] = field(repr=False)
    kind: str = "value"

    def __post_init__(self) -> None:
        word("name of a goal", self.name)
        word("unit of a goal", self.unit)
        choice("kind of a goal", self.kind, self.kinds)
        if not callable(self.function):
            raise InputError(
                f"function of a goal must be a function of a {self.given}, "
                f"got {shown(self.function)}"
            )


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
        Spread of runs that differ by chance (ends of steps, seeds), in the unit of the value.
    sampling : float or ndarray, default 0.0
        Error of the time over which a mean was taken, in the unit of the value.
    contact : float, default 0.0
        Error of the resolution of the contact law, in the unit of the value, where it was measured.
    mesh : float, default 0.0
        Spread over meshes of one size, in the unit of the value, where it was measured.
    filling : float or ndarray, default 0.0
        Distance from grains of the other kind, in the unit of the value, where it was measured.
    """

    step: Values = 0.0
    solver: Values = 0.0
    chance: Values = 0.0
    sampling: Values = 0.0
    contact: Values = 0.0
    mesh: Values = 0.0
    filling: Values = 0.0

    @property
    def total(self) -> Values:
        """Half-width of the whole bar, in the unit of the value."""
        total = reduce(np.hypot, (getattr(self, part.name) for part in fields(self)))
        return total if isinstance(total, np.ndarray) else float(total)

    __repr__ = by_fields

    def __str__(self):
        sizes = {part.name: largest(getattr(self, part.name)) for part in fields(self)}
        words = (f"{name} {value:.2g}" for name, value in sizes.items() if value > 0.0)
        return ", ".join(words) or "no error found"


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
        Whether it was spent; else it is predicted from runs.
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
        Where a similar question of ``taichi_dem.solve`` may start: a level of the step.
    parting_s : float, default math.inf
        Time from which one rounding makes a difference above the tolerance [s]; infinite if never.
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
        parting = f"runs that differ by one rounding part after {self.parting_s:.2g} s"
        return words if math.isinf(self.parting_s) else f"{words}; {parting}"


@dataclass(frozen=True)
class Branch:
    """One of several outcomes of a question.

    Parameters
    ----------
    value : float
        Mean over its runs, in the unit of the goal.
    error : float
        Half-width of the bar of the mean, in the unit of the goal.
    share : float
        Share of all runs with this outcome.
    share_error : float
        Half-width of the bar of that share.
    seeds : tuple of int
        Seeds of its runs.
    """

    value: float
    error: float
    share: float
    share_error: float
    seeds: tuple[int, ...]

    def in_words(self, unit: str, runs: str) -> str:
        """Value, bar and share in words; runs: what a seed stands for, in the plural."""
        share = f"{100.0 * self.share:.0f} +- {100.0 * self.share_error:.0f} %"
        return f"{_in_words(self.value, self.error, unit)} for {share} of the {runs}"


@dataclass(frozen=True, eq=False, repr=False)
class Answer(Worded):
    """Value of a goal with its error bar.

    Parameters
    ----------
    goal : str
        Name of the goal.
    unit : str
        Unit of the value, ``"1"`` for none.
    value : float or ndarray
        A number, or one for each place of a curve; that of the most frequent branch.
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
        Why the answer falls short, and what would help; ``""`` if it does not.
    branches : tuple of Branch, default ()
        Outcomes of the runs of a question without a single answer, the most frequent first.
    sources : tuple of Source, default ()
        Sources of error by name, measured or not, with the cost of each measure.

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
    cost_curve: Sequence[Expense] = ()
    shortfall: str = ""
    branches: tuple[Branch, ...] = ()
    sources: tuple[Source, ...] = ()

    @property
    def budget(self) -> "pd.DataFrame":
        """Sources of error as rows: error, whether the bar has it, how, CPU seconds [s]."""
        return table(self.sources)

    @property
    def error(self) -> Values:
        """Half-width of the error bar, in the unit of the value."""
        return self.parts.total

    @property
    def larger(self) -> tuple[Source, ...]:
        """Sources that are not in the bar and commonly larger than it."""
        outside = (source for source in self.sources if not source.measured)
        return tuple(source for source in outside if source.common > largest(self.error))

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

    def __str__(self):
        lines = [f"{self._bar()} ({self.parts}{self._unmeasured()}); {self.plan}"]
        lines += [source.in_words(self.unit) for source in self.sources] + [self.shortfall]
        # What the report of the finest run warns of; a Response has none.
        needs = getattr(getattr(self.result, "report", None), "needs", ())
        return "\n".join(filter(None, [*lines, *(f"warning: {need}" for need in needs)]))

    __repr__ = __str__

    def _unmeasured(self):
        names = [source.name for source in self.sources if not source.measured]
        lines = [f"; not in the bar: {', '.join(names)}"] if names else []
        for source in self.larger:
            share = share_in_words(source.common, self.value, self.unit)
            lines.append(f"; the {source.name} is commonly {share}, more than this bar")
        return "".join(lines)

    def _bar(self):
        if isinstance(self.value, np.ndarray):
            count = counted(self.value.size, "value")
            return f"{count}, each to {largest(self.error):.2g} {self.unit}"
        return _in_words(self.value, self.error, self.unit)


def _in_words(value, error, unit):
    """A number with its bar and unit."""
    return f"{value:.6g} +- {error:.2g}{f' {unit}' if unit != '1' else ''}"


def doubted(answer: Answer, *reasons: str) -> Answer:
    """The answer; it is not reached if there are reasons to doubt its run."""
    return replace(answer, shortfall="; ".join(filter(None, (answer.shortfall, *reasons))))


def with_source(answer: Answer, source: Source) -> Answer:
    """The answer with a source of error that no step reduces."""
    wider = replace(answer, sources=(*answer.sources, source))
    if not source.measured or not np.any(source.error):
        return wider
    wider = replace(wider, parts=replace(answer.parts, **{source.name: source.error}))
    if largest(wider.error) <= wider.tolerance * largest(wider.value):
        return wider
    prefix = "" if wider.shortfall else f"{100.0 * wider.tolerance:g} % was not reached: "
    moves = f"the {source.name} moves it by {share_in_words(source.error, wider.value, wider.unit)}"
    if largest(source.error) > wider.tolerance * largest(wider.value):
        return doubted(wider, f"{prefix}{moves}, which no shorter step reduces")
    if largest(answer.error) > wider.tolerance * largest(wider.value):
        return wider
    whole = share_in_words(wider.error, wider.value, wider.unit)
    return doubted(wider, f"{prefix}{moves}, with the rest the bar is {whole}")


def share_in_words(error: Values, value: Values, unit: str) -> str:
    """A half-width as a share of its value, of a value of zero in its unit."""
    size, half = largest(value), largest(error)
    return f"{100.0 * half / size:.2g} %" if size else f"{half:.2g} {unit} about zero"


def branched(
    answer: Answer, branches: tuple[Branch, ...], step: Values, run: str, ends: str
) -> Answer:
    """The answer of a question with several outcomes: that of the most frequent."""
    total = counted(sum(len(branch.seeds) for branch in branches), run)
    each = "; ".join(branch.in_words(answer.unit, f"{run}s") for branch in branches)
    words = f"no single number: {total} {ends.format(len(branches))}: {each}"
    first = branches[0]
    parts = replace(answer.parts, step=step, chance=first.error, sampling=0.0)
    errors = {"step": np.hypot(step, parts.solver), "chance": first.error, "sampling": 0.0}
    sources = tuple(
        replace(source, error=errors.get(source.name, source.error)) for source in answer.sources
    )
    kept = replace(answer, value=first.value, parts=parts, sources=sources)
    return replace(kept, shortfall=words, branches=branches)


def branches_of(
    values: np.ndarray, clusters: Sequence[np.ndarray], seeds: Sequence[int], half: float
) -> tuple[Branch, ...]:
    """Branches of clusters of values; half: half-width of the bar of one value."""
    return tuple(_branch(values[part], part, seeds, half) for part in clusters)


def _branch(values, part, seeds, half):
    count = len(part)
    half = half / math.sqrt(count)
    mean, deviation = mean_and_deviation(values)
    if count > 1:
        half = max(half, t_quantile(0.95, count - 1) * deviation / math.sqrt(count))
    named = tuple(seeds[k] for k in sorted(part.tolist()))
    return Branch(mean, half, count / len(seeds), share_error(count, len(seeds)), named)


def largest(values: Values) -> float:
    """Largest magnitude of a value or a curve."""
    return float(np.abs(values).max(initial=0.0))
