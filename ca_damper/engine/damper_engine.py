"""Engine of the damper: fields and kernels of one structure, compiled once for all its batches."""

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any

from taichi.lang import impl

from ca_damper.engine.account import MomentumAccount
from ca_damper.engine.container import CONTAINERS
from ca_damper.engine.coupling import Coupling
from ca_damper.filling import LEAST_PLACES, check_device, check_places, structure_of
from ca_damper.scenes.clock import Clock
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.engine_pool import Engine, EnginePool, Loan
from taichi_dem.kit.errors import InputError

#: Least room for scenes, measured cycles, and places of a scene: below, nothing is saved.
_LEAST = (64, 32, *(LEAST_PLACES,) * 32)


@dataclass(frozen=True)
class EngineStructure:
    """Compiled structure of a batch: key of its filling's structure, mount, names of sizes.

    filling: one of that structure, which declares the fields.
    """

    key: Hashable
    mount: str
    sizes: tuple[str, ...]
    filling: Any = field(compare=False)


class DamperEngine(Engine):
    """Clock, container, filling and measures of the scenes of one batch at a time."""

    advice = (
        "run fewer scenes at a time, measure fewer cycles, or give back the memory of earlier "
        "batches by runtime.clear()"
    )
    structure: EngineStructure

    def declare(self) -> None:
        """Declare the fields of all parts."""
        scenes, cycles, *places = self.capacity
        sizes = dict(zip(self.structure.sizes, places))
        self.table = SceneFields(scenes, {"cycles": cycles, **sizes})
        self.clock = Clock(self.table)
        self.container = CONTAINERS[self.structure.mount](self.table, self.clock)
        self.device = self._bound()
        self.account = MomentumAccount(self.table)
        self.coupling = Coupling(self.table, self.clock, self.container, self.device, self.account)
        self.is_compiled = False

    def _bound(self) -> Any:
        filling, builder = self.structure.filling, impl._root_fb
        try:
            return check_device(filling, filling.bind(self.table))
        finally:
            if builder.finalized:
                # Taichi allocated what was declared so far at the first use of a field.
                raise InputError(
                    "bind of a filling must declare its fields and use none of them: write their "
                    f"values in 'load', got {type(filling).__name__}"
                )

    def load(self, filling: Any, table: SceneTable, rtol: float, atol: float) -> None:
        """Take over the numbers of a batch; the state follows with ``coupling.start``."""
        self.table.load(table)
        self.container.load(filling.gravity, rtol, atol)
        self.coupling.load(filling.gravity)
        self.account.load(filling.particle_mass * filling.gravity)
        if hasattr(filling, "structure"):
            self.device.load(filling)


_POOL = EnginePool(DamperEngine, _LEAST)


def borrow(filling: Any, mount: str, scenes: int, cycles: int) -> Loan:
    """Borrow an engine in which so many scenes of a filling find room; InputError if none can."""
    structure = structure_of(filling)
    places = tuple(structure.sizes.values())
    check_places(scenes, max((1, *places[:1])))
    asked = EngineStructure(structure.key, mount, tuple(structure.sizes), filling)
    return _POOL.borrow(asked, (scenes, max(1, cycles), *places), filling, "batch")
