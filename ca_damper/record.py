"""Output of a run: time series, frames for pictures, CSV files, written whole or not at all."""

from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from ca_damper.progress import Stages
from taichi_dem.kit.display import by_fields, counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import Listener
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, shown, whole

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
    """

    history: dict[str, np.ndarray]
    frames: tuple[tuple[Frame, ...], ...]

    def __repr__(self):
        samples, scenes = np.shape(self.history.get("time_s", np.zeros((0, 0))))
        most = max((len(frames) for frames in self.frames), default=0)
        of_each = f"{counted(most, 'frame')} of each" if most else "no frames"
        return in_brief(self, counted(samples, "sample"), counted(scenes, "scene"), of_each)


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
    return Film(history, tuple(zip(*shots)))


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
