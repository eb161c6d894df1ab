"""Effects that a batch computes: those listed, or those that its scenes need; its certificate.

A filling takes part by two methods, both optional: ``activated(particles)`` returns the filling
with the effects that at most so many particles call for, and an Estimate for each effect that it
decided on; ``left_out(particles)`` returns an Estimate for each effect that it does not compute.
Its device may have ``first_steps(effects)`` and ``audit()``, as that of the spheres.
"""

from typing import Any

import numpy as np

from ca_damper.report.certificate import Certificate, Periods
from ca_damper.report.measures import Cycles
from ca_damper.report.steady_state import period
from taichi_dem.kit.certificate import Estimate
from taichi_dem.kit.effect_usage import EffectUse

#: Difference of cycles up to which they are alike, as a share of the first harmonic.
ALIKE = 1e-3


def activated(filling: Any, table: Any, effects: str) -> tuple[Any, tuple[Estimate, ...]]:
    """The filling with the effects that are asked for, and estimates of those decided on."""
    if effects == "listed" or not hasattr(filling, "activated"):
        return filling, ()
    chosen: tuple[Any, tuple[Estimate, ...]] = filling.activated(_most_particles(table))
    return chosen


def certificate_of(batch: Any) -> Certificate:
    """Certificate of a batch since its start."""
    filling, device = batch.filling, batch.device
    left_out = getattr(filling, "left_out", None)
    audit = device.audit() if hasattr(device, "audit") else None
    return Certificate(
        effects=batch.asked_effects,
        acting=_acting(batch, device) if hasattr(device, "first_steps") else (),
        left_out=left_out(_most_particles(batch.table)) if left_out else (),
        estimates=batch.estimates,
        audits=() if audit is None else (audit,),
        periods=batch.periods,
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


def _acting(batch, device):
    """In how many scenes each effect acted, and from when [s], for fillings that note it."""
    found = []
    for name, steps in device.first_steps(batch.filling.effects).items():
        times = batch.time_origin + steps * batch.table.column("dt")
        acted = times[np.isfinite(times)]
        since = float(acted.min()) if acted.size else None
        found.append(EffectUse(name, "scenes", acted.size, batch.count, since_s=since))
    return tuple(found)
