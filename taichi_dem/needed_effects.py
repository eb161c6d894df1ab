"""Effects that a run needed: which to keep, drop and add."""

from dataclasses import replace

import numpy as np

from taichi_dem.kit.effect_table import EffectTable
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.validation import fraction, instance
from taichi_dem.laws.roles import ChosenEffects
from taichi_dem.mesh.topology import parts_of
from taichi_dem.result import Result
from taichi_dem.simulate import run_simulation
from taichi_dem.simulation import Simulation
from taichi_dem.state.model import names_of

#: Largest difference of two runs that rounding explains, as a share of what is recorded.
ROUNDING = 1e-9


def needed_effects(result: Result, tolerance: float = ROUNDING) -> EffectTable:
    """Advice on the effects of a run: which to keep, drop and add.

    The run is repeated without the effects that seem to have done nothing; ``Report.advice`` makes
    no run. Loads and supports define the problem and are always kept.

    Parameters
    ----------
    result : Result
        Result of ``simulate``.
    tolerance : float, default ROUNDING
        Largest difference of recorded values that counts as equal, as a share of the largest value,
        from 0 to 1; by default that of rounding. Effects with less energy are tried too.

    Examples
    --------
    >>> print(needed_effects(result))  # doctest: +SKIP
    """
    report, tolerance = instance("result", result, Result).report, fraction("tolerance", tolerance)
    tried = [use.effect for use in report.effect_activity if use.minor(tolerance)]
    shown = _differences(result, tried, tolerance) if tried and not result.diverged else {}
    return report.advice(tolerance, shown)


def _differences(result, names, tolerance):
    """Difference that each effect makes to a run, by name, as a share of what was recorded."""
    together = _difference(result, names)
    if together <= tolerance or len(names) == 1:
        return dict.fromkeys(names, together)
    effects = result.scene.effects
    differences: dict[str, float] = {}
    left_out: list[str] = []
    rubs = {name for name, effect in zip(names_of(effects), effects) if effect.role == "friction"}
    # Friction first: contact can be left out only with it.
    for name in sorted(names, key=lambda name: name not in rubs):
        differences[name] = _difference(result, [*left_out, name])
        if differences[name] <= tolerance:
            left_out.append(name)
    return differences


def _difference(result, names):
    """Largest relative difference of a run without some effects; infinite where it fails."""
    scene, report = result.scene, result.report
    kept = _without(scene.effects, names, may_be_silent=not scene.on_demand)
    try:
        scene = replace(scene, effects=ChosenEffects(kept, scene.effects.word), loads=())
        simulation = Simulation(scene, result.method, report.driver.split("+")[0])
        if result.start is not None:
            simulation.state.set_motion(**result.start)
        samples = len(result.series["time_s"]) - 1
        again = run_simulation(simulation, until=report.until_s, samples=samples, progress=None)
    except (InputError, SimulationDiverged):
        return np.inf
    return recorded_difference(result, again)


def _without(effects, names, may_be_silent):
    """Effects of a list without those of some names; silent friction goes with its contact."""
    kept = []
    for name, effect in zip(names_of(effects), effects):
        if name not in names:
            kept.append(effect)
        elif may_be_silent and vars(type(effect)).get("may_be_silent"):
            kept.append(effect.silent())
    if any(effect.role == "contact" for effect in kept):
        return kept
    return [effect for effect in kept if effect.name or effect.role != "friction"]


def recorded_difference(first: Result, second: Result) -> float:
    """Largest difference of all columns, speeds and times of fracture of two runs."""
    history, broken, part = first.series, first.broken_time, parts_of(first.model.mesh)
    joules = [name for name in history if name.endswith("_J") and name != "residual_J"]
    energy = max((np.abs(history[name]).max(initial=0.0) for name in joules), default=0.0)
    # The energy that rounding may have put into the bonds moves the lightest body at most so fast,
    # and over the run so far.
    heat = first.report.round_off_J
    speed = float(np.sqrt(2.0 * heat / first.model.body_mass.min()))
    rounding = {"_J": heat, "_m_s": speed, "_mm": 1e3 * speed * first.report.until_s}
    fastest = np.zeros(part.max() + 1)
    np.maximum.at(fastest, part, first.peak_speed)
    differences = [
        _apart(first.peak_speed, second.peak_speed, speed, fastest[part]),
        _apart(np.nan_to_num(broken), np.nan_to_num(second.broken_time)),
    ]
    if not np.array_equal(np.isnan(broken), np.isnan(second.broken_time)):
        return np.inf
    for name in history:
        # Forces follow from places and velocities, and are nothing but rounding at rest.
        if name != "residual_J" and not name.endswith("_N"):
            unexplained = next((rounding[unit] for unit in rounding if name.endswith(unit)), 0.0)
            scale = energy if name in joules else None
            differences.append(_apart(history[name], second.series.get(name), unexplained, scale))
    return float(max(differences, default=0.0))


def _apart(a, b, rounding=0.0, scale=None):
    """Largest difference of two arrays, over the largest value of the first or given scales."""
    if b is None or np.shape(a) != np.shape(b):
        return np.inf
    largest = np.abs(a).max(initial=0.0) if scale is None else scale
    apart = np.abs(np.asarray(a, dtype=np.float64) - b)
    shares = np.where(apart <= rounding, 0.0, apart) / np.maximum(largest, 1e-300)
    return float(shares.max(initial=0.0))
