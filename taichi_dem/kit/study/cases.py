"""Cases at the edge of what methods bear: each method stays within bounds or refuses in words.

A ``Case`` is a function of a ``Trial``. It runs the trial's method on a small job and gives the
trial figures with their bounds, and a curve to draw. ``assess`` tells how the method fared.
"""

import difflib
import math
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from taichi_dem.kit.display import in_brief
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.validation import shown

#: Status of a method in a case.
PASSED, REFUSED, FAILED = "passed", "refused", "failed"
#: Names of cases that the refusal of another one gives.
_NAMED = 6


class Limit(NamedTuple):
    """A figure that must not exceed a bound; formula: where the bound comes from."""

    name: str
    value: float
    bound: float
    formula: str

    @property
    def margin(self) -> float:
        """How many times the bound holds the figure: NaN is not kept."""
        return math.inf if self.value <= 0.0 else self.bound / self.value

    @property
    def is_kept(self) -> bool:
        """Whether the figure stays within its bound; NaN does not."""
        return self.value <= self.bound


class Curve(NamedTuple):
    """Lines of one run to draw over x; dots: as markers alone."""

    xlabel: str
    x: Any
    ylabel: str
    lines: Sequence
    dots: bool = False


@dataclass(frozen=True, eq=False)
class Case:
    """A job at the edge of what a method bears.

    package: whose case. question: what is hard, in a sentence. run(trial): does it. methods: that
    claim to bear it, by name. refused: those that cannot, and words of the sentence that says so.
    """

    name: str
    package: str
    question: str
    run: Callable[["Trial"], None]
    methods: tuple[str, ...] = ()
    refused: dict[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return in_brief(self, self.name, self.package)

    @property
    def asked(self) -> tuple[str, ...]:
        """All methods to be run."""
        return (*self.methods, *self.refused)


class Cases(list):
    """Cases of a package; as a decorator it makes one of a function, see ``__call__``."""

    def __init__(self, package: str):
        super().__init__()
        self.package = package

    def add(
        self,
        name: str,
        question: str,
        run: Callable[["Trial"], None],
        methods: Iterable[str],
        *refusals: tuple[Iterable[str], str],
    ) -> None:
        """Add a Case; refusals: pairs (methods that refuse it, words of their sentence)."""
        refused = {name: words for names, words in refusals for name in names}
        self.append(Case(name, self.package, question, run, tuple(methods), refused))

    def __call__(self, methods: Iterable[str], *refusals: tuple[Iterable[str], str]) -> Callable:
        """Decorate a function as a case; the first line of its docstring is the question.

        methods, refusals: as in ``add``.
        """

        def decorate(run):
            self.add(run.__name__, run.__doc__.split("\n")[0], run, methods, *refusals)
            return run

        return decorate


@dataclass(eq=False)
class Trial:
    """A method in a case: what the run gave, and how the method fared.

    quick: whether to take a smaller job. limits, curve: figures, and what to draw of the run.
    warnings: sentences in which the run itself said that its numbers are not to be trusted.
    words: the worst figure, or the sentence with which the method refused. worst: the worst figure,
    None where there was none. seconds: in all; compile_s: part of them.
    """

    case: Case
    method: str
    quick: bool
    limits: list[Limit] = field(default_factory=list)
    curve: Curve | None = None
    warnings: list[str] = field(default_factory=list)
    compile_s: float = 0.0
    status: str = FAILED
    words: str = ""
    worst: Limit | None = None
    seconds: float = 0.0

    def __repr__(self) -> str:
        return in_brief(self, self.case.name, self.method, self.status)

    def limit(self, name: str, value: Any, bound: float, formula: str) -> None:
        """Add a figure, or the largest of an array, and its bound."""
        self.limits.append(Limit(name, float(np.max(value)), float(bound), formula))

    def draw(self, xlabel: str, x: Any, ylabel: str, *lines: Any, dots: bool = False) -> None:
        """Keep lines over x to draw."""
        self.curve = Curve(xlabel, x, ylabel, lines, dots)

    @property
    def margin(self) -> float:
        """Of the worst figure, NaN without one."""
        return self.worst.margin if self.worst else math.nan


def assess(case: Case, method: str, quick: bool) -> Trial:
    """Run a method through a case; returns its Trial.

    A method that claims the case passes with all figures within their bounds. One that does not
    has to say so in the words of ``Case.refused``, by an exception or a warning of its report: one
    that returns numbers without them fails.
    """
    trial, started, error = Trial(case, method, quick), time.perf_counter(), ""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", UserWarning)
        try:
            case.run(trial)
        except (InputError, SimulationDiverged) as raised:
            error = " ".join(str(raised).split())
    trial.warnings += [str(one.message) for one in heard]
    if error or method in case.refused:
        wanted = case.refused.get(method)
        said = [words for words in (error, *trial.warnings) if wanted and wanted in words]
        trial.status = REFUSED if said else FAILED
        trial.words = [*said, error or "returned numbers where it should have refused"][0]
    else:
        worst = trial.worst = min(trial.limits, key=_closeness)
        trial.status = PASSED if all(limit.is_kept for limit in trial.limits) else FAILED
        value, bound = f"{worst.value:.3g}", f"{worst.bound:.3g}"
        trial.words = f"{worst.name} {value} of at most {bound} ({worst.formula})"
    trial.seconds = time.perf_counter() - started
    return trial


def _closeness(limit):
    return -math.inf if math.isnan(limit.margin) else limit.margin


def cases_named(cases: Iterable[Case], names: Iterable[str]) -> list[Case]:
    """The cases of these names in this order. Raises InputError for a name that is none."""
    known = {case.name: case for case in cases}
    return [known[_checked(name, known)] for name in names]


def _checked(name, known):
    """The name; a wrong one is answered with those that are like it, not with all."""
    if name in known:
        return name
    alike = difflib.get_close_matches(str(name), known, _NAMED, 0.0)
    raise InputError(
        f"case must be one of {len(known)} names, such as {', '.join(alike)}, got {shown(name)}"
    )
