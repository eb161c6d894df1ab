"""Effects that a batch computes: those listed, or those that its scenes need; its certificate.

A filling takes part by two methods, both optional: ``activated(particles)`` returns the filling
with the effects that at most so many particles call for, and an Estimate for each effect that it
decided on; ``left_out(particles)`` returns an Estimate for each effect that it does not compute.
Its device may have ``first_steps(effects)``, as that of the spheres.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ca_damper.filling import Fillings
from ca_damper.report.certificate import Certificate, Periods, checked_range
from ca_damper.report.measures import Cycles
from ca_damper.report.steady_state import period
from taichi_dem.kit.display import counted
from taichi_dem.kit.effect_table import EffectUse, Estimate
from taichi_dem.kit.errors import InputError

#: Difference of cycles up to which they are alike, as a share of the first harmonic.
ALIKE = 1e-3


def activated(
    fillings: Fillings, table: Any, effects: str
) -> tuple[Fillings, tuple[Estimate, ...]]:
    """The fillings with the effects that are asked for, and estimates of those decided on."""
    if effects == "listed" or not hasattr(fillings.kinds[0], "activated"):
        return fillings, ()
    most = _most_particles(table)
    chosen, estimates = zip(*(one.activated(most) for one in fillings.kinds))
    if len({one.structure.key for one in chosen}) > 1:
        raise InputError(
            'effects must be "listed" where "auto" finds other effects in some fillings of a batch '
            "than in others, got 'auto'"
        )
    return Fillings([chosen[k] for k in fillings.which], table.count), _largest(estimates)


def _largest(estimates):
    """Of the estimates of each filling, in one order of the effects, the largest of each effect."""
    return tuple(max(of_one, key=lambda one: one.group) for of_one in zip(*estimates))


def certificate_of(batch: Any) -> Certificate:
    """Certificate of a batch since its start."""
    checked, diverged = checked_range(batch), len(batch.divergences())
    outside = checked.outside if checked is not None else ()
    kinds, most = batch.fillings.kinds, _most_particles(batch.table)
    left_out = [one.left_out(most) for one in kinds if hasattr(one, "left_out")]
    return Certificate(
        effects=batch.asked_effects,
        acting=effect_uses(batch),
        left_out=_largest(left_out),
        estimates=batch.estimates,
        periods=batch.periods,
        warnings=(
            *(f"outside of the checked range, {one}" for one in outside),
            *((f"{counted(diverged, 'scene')} diverged",) if diverged else ()),
        ),
    )


def periods_of(cycles: Cycles) -> Periods | None:
    """Which scenes are periodic over the measured cycles; None for fewer than two."""
    measured = cycles.record.shape[1]
    if measured < 2:
        return None
    series = cycles.harmonic_by_cycle("x")
    found = [period(one, ALIKE) for one in series if np.isfinite(one).all()]
    lengths, counts = np.unique([one for one in found if one], return_counts=True)
    pairs = tuple(zip(map(int, lengths), map(int, counts)))
    return Periods(measured, ALIKE, pairs, len(found) - int(counts.sum()))


def _most_particles(table: Any) -> int:
    """Most particles of a scene."""
    return int(table.column("particles").max())


def effect_uses(batch: Any) -> tuple[EffectUse, ...]:
    """Activity of each effect since the start, and when it began as far as the filling notes it."""
    device, effects = batch.device, batch.fillings.kinds[0].effects
    first = device.first_steps(effects) if hasattr(device, "first_steps") else {}
    return tuple(
        replace(use, **_begun(batch, first[use.effect])) if use.effect in first else use
        for use in device.uses(effects)
    )


def _begun(batch, steps):
    """When [s] and where an effect acted first, by its first step in each scene; empty if never."""
    times = batch.time_origin + steps * batch.table.column("dt")
    scene = int(times.argmin())
    if not np.isfinite(times[scene]):
        return {}
    return {"since_s": float(times[scene]), "where": f"scene {scene}"}
