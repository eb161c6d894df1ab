"""The short report at the end of a run."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from taichi_dem.kit.display import BRIEF, Worded, counted, in_brief, in_lines
from taichi_dem.kit.effect_table import EffectTable, EffectUse
from taichi_dem.methods import order_of
from taichi_dem.report.effects import Certificate
from taichi_dem.report.energy_balance import given_and_held, injected_words, put_in_words
from taichi_dem.report.missing_effects import MissingEffect
from taichi_dem.report.shared_volume import Interpenetration
from taichi_dem.scene import Scene


@dataclass(frozen=True)
class Report(Worded):
    """Figures and cost of a run.

    Parameters
    ----------
    method : str
        Name of the method.
    driver : str
        Driver that ran.
    effects : tuple of str
        Names of the effects.
    until_s : float
        Simulated time [s].
    body_count : int
        Number of bodies.
    bond_count : int
        Number of bonds.
    broken_faces : int
        Number of released bonds.
    smallest_step_s : float
        Shortest step of a body [s].
    substeps : int
        Ticks at which a body was active.
    body_updates : int
        Updates of bodies.
    bond_evaluations : int
        Evaluations of bonds.
    pair_evaluations : int
        Evaluations of contact pairs.
    sweeps : int
        Sweeps over all dashpots where they are solved, else 0.
    uniform_evaluations : int
        Bonds and pairs that one step for all would have evaluated in the same substeps.
    searches : int
        Updates of the contact lists.
    energy_balance : dict
        Energy terms [J] by name.
    linear_momentum_error : float
        Unexplained momentum, as a share of that exchanged.
    angular_momentum_error : float
        Unexplained angular momentum, as a share of that exchanged.
    compile_seconds : float
        Time spent on compiling [s].
    run_seconds : float
        Wall time spent stepping [s].
    run_cpu_seconds : float
        CPU time spent stepping [s].
    effect_table : EffectTable
        Effects that acted, are missing or were left out; a ``Certificate`` with effects="auto".
    unresolved : tuple of str
        Sentences about bonds and contacts for which the step was too long.
    bound_by : dict
        Number of bodies at the end by the ``step_control.CRITERIA`` that bounds their step.
    round_off_J : float, default 0.0
        Energies below this may be round-off [J].
    unconverged_steps : int, default 0
        Steps whose sweeps ended before convergence.
    worst_residual : float, default 0.0
        Their largest residual, as a share of the speed of the fastest body.
    interpenetration : Interpenetration, optional
        Volume that bodies shared, where it was measured.
    bond_slip : tuple of BondSlip, default ()
        The bond that slipped farthest; empty where none slipped.
    known_error : str, default ""
        What is known of the error, in words.
    """

    method: str
    driver: str
    effects: tuple
    until_s: float
    body_count: int
    bond_count: int
    broken_faces: int
    smallest_step_s: float
    substeps: int
    body_updates: int
    bond_evaluations: int
    pair_evaluations: int
    sweeps: int
    uniform_evaluations: int
    searches: int
    energy_balance: dict
    linear_momentum_error: float
    angular_momentum_error: float
    compile_seconds: float
    run_seconds: float
    run_cpu_seconds: float
    effect_table: EffectTable
    unresolved: tuple
    bound_by: dict
    round_off_J: float = 0.0
    unconverged_steps: int = 0
    worst_residual: float = 0.0
    interpenetration: Interpenetration | None = None
    bond_slip: tuple = ()
    known_error: str = ""

    def __repr__(self):
        took = f"{self.run_seconds:.3g} s run"
        return in_brief(self, self.outcome, took, "print it for all figures")

    @property
    def outcome(self) -> str:
        """Method, simulated time and broken bonds in words."""
        broken = f"{self.broken_faces:,} of {self.bond_count:,} bonds broken"
        return f"{self.method}, {self.until_s:.4g} s simulated, {broken}"

    @property
    def needs(self) -> tuple[str, ...]:
        """Sentences about missed effects, slip of bonds, and too long a step."""
        slipped = (slip for slip in self.bond_slip if slip.count)
        return (*map(str, (*self.missing_effects, *slipped)), *self.unresolved)

    @property
    def effect_activity(self) -> tuple[EffectUse, ...]:
        """Activity of each effect."""
        return self.effect_table.acting

    @property
    def missing_effects(self) -> tuple[MissingEffect, ...]:
        """Effects that were left out and needed."""
        return self.effect_table.missing

    @property
    def certificate(self) -> Certificate | None:
        """What acted and what was left out, with effects="auto"; else None."""
        return self.effect_table if isinstance(self.effect_table, Certificate) else None

    @property
    def contact_evaluations(self) -> int:
        """Bonds and contact pairs evaluated."""
        return self.bond_evaluations + self.pair_evaluations

    @property
    def ideal_gain(self) -> float:
        """Ratio of bodies times substeps to body updates, the gain if pairs cost nothing."""
        return self.body_count * self.substeps / max(1, self.body_updates)

    @property
    def boundary_gain(self) -> float:
        """Ratio of the evaluations of one step for all to those that were made."""
        return self.uniform_evaluations / max(1, self.contact_evaluations)

    @property
    def energy_residual_fraction(self) -> float:
        """Unexplained energy as a share of the energy put in, or of that held if more."""
        return abs(self.energy_balance["residual"]) / max(*self._given_and_held(), 1e-300)

    def _given_and_held(self):
        """Energy put in, and energy held at the end [J]."""
        return given_and_held(self.energy_balance)

    @property
    def unexplained(self) -> str:
        """The residual in words, a share of the energy put in unless all energies are round-off."""
        given, held = self._given_and_held()
        if max(given, held) <= self.round_off_J:
            return f"{abs(self.energy_balance['residual']):.2g} J; all energies are round-off"
        whole = "the energy held" if held > given + self.round_off_J else "the energy put in"
        return f"{100.0 * self.energy_residual_fraction:.3g} % of {whole}"

    def advice(
        self, tolerance: float = 0.0, shown: Mapping[str, float] | None = None
    ) -> EffectTable:
        """Advice on the effects, of which runs without some have shown a difference, by name.

        Parameters
        ----------
        tolerance : float, default 0.0
            Largest difference that counts as equal, as a share of what was recorded.
        shown : mapping, optional
            Differences that were shown, see ``needed_effects``; none by default.

        Returns
        -------
        EffectTable
            Print it, or read its ``table()``.
        """
        slipped = (slip for slip in self.bond_slip if slip.count and not slip.weakens)
        return self.effect_table.advised(tolerance, shown or {}, slipped)

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        figures = asdict(self)
        table = figures.pop("effect_table")
        figures.update(acted=table["acting"], missed=table["missing"])
        figures["certificate"] = self.certificate and self.certificate.as_dict()
        derived = "contact_evaluations ideal_gain boundary_gain energy_residual_fraction needs"
        return {**figures, **{name: getattr(self, name) for name in derived.split()}}

    def rows(self) -> dict[str, str]:
        """All lines by name; ``""`` for what there is nothing to say of."""
        varies = self.body_updates != self.body_count * self.substeps
        gain = f"{self.ideal_gain:.2f} ideal, {self.boundary_gain:.2f} with pairs at the finer step"
        swept = f"{self.sweeps:,}, {self.sweeps / max(1, self.substeps):.2f} a substep"
        unconverged = f"{self.unconverged_steps:,} substeps unconverged"
        bound = ((name.replace("_", " "), n) for name, n in self.bound_by.items())
        broken = f"{self.broken_faces:,} of {self.bond_count:,} bonds broken"
        evaluated = f"{self.bond_evaluations:,} bonds, {self.pair_evaluations:,} pairs"
        momentum = f"{self.linear_momentum_error:.1e} linear, {self.angular_momentum_error:.1e}"
        run = f"{self.run_seconds:.1f} s run ({self.run_cpu_seconds:.1f} s of CPU)"
        left_out = self.certificate.left_out_lines() if self.certificate else ()
        return {
            "method": f"{self.method}, {self.driver} driver",
            "effects": "\n".join(f"{use.effect}: {use}" for use in self.effect_activity) or "none",
            "simulated": f"{self.until_s:.4g} s, {broken}",
            "smallest step": f"{self.smallest_step_s:.3g} s",
            "steps bound by": ", ".join(f"{name} ({n} bodies)" for name, n in bound),
            "substeps": f"{self.substeps:,}",
            "evaluations": f"{evaluated}, {self.body_updates:,} bodies",
            "largest bond slip": "\n".join(slip.figure for slip in self.bond_slip),
            "gain over uniform": gain if varies else "",
            "sweeps": f"{swept}, {unconverged}" if self.sweeps else "",
            "contact searches": f"{self.searches:,}",
            "interpenetration": str(self.interpenetration or "not looked for"),
            "energy put in": put_in_words(self.energy_balance, self.round_off_J),
            "energy residual": self.unexplained,
            "injected": injected_words(self.energy_balance, self.round_off_J),
            "known error": self.known_error.replace("; ", "\n"),
            "certificate": "\n".join(left_out),
            "momentum error": f"{momentum} angular",
            "time": f"{self.compile_seconds:.1f} s before the first step, {run}",
        }

    def details(self) -> str:
        """All figures.

        Returns
        -------
        str
            A table of some thirty lines, then a line for each effect that was missed.
        """
        return in_lines(self.rows(), self.needs)

    def __str__(self):
        """At most fifteen lines: what came out, how sure, how long; how, and what was missed."""
        rows = self.rows()
        acted = (f"{use.effect} ({use.events:,})" for use in self.effect_activity)
        brief = {
            "result": f"{counted(self.body_count, 'body')} for {rows['simulated']}",
            "error": self.known_error,
            "time": rows["time"],
            "method": f"{self.method}, smallest step {rows['smallest step']}",
            "effects": ", ".join(acted) or "none",
            "energy put in": rows["energy put in"],
            "injected": rows["injected"],
            "certificate": self.certificate.verdict if self.certificate else "",
        }
        return in_lines(brief, self.needs, BRIEF)


def known_error(report: Report, scene: Scene, method: Any) -> str:
    """Known error of a run without a requested accuracy, at no extra cost."""
    if not report.substeps:
        return ""
    varying = report.substeps > round(report.until_s / method.dt0)
    orders = [order_of(method, scene.damped(touching=report.pair_evaluations > 0), varying)]
    orders += [load.order for load in scene.effects if load.role == "load"]
    order = None if None in orders else min(filter(None, orders))
    # Events each fall within a step, whatever the order between them.
    events = {"breaks": report.broken_faces, "contacts": report.pair_evaluations}
    between = " and ".join(name for name, count in events.items() if count)
    words = "order unknown" if order is None else f"order {order}"
    words += f" between {between}" if between and order is not None else ""
    closes = f"energy balance: {report.unexplained.replace('; ', ', ')}"
    if "%" in closes:
        closes = closes.replace(":", " closes to").removesuffix(" of the energy put in")
    words = f"{'steps up to' if varying else 'step'} {method.dt0:.3g} s, {words}; {closes}"
    return "; ".join((words, *scene.body_materials.weakened))
