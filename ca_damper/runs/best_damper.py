"""Search for the box of grains that lets a structure swing least under a given motion."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ca_damper.automaton import Automaton
from ca_damper.excitation.excitation import Excitation, excitation_of
from ca_damper.excitation.signal import Signal
from ca_damper.fixed_mass import RigidMass
from ca_damper.oscillator import Oscillator
from ca_damper.report.progress import OpenEnded
from ca_damper.runs.grains import DENSITY, Grains, boxes_of, pair_of
from ca_damper.runs.settled import SteadyPeak
from ca_damper.runs.shake import shake
from ca_damper.scenes.clock import automatic_dt
from ca_damper.scenes.gravity import gravity_along
from ca_damper.spheres import Spheres
from taichi_dem.kit.bars.chance import mean_and_deviation, t_quantile
from taichi_dem.kit.data_table import Tabulated
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import (
    between,
    choice,
    instance,
    is_real,
    positive,
    several,
    told_apart,
    whole,
)

#: Numbers of grains that are tried.
NUMBERS = (5, 10, 20, 30, 50)
#: Frequencies f/f0 to begin with: from this far below the peak with fixed grains to above that of
#: the empty container.
_BELOW, _ABOVE = 0.03, 1.02
#: Boxes that the first look leaves, and its share of the cycles.
_LEFT, _BRIEF = 4, 0.4
#: Steps of the automaton in the longest one it bears. Its peaks of 30 grains are then 0.14 % off.
_STEPS = 6.0
_CONFIDENCE = 0.95
#: Fillings whose grains and box can be replaced.
_KINDS = (Automaton, Spheres)


@dataclass(frozen=True)
class Value:
    """Mean over seeds and half-width of its bar of 95 % [m], infinite of one seed."""

    mean: float
    error: float

    @classmethod
    def of(cls, values: np.ndarray, beside: float = 0.0) -> "Value":
        """Of a value a seed, and a half-width beside chance."""
        count = len(values)
        mean, deviation = mean_and_deviation(values)
        half = t_quantile(_CONFIDENCE, count - 1) * deviation / math.sqrt(count)
        return cls(mean, math.hypot(half, beside) if count > 1 else math.inf)

    def __str__(self) -> str:
        return f"{1e3 * self.mean:.3g} +- {1e3 * self.error:.2g} mm"


@dataclass(frozen=True, eq=False)
class BestDamper(Tabulated):
    """The best box that was found; as a table, all boxes of the first look.

    Parameters
    ----------
    grains : Grains
        Number, mass and diameter of the grains, and their box.
    value : Value
        Peak or RMS that was asked for [m], by the filling that searched.
    confirmed : Value or None
        The same by the filling that confirms.
    without, fixed : float
        The same with no grains, and with the grains fixed [m].
    acceleration_ratio : float
        Largest downward acceleration with the grains fixed over gravity; below 1 they lie still.
    equals : tuple of (Grains, Value)
        Boxes whose bars overlap that of the best: chance does not tell them apart.
    errors : dict of str to Value
        The value after errors of manufacture, by the filling that confirms.
    tried : tuple of (Grains, float)
        Boxes of the first look and their values [m].
    search_seconds : float
        CPU time of the search and its bar [s], compiling included.
    """

    grains: Grains
    value: Value
    confirmed: Value | None
    without: float
    fixed: float
    acceleration_ratio: float
    equals: tuple[tuple[Grains, Value], ...]
    errors: dict[str, Value]
    tried: tuple[tuple[Grains, float], ...]
    search_seconds: float

    def __str__(self) -> str:
        without, fixed = (f"{1e3 * one:.3g} mm" for one in (self.without, self.fixed))
        words = [f"without grains {without}, with fixed ones {fixed}, with free ones {self.value}"]
        words += [self.why, str(self.grains)]
        if self.confirmed is not None:
            words.append(f"confirmed: {self.confirmed}")
        words += [f"{name}: {value}" for name, value in self.errors.items()]
        if self.equals:
            words.append(f"{len(self.equals)} other boxes are as good to within the bars")
        if self.at_ends and self.acceleration_ratio >= 1.0:
            ends = " and ".join(self.at_ends)
            words.append(f"the best has the {ends} that was tried: one beyond may be better")
        return "\n".join(words)

    @property
    def why(self) -> str:
        """What the grains do to the motion, in words."""
        if self.acceleration_ratio < 1.0:
            return (
                f"peak acceleration {min(self.acceleration_ratio, 0.999):.3g} g, grains lie still: "
                "they add mass only, and no box of this mass damps below 1 g"
            )
        words = (
            f"peak acceleration {self.acceleration_ratio:.3g} g with fixed grains: free ones fly"
        )
        if not self.value.mean + self.value.error < self.fixed:
            return f"{words}, but damp nothing beyond the bar"
        share = self.value.mean / self.fixed
        return f"{words}, and their impacts leave {share:.2g} of the motion with fixed ones"

    @property
    def at_ends(self) -> tuple[str, ...]:
        """What of the best box lies at an end of what was tried, in words."""
        best, boxes = self.grains, [one for one, _ in self.tried]
        counts = [one.particles for one in boxes]
        heights = [one.height for one in boxes if one.particles == best.particles]
        found = []
        for name, own, tried in (
            ("number of grains", best.particles, counts),
            ("height", best.height, heights),
        ):
            ends = ("smallest", min(tried)), ("largest", max(tried))
            found += [f"{side} {name}" for side, end in ends if own == end and len({*tried}) > 1]
        return tuple(found)

    def columns(self) -> dict[str, Any]:
        """A row a box of the first look."""
        boxes, values = zip(*self.tried)
        return {
            "particles": [one.particles for one in boxes],
            "diameter_m": [one.diameter for one in boxes],
            "clearance_m": [one.clearance for one in boxes],
            "value_m": [*values],
        }


def best_damper(
    oscillator: Oscillator,
    motion: float | Signal | Excitation,
    *,
    mass: float,
    box: tuple[float, float],
    particles: int | Sequence[int] = NUMBERS,
    density: float = DENSITY,
    goal: str = "peak",
    tolerance: float = 0.1,
    seeds: int = 5,
    heights: int = 6,
    cycles: tuple[int, int] = (120, 20),
    filling: Any = None,
    confirm: Any = None,
    progress: Listener | str | None = "auto",
) -> BestDamper:
    """Find number and size of grains, and the clearance, that damp a motion best.

    All boxes are looked at briefly, then heights between the best and its neighbours, and the best
    again with more frequencies, cycles and seeds. A second filling confirms the winner, and shifts
    clearance, mass and size of its grains by the tolerance, one at a time.

    Parameters
    ----------
    oscillator : Oscillator
        Primary structure with the empty container.
    motion : float or Signal or Excitation
        Amplitude of the base [m], for sines over the resonance; or what ``shake`` takes.
    mass : float
        Mass of all grains [kg], at most that of the oscillator.
    box : tuple of (float, float)
        Inner width and greatest inner height [m].
    particles : int or sequence of int, default (5, 10, 20, 30, 50)
        Numbers of grains to try; their size follows from the mass.
    density : float
        Density of a grain [kg/m^3]; that of the default grains if not given.
    goal : str, default "peak"
        ``"peak"`` or ``"rms"`` of the displacement from the base; for sines the largest RMS.
    tolerance : float, default 0.1
        Share by which clearance, mass and size may be off.
    seeds : int, default 5
        Seeds of the bars.
    heights : int, default 6
        Heights of the box that are tried for each number at first, at most.
    cycles : tuple of (int, int), default (120, 20)
        Cycles of sines before those that are measured, and these; a first look takes 0.4 of them.
        Runs that have not settled by then go on, up to eight times as long.
    filling : Automaton or Spheres, optional
        Filling that searches, whose grains and box are replaced; ``Automaton()`` if None.
    confirm : Automaton or Spheres, optional
        Filling that confirms; ``Spheres()`` if None, nothing where spheres search.
    progress : callable or str or None, default "auto"
        As in ``frequency_response``.

    Examples
    --------
    >>> best_damper(
    ...     Oscillator(), 0.6e-3, mass=6e-3, box=(60e-3, 96e-3)
    ... ).grains.particles  # doctest: +SKIP
    """
    case = _Case(oscillator, motion, mass, goal, cycles)
    between("tolerance", tolerance, 0.0, 0.5)
    whole("seeds", seeds, 2, 1000)
    counts = several("particles", particles, lambda name, n: whole(name, n, 1, 1000))
    layers = whole("heights", heights, 1, 100)
    boxes = boxes_of(case.mass, counts, box, positive("density", density), layers)
    filling = instance("filling", Automaton() if filling is None else filling, _KINDS)
    if confirm is None and not isinstance(filling, Spheres):
        confirm = Spheres()
    if confirm is not None:
        instance("confirm", confirm, _KINDS)
    with reporting(progress, "best damper") as listener:
        case.tell = OpenEnded(listener)
        found = _searched(case, filling, boxes, seeds)
        sure = _confirmed(case, confirm, found["grains"], seeds, tolerance)
        case.tell.end()
    return BestDamper(**found, **sure, **case.beside(gravity_along(filling)))


def _searched(case, filling, boxes, seeds):
    """The winner among boxes and what was seen on the way: fields of a BestDamper."""
    begun = time.process_time()
    seen: dict[Grains, float] = {}
    while boxes:
        seen |= {one: float(case.values(filling, one, 1, brief=True)[0][0]) for one in boxes}
        left = sorted(seen, key=lambda one: _rank(seen[one]))[:_LEFT]
        boxes = left[0].between_neighbours(seen)
    judged = [(one, Value.of(*case.values(filling, one, seeds))) for one in left]
    # By the upper end of the bar: a box whose motion nobody can tell is no good box.
    (best, value), *others = sorted(judged, key=lambda pair: _rank(pair[1].mean + pair[1].error))
    equals = ((one, v) for one, v in others if v.mean - v.error < value.mean + value.error)
    found = {"grains": best, "value": value, "equals": tuple(equals)}
    found["tried"] = tuple(sorted(seen.items()))
    return {**found, "search_seconds": time.process_time() - begun}


def _rank(value):
    return math.inf if math.isnan(value) else value


def _confirmed(case, filling, best, seeds, tolerance):
    """The winner by another filling, and after errors of manufacture: fields of a BestDamper."""
    boxes = {} if filling is None else {"": best, **dict(best.with_errors(tolerance))}
    errors = {name: Value.of(*case.values(filling, one, seeds)) for name, one in boxes.items()}
    return {"confirmed": errors.pop("", None), "errors": errors}


class _Case:
    """Structure, motion, and what of its motion is to be small; mass: of all grains [kg]."""

    def __init__(self, oscillator: Any, motion: Any, mass: Any, goal: Any, cycles: Any):
        self.oscillator = instance("oscillator", oscillator, Oscillator)
        self.goal = choice("goal", goal, ("peak", "rms"))
        words = "the cycles before those that are measured, and these"
        self.cycles = pair_of("cycles", cycles, words, lambda name, n: whole(name, n, 1, 100_000))
        self.mass, self.tell = positive("mass", mass), OpenEnded(None)
        if self.mass > oscillator.mass:
            got, most = told_apart(self.mass, oscillator.mass)
            raise InputError(f"mass must be at most that of the oscillator, {most} kg, got {got}")
        self.signal: Any = None if is_real(motion) else excitation_of(motion)
        if self.signal is None:
            self.oscillator = replace(oscillator, base_amplitude=positive("motion", motion))
            if oscillator.damping == 0.0:
                raise InputError(
                    "damping of the oscillator must be positive where its base moves as a sine, as "
                    "no steady state bounds it while grains lie still, got 0"
                )

    def values(
        self, filling: Any, grains: Grains, seeds: Any, brief: bool = False
    ) -> tuple[np.ndarray, float]:
        """What is to be small [m] of a box, a value a seed, and a half-width beside chance [m]."""
        filling = grains.put_into(filling)
        if self.signal is not None:
            made = self._shaken(filling, grains.particles, seeds, dt=_step(filling))
            return self._of_record(made)[0], 0.0
        job = {"particles": grains.particles, "seeds": seeds, "oscillator": self.oscillator}
        low = self.oscillator.peak(grains.particles * grains.mass)[0] - _BELOW
        share = _BRIEF if brief else 1.0
        transient, measured = (math.ceil(share * one) for one in self.cycles)
        job["dt"] = automatic_dt(_step(filling), _ABOVE * self.oscillator.natural_frequency)
        search = SteadyPeak(filling, (transient, measured), self.tell, **job)
        return search.run(low, _ABOVE, *((0,) if brief else ()))

    def beside(self, gravity: float) -> dict[str, Any]:
        """What is to be small without grains and with fixed ones: fields of a BestDamper."""
        own = self.oscillator
        if self.signal is None:
            (low, fixed), without = own.peak(self.mass), own.peak()[1]
            # Its peak lies above that of the displacement, where it is damped.
            hertz = own.natural_frequency * np.linspace(low, _ABOVE, 1000)
            size = math.sqrt(2.0) * (2.0 * np.pi * hertz) ** 2 * own.rms(hertz, self.mass)
        else:
            made = self._shaken(RigidMass(particle_mass=self.mass), (0, 1), 1)
            (without,), (fixed,) = self._of_record(made)
            size = -np.diff(made.v[:, 1, 0]) / np.diff(made.time_s)
        ratio = float(size.max()) / gravity if gravity else math.inf
        return {"without": float(without), "fixed": float(fixed), "acceleration_ratio": ratio}

    def _shaken(self, filling, particles, seeds, **options):
        """TimeHistory under the signal, with forty samples in a period of the structure."""
        options |= {"interval": min(1e-3, 0.025 / self.oscillator.natural_frequency)}
        job = {"particles": particles, "seeds": seeds, "oscillator": self.oscillator}
        return shake(filling, self.signal, progress=self.tell, **job, **options)

    def _of_record(self, run: Any) -> np.ndarray:
        """What is to be small [m] of a TimeHistory, (particles, seeds)."""
        return np.asarray(run.relative_peak if self.goal == "peak" else run.relative_rms)


def _step(filling: Any) -> float:
    """Step of a filling in a search [s]."""
    if isinstance(filling, Automaton):
        return filling.longest_dt / _STEPS
    return min(filling.default_dt, filling.step_bound[0])
