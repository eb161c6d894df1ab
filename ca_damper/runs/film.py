"""Films of a run: time series and frames of every scene, and a page that plays them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.engine.recorder import ROOM
from ca_damper.report.measures import SAMPLE_UNITS
from ca_damper.report.progress import Stages
from ca_damper.report.record import SceneFrame, frames_of
from taichi_dem.kit.data_table import dataset
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, FileName, several, shown, whole
from taichi_dem.kit.viewer import WebPage

_MOST_STEPS = 2**31 - 1


@dataclass(frozen=True, eq=False)
class Film:
    """A recorded run.

    Parameters
    ----------
    history : dict
        Arrays (samples, scenes) by name, see ``Batch.sample``.
    frames : tuple of tuple of Frame
        Frames of each scene.
    filling : Filling, optional
        Filling of the batch.
    mount : str, default "spring"
        Mount of the batch.
    """

    history: dict[str, np.ndarray]
    frames: tuple[tuple[SceneFrame, ...], ...]
    filling: Any = None
    mount: str = "spring"

    def __repr__(self):
        samples, scenes = np.shape(self.history.get("time_s", np.zeros((0, 0))))
        most = max((len(frames) for frames in self.frames), default=0)
        of_each = f"{counted(most, 'frame')} of each" if most else "no frames"
        return in_brief(self, counted(samples, "sample"), counted(scenes, "scene"), of_each)

    def show(
        self,
        path: FileName | None = None,
        *,
        scenes: Sequence[int] | None = None,
        open_browser: bool | None = None,
    ) -> WebPage:
        """Write one HTML page that plays containers and grains side by side, without a network.

        Parameters
        ----------
        path : file name, optional
            Of the page; by default ``view.html`` in a new folder for temporary files.
        scenes : sequence of int, optional
            Numbers of the scenes shown, at most six; by default the first six.
        open_browser : bool, optional
            By default it opens only from a terminal of a desktop.
        """
        # Imported here, so that matplotlib loads only where something is shown.
        from ca_damper.plot.containers import MOST_SCENES, show_film

        if not self.frames:
            raise InputError("frames must be recorded to show a film: film(..., frame_every=20)")
        count = len(self.frames)
        given = range(min(MOST_SCENES, count)) if scenes is None else scenes
        chosen = several("scenes", given, lambda name, x: whole(name, x, 0, count - 1))
        if len(chosen) > MOST_SCENES:
            raise InputError(f"scenes must be at most {MOST_SCENES}, got {len(chosen)}")
        return show_film(self, chosen, path, open_browser)

    def to_xarray(self) -> Any:
        """The history as an xarray Dataset over sample and scene, units in attributes."""
        dims = "sample", "scene"
        units = {"time_s": "s", **SAMPLE_UNITS}
        variables = {name: (dims, array, units[name]) for name, array in self.history.items()}
        return dataset(variables, {})


def film(
    batch: Any,
    steps: int,
    *,
    sample_every: int = 1,
    frame_every: int | None = None,
    progress: Listener | str | None = AUTO,
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
    """
    if not hasattr(batch, "sample") or isinstance(batch, type):
        raise InputError(f"batch must be a Batch that has been started, got {shown(batch)}")
    steps, filling = whole("steps", steps, 1, _MOST_STEPS), batch.filling
    samples = range(0, steps + 1, whole("sample_every", sample_every, 1, _MOST_STEPS))
    frames = range(0)
    if frame_every is not None:
        frames = range(0, steps + 1, whole("frame_every", frame_every, 1, _MOST_STEPS))
    # The kernel takes the samples; they are read at every frame, and where it has no more room.
    room = samples.step * ROOM
    ends = sorted({*range(room, steps, room), *frames[1:], steps})
    rows, shots = [], []
    with reporting(progress, "film") as report_progress:
        tell = Stages(report_progress, [end / steps for end in ends])
        for begin, end in zip([0, *ends], ends):
            if begin in frames:
                shots.append(frames_of(batch))
            rows.append(batch.record(end - begin, samples.step, begin % samples.step, tell))
    present = batch.sample()
    if steps in samples:
        rows.append({name: values[None] for name, values in present.items()})
    if steps in frames:
        shots.append(frames_of(batch, present))
    history = {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
    return Film(history, tuple(zip(*shots)), filling, batch.mount)
