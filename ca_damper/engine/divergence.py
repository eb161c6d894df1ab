"""Divergence of a scene in words: which, when, why, and a step that would do."""

from typing import Any

from ca_damper.engine.coupling import LOST
from ca_damper.errors import SimulationDiverged

_LOST_IN_WORDS = "lost its container, whose motion is no finite number"


def divergence(
    filling: Any, row: dict[str, Any], code: int, step: int, time_s: float
) -> SimulationDiverged:
    """Exception for a scene, a row of the table, that diverged with a code by a step."""
    dt = row["dt"]
    words, allowed = filling.divergence(max(code, 1), row["particles"], dt)
    if code == LOST:
        # The longest step of the filling is still the best advice.
        words, allowed = _LOST_IN_WORDS, min(allowed, 0.5 * dt)
    return SimulationDiverged(
        f"the scene of particles = {row['particles']} and seed {row['seed']} at "
        f"{row['frequency']:.5g} Hz diverged by step {step}, t = {time_s:.4g} s: it {words}; "
        f"dt must be at most {allowed:.3g} s, was {dt:.3g} s",
        scene=row,
        step=step,
        time_s=time_s,
        dt=dt,
        dt_allowed=allowed,
    )
