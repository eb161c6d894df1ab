"""A run that is one window: how long, in which steps, with which samples and seeds."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ca_damper.excitation.excitation import Excitation, excitation_of
from ca_damper.scenes.checks import MOST_SEED
from ca_damper.scenes.clock import LEAST_STEPS_PER_CYCLE, MOST_STEPS_PER_CYCLE
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import positive, several, shown, told_apart, whole


class Window(NamedTuple):
    """A window of ``duration`` [s]: even samples, steps between two of them, and the step [s]."""

    duration: float
    samples: int
    every: int
    dt: float


def window(duration: float, dt: float, interval: Any) -> Window:
    """Window with the largest step that makes a whole number of samples, none longer than dt [s].

    interval: between samples at most [s]. Raises InputError for more steps than a clock counts.
    """
    samples = math.ceil(duration / positive("interval", interval) * (1 - 1e-12))
    every = math.ceil(duration / (samples * dt) * (1.0 - 1e-12))
    every = max(every, math.ceil(LEAST_STEPS_PER_CYCLE / samples))
    if samples * every > MOST_STEPS_PER_CYCLE:
        got, most = told_apart(duration, MOST_STEPS_PER_CYCLE * dt)
        raise InputError(f"duration must be at most {most} s in steps of {dt:.3g} s, got {got}")
    return Window(duration, samples, every, duration / (samples * every))


def run_duration(excitation: Excitation, duration: float | None) -> float:
    """Duration asked for, or that of the excitation [s]; InputError for one without an end."""
    own = float(excitation.duration(1)[0])
    if duration is None and math.isinf(own):
        raise InputError("duration must be given for an excitation without an end, got None")
    return own if duration is None else positive("duration", duration)


def run_seeds(seeds: int | Sequence[int]) -> tuple[int, ...]:
    """Seeds given as their number or one by one; InputError."""
    given: Any = seeds
    if not hasattr(seeds, "__iter__") or isinstance(seeds, (str, bytes, dict)):
        given = range(1, whole("seeds", seeds, 1, 1_000_000) + 1)
    found: tuple[int, ...] = several("seeds", given, lambda n, x: whole(n, x, 0, MOST_SEED))
    return found


def one_for_all(value: Any) -> Excitation:
    """Excitation of one Signal or SineForce for all scenes; InputError for several or None."""
    if value is None:
        raise InputError("excitation must be a Signal or an Excitation, got None")
    excitation = excitation_of(value)
    if isinstance(excitation.base, tuple) or isinstance(excitation.force, tuple):
        raise InputError(
            f"excitation must be one for all scenes here, got several: {shown(excitation)}"
        )
    return excitation
