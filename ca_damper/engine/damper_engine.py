"""Engine of the damper: fields and kernels of one structure, compiled once for all its batches."""

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any

from ca_damper.engine.container import Container
from ca_damper.engine.coupling import Coupling, MomentumAccount
from ca_damper.engine.mount import Mount, MountKind
from ca_damper.engine.recorder import ROOM, SampleRecorder
from ca_damper.engine.signals import DeviceExcitation
from ca_damper.engine.sine_container import SineContainer
from ca_damper.excitation.excitation import Excitation, ExcitationKind
from ca_damper.filling import LEAST_PLACES, Fillings
from ca_damper.scenes.clock import CycleClock
from ca_damper.scenes.gravity import gravity_along
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.engine_pool import Engine, EnginePool
from taichi_dem.kit.errors import InputError

#: Least room for scenes, measured cycles, samples, and places of a scene: below, nothing is saved.
_LEAST = (64, 32, ROOM, *(LEAST_PLACES,) * 32)
#: Most places, and most cycles or samples, in all scenes of a batch: four numbers of a place, and
#: twelve of a cycle, are half of what Taichi can index.
_MOST_PLACES, _MOST_RECORDS = 2**25, 2**23


@dataclass(frozen=True)
class EngineStructure:
    """Compiled structure of a batch: its filling's structure, mount, excitation, names of sizes."""

    key: Hashable
    mount: MountKind
    excitation: ExcitationKind
    sizes: tuple[str, ...]
    filling: Any = field(compare=False)


class DamperEngine(Engine):
    """Clock, container, filling and measures of the scenes of one batch at a time."""

    advice = (
        "run fewer scenes at a time, measure fewer cycles, or give back the memory of earlier "
        "batches by runtime.clear()"
    )
    serves = "batch"
    structure: EngineStructure

    def declare(self) -> None:
        """Declare the fields of all parts."""
        scenes, cycles, samples, *places = self.capacity
        sizes = dict(zip(self.structure.sizes, places))
        self.table = SceneFields(scenes, {"cycles": cycles, "samples": samples, **sizes})
        self.clock = CycleClock(self.table)
        self.account, self.recorder = MomentumAccount(self.table), SampleRecorder(self.table)
        mount, kind = self.structure.mount, self.structure.excitation
        self.excitation = DeviceExcitation(self.table, self.clock, kind)
        is_sine = mount.word == "spring" and kind == ExcitationKind()
        container = SineContainer if is_sine else Container
        self.container = container(self.table, self.clock, self.excitation, mount)
        self.device = self.structure.filling.bind(self.table)
        parts = self.container, self.device, self.account, self.recorder
        self.coupling = Coupling(self.table, self.clock, *parts)
        self.is_compiled = False

    def upload(
        self,
        fillings: Fillings,
        table: SceneTable,
        mount: Mount,
        rtol: float,
        atol: float,
        excitation: Excitation,
    ) -> None:
        """Take over the numbers of a batch; the state follows with ``coupling.start``."""
        self.table.upload(table)
        fillings.write(self.table.gravity, gravity_along)
        fillings.write(
            self.table.weight, lambda filling: filling.particle_mass * gravity_along(filling)
        )
        self.container.upload(mount, mount.numbers(table), rtol, atol)
        self.excitation.upload(excitation)
        self.device.upload(fillings)


_POOL = EnginePool(DamperEngine, _LEAST)


def borrow(
    fillings: Fillings,
    mount: MountKind,
    kind: ExcitationKind,
    counts: tuple[int, int, int],
    more: dict[str, int],
    owner: object,
) -> DamperEngine:
    """An engine in which so many scenes of fillings find room, for an owner; or InputError."""
    structure, filling = fillings.structure, fillings.kinds[0]
    scenes, *others = counts
    places = next(iter(structure.sizes.values()), 0)
    rooms = ("particles", places, _MOST_PLACES), ("cycles or samples", max(others), _MOST_RECORDS)
    for what, count, most in rooms:
        if scenes * count > most:
            raise InputError(
                f"scenes x {what} must be at most {most} in one batch, got {scenes} x {count}: run "
                "fewer scenes at a time, or measure fewer cycles"
            )
    sizes = {**structure.sizes, **more}
    asked = EngineStructure((type(filling), structure.key), mount, kind, tuple(sizes), filling)
    capacity = (*counts, *sizes.values())
    engine: DamperEngine = _POOL.borrow(asked, capacity, filling, owner)
    return engine
