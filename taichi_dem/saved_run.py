"""What a checkpoint holds of a blast; what two runs must share for one to go on from the other."""

from typing import Any

import numpy as np

from taichi_dem.kit.checkpoint import Checkpoint, digest, identity_of, version_text
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.restart import CheckpointWriter, RunSnapshot, opened
from taichi_dem.kit.validation import told_apart
from taichi_dem.methods import Method
from taichi_dem.output.record import Recorder
from taichi_dem.scene import Scene
from taichi_dem.simulation import Simulation
from taichi_dem.state.timeline import MACRO_TICKS


def arrays_of(
    scene: Scene, method: Method, checkpoint: Any, resume: Any, last: int
) -> dict[str, np.ndarray] | None:
    """Arrays by name to resume from, or None; last: number of largest steps of the run."""
    if isinstance(checkpoint, Checkpoint):
        # Refuses too many of them, before anything is done.
        checkpoint.marks(last, method.dt0)
    arrays = opened(checkpoint, resume, lambda: run_identity(scene, method))
    tick = np.asarray(arrays.get("field/state.tick", 0) if arrays else 0)
    # What is no tick at all is refused where the fields are restored.
    begin = int(tick.max(initial=0)) if tick.dtype.kind == "i" else 0
    if begin > last * MACRO_TICKS:
        got, least = told_apart(last * method.dt0, begin * (method.dt0 / MACRO_TICKS))
        raise InputError(f"until must be at least {least} s, where {resume} begins, got {got}")
    return arrays


def writer_of(
    simulation: Simulation, recorder: Recorder, checkpoint: Any, resume: Any, arrays: Any
) -> CheckpointWriter:
    """Writer of checkpoints, after a resumed run has been restored."""
    if checkpoint is None and not arrays:
        return CheckpointWriter()
    run = saved_run(simulation, recorder)
    if arrays:
        room = arrays.get("simulation/room")
        # Any other is refused where it is compared.
        if np.shape(room) == np.shape(simulation.engine.capacity):
            simulation.make_room(room.tolist())
        run.restore(arrays, resume)
    return CheckpointWriter(checkpoint, run, lambda: (simulation.macro_step, simulation.time_s))


def saved_run(simulation: Simulation, recorder: Recorder) -> RunSnapshot:
    """All that a checkpoint holds of a started simulation, a ``restart.RunSnapshot``."""
    parts = {"simulation": simulation, **simulation.followed.kept, "recorder": recorder}
    identity = run_identity(simulation.scene, simulation.method)
    return RunSnapshot(identity, lambda: FieldMemory(simulation.engine), parts)


def run_identity(scene: Scene, method: Method) -> dict[str, str]:
    """Properties that a resumed run must share with the saved one, in words by name."""
    # Driver, threads, duration and recording may differ.
    mesh = scene.mesh
    groups = [array for name in sorted(mesh.groups) for array in (list(name), mesh.groups[name])]
    content = digest(mesh.points, mesh.tetrahedra, *groups)
    return {
        "version": version_text(),
        "mesh": f"{mesh.body_count} tetrahedra ({content})",
        "bonded shares": identity_of(mesh.bonded_shares),
        "material": _material_identity(scene),
        "effects": ", ".join(
            f"{effect.name} {identity_of(vars(effect))}" for effect in scene.effects
        ),
        "max_speed": identity_of(scene.max_speed),
        "initial motion": identity_of(scene.initial_motion) if scene.initial_motion else "nothing",
        "on demand": identity_of((scene.on_demand, scene.sleep)),
        "method": identity_of(method),
    }


def _material_identity(scene):
    """Materials of a scene in words, and which body has which."""
    laid = scene.body_materials
    if laid.is_one:
        return identity_of(laid.materials[0])
    names = [identity_of(material) for material in laid.materials]
    # In an order of their own, not that of the groups.
    order = sorted(range(len(names)), key=names.__getitem__)
    place = np.argsort(order)[laid.of_body]
    return f"{'; '.join(names[k] for k in order)} ({digest(place)})"
