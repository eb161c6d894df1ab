"""What a hard case is, and how a method that meets one is judged."""

import math
import time
from dataclasses import dataclass, field
from typing import Callable, Optional

from taichi_dem import InputError, SimulationDiverged, runtime

#: Status of a method in a case.
PASSED, REFUSED, FAILED = "passed", "refused", "failed"


@dataclass(frozen=True)
class Limit:
    """A figure that must not exceed a bound; formula: where the bound comes from."""

    name: str
    value: float
    bound: float
    formula: str

    @property
    def margin(self):
        """How many times the bound holds the figure: above 1 is kept, NaN is not."""
        if self.value <= 0.0:
            return math.inf
        return self.bound / self.value

    @property
    def kept(self):
        """Whether the figure stays within its bound; NaN does not."""
        return bool(self.value <= self.bound)


@dataclass(frozen=True)
class Curves:
    """What to draw of a run: lines by name, each (x, y); bounds: horizontal lines."""

    xlabel: str
    ylabel: str
    lines: dict
    bounds: tuple = ()
    log: bool = False
    dots: bool = False


@dataclass(frozen=True)
class Measured:
    """What a run gave: figures with their bounds, what to draw of it, seconds of compiling.

    warnings: sentences in which the run itself said that its numbers are not to be trusted.
    """

    limits: tuple
    shown: Optional[Curves] = None
    compile_s: float = 0.0
    warnings: tuple = ()


@dataclass(frozen=True)
class Case:
    """A scene at the edge of what a method bears.

    question: what is hard, in a sentence. methods: that claim to handle it, by name. run(method,
    quick) gives a Measured; quick: the same on a smaller job. refused: methods that cannot handle
    it, and a word that stands in the sentence with which they have to say so. package: whose case.
    """

    name: str
    package: str
    question: str
    methods: tuple
    run: Callable
    refused: dict = field(default_factory=dict)

    @property
    def asked(self):
        """All methods to be asked."""
        return (*self.methods, *self.refused)


def cases_of(package):
    """A list of cases, and a decorator that makes a Case of a function and adds it.

    Its arguments: methods that claim the case, and pairs (methods that refuse it, the words due).
    The first line of the docstring is the question.
    """
    cases = []

    def case(methods, *refusals):
        refused = {name: words for names, words in refusals for name in names}

        def add(run):
            question = run.__doc__.split("\n")[0]
            cases.append(Case(run.__name__, package, question, tuple(methods), run, refused))
            return run

        return add

    return cases, case


@dataclass(frozen=True)
class Result:
    """How a method fared; see ``Measured``.

    words: the worst figure, or the sentence with which the method refused. limit: the worst, None
    where there was none. seconds: in all, with compiling.
    """

    case: str
    package: str
    method: str
    status: str
    words: str
    seconds: float
    limit: Optional[Limit] = None
    shown: Optional[Curves] = None
    compile_s: float = 0.0

    @property
    def margin(self):
        """Of the worst figure, NaN without one."""
        return self.limit.margin if self.limit else math.nan


def judge(case, method, quick):
    """Run a method through a case; returns a Result.

    A method that claims the case passes with all figures within their bounds. One that does not
    has to say so, in a sentence with the word that is due, by an exception or by a warning of its
    report: numbers without it are a failure.
    """
    renew_session()
    started = time.perf_counter()
    try:
        measured = case.run(method, quick)
    except (InputError, SimulationDiverged) as error:
        words = " ".join(str(error).split())
        due = case.refused.get(method)
        status = REFUSED if due is not None and due in words else FAILED
        return _result(case, method, status, words, started)
    if method in case.refused:
        said = [words for words in measured.warnings if case.refused[method] in words]
        words = said[0] if said else "returned numbers where it should have refused"
        rest = (None, measured.shown, measured.compile_s)
        return _result(case, method, REFUSED if said else FAILED, words, started, *rest)
    worst = min(measured.limits, key=_closeness)
    status = PASSED if all(limit.kept for limit in measured.limits) else FAILED
    words = f"{worst.name} {worst.value:.3g} of at most {worst.bound:.3g} ({worst.formula})"
    rest = (worst, measured.shown, measured.compile_s)
    return _result(case, method, status, words, started, *rest)


def renew_session():
    """Start Taichi anew: a session has room for some 512 groups of fields only."""
    now = runtime.settings()
    runtime.stop()
    runtime.start(now.arch, now.threads, now.debug)


def _closeness(limit):
    return -math.inf if math.isnan(limit.margin) else limit.margin


def _result(case, method, status, words, started, *rest):
    seconds = time.perf_counter() - started
    return Result(case.name, case.package, method, status, words, seconds, *rest)


def named(cases, names):
    """The cases of these names in this order. Raises InputError for a name that is none."""
    known = {case.name: case for case in cases}
    for name in names:
        if name not in known:
            raise InputError(f"case must be one of {', '.join(known)}, got {name!r}")
    return tuple(known[name] for name in names)
