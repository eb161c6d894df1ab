"""Effects that a run needed: those to keep, to drop, and to add."""

from taichi_dem.diagnostics.report import Report
from taichi_dem.kit.effect_usage import Advice
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import fraction


def needed_effects(result: object, tolerance: float = 1e-3) -> Advice:
    """Advice on the effects of a run; print it, or read its ``droppable`` and ``missing``.

    result: the Result of ``simulate``, or its report. tolerance: share of the energy that passed
    through bonds below which their damping is negligible, in [0, 1]. Effects that steer (fracture,
    slip, contact, friction) take little energy and decide much: they are dropped only where they
    never acted. Loads and supports define the problem and are always kept; so are user-defined
    effects unless they cannot have acted, as the account need not show their activity. Dashpots
    that took no more than rounding errors can be dropped: only last digits differ without them.
    Raises InputError for another kind of result, or a tolerance out of range.
    """
    report = getattr(result, "report", result)
    if not isinstance(report, Report):
        kind = type(result).__name__
        raise InputError(f"result must be a Result of simulate or its report, got {kind}")
    slipped = (slip for slip in report.bond_slip if slip.excessive and not slip.weakens)
    missing = (*report.missing_effects, *slipped)
    return Advice(report.effect_activity, missing, fraction("tolerance", tolerance))
