"""Options of the combined filling."""

from dataclasses import dataclass
from typing import ClassVar

from ca_damper.combined.device import DeviceCombined
from ca_damper.filling import Structure
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.options import Spheres
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import whole


@dataclass(frozen=True)
class Combined(Spheres):
    """Spheres that take short steps where contacts last, and long ones while all of them fly.

    A step is as long as one of the automaton. Where no contact is possible in it, by bounds of all
    speeds, the grains fly through it at once; else they take ``substeps`` steps of spheres. The
    impulse of a step on the container is the sum of both. All other parameters are those of
    ``Spheres``.

    Parameters
    ----------
    substeps : int, default 5
        Steps of spheres in a step with contacts, from 1 to 1000.

    Raises
    ------
    InputError
        A value is out of its range, or ``search`` is not ``"cells"``.
    """

    substeps: int = 5

    label: ClassVar[str] = "combined"
    default_dt: ClassVar[float] = 1e-4

    def __post_init__(self) -> None:
        super().__post_init__()
        whole("substeps", self.substeps, 1, 1000)
        if self.search != "cells":
            raise InputError(
                "search must be 'cells' where grains fly in long steps, which its lists allow, "
                f"got {self.search!r}"
            )

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that are computed, in words for the report."""
        return (*super().effects, "long flights")

    def safe_step(self) -> float:
        """Step [s] whose short ones resolve the contact of spheres that fell through the box."""
        return self.substeps * super().safe_step()

    @property
    def structure(self) -> Structure:
        """As that of the spheres; substeps is a number."""
        same = super().structure
        return Structure(("combined", same.key), same.sizes)

    def bind(self, table: SceneFields) -> DeviceCombined:
        """The grains on the device, for all scenes of a table."""
        return DeviceCombined(self, table)
