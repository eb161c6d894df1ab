"""Progress of a batch, and of runs in several stages as a whole."""

from collections.abc import Sequence
from dataclasses import dataclass

from taichi_dem.kit.display import prefixed
from taichi_dem.kit.progress import Listener, Pace, Progress

#: Calls of a progress callback keep this distance [s] when stages are short.
_LEAST_SECONDS = 0.1
#: Share of an open-ended job that its first run is taken for.
_GROWTH = 0.1


@dataclass(frozen=True)
class BatchProgress(Progress):
    """Progress of a batch. steps: scene-steps done."""

    phase: str = "stepping"
    steps: int = 0

    def __post_init__(self):
        """Say the scene-steps a second."""
        words = prefixed(self.steps / max(self.seconds, 1e-9), "scene steps/s")
        object.__setattr__(self, "words", words)


class Stages:
    """Passes the progress of stages on as that of the whole, at whose shares ``ends`` they end."""

    def __init__(self, progress: Listener | None, ends: Sequence[float]):
        self.progress, self.ends, self.stage = progress, ends, 0
        self.before = BatchProgress(0.0, 0.0)
        self.pace = Pace(_LEAST_SECONDS)

    def __call__(self, progress: Progress) -> None:
        """Take note of the present stage's progress; the stage ends with a share of 1."""
        # Progress of compiling belongs to no stage.
        if not isinstance(progress, BatchProgress):
            return self._pass_on(progress)
        begin, end = self.before.share, self._end()
        share = end if progress.share == 1.0 else begin + (end - begin) * progress.share
        seconds = self.before.seconds + progress.seconds
        steps = self.before.steps + progress.steps
        whole = BatchProgress(float(share), seconds, steps=steps)
        if progress.share == 1.0:
            self.stage, self.before = self.stage + 1, whole
        if self.pace.should_report(share == 1.0):
            self._pass_on(whole)

    def _end(self):
        return self.ends[self.stage]

    def _pass_on(self, progress):
        if self.progress is not None:
            self.progress(progress)


class OpenEnded(Stages):
    """The same of runs whose number is not known: the share grows ever slower."""

    def __init__(self, progress: Listener | None):
        super().__init__(progress, ())

    def _end(self):
        return 1.0 - 1.0 / (1.0 + _GROWTH * (self.stage + 1.0))

    def end(self) -> None:
        """Report that all is done."""
        self._pass_on(BatchProgress(1.0, self.before.seconds, steps=self.before.steps))
