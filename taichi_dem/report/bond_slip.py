"""Residual slip of bonds that hold, as a share of the shortest edge of their face."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from taichi_dem.report.readings import Readings
from taichi_dem.state.model import Model

#: Largest slip over the shortest edge at which a bond still represents its face. Of a triangle that
#: has slid by a share s of an edge along it, (1 - s)^2 still lies on the other: at 5 % a tenth of
#: the area that the bond acts on is gone, more than an error that a user would accept.
MOST_SLIP = 0.05
_FULL = "the cohesion is undiminished: SlipWeakening in place of ShearSlip degrades it with slip"
_WEAKENED = "friction acts on the whole of it: compare with a coarser mesh"


@dataclass(frozen=True)
class BondSlip:
    """Largest residual slip of a bond that held, at the recording times of a run.

    share: of the shortest edge of its face. bond, place_m, time_s: the bond, the middle of its face
    in the mesh [m], and when. most: largest number of bonds beyond ``MOST_SLIP`` at a time.
    weakens: whether slip degrades cohesion.
    """

    share: float
    bond: int
    place_m: tuple
    time_s: float
    most: int
    weakens: bool

    #: As of a ``MissingEffect``: the effect to list.
    effect = "SlipWeakening"

    @property
    def excessive(self) -> bool:
        """Whether a bond has slipped too far to represent its face."""
        return self.most > 0

    @property
    def count(self) -> int:
        """Places of the finding, as of a ``MissingEffect``."""
        return self.most

    @property
    def what(self) -> str:
        """The finding in words."""
        return f"bonds that hold have slipped by more than {100 * MOST_SLIP:g} % of an edge"

    @property
    def figure(self) -> str:
        """The share and the bond in words."""
        return f"{100 * self.share:.3g} % of the shortest edge of its face (bond {self.bond})"

    def __str__(self):
        place = ", ".join(f"{x:.3g}" for x in self.place_m)
        remedy = _WEAKENED if self.weakens else _FULL
        return (
            f"up to {self.most} {self.what} of their face, bond {self.bond} (at {place} m) by "
            f"{100 * self.share:.3g} % at t = {self.time_s:.4g} s: less of the face lies on the "
            f"other, but {remedy}"
        )


class BondSlips:
    """Measures the residual slip of bonds at recording times."""

    def __init__(self, model: Model, readings: Readings):
        self.model, self.readings = model, readings
        (law,) = model.by_role["bond"] or model.by_role["shear"] or (None,)
        self.present = model.bond_count > 0 and getattr(law, "remembers_slip", False)
        self.weakens = getattr(law, "releases", False)
        self.share, self.time_s, self.bond, self.most = 0.0, 0.0, -1, 0
        if self.present:
            corners = model.mesh.points[model.topology.vertices]
            edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
            self.shortest = edges.min(axis=1)

    def sample(self, time_s: float) -> None:
        """Update the figures at a recording time [s]."""
        if not self.present:
            return
        share = self.readings.residual_slip() / self.shortest
        self.most = max(self.most, int((share > MOST_SLIP).sum()))
        if share.max() > self.share:
            self.bond, self.time_s = int(share.argmax()), time_s
            self.share = float(share.max())

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        return {"slip": np.array([self.share, self.time_s, self.bond, self.most])}

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        self.share, self.time_s, bond, most = saved["slip"].tolist()
        self.bond, self.most = int(bond), int(most)

    def finding(self) -> tuple[BondSlip, ...]:
        """The ``BondSlip`` of the run so far, or nothing where no bond slipped."""
        if self.bond < 0:
            return ()
        corners = self.model.topology.vertices[self.bond]
        place = tuple(self.model.mesh.points[corners].mean(axis=0).tolist())
        return (BondSlip(self.share, self.bond, place, self.time_s, self.most, self.weakens),)
