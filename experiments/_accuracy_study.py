"""How answers are judged: their price over single runs, and their bars by finer runs."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from _damper_reference import reference_values
from ca_damper import solve_response
from taichi_dem import Answer, InputError, Uniform, simulate, solve, step_report
from taichi_dem.accuracy.runs import Job, Runs
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.study.timing import clock
from taichi_dem.simulate import result_of

#: The reference has a step so many halvings below that of the answer: 16 times finer.
FINER = 4
#: Steps of the scan: the longest stable one, over 2^k; a method whose steps are longer than that by
#: more than this has no chance.
SCANNED, HOPELESS = range(6), 100
#: Times of a run; the least of them counts, as the first may compile.
REPEATS = 2


@dataclass(frozen=True)
class FixedRun:
    """A run with a fixed method and step: its words, its value of the goal, its CPU time [s]."""

    method: str
    value: float
    seconds: float


@dataclass(frozen=True)
class Judged:
    """An answer, its CPU time [s], and the true value: that of the same goal at a finer step.

    doubt: half-width at 95 % of the bar of the true value, where seeds make it a mean.
    """

    question: Any
    answer: Answer
    seconds: float
    true: float
    doubt: float = 0.0

    @property
    def deviation(self) -> float:
        """How far the value is off, in half-widths of its bar; from -1 to 1 where that holds."""
        off = float(self.answer.value) - self.true
        width = math.hypot(self.answer.error, self.doubt)
        return off / width if width else (math.copysign(math.inf, off) if off else 0.0)

    @property
    def holds(self) -> bool:
        """Whether the bar holds the true value, as well as that is known."""
        width = math.hypot(self.answer.error, self.doubt)
        return abs(float(self.answer.value) - self.true) <= width

    @property
    def single(self) -> bool:
        """Whether a single number answers the question."""
        return not self.answer.branches

    def row(self, kind: str) -> tuple:
        """Cells of a table: the question, the answer, the truth."""
        asked, answer = self.question, self.answer
        words = str(asked).replace(",", ";"), 100.0 * asked.tolerance, float(answer.value)
        found = *words, float(answer.error), self.true, int(self.holds), int(answer.reached)
        return (kind, asked.seed, *found, self.seconds)


def judged_blast(question: Any) -> Judged | None:
    """A question to the blast answered, beside the value at a step 16 times finer.

    None where one of them is refused: a bar that is crushed to rubble fills its lists.
    """
    job = _job(question)
    try:
        answer, seconds = answered(question)
        true = Runs(job, None).value(answer.plan.begin + 1 + FINER)
    except InputError as refused:
        print(f"left out: {question}: {refused}")
        return None
    return Judged(question, answer, seconds, math.nan if true is None else true)


def judged_damper(question: Any) -> Judged | None:
    """A question to the damper answered, beside the mean of finer runs with other seeds.

    None where its budget ends before there is anything to tell.
    """
    try:
        answer = solve_response(**question.arguments())
    except InputError:
        return None
    true = reference_values(question, answer)
    doubt = 0.0
    if len(true) > 1:
        doubt = t_quantile(0.95, len(true) - 1) * float(true.std(ddof=1)) / math.sqrt(len(true))
    return Judged(question, answer, answer.plan.seconds, float(true.mean()), doubt)


def answered(question: Any, repeats: int = REPEATS) -> tuple[Answer, float]:
    """Answer to a question to the blast, and its CPU time [s]."""
    spent = []
    for _ in range(repeats):
        begun = clock()
        given = {"until": question.until, "goal": question.goal, "progress": None}
        answer = solve(question.scene, tolerance=question.tolerance, **given)
        spent.append(clock() - begun)
    return answer, min(spent)


def _job(question):
    return Job(question.scene, question.until, question.goal, question.tolerance, 0.95)


def fixed_runs(question: Any, others: bool = True) -> list[FixedRun]:
    """All runs of the scan, those that diverge left out; others: methods beside the answer's."""
    found = (_fixed_run(question, words, method) for words, method in _scanned(question, others))
    return [run for run in found if run is not None]


def _scanned(question, others):
    """Methods of the scan, with their words."""
    job = _job(question)
    make, longest = type(job.method(0)), job.method(0).dt0
    found = [(job.in_words(k), make(longest / 2**k)) for k in SCANNED]
    if others and job.solves:
        report = step_report(question.scene)
        full, limited = (float(report.borne(kind).min()) for kind in ("full", "limited"))
        found += [(f"explicit, {dt:.2g} s", Uniform(dt)) for dt in (full, 0.5 * full)]
        found.append((f"limited dashpots, {limited:.2g} s", Uniform(limited, dashpot="limited")))
    return [(words, made) for words, made in found if HOPELESS * made.dt0 > longest]


def _fixed_run(question, words, method) -> FixedRun | None:
    """One run of the scan; None where it diverges, or is refused as too long a step."""
    spent, rows = [], 100 if question.goal.kind == "extreme" else 1
    looks = {"samples": rows, "frames": 1, "progress": None}
    for _ in range(REPEATS):
        begun = clock()
        try:
            result = result_of(
                simulate, question.scene, method=method, until=question.until, **looks
            )
        except InputError:
            return None
        spent.append(clock() - begun)
    if result.diverged:
        return None
    return FixedRun(words, question.goal.value(result), min(spent))


def cheapest(runs: list[FixedRun], true: float, tolerance: float) -> FixedRun | None:
    """Cheapest run that is off by a share of the true value at most; None if there is none."""
    good = [run for run in runs if abs(run.value - true) <= tolerance * abs(true)]
    return min(good, key=lambda run: run.seconds, default=None)


def twins_of(question: Any, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Runs that differ by one rounding: times [ms], mean ways [mm], and how far they are apart.

    (frames,), (count, frames) and (count - 1, frames), the last as a share of a usual way.
    """
    job = _job(question)
    runs = Runs(job, None)
    level = next(k for k in SCANNED if runs.value(k) is not None)
    frames = [runs.frames(level, twin) for twin in range(count)]
    moved = np.array([[frame.displacement for frame in some] for some in frames])
    loose = np.linalg.norm(moved[0, -1], axis=1) > np.median(np.linalg.norm(moved[0, -1], axis=1))
    moved = moved[:, :, loose]
    ways = np.linalg.norm(moved, axis=3)
    apart = np.linalg.norm(moved[1:] - moved[0], axis=3)
    share = apart.mean(axis=2) / np.maximum(ways[0].mean(axis=1), 1e-300)
    time_ms = 1e3 * np.array([frame.time_s for frame in frames[0]])
    return time_ms, 1e3 * ways.mean(axis=2), share
