"""Cases at the edge of what methods bear: each method stays within bounds or refuses in words.

A ``Case`` is a function of a ``Trial``. It runs the trial's method on a small job and gives the
trial figures with their bounds. ``assess`` tells how the method fared.
"""

import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from taichi_dem.kit.errors import InputError, SimulationDiverged


class Limit(NamedTuple):
    """A figure that must not exceed a bound; formula: where the bound comes from."""

    name: str
    value: float
    bound: float
    formula: str

    @property
    def margin(self):
        """How many times the bound holds the figure: NaN is not kept."""
        return math.inf if self.value <= 0.0 else self.bound / self.value


class Case(NamedTuple):
    """A job at the edge of what a method bears.

    package: whose case. question: what is hard, in a sentence. run(trial, *given): does it.
    methods: that claim to bear it. refused: those that cannot, with words of their sentence.
    """

    name: str
    package: str
    question: str
    run: Callable
    given: tuple
    methods: tuple
    refused: dict

    @property
    def asked(self):
        """All methods to be run."""
        return (*self.methods, *self.refused)


class Cases(list):
    """Cases of a package; as a decorator it makes some of a function."""

    def __init__(self, package):
        super().__init__()
        self.package = package

    def __call__(self, methods, /, *refusals, **family):
        """Decorate a function of a Trial; the first line of its docstring is the question.

        methods: that bear the case. refusals: pairs, methods and words of their sentence. family:
        names of several cases and the further arguments of each, which also fill the braces of the
        question; without it the case has the name of the function.
        """
        refused = {method: words for some, words in refusals for method in some}

        def decorate(run):
            for name, given in (family or {run.__name__: ()}).items():
                given = given if isinstance(given, tuple) else (given,)
                question = run.__doc__.split("\n")[0].format(*given)
                job = Case(name, self.package, question, run, given, tuple(methods), refused)
                self.append(job)
            return run

        return decorate


@dataclass(eq=False)
class Trial:
    """A method in a case: what the run gave, and how the method fared.

    quick: whether to take a smaller job. limits: figures with bounds. warnings: sentences in which
    the run itself said that its numbers are not to be trusted. words: the worst figure, or the
    sentence with which the method refused. worst: the worst figure, if any. seconds: in all;
    compile_s: part of them.
    """

    case: Case
    method: str
    quick: bool
    limits: list = field(default_factory=list)
    warnings: list = field(default_factory=list)
    compile_s: float = 0.0
    status: str = "failed"
    words: str = ""
    worst: Limit | None = None
    seconds: float = 0.0

    def limit(self, name, value, bound, formula):
        """Add a figure, or the largest of an array, and its bound."""
        self.limits.append(Limit(name, float(np.max(value)), float(bound), formula))


def assess(case, method, quick):
    """Run a method through a case; returns its Trial: passed, refused or failed.

    A method that claims the case passes with all figures within their bounds. One that does not
    has to say so in the words of ``Case.refused``, by an exception or a warning of its report: one
    that returns numbers without them fails.
    """
    trial, started, error = Trial(case, method, quick), time.perf_counter(), ""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", UserWarning)
        try:
            case.run(trial, *case.given)
        except (InputError, SimulationDiverged) as raised:
            error = " ".join(str(raised).split())
    trial.warnings += [str(one.message) for one in heard]
    if error or method in case.refused:
        wanted = case.refused.get(method)
        said = [words for words in (error, *trial.warnings) if wanted and wanted in words]
        trial.status = "refused" if said else "failed"
        trial.words = [*said, error or "returned numbers where it should have refused"][0]
    else:
        worst = trial.worst = min(trial.limits, key=lambda one: np.nan_to_num(one.margin, nan=-1.0))
        kept = all(limit.value <= limit.bound for limit in trial.limits)
        trial.status = "passed" if kept else "failed"
        figure = f"{worst.name} {worst.value:.3g} of at most {worst.bound:.3g}"
        trial.words = f"{figure} ({worst.formula})"
    trial.seconds = time.perf_counter() - started
    return trial
