"""What is known of the error of a run that was not asked for an accuracy: for nothing extra."""

from typing import Any

from taichi_dem.kit.accuracy import plans
from taichi_dem.methods import order_of
from taichi_dem.report.report import Report
from taichi_dem.scene import Scene, kind_of


def known_error(report: Report, scene: Scene, method: Any) -> str:
    """Step and order of the method, how the energy balance closes, and what a plan says, in words.

    A plan is at hand where the session has answered a question of a scene of this kind.
    """
    if not report.substeps:
        return ""
    plan = plans.recall(kind_of(scene))
    parts = _step(report, scene, method), _balance(report), plan and f"in such scenes {plan}"
    return "; ".join(part for part in parts if part)


def _step(report, scene, method):
    """Step, and order of the method at it."""
    varying = report.substeps > round(report.until_s / method.dt0)
    order = order_of(method, scene.damped(touching=report.pair_evaluations > 0), varying)
    words = "order unknown" if order is None else f"order {order}{_between(report)}"
    return f"{'steps up to' if varying else 'step'} {method.dt0:.3g} s, {words}"


def _between(report):
    """Events, each of which falls within a step, whatever the order between them."""
    events = {"breaks": report.broken_faces, "contacts": report.pair_evaluations}
    found = [name for name, count in events.items() if count]
    return f" between {' and '.join(found)}" if found else ""


def _balance(report):
    """How well the energy balance closes."""
    if "%" in report.unexplained:
        return f"energy balance closes to {report.unexplained.replace(' of it', '')}"
    return f"energy balance: {report.unexplained.replace('; ', ', ')}"
