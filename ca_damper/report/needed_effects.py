"""Effects of a filling that a run needed."""

from ca_damper.report.report import Report
from taichi_dem.kit.effect_usage import Advice
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import fraction


def needed_effects(result: object, tolerance: float = 1e-3) -> Advice:
    """Advice on the effects of a run of the damper.

    Parameters
    ----------
    result : Response or Report
        Result of ``frequency_response``, or the report of a batch.
    tolerance : float, default 0.001
        Share of the energy taken (friction) or in motion (rotation) below which an effect is
        negligible, from 0 to 1.

    Returns
    -------
    Advice
        Print it, or read its ``droppable``.

    Raises
    ------
    InputError
        The result is of another kind, or the tolerance is out of range.

    Notes
    -----
    Spheres are checked every few steps: an effect that may have acted unseen between two checks is
    kept.

    Examples
    --------
    >>> print(needed_effects(response))  # doctest: +SKIP
    """
    report = getattr(result, "report", result)
    if not isinstance(report, Report):
        kind = type(result).__name__
        raise InputError(f"result must be a Response or the Report of a Batch, got {kind}")
    return Advice(report.effect_activity, (), fraction("tolerance", tolerance))
