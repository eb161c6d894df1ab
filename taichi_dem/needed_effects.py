"""Effects that a run needed: those to keep, to drop, and to add."""

from taichi_dem.diagnostics.report import Report
from taichi_dem.kit.effect_usage import Advice
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import fraction


def needed_effects(result: object, tolerance: float = 1e-3) -> Advice:
    """Advice on the effects of a run; print it, or read its ``droppable`` and ``missing``.

    result: what ``simulate`` gave, or its report. tolerance: share of the energy that passed
    through bonds below which their damping counts as nothing, in [0, 1]. Effects that steer
    (fracture, slip, contact, friction) take little and decide much: they are dropped only where
    they never acted. Loads and supports pose the question and are always kept; so is an effect of
    one's own unless it cannot have acted, as the account need not show what it does. Dashpots that
    took no more than rounding leaves can be dropped: only last digits differ without them.
    Raises InputError for a result that is none, or a tolerance out of range.
    """
    report = getattr(result, "report", result)
    if not isinstance(report, Report):
        kind = type(result).__name__
        raise InputError(f"result must be a Result of simulate or its report, got {kind}")
    return Advice(report.effect_activity, report.missing_effects, fraction("tolerance", tolerance))
