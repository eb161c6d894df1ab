"""Time integration methods for the user; each sets how the schedule steps."""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import between, choice, plain_fields, positive, shown
from taichi_dem.step_control import Displacement, FixedStep, StepControl


class Method:
    """How bodies step; base of these methods and of user-defined ones.

    A user-defined class has at least ``dt0`` and ``name`` (docs/add_a_time_integrator.md). It may
    also have ``step``, a class derived from ``step.explicit.ExplicitStep``; ``structure``, on which
    its kernels depend (``structure_of``); and ``order``, that of its error (``order_of``).
    """

    dt0: Any
    name: Any
    uniform: bool = True
    neighbour: str = "held"
    control: StepControl | None = None
    dashpot: str = "full"
    distance: float | None = None
    solves: bool = False
    steps_ahead: Any = 0.0

    def criterion(self) -> Any:
        """Rule for the level of a body."""
        return FixedStep() if self.distance is None else Displacement()


def structure_of(method: Any) -> Hashable:
    """Parts of a method on which its kernels depend: all but its numbers.

    A user-defined method may have a member ``structure``; else any change of its numbers compiles.
    """
    if type(method).__module__ != __name__:
        return getattr(method, "structure", (type(method), repr(method)))
    rule = method.control
    if rule is not None:
        rule = rule.level_jump is not None
    return type(method), method.neighbour, method.dashpot, method.distance is None, rule


def order_of(method: Any, damped: bool, varying: bool) -> int | None:
    """Order of the error in the step between events; None where the method declares none.

    A class derived from a method declares its own order, or none: its ``step`` may have another.
    """
    kind = type(method)
    declared = kind.order if kind.__module__ == __name__ else vars(kind).get("order")
    return declared(method, damped, varying) if callable(declared) else None


class _Explicit(Method):
    """What explicit methods share, whether bodies step by one level or by levels of their own."""

    def __post_init__(self):
        plain_fields(self)
        positive("dt0", self.dt0)
        # Without a limit of the way there is one level only.
        if self.distance is not None or not self.uniform:
            positive("distance", self.distance)
        choice("neighbour", self.neighbour, ("held", "drifted"))
        choice("dashpot", self.dashpot, ("full", "limited"))
        rule = self.control
        if rule is not None and not isinstance(rule, StepControl):
            raise InputError(f"control must be a StepControl or None, got {shown(rule)}")
        floor = rule.dashpot_floor if rule is not None else 0.0
        if floor > 0.0 and self.dashpot != "limited":
            raise InputError(f"dashpot_floor must be 0 unless dashpot is 'limited', got {floor!r}")

    @property
    def name(self) -> str:
        """Short name for tables."""
        kind = "uniform" if self.uniform else f"multirate_{self.neighbour}"
        controlled = "_controlled" if self.control is not None else ""
        return kind + controlled + ("_limited" if self.dashpot == "limited" else "")

    @property
    def steps_ahead(self) -> float:
        """Steps of a body by which its contacts are counted before they touch."""
        rule = self.control or (StepControl() if self.dashpot == "limited" else None)
        return rule.ahead if rule is not None else 0.0

    def order(self, damped: bool, varying: bool) -> int | None:
        """Order of the error in the step, see ``order_of``; None where it is not known.

        Dashpots lag by half a step; limited ones are those of another material at each step.
        """
        if damped and self.dashpot == "limited":
            return None
        return 1 if damped or varying else 2


@dataclass(frozen=True)
class Uniform(_Explicit):
    """One step for all bodies, explicit (Konno et al., sections 3.1 and 4.3).

    Parameters
    ----------
    dt0 : float, default 1e-08
        Largest step [s].
    distance : float, optional
        Displacement limit l [m]: the fastest body sets the step of all. None: it is always dt0.
    control : StepControl, optional
        Further limits of the step.
    dashpot : str, default "full"
        ``"full"``, or ``"limited"``: weaken each dashpot just enough to be stable.
    """

    dt0: float = 1e-8
    distance: float | None = None
    control: StepControl | None = None
    dashpot: str = "full"


@dataclass(frozen=True)
class Multirate(_Explicit):
    """Steps that differ by powers of two from body to body, explicit (Konno et al., section 3.1).

    Parameters
    ----------
    dt0 : float, default 1e-08
        Largest step [s].
    distance : float, default 1e-08
        Displacement limit l [m]: a body takes the largest dt0 / 2^k in which it moves by no more.
    neighbour : str, default "held"
        ``"held"``: a body between its own times stays at its last position (the paper).
        ``"drifted"``: it drifts to every evaluation, and takes the impulse at once.
    control : StepControl, optional
        As in ``Uniform``.
    dashpot : str, default "full"
        As in ``Uniform``.
    """

    dt0: float = 1e-8
    distance: float = 1e-8
    neighbour: str = "held"
    control: StepControl | None = None
    dashpot: str = "full"

    uniform = False


@dataclass(frozen=True)
class ImplicitDashpots(Method):
    """One step for all bodies, with the dashpots of bonds and contacts solved together in it.

    Springs and loads are explicit; their stability bounds the step, not that of the dashpots.

    Parameters
    ----------
    dt : float, default 4e-07
        Step [s].
    sweeps : tuple of (int, int), default (2, 20)
        Fewest and most sweeps over all dashpots in a step.
    tolerance : float, default 0.05
        Sweeps end once none changes a velocity by more than this share of the largest speed in the
        scene; slow motion beside very fast bodies needs a smaller one.
    theta : float, default 0.5
        Time in the step, as a share of it, at which bond dashpots take their velocity: from 0.5
        (mean of both ends, second order) to 1 (the end, first order, for very long steps).
    refresh : float, default 3e-05
        Interval between updates of the solved blocks of bonds [s].
    """

    dt: float = 4e-7
    sweeps: tuple[int, int] = (2, 20)
    tolerance: float = 0.05
    theta: float = 0.5
    refresh: float = 3e-5

    solves = True
    # Spheres that may touch within the step are solved in it; slightly more, as a spin is rounded.
    steps_ahead = 1.01
    name = "implicit"

    def __post_init__(self):
        plain_fields(self)
        positive("dt", self.dt)
        positive("tolerance", self.tolerance)
        positive("refresh", self.refresh)
        between("theta", self.theta, 0.5, 1.0)
        whole = isinstance(self.sweeps, tuple) and all(type(s) is int for s in self.sweeps)
        if not (whole and len(self.sweeps) == 2 and 1 <= self.sweeps[0] <= self.sweeps[1] <= 1000):
            raise InputError(
                "sweeps must be two whole numbers, fewest and most, from 1 to 1000, "
                f"got {shown(self.sweeps)}"
            )

    @property
    def dt0(self) -> float:
        """Largest step [s]."""
        return self.dt

    def order(self, damped: bool, varying: bool) -> int:
        """Order of the error in the step, 1 or 2, see ``order_of``; that of converged sweeps."""
        return 1 if varying or (damped and self.theta != 0.5) else 2
