"""Effects that a run needed: those to keep, to drop, and to add.

An effect is said to be droppable only where a run without it has been made and is equal.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Optional, Union

import numpy as np

from taichi_dem.kit.effect_usage import Advice
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.validation import fraction, instance, positive
from taichi_dem.laws.chosen import ChosenEffects
from taichi_dem.mesh.parts import may_meet, parts_of
from taichi_dem.report.estimates import Estimate, estimates_before
from taichi_dem.report.report import Report
from taichi_dem.result import Result
from taichi_dem.scene import Scene
from taichi_dem.simulate import run_simulation
from taichi_dem.simulation import Simulation
from taichi_dem.state.model import Model

#: Largest difference of two runs that rounding explains, as a share of what is recorded.
ROUNDING = 1e-9


def needed_effects(result: object, tolerance: float = ROUNDING) -> Advice:
    """Advice on the effects of a run: those to keep, to drop, and to add.

    A run of a Result is repeated without the effects that seem to have had no part; of a report
    alone, no effect can be shown droppable. Loads and supports define the problem and are always
    kept.

    Parameters
    ----------
    result : Result or Report
        Result of ``simulate``, or its report.
    tolerance : float, default ROUNDING
        Largest difference of all that was recorded that counts as equal, as a share of its largest
        value, from 0 to 1; by default what rounding explains. With a larger one, effects that took
        less than this share of the energy are tried too.

    Returns
    -------
    Advice
        Print it, or read its ``droppable`` and ``missing``.

    Raises
    ------
    InputError
        The result is of another kind, or the tolerance is out of range.

    Examples
    --------
    >>> print(needed_effects(result))  # doctest: +SKIP
    """
    report = getattr(result, "report", result)
    if not isinstance(report, Report):
        kind = type(result).__name__
        raise InputError(f"result must be a Result of simulate or its report, got {kind}")
    uses, tolerance = report.effect_activity, fraction("tolerance", tolerance)
    tried = [use.effect for use in uses if use.idle or use.negligible(tolerance)]
    shown: dict[str, float] = {}
    if isinstance(result, Result) and not result.diverged:
        shown = differences(result, tried, tolerance)
    slipped = (slip for slip in report.bond_slip if slip.excessive and not slip.weakens)
    return Advice(uses, (*report.missing_effects, *slipped), tolerance, shown)


def estimated_effects(scene: Scene, until: float) -> tuple[Estimate, ...]:
    """Estimates of which effects a scene needs, before a run.

    Parameters
    ----------
    scene : Scene
        Scene.
    until : float
        End of the run [s].

    Returns
    -------
    tuple of Estimate
        For each effect a dimensionless group that compares it with what it acts beside, and the
        verdict negligible, needed or unclear. Print them.

    Raises
    ------
    InputError
        The argument is no Scene, or the time is not positive.
    """
    instance("scene", scene, Scene)
    model = Model(scene.mesh, scene.body_materials, scene.effects)
    until, velocity = positive("until", until), scene.initial_motion.get("velocity")
    return estimates_before(model, until, velocity, may_meet(scene, parts_of(scene.mesh)))


def differences(result: Result, names: Iterable[str], tolerance: float) -> dict[str, float]:
    """Difference that each effect makes to a run, by name, as a share of what was recorded.

    names: of the effects, all left out together first; where this differs by more than the
    tolerance, one after the other. Friction goes with the contact it acts in.
    """
    names = tuple(names)
    if not names:
        return {}
    together = _difference(result, names)
    if together <= tolerance or len(names) == 1:
        return dict.fromkeys(names, together)
    found: dict[str, float] = {}
    left_out: tuple[str, ...] = ()
    # Friction first: contact can be left out only with it.
    for name in sorted(names, key=lambda name: _role(result, name) != "friction"):
        found[name] = _difference(result, (*left_out, name))
        if found[name] <= tolerance:
            left_out = (*left_out, name)
    return found


def _role(result, name):
    return next(effect.role for effect in result.scene.effects if effect.name == name)


def _difference(result, names):
    """Largest relative difference of a run without some effects; infinite where it fails."""
    scene = result.scene
    kept = _without(scene.effects, names, may_be_silent=not scene.on_demand)
    try:
        scene = replace(scene, effects=ChosenEffects(kept, scene.effects.word), loads=())
        simulation = Simulation(scene, result.method, result.report.driver.split("+")[0])
        if result.start is not None:
            simulation.state.set_motion(**result.start)
        samples = len(result.history["time_s"]) - 1
        options: dict[str, Any] = {"samples": samples, "progress": None}
        again = run_simulation(simulation, until=result.report.until_s, **options)
    except (InputError, SimulationDiverged):
        return np.inf
    return recorded_difference(result, again)


def _without(effects, names, may_be_silent):
    """Effects of a list without those of some names; silent friction goes with its contact.

    Of these, those that can stay as silent copies: the same bits, and nothing is compiled anew.
    """
    kept = []
    for effect in effects:
        if effect.name not in names:
            kept.append(effect)
        elif may_be_silent and _can_be_silent(effect):
            kept.append(effect.silent())
    if any(effect.role == "contact" for effect in kept):
        return kept
    return [effect for effect in kept if effect.name or effect.role != "friction"]


def _can_be_silent(effect):
    """Whether its class itself says how: one that it derives from may not know its law."""
    return "harmless" in vars(type(effect))


def recorded_difference(first: Result, second: Result) -> float:
    """Largest difference of all columns, speeds and times of fracture of two runs.

    A share of the largest value of each; of energies, of the largest of all of them; of speeds, of
    the largest in the connected part to which a body belongs; zero where rounding explains it.
    Infinite where columns have other lengths.
    """
    joules = [name for name in first.history if name.endswith("_J") and name != "residual_J"]
    energy = max((np.abs(first.history[name]).max(initial=0.0) for name in joules), default=0.0)
    rounding = _rounding(first)
    found = [
        _apart(first.peak_speed, second.peak_speed, rounding["_m_s"], _fastest_beside(first)),
        _broken_apart(first.broken_time, second.broken_time),
    ]
    for name in first.history:
        if name != "residual_J":
            unexplained = next((rounding[unit] for unit in rounding if name.endswith(unit)), 0.0)
            columns = first.history[name], second.history.get(name)
            found.append(_apart(*columns, unexplained, energy if name in joules else None))
    return float(max(found, default=0.0))


def _fastest_beside(result):
    """Largest speed in the part of each body [m/s]."""
    part = parts_of(result.model.mesh)
    fastest = np.zeros(part.max() + 1)
    np.maximum.at(fastest, part, result.peak_speed)
    return fastest[part]


def _rounding(result):
    """Differences that rounding alone explains, by the unit at the end of a column's name.

    The energy that rounding may have put into the bonds moves the lightest body at most so fast,
    and over the run so far.
    """
    energy = result.report.round_off_J
    speed = float(np.sqrt(2.0 * energy / result.model.body_mass.min()))
    return {"_J": energy, "_m_s": speed, "_mm": 1e3 * speed * result.report.until_s}


def _broken_apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of times of fracture [s], over the latest; NaN for bonds that hold."""
    if not np.array_equal(np.isnan(one), np.isnan(other)):
        return np.inf
    return _apart(np.nan_to_num(one), np.nan_to_num(other))


def _apart(
    one: np.ndarray,
    other: Optional[np.ndarray],
    rounding: float = 0.0,
    scale: Union[float, np.ndarray, None] = None,
) -> float:
    """Largest difference of two arrays, over the largest value of the first or given scales.

    Zero up to the difference that rounding explains.
    """
    if other is None or np.shape(one) != np.shape(other):
        return np.inf
    largest = np.abs(one).max(initial=0.0) if scale is None else scale
    apart = np.abs(np.asarray(one, dtype=np.float64) - other)
    shares = np.where(apart <= rounding, 0.0, apart) / np.maximum(largest, 1e-300)
    return float(shares.max(initial=0.0))
