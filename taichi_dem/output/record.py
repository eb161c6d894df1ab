"""Output of a run: time series, snapshots, ParaView files; written whole or not at all."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.display import by_fields
from taichi_dem.kit.files import output_folder, remove_files, write_csv
from taichi_dem.kit.fixed_order import largest_eigenvalues
from taichi_dem.kit.validation import FileName, file_stem, flag, instance, several
from taichi_dem.loads.pressure import GasPressure
from taichi_dem.mesh.files import write_pvd, write_vtu
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.output.hole_monitor import hole_of
from taichi_dem.report.forces import force_names
from taichi_dem.report.stress import body_stress
from taichi_dem.simulation import Simulation
from taichi_dem.state.model import Model
from taichi_dem.state.timeline import MAX_LEVEL, NEVER

#: Energy terms that have a column of their own in the time series, in its order.
ENERGY_COLUMNS = tuple(
    "kinetic bond_strain sphere_strain gas_work bond_dashpot softening release slip sphere_dashpot "
    "friction injected residual".split()
)

#: Letters of a series' name.
_LONGEST_NAME = 50


@dataclass(frozen=True, eq=False)
class Frame:
    """Snapshot of the block at one time.

    Parameters
    ----------
    time_s : float
        Time [s].
    position : ndarray
        Positions of the centres [m], shape (body_count, 3).
    rotation : ndarray
        Rotation matrices, from body to world axes [-], shape (body_count, 3, 3).
    displacement : ndarray
        Displacements from the start [m], shape (body_count, 3).
    velocity : ndarray
        Velocities of the centres [m/s], shape (body_count, 3).
    level : ndarray
        Levels of the step, dt0 / 2^level, shape (body_count,).
    damage : ndarray
        Share of the fracture energy that a body's bonds have spent, 0 to 1, (body_count,).
    bound : ndarray
        Index in ``step_control.CRITERIA`` of what bounds the step, shape (body_count,).
    angular_momentum : ndarray
        About each body's own centre, in world axes [kg m^2/s], shape (body_count, 3).
    stress : ndarray
        Mean stress [Pa], shape (body_count, 3, 3): symmetric, in world axes, tension positive.

    Notes
    -----
    The stress is the symmetric part of the sum of forces times arms from the centre, over the
    volume at rest. Forces are those of bonds (springs, and dashpots where they act) and contacts,
    and of loads, ground and supports on the faces of their groups, at the faces' middles. Weight,
    loads without a group and inertia act at the centre and add nothing; centrifugal terms of a
    rotating body are left out. Dashpots have velocities of half a step before.
    """

    time_s: float
    position: np.ndarray
    rotation: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    level: np.ndarray
    damage: np.ndarray
    bound: np.ndarray
    angular_momentum: np.ndarray
    stress: np.ndarray

    __repr__ = by_fields

    @property
    def speed(self) -> np.ndarray:
        """Speed of every body [m/s], (n,)."""
        return np.linalg.norm(self.velocity, axis=1)

    @property
    def largest_stress(self) -> np.ndarray:
        """Largest principal stress of every body [Pa], (n,), tension positive."""
        return largest_eigenvalues(self.stress)


class Recorder:
    """Collects samples and frames of a simulation."""

    grows = "row.", "frame."

    def __init__(self, simulation: Simulation, *groups: str, brief: bool = False):
        self.simulation, self.model, self.brief = simulation, simulation.model, brief
        self.holes = {group: hole_of(self.model, group) for group in groups}
        loads = enumerate(self.model.loads)
        self.gas = [place for place, load in loads if isinstance(load, GasPressure)]
        self.forces = force_names(self.model)
        grounds = self.forces[len(self.model.loads) :][: len(self.model.ground)]
        self.grounds = [f"{name.removesuffix('_force')}_J" for name in grounds]
        self.rows: list[dict[str, float]] = []
        self.frames: list[Frame] = []
        self.peak_speed = np.zeros(self.model.body_count)

    def compile(self) -> None:
        """Compile all that recording needs, so that nothing later keeps Ctrl-C waiting."""
        engine = self.simulation.engine
        if engine.recording_compiled:
            return
        engine.recording_compiled = True
        self.sample()
        self.snapshot()
        self.rows, self.frames = [], []
        self.peak_speed = np.zeros(self.model.body_count)

    def sample(self) -> None:
        """Add a row to the time series."""
        sim: Any = self.simulation
        here = slice(self.model.body_count)
        position, velocity = values(sim.state.position, here), sim.readings.motion()[:, :3]
        account = sim.energy_balance.account()
        account["gas_work"] = sum(map(sim.energy_balance.load_work, self.gas))
        row = {"time_s": sim.time_s}
        for group, hole in self.holes.items():
            name, body = ("hole", "") if len(self.holes) == 1 else (group, f"{group}_")
            row[f"{name}_radial_displacement_mm"] = 1e3 * hole.radial_displacement(position)
            displacement = hole.monitored_displacement(position)
            row[f"{body}monitor_displacement_mm"] = 1e3 * displacement
        row["broken_faces"] = int(sim.state.broken().sum())
        row.update({f"{name}_J": account[name] for name in ENERGY_COLUMNS})
        if self.model.has_contact and self.model.contact.has_memory:
            row["hysteresis_J"] = account["hysteresis"]
        if self.model.ground:
            row["ground_dashpot_J"] = account["ground_dashpot"]
            row.update(self._ground_work())
        row["smallest_step_s"] = sim.method.dt0 / 2.0 ** int(values(sim.state.level, here).max())
        row["load_work_J"], row["support_work_J"] = account["load_work"], account["support_work"]
        speed = np.linalg.norm(velocity, axis=1)
        row["largest_speed_m_s"] = float(speed.max())
        for name, force in zip(self.forces, sim.forces.sums()):
            row.update({f"{name}_{axis}_N": float(force[k]) for k, axis in enumerate("xyz")})
        self.peak_speed = np.maximum(self.peak_speed, speed)
        self.rows.append(row)

    def _ground_work(self):
        """Energy that each of several grounds has taken, columns of the time series."""
        if len(self.grounds) == 1:
            return {}
        taken = self.simulation.energy_balance.works()[:, -len(self.model.ground) :].sum(axis=0)
        return dict(zip(self.grounds, (-taken).tolist()))

    def snapshot(self) -> None:
        """Keep the block as it is now."""
        self.frames.append(self.frame())

    def frame(self) -> Frame:
        """The block as it is now, a Frame."""
        motion = self.simulation.motion()
        return Frame(
            time_s=self.simulation.time_s,
            position=motion["position"],
            rotation=motion["rotation"],
            displacement=motion["position"] - self.model.centre,
            velocity=motion["velocity"],
            level=motion["level"],
            damage=self._body_damage(self.simulation.readings.damage()),
            bound=values(self.simulation.state.bound, slice(self.model.body_count)),
            angular_momentum=motion["angular_momentum"],
            stress=self._stress(),
        )

    def _stress(self):
        if self.brief:
            return np.full((self.model.body_count, 3, 3), np.nan)
        return body_stress(self.simulation.parts, self.simulation.forces)

    def example(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint of one sample and one frame; forgets all of before."""
        self.rows, self.frames = [], []
        self.sample()
        self.snapshot()
        return self.saved()

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name: columns of rows, stacks of frames."""
        rows = {f"row.{name}": column for name, column in self.history().items()}
        stacks = {
            f"frame.{field.name}": np.array([getattr(frame, field.name) for frame in self.frames])
            for field in fields(Frame)
            if self.frames
        }
        return {**rows, **stacks, "peak_speed": self.peak_speed}

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        self.peak_speed = saved["peak_speed"]
        rows = {k[4:]: column.tolist() for k, column in saved.items() if k.startswith("row.")}
        self.rows = [dict(zip(rows, values)) for values in zip(*rows.values())]
        stacks = {k[6:]: stack for k, stack in saved.items() if k.startswith("frame.")}
        times = stacks.pop("time_s", np.zeros(0)).tolist()
        self.frames = [
            Frame(time_s, **dict(zip(stacks, arrays)))
            for time_s, *arrays in zip(times, *stacks.values())
        ]

    def _body_damage(self, damage):
        bond = self.model.topology.body_bond
        # A face without a bond has the number -1, the place of the zero.
        own = np.append(damage, 0.0)[bond]
        return own.sum(axis=1) / np.maximum(1, (bond >= 0).sum(axis=1))

    def history(self) -> dict[str, np.ndarray]:
        """Time series, columns by name with a row a sample."""
        names = self.rows[0].keys() if self.rows else ()
        return {name: np.array([row[name] for row in self.rows]) for name in names}

    def broken_time(self) -> np.ndarray:
        """When each bond was released [s], (bond_count,); NaN while it holds."""
        bonds = slice(self.model.bond_count)
        tick = values(self.simulation.state.broken_tick, bonds)
        seconds = tick * (self.simulation.method.dt0 / 2.0**MAX_LEVEL)
        return np.where(tick == NEVER, np.nan, seconds)


def body_corners(model: Model, frame: Frame) -> np.ndarray:
    """World positions of the corners of all bodies in a frame [m], (n, 4, 3)."""
    arms = model.mesh.points[model.mesh.tetrahedra] - model.centre[:, None]
    return frame.position[:, None] + np.einsum("nij,nkj->nki", frame.rotation, arms)


def write_bonds(path: FileName, model: Model, broken_time: np.ndarray) -> None:
    """Write a CSV row a bond: its bodies, centre and area of its face, and when it broke."""
    top, points = model.topology, model.mesh.points
    centre = points[top.vertices].mean(axis=1)
    times = np.array(broken_time, dtype=object)
    times[np.isnan(broken_time)] = ""
    columns = {
        "bond": np.arange(top.bond_count),
        "master": top.master,
        "slave": top.slave,
        **{f"{axis}_m": centre[:, k] for k, axis in enumerate("xyz")},
        "area_m2": np.linalg.norm(area_vectors(points, top.vertices), axis=1),
        "broken_time_s": times,
    }
    write_csv(path, columns)


def write_bodies(path: FileName, frames: Sequence[Frame]) -> None:
    """Write a CSV row for each body of each frame: its level, speed and displacement."""
    moved = [np.linalg.norm(frame.displacement, axis=1) for frame in frames]
    columns = {
        "time_s": np.concatenate([np.full(len(f.level), f.time_s) for f in frames]),
        "body": np.concatenate([np.arange(len(frame.level)) for frame in frames]),
        "level": np.concatenate([frame.level for frame in frames]),
        "speed_m_s": np.concatenate([frame.speed for frame in frames]),
        "displacement_m": np.concatenate(moved),
    }
    write_csv(path, columns)


def series_name(folder: FileName) -> str:
    """Name of a series after its folder, fit for files everywhere; "run" where nothing is left."""
    name = os.path.basename(os.path.abspath(folder))
    return re.sub(r"[^\w.-]+", "_", name)[:_LONGEST_NAME].strip("._-") or "run"


def remove_series(folder: FileName, name: str) -> None:
    """Remove a ParaView series of a name, and nothing else, from a folder that may not be there."""
    remove_files(folder, re.escape(name) + r"(\.pvd|_\d{4,}\.vtu)")


def corners_of_bodies(model: Model) -> np.ndarray:
    """Numbers of the corners of every body where each brings its own, (n, 4) int32."""
    return np.arange(4 * model.body_count, dtype=np.int32).reshape(-1, 4)


def cell_data(
    model: Model, frame: Frame, acting_since: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """What ParaView gets of every body in a frame, arrays by name: see ``write_paraview``."""
    data = {
        "body_id": np.arange(len(frame.level), dtype=np.int32),
        "level": frame.level,
        "speed_m_s": frame.speed,
        "displacement_m": frame.displacement,
        "damage": frame.damage,
        "step_bound_by": frame.bound,
        "stress_Pa": frame.stress.reshape(-1, 9),
        "largest_stress_Pa": frame.largest_stress,
    }
    if not model.materials.is_one:
        data["material"] = model.materials.of_body
    for effect, since in acting_since.items():
        data[f"{effect}_acts"] = (since <= frame.time_s).astype(np.int32)
        data[f"{effect}_since_s"] = since
    return data


def write_paraview(
    folder: FileName,
    model: Model,
    frames: Sequence[Frame],
    name: str | None = None,
    acting_since: Mapping[str, np.ndarray] | None = None,
    *,
    single: bool = False,
) -> None:
    """Write frames as a ParaView series: folder/name.pvd and a VTU file a frame.

    Parameters
    ----------
    folder : path
        Folder of the series; it is made where it does not exist.
    model : Model
        Arrays of the scene, ``result.model``.
    frames : sequence of Frame
        Snapshots, ``result.frames``.
    name : str, optional
        Name of the files; that of the folder if None.
    acting_since : mapping, optional
        When effects acted first on each body [s], by name; cells then carry NAME_since_s.
    single : bool, default False
        Real numbers of 4 bytes, seven digits, and compressed: for small files.

    Notes
    -----
    Cells carry body_id, level, speed_m_s, displacement_m, damage, step_bound_by, the place in
    ``step_control.CRITERIA`` of what bounds a body's step, stress_Pa, nine components by rows, and
    largest_stress_Pa, the largest principal one; with several materials also material.
    """
    instance("model", model, Model)
    frames = several("frames", frames, lambda what, given: instance(what, given, Frame))
    instance("acting_since", acting_since, (Mapping, type(None)))
    flag("single", single)
    folder = output_folder(folder)
    name = series_name(folder) if name is None else file_stem("name", name)
    remove_series(folder, name)
    cells = corners_of_bodies(model)
    names = []
    for number, frame in enumerate(frames):
        names.append(f"{name}_{number:04d}.vtu")
        points = body_corners(model, frame).reshape(-1, 3)
        data = cell_data(model, frame, acting_since or {})
        write_vtu(os.path.join(folder, names[-1]), points, cells, data, single)
    write_pvd(os.path.join(folder, f"{name}.pvd"), [frame.time_s for frame in frames], names)
