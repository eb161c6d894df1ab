"""How the bars of answers are judged: by finer runs."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd

import ca_damper as ca
import taichi_dem as dem
from cases.questions import BlastQuestion, DamperQuestion
from taichi_dem.accuracy.levels import Levels
from taichi_dem.accuracy.runs import Runs
from taichi_dem.kit import study
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.checkpoint import digest, identity_of
from taichi_dem.saved_run import run_identity

#: A reference: first seed, cycles; its step is so much shorter, less so at a peak of spheres.
FIRST_SEED, TRANSIENT, MEASURED, QUARTER, PEAK_OF_SPHERES = 1001, 120, 80, 4, 2
#: Seeds of a round of it, as many as come to so many steps, between these; rounds at most, and
#: standard error by half the bar at which they end.
STEPS, FEWEST, MOST, ROUNDS, SHARP = 8_000_000, 3, 12, 3, 0.3
#: The reference has a step so many halvings below that of the answer: 16 times finer.
FINER = 4


def reference_values(question, answer):
    """Independent values whose mean is what the bar should hold, one a seed; and their step [s].

    Exact for a filling that is a mass and nothing else. Else at a finer step, with other seeds, an
    automaton's peak at half the spacing; of several motions those nearest to the answer.
    """
    filling, o, goal = question.filling, question.oscillator, question.goal
    if isinstance(filling, (ca.Empty, ca.RigidMass)):
        mass = question.particles * filling.particle_mass
        if goal.kind == "extreme":
            return np.array([o.peak(mass)[goal.unit == "m"]]), 0.0
        return np.array([float(o.rms(goal.ratios[0] * o.natural_frequency, mass))]), 0.0
    ratios, finer = answer.result.ratios, QUARTER
    if goal.kind == "extreme" and isinstance(filling, ca.Spheres):
        finer = PEAK_OF_SPHERES
    elif goal.kind == "extreme":
        step = np.diff(ratios).min() / 2.0
        ratios = np.arange(ratios[0], ratios[-1] + 0.5 * step, step)
    job = {"particles": question.particles, "ratios": ratios, "oscillator": o, "progress": None}
    job.update(dt=float(answer.result.dt.max()) / finer)
    job.update(transient_cycles=TRANSIENT, measured_cycles=MEASURED)
    steps = len(ratios) * (TRANSIENT + MEASURED) * finer
    steps *= float(answer.result.steps_per_cycle.max())
    count, values = min(MOST, max(FEWEST, round(STEPS / steps))), np.empty(0)
    for first in range(FIRST_SEED, FIRST_SEED + ROUNDS * count, count):
        found = ca.frequency_response(filling, seeds=range(first, first + count), **job)
        values = np.concatenate([values, _values_of(found, goal, answer)])
        if values.std() <= SHARP * answer.error * math.sqrt(len(values)):
            break
    return values, job["dt"]


def _values_of(found, goal, answer):
    """Values of a goal, one a seed; of several motions those of the answer's, if there are any."""
    branches = answer.branches
    if goal.kind == "extreme" and not branches:
        # Jackknife of the peak of the mean curve.
        curves = found.rms[0].T
        count, whole = len(curves), _top(found.ratios, curves.mean(axis=0), goal)
        less = [
            _top(found.ratios, np.delete(curves, k, 0).mean(axis=0), goal) for k in range(count)
        ]
        return count * whole - (count - 1) * np.array(less)
    values = goal.values(found)[:, 0]
    values = values[np.isfinite(values)]
    centres = [branch.value for branch in branches] or [answer.value]
    own = np.abs(values[:, None] - centres).argmin(axis=1) == 0
    return values[own] if own.any() else values


