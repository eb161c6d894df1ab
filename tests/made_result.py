"""A result made up without a run: bodies that move, bonds that break, everything at random."""

import numpy as np

from cases.meshes import with_moved_nodes
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, effects
from taichi_dem.mesh.shapes import bar
from taichi_dem.output.record import ENERGY_COLUMNS, Frame
from taichi_dem.result import Result
from taichi_dem.state.model import Model

#: Time between frames [s].
STEP = 1e-5


def turned(axis, angle):
    """Rotation matrices (n, 3, 3) about axes (n, 3), of angles (n,), by Rodrigues."""
    axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    cross = np.cross(np.eye(3), axis[:, None, :])
    part = np.sin(angle)[:, None, None] * cross
    return np.eye(3) + part + (1.0 - np.cos(angle))[:, None, None] * cross @ cross


def frame_of(model, time_s, rng):
    """Bodies anywhere, in any position, with any velocity and angular momentum."""
    count = model.body_count
    rotation = turned(rng.normal(size=(count, 3)), rng.uniform(0.0, 3.0, count))
    moved, strain = 1e-3 * rng.normal(size=(count, 3)), rng.normal(size=(count, 3, 3))
    return Frame(
        time_s=time_s,
        position=model.centre + moved,
        rotation=rotation,
        displacement=moved,
        velocity=rng.normal(size=(count, 3)),
        level=np.zeros(count, dtype=np.int32),
        damage=rng.uniform(size=count),
        bound=np.zeros(count, dtype=np.int32),
        angular_momentum=1e-3 * rng.normal(size=(count, 3)),
        stress=1e6 * (strain + strain.swapaxes(1, 2)),
    )


def made_result(seed=1, mesh=None, frames=4, share=0.5):
    """A Result of a bar of which a share of the bonds breaks; forces and energies are made up.

    Velocities and spins do not belong to the positions of the frames.
    """
    rng = np.random.default_rng(seed)
    mesh = with_moved_nodes(bar(0.4, 0.1, (4, 2, 2)), 5e-3, seed) if mesh is None else mesh
    scene = Scene(mesh, CONCRETE, [effects.BondDamping(), effects.Softening()])
    model, last = Model(mesh, CONCRETE, scene.effects), STEP * (frames - 1)
    broken = rng.uniform(1e-9, max(last, 1e-6), model.bond_count)
    broken[rng.uniform(size=model.bond_count) > share] = np.nan
    shots = tuple(frame_of(model, STEP * k, rng) for k in range(frames))
    names = [f"{name}_J" for name in (*ENERGY_COLUMNS, "load_work", "support_work")]
    history = {"time_s": np.linspace(0.0, last, 7)}
    history.update({name: np.abs(rng.normal(size=7)) for name in names})
    history["broken_faces"] = np.arange(7)
    history["smallest_step_s"] = np.full(7, 1e-7)
    history["largest_speed_m_s"] = np.linspace(0.0, 3.0, 7)
    peak = np.max([np.zeros(model.body_count), *(frame.speed for frame in shots)], axis=0)
    method = ImplicitDashpots(1e-7)
    return Result(scene, method, model, history, shots, broken, peak, None)
