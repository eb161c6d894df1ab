"""Time histories: motions of containers, or of a structure with boxes, under one excitation."""

import itertools
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ca_damper.excitation.excitation import Excitation
from ca_damper.oscillator import Oscillator
from ca_damper.report.report import Report
from ca_damper.runs.result import ScenesResult
from ca_damper.structure import ModalStructure
from taichi_dem.kit.display import counted, in_brief, listed


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionHistory(ScenesResult):
    """Base of time histories; a scene has a place and a seed."""

    label: str
    excitation: Excitation
    seeds: tuple
    time_s: np.ndarray
    base: np.ndarray
    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    rms: np.ndarray
    peak: np.ndarray
    report: Report | None = None

    #: Dimension of the places, and of the containers.
    _dimensions: ClassVar[tuple[str, str]]

    def _containers(self) -> str:
        raise NotImplementedError

    def _names(self) -> dict[str, Any]:
        """Names of places and of containers, by the beginning of their columns."""
        raise NotImplementedError

    def __repr__(self) -> str:
        axes = f"{self._containers()}, {counted(len(self.seeds), 'seed')}"
        size = f"{counted(len(self.time_s), 'sample')} in {self.time_s[-1]:.6g} s"
        highest = f"largest RMS {1e3 * np.nanmax(self.rms):.4g} mm"
        return in_brief(self, self.label, axes, size, highest)

    @property
    def relative(self) -> np.ndarray:
        """Displacement from the base [m], (samples, places, seeds)."""
        return self.x - self.base[:, None, None]

    def columns(self) -> dict[str, Any]:
        """A row a sample: time, base, x of each place and force on each container, by seed."""
        columns = {"time_s": self.time_s, "base_m": self.base}
        for values, (head, names) in zip((self.x, self.force), self._names().items()):
            for (i, name), (j, seed) in itertools.product(enumerate(names), enumerate(self.seeds)):
                columns[f"{head}{name}_seed{seed}"] = values[:, i, j]
        return columns

    def _axes(self) -> dict[str, Any]:
        return {"time": (self.time_s, "s"), "seed": (self.seeds, "1")}

    def _variables(self) -> dict[str, Any]:
        place, container = ((axis, "seed") for axis in self._dimensions)
        return {
            "base": (("time",), self.base, "m"),
            "x": (("time", *place), self.x, "m"),
            "v": (("time", *place), self.v, "m/s"),
            "force": (("time", *container), self.force, "N"),
            "rms": (place, self.rms, "m"),
            "peak": (place, self.peak, "m"),
        }


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TimeHistory(MotionHistory):
    """Motions of containers under one excitation: the places are the numbers of particles.

    Parameters
    ----------
    oscillator : Oscillator
        Primary structure.
    particles : tuple of int
        Numbers of particles.
    """

    oscillator: Oscillator
    particles: tuple

    _dimensions = "particles", "particles"

    def _containers(self) -> str:
        return f"particles {listed(self.particles)}"

    def _names(self) -> dict[str, Any]:
        return {"x_m_N": self.particles, "force_N_N": self.particles}

    def _axes(self) -> dict[str, Any]:
        return {**super()._axes(), "particles": (self.particles, "1")}

    @property
    def relative_rms(self) -> np.ndarray:
        """RMS of the samples of ``relative`` about their mean [m], (particles, seeds)."""
        return self.relative.std(axis=0)

    @property
    def relative_peak(self) -> np.ndarray:
        """Largest magnitude of ``relative`` [m], of the samples, (particles, seeds)."""
        return np.abs(self.relative).max(axis=0)

    @property
    def added_damping(self) -> np.ndarray:
        """Coefficient of a dashpot on the base that takes the filling's work [N s/m].

        -int F dx / int (x' - y')^2 dt over the run; samples must be close. NaN without motion.
        """
        work = -(self.force[1:] * np.diff(self.x, axis=0)).sum(axis=0)
        stretch = np.diff(self.relative, axis=0) ** 2
        moved = (stretch / np.diff(self.time_s)[:, None, None]).sum(axis=0)
        return np.divide(work, moved, out=np.full_like(work, np.nan), where=moved > 0.0)

    @property
    def damping_ratio(self) -> np.ndarray:
        """Share of critical damping by the structure's own dashpot and ``added_damping``."""
        o = self.oscillator
        critical = 2.0 * math.sqrt(o.stiffness * o.mass)
        return (o.damping + self.added_damping) / critical


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StructureHistory(MotionHistory):
    """Motions of a structure with boxes; in its report a place without a box is a scene too.

    Parameters
    ----------
    structure : ModalStructure
        Places and modes.
    boxes : tuple of Box
        Boxes.
    """

    structure: ModalStructure
    boxes: tuple

    _dimensions = "place", "box"

    def _containers(self) -> str:
        return f"{len(self.boxes)} box{'es' * (len(self.boxes) > 1)}"

    def _names(self) -> dict[str, Any]:
        return {"x_m_place": range(self.x.shape[1]), "force_N_box": range(len(self.boxes))}

    @property
    def modal(self) -> np.ndarray:
        """Modal coordinates p - G y of the motion from the base, (samples, modes, seeds)."""
        return np.moveaxis(self.structure._modal(np.moveaxis(self.relative, 1, -1)), -1, 1)
