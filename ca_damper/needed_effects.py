"""Effects of a filling that a run needed."""

from ca_damper.report import Report
from taichi_dem.kit.effect_usage import Advice
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import fraction


def needed_effects(result: object, tolerance: float = 1e-3) -> Advice:
    """Advice on the effects of a run; print it, or read its ``droppable``.

    result: a Response, or the Report of a Batch. tolerance: share of the energy taken (friction) or
    in motion (rotation) below which an effect is negligible, in [0, 1]. Spheres are checked every
    few steps: an effect that may have acted unseen between two checks is kept.
    Raises InputError for another kind of result, or a tolerance out of range.
    """
    report = getattr(result, "report", result)
    if not isinstance(report, Report):
        kind = type(result).__name__
        raise InputError(f"result must be a Response or the Report of a Batch, got {kind}")
    return Advice(report.effect_activity, (), fraction("tolerance", tolerance))
