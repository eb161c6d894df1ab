"""The short report at the end of a run of the damper."""

import json
from dataclasses import asdict, dataclass
from typing import Any

from ca_damper.report.certificate import Certificate, CheckedRange
from taichi_dem.kit.display import BRIEF, Worded, counted, in_brief, in_lines
from taichi_dem.kit.effect_table import EffectTable, EffectUse
from taichi_dem.kit.files import write_text
from taichi_dem.kit.validation import FileName, fraction, instance

#: Evaluations of the right-hand side in an attempt of RK45; the first slope is the last one's.
RK45_STAGES = 6


@dataclass(frozen=True)
class Report(Worded):
    """Figures and cost of a batch since it was made.

    Parameters
    ----------
    method : str
        Label of the filling.
    mount : str
        ``"spring"``, ``"base"``, ``"floor"`` or ``"structure"``.
    effects : tuple of str
        Effects that the filling was asked to compute.
    scenes : int
        Number of scenes.
    particles : tuple of (int, int)
        Fewest and most particles of a scene.
    dt_s : tuple of (float, float)
        Shortest and longest step [s].
    simulated_s : float
        Longest time of a scene since its start [s].
    step_bound : tuple of (float, str) or None
        Longest step that the filling allows or advises [s], and why; None where any does. Of
        several fillings that of which a scene takes the largest share.
    momentum_error : float
        Momentum that no impulse explains, as a share of that exchanged, in the worst scene.
    scene_steps : int
        Number of steps of all scenes.
    particle_steps : int
        Number of steps of all scenes, each times its particles.
    container_evaluations : int
        Evaluations of the container's right-hand side since the start; 0 on the base.
    compile_seconds : float
        Time spent on compiling [s].
    run_seconds : float
        Time spent on stepping [s].
    certificate : Certificate
        Table of the effects: which acted, since when, and what was left out.
    order : int, optional
        Order of the error in the step; None where the filling declares none.
    sampling : tuple of (int, float), optional
        Number of measured cycles, and half-width of the mean of the highest RMS as a share of it,
        with a confidence of 95 %; None where unknown, as for a mean that still changes.
    diverged : tuple of str
        A sentence for each scene that diverged, the first in time first; its results are nan.
    excitation : tuple of str, default ()
        Excitation beside the sine of the base, and treatment of samples, in words.
    transient : str, default ""
        Why the mean of the highest RMS is not known, in words.
    bound_taken : float, default 0.0
        Step of that scene, as a share of ``step_bound``.
    """

    method: str
    mount: str
    effects: tuple[str, ...]
    scenes: int
    particles: tuple[int, int]
    dt_s: tuple[float, float]
    simulated_s: float
    step_bound: tuple[float, str] | None
    momentum_error: float
    scene_steps: int
    particle_steps: int
    container_evaluations: int
    compile_seconds: float
    run_seconds: float
    certificate: Certificate
    order: int | None = None
    sampling: tuple[int, float] | None = None
    diverged: tuple[str, ...] = ()
    excitation: tuple[str, ...] = ()
    transient: str = ""
    bound_taken: float = 0.0

    def __repr__(self):
        times = f"{self.simulated_s:.4g} s simulated", f"{self.run_seconds:.3g} s run"
        return in_brief(self, self.method, self._scenes(), *times, "print it for all figures")

    def _scenes(self):
        return f"{counted(self.scenes, 'scene')} with {_range(self.particles)} particles"

    @property
    def effect_activity(self) -> tuple[EffectUse, ...]:
        """Activity of each effect that can be counted, since the start."""
        return self.certificate.acting

    @property
    def checked(self) -> CheckedRange | None:
        """Range in which the filling was checked, and what of the run lies outside."""
        return self.certificate.checked

    @property
    def particle_steps_per_second(self) -> float:
        """Speed without compiling [1/s]; 0 before anything has run."""
        return self.particle_steps / self.run_seconds if self.run_seconds > 0.0 else 0.0

    @property
    def known_error(self) -> str:
        """What is known of the error of the run, for nothing extra."""
        order = "order unknown" if self.order is None else f"order {self.order}"
        parts = [f"step {_range(self.dt_s)} s, {order}"]
        parts.append(f"momentum closes to {100.0 * self.momentum_error:.2g} %")
        if self.sampling is not None:
            cycles, share = self.sampling
            known = f"known to {100.0 * share:.2g} %"
            parts.append(f"highest RMS, a mean over {counted(cycles, 'cycle')}, {known}")
        elif self.transient:
            parts.append(f"highest RMS not known: {self.transient}")
        return "; ".join(parts)

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file."""
        figures = asdict(self)
        table = figures.pop("certificate")
        figures.update(acted=table["acting"], checked=table["checked"])
        figures["certificate"] = self.certificate.as_dict()
        derived = ("particle_steps_per_second", "known_error")
        return {**figures, **{name: getattr(self, name) for name in derived}}

    def write(self, path: FileName) -> None:
        """Write all figures as a JSON file, which is replaced as a whole."""
        write_text(path, json.dumps(self.as_dict(), indent=1))

    def _bound(self):
        """Bound of the step, and the step relative to it."""
        if self.step_bound is None:
            return ""
        most, why = self.step_bound
        return f"{why}: {most:.3g} s, of which steps take {self.bound_taken:.2g}"

    def _rows(self):
        """All lines by name."""
        gone = f"{counted(len(self.diverged), 'scene')}; these and all on their structures have NaN"
        checked = self.checked
        acted = [f"{use.effect}: {use}" for use in self.effect_activity]
        acted += self.certificate.left_out_lines()
        return {
            "method": f"{self.method}, container on the {self.mount}",
            "excitation": "\n".join(self.excitation),
            "effects": "\n".join([", ".join(self.effects) or "none", *acted]),
            "scenes": self._scenes(),
            "simulated": f"{self.simulated_s:.4g} s in steps of {_range(self.dt_s)} s",
            "diverged": f"{gone}\n{self.diverged[0]}" if self.diverged else "",
            "step bound by": self._bound(),
            "momentum error": f"{self.momentum_error:.2g} of what was exchanged",
            "known error": self.known_error.replace("; ", "\n"),
            "checked with": f"{checked.words}\n{checked.finding}" if checked is not None else "",
            "steps": f"{self.scene_steps:,} of scenes, {self.particle_steps:,} of particles",
            "evaluations": f"{self.container_evaluations:,} of the container's motion",
            "time": (
                f"{self.compile_seconds:.1f} s before the first step, {self.run_seconds:.1f} s run "
                f"({1e-6 * self.particle_steps_per_second:.3g} million particle steps a second)"
            ),
        }

    def details(self) -> str:
        """All figures."""
        return in_lines(self._rows())

    def __str__(self):
        """At most fifteen lines: what came out, how sure, how long; then how."""
        rows = self._rows()
        brief = {
            "result": f"{rows['scenes']}, {rows['simulated']}",
            "error": self.known_error,
            "time": rows["time"],
            "method": rows["method"],
            "excitation": "; ".join(self.excitation),
            "effects": ", ".join(self.effects) or "none",
            "diverged": rows["diverged"],
            "step bound by": rows["step bound by"],
            "checked range": self.checked.finding if self.checked is not None else "",
            "certificate": self.certificate.verdict,
        }
        return in_lines(brief, (), BRIEF)


def _range(pair):
    low, high = (f"{value:.3g}" for value in pair)
    return low if low == high else f"{low} to {high}"


def needed_effects(result: object, tolerance: float = 1e-3) -> EffectTable:
    """Advice on the effects of a run of the damper.

    Parameters
    ----------
    result : Response or Report
        Result of ``frequency_response``, or the report of a batch.
    tolerance : float, default 0.001
        Share of the energy taken (friction) or in motion (rotation) that is negligible, 0 to 1.

    Notes
    -----
    Spheres are checked every few steps: an effect that may have acted between two checks is kept.

    Examples
    --------
    >>> print(needed_effects(response))  # doctest: +SKIP
    """
    report: Report = instance("result", getattr(result, "report", result), Report)
    share = fraction("tolerance", tolerance)
    return report.certificate.advised(share)
