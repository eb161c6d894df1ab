"""Output of a run: time series, frames for pictures, CSV files, written whole or not at all."""

from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from ca_damper.measures import SAMPLE_UNITS
from ca_damper.progress import Stages
from taichi_dem.kit.data_table import dataset
from taichi_dem.kit.display import by_fields, counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.extended_xyz import XyzFrame, write_extended_xyz
from taichi_dem.kit.progress.progress import Listener
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, FileName, shown, whole

_MOST_STEPS = 2**31 - 1
_MOST_MARKS = 1_000_000


@dataclass(frozen=True, eq=False)
class Frame:
    """Snapshot of one scene.

    Parameters
    ----------
    time_s : float
        Time [s].
    x : float
        Displacement of the container [m].
    y : float
        Displacement of the base [m].
    position : ndarray
        Positions of the particles, horizontal and vertical, as the ``snapshot`` of the filling [m],
        shape (particles, 2).
    velocity : ndarray
        Velocities of the particles [m/s], shape (particles, 2).
    diameter : ndarray, optional
        Diameter of each particle [m], shape (particles,), where they are of several sizes; else
        None.
    """

    time_s: float
    x: float
    y: float
    position: np.ndarray
    velocity: np.ndarray
    diameter: Optional[np.ndarray] = None

    def __repr__(self):
        return by_fields(self)


@dataclass(frozen=True, eq=False)
class Film:
    """A recorded run.

    Parameters
    ----------
    history : dict
        Arrays (samples, scenes) by name, see ``Batch.sample``.
    frames : tuple of tuple of Frame
        Frames of each scene.
    filling : Filling
        Of the batch.
    """

    history: dict[str, np.ndarray]
    frames: tuple[tuple[Frame, ...], ...]
    filling: Any = None

    def __repr__(self):
        samples, scenes = np.shape(self.history.get("time_s", np.zeros((0, 0))))
        most = max((len(frames) for frames in self.frames), default=0)
        of_each = f"{counted(most, 'frame')} of each" if most else "no frames"
        return in_brief(self, counted(samples, "sample"), counted(scenes, "scene"), of_each)

    def to_xarray(self) -> Any:
        """The history as an xarray Dataset over sample and scene, units in attributes.

        Raises
        ------
        InputError
            Where xarray is not installed.
        """
        dims = "sample", "scene"
        found = {name: (dims, array, SAMPLE_UNITS[name]) for name, array in self.history.items()}
        return dataset(found, {})

    def write_xyz(self, path: FileName, scene: int = 0) -> None:
        """Write the frames of a scene as an extended XYZ file for OVITO.

        Parameters
        ----------
        path : str or path
            Such as ``"grains.xyz"``.
        scene : int
            Number of the scene, from 0 on.

        Raises
        ------
        InputError
            Where the film has no frames or no such scene, the filling has no box, or the file
            cannot be written.

        Notes
        -----
        Columns: pos [m] and velo [m/s], across, up, and 0; radius [m]. The cell is the box, which
        moves with its container.
        """
        if not self.frames:
            raise InputError("a film must have frames for this: film(..., frame_every=1) keeps all")
        shots = self.frames[whole("scene", scene, 0, len(self.frames) - 1)]
        width, height, diameter = inner_size(self.filling)
        size = (width, height, diameter)
        write_extended_xyz(path, [_particles(shot, size) for shot in shots])


def inner_size(filling: Any) -> tuple[float, float, float]:
    """Width and height of the box of an Automaton or Spheres, and diameter of a particle [m]."""
    if hasattr(filling, "columns"):
        cell = filling.width
        return filling.columns * cell, filling.rows * cell, cell
    if not hasattr(filling, "diameter"):
        raise InputError(f"filling must be an Automaton or Spheres for this, got {shown(filling)}")
    return filling.width, filling.height, filling.diameter


def _particles(shot, size):
    """Particles of a frame in the room, in which the container has moved by x."""
    flat, count = np.zeros((len(shot.position), 1)), len(shot.position)
    diameter = np.full(count, size[2]) if shot.diameter is None else shot.diameter
    columns = {
        "pos": np.hstack([shot.position + np.array([0.0, shot.x]), flat]),
        "radius": 0.5 * diameter,
        "velo": np.hstack([shot.velocity, flat]),
    }
    return XyzFrame(shot.time_s, columns, (0.0, shot.x, -0.5 * size[2]), size)


def film(
    batch: Any,
    steps: int,
    *,
    sample_every: int = 1,
    frame_every: Optional[int] = None,
    progress: Union[Listener, str, None] = AUTO,
) -> Film:
    """Run a batch of few scenes on by a number of steps and record it.

    Parameters
    ----------
    batch : Batch
        Batch that has been started.
    steps : int
        Number of steps.
    sample_every : int, default 1
        Steps between samples; the present state is the first sample.
    frame_every : int, optional
        Steps between frames; None for no frames.
    progress : callable or str or None, default "auto"
        As in ``frequency_response``.

    Returns
    -------
    Film
        Samples of all scenes, and frames with the positions of the particles.

    Raises
    ------
    InputError
        The batch was not started, or a number is out of range.
    SimulationDiverged
        A scene left the range in which its numbers mean anything.

    Examples
    --------
    >>> shot = film(batch, steps=2000, frame_every=100)  # doctest: +SKIP
    """
    if not hasattr(batch, "sample") or isinstance(batch, type):
        raise InputError(f"batch must be a Batch that has been started, got {shown(batch)}")
    steps = whole("steps", steps, 1, _MOST_STEPS)
    samples = _marks("sample_every", sample_every, steps)
    frames = _marks("frame_every", frame_every, steps) if frame_every is not None else set()
    marks = sorted(samples | frames | {steps})
    rows, shots = [], []
    with reporting(progress, "film") as report_progress:
        tell = Stages(report_progress, [mark / steps for mark in marks[1:]])
        for before, mark in zip([0, *marks], marks):
            if mark > before:
                batch.advance(mark - before, tell)
            present = batch.sample()
            if mark in samples:
                rows.append(present)
            if mark in frames:
                shots.append(frames_of(batch, present))
    history = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    return Film(history, tuple(zip(*shots)), batch.filling)


def _marks(name, every, steps):
    """Steps at which to record, from 0 on; InputError where they are too many to be kept."""
    if whole(name, every, 1, _MOST_STEPS) * _MOST_MARKS < steps:
        raise InputError(
            f"{name} must be at least {-(-steps // _MOST_MARKS)} in a film of {steps} steps, "
            f"got {every}"
        )
    return set(range(0, steps + 1, every))


def frames_of(batch: Any, present: Optional[dict[str, np.ndarray]] = None) -> tuple[Frame, ...]:
    """A Frame of every scene of a batch as it is now.

    present: what ``Batch.sample`` has just given, if it has been asked.
    """
    found = batch.sample() if present is None else present
    time_s, x, y = (found[name].tolist() for name in ("time_s", "x", "y"))
    shots = [batch.snapshot(s) for s in range(batch.count)]
    return tuple(
        Frame(time_s[s], x[s], y[s], shot["position"], shot["velocity"], shot.get("diameter"))
        for s, shot in enumerate(shots)
    )