def _top(ratios, curve, goal):
    """Place or height of the peak of a curve, smoothed by a polynomial of 1 / RMS^2."""
    square = ratios**2
    x = (square - square.mean()) / np.ptp(square)
    fit = np.polynomial.Polynomial.fit(x, curve**-2.0, min(4, len(x) // 2 + 1))
    place = np.linspace(x[0], x[-1], 4001)
    low = fit(place)
    k = int(low.argmin())
    at_peak = math.sqrt(square.mean() + np.ptp(square) * place[k]), low[k] ** -0.5
    return at_peak[goal.unit == "m"]


def levels_of(question):
    """Steps of the runs that ``solve`` makes."""
    return Levels(question.scene, question.until, question.goal)


def asked_blast(question):
    """Answer to a question to the blast, CPU time [s], step of the truth [s], and its measure."""
    begun, given = study.clock(), {"until": question.until, "goal": question.goal}
    answer = dem.solve(question.scene, tolerance=question.tolerance, progress=None, **given)
    seconds = study.clock() - begun
    levels, level = levels_of(question), answer.plan.begin + 1 + FINER
    step = levels.method(level).dt0

    def measure():
        true = Runs(levels).value(level)
        return math.nan if true is None else true, 0.0, step

    return answer, seconds, step, measure


def asked_damper(question):
    """The same of a question to the damper: the mean of finer runs with other seeds."""
    answer = ca.solve_response(**question.arguments())

    def measure():
        true, step = reference_values(question, answer)
        count, doubt = len(true), 0.0
        if count > 1:
            doubt = t_quantile(0.95, count - 1) * float(true.std(ddof=1)) / math.sqrt(count)
        return float(true.mean()), doubt, step

    spheres_peak = isinstance(question.filling, ca.Spheres) and question.goal.kind == "extreme"
    finer = PEAK_OF_SPHERES if spheres_peak else QUARTER
    return answer, answer.plan.seconds, float(answer.result.dt.max()) / finer, measure


#: How each kind of question is asked.
ASKED = {BlastQuestion: asked_blast, DamperQuestion: asked_damper}


class References:
    """True values by battery and number, with the step of the runs that gave them.

    path: of those that are kept.
    """

    def __init__(self, path):
        self.kept = pd.read_csv(path, index_col=["battery", "number"]) if path.exists() else None
        self.used = {}

    def of(self, battery, number, question):
        """Function (step, bar, measure): true value and half-width of its own bar.

        step: of the runs at most [s]. bar: half-width of the answer, at most as wide as which that
        of the truth may be. measure: makes the runs, where none that are kept will do: true value,
        half-width, and step.
        """

        def known(step, bar, measure):
            content, found = content_of(question), None
            if self.kept is not None and (battery, number) in self.kept.index:
                row = self.kept.loc[(battery, number)]
                fine = row.step <= (1.0 + 1e-9) * step
                sharp = not row.doubt > bar
                found = row if row.content == content and fine and sharp else None
            if found is None:
                true, doubt, fine = measure()
                told = {"content": content, "question": str(question)}
                found = {**told, "step": fine, "true": true, "doubt": doubt}
            self.used[battery, number] = dict(found)
            return found["true"], found["doubt"]

        return known

    def write(self, path):
        """Write those that were asked for, and the others that are kept."""
        kept = {} if self.kept is None else self.kept.to_dict("index")
        rows = [[*key, *row.values()] for key, row in sorted({**kept, **self.used}.items())]
        study.write_rows(path, rows, "battery number content question step true doubt")


def content_of(question):
    """A word for all that a question is made of."""
    if isinstance(question, BlastQuestion):
        identity = run_identity(question.scene, levels_of(question).method(0))
        parts = [words for name, words in identity.items() if name != "version"]
        return digest([str(question), *parts])
    parts = question.filling, question.oscillator
    return digest([str(question), *map(identity_of, parts)])


def measured(step, bar, measure):
    """The truth as runs made for it give it, see ``References.of``."""
    return measure()[:2]


def judged(question, reference=measured):
    """An answer beside the truth; None where the question is refused.

    reference: as ``measured``. deviation: how far the value is off, in half-widths of the bar
    and of what is not known of the truth. single: whether both are one number.
    """
    try:
        answer, seconds, step, measure = ASKED[type(question)](question)
        true, doubt = reference(step, answer.error, measure)
    except (dem.InputError, dem.SimulationDiverged) as refused:
        return print(f"left out: {question}: {refused}")
    off, width = float(answer.value) - true, math.hypot(answer.error, doubt)
    far = off / width if width else (math.copysign(math.inf, off) if off else 0.0)
    return SimpleNamespace(
        **{"question": str(question), "cpu_s": seconds, "parts": str(answer.parts)},
        **{"value": float(answer.value), "error": float(answer.error), "true": true},
        **{"holds": int(abs(off) <= width), "reached": int(answer.reached), "deviation": far},
        **{"doubt": doubt, "answer": answer},
        single=not answer.branches and math.isfinite(width + abs(off)),
    )
