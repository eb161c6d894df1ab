"""What reports read of a simulation, and what they keep of it over a run."""

from collections.abc import Mapping
from typing import ClassVar, NamedTuple, Optional

import numpy as np

from taichi_dem.contact.contacts import Contacts
from taichi_dem.report.readings import Readings
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.step.advance import Advance
from taichi_dem.step.multirate.schedule import Schedule


class Run(NamedTuple):
    """What a report reads of a simulation; contacts is None without contact."""

    model: Model
    state: State
    schedule: Schedule
    advance: Advance
    readings: Readings
    contacts: Optional[Contacts]


class Kept:
    """What is followed over a run: a checkpoint holds its attributes of the names ``kept``."""

    kept: ClassVar[tuple[str, ...]] = ()

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        return {name: np.array(getattr(self, name)) for name in self.kept}

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        for name in self.kept:
            setattr(self, name, saved[name].copy()[()])
