"""How far a run is, and runs in several stages told as one."""

import math
import time
from dataclasses import dataclass

#: Calls of a progress callback keep this distance [s] when stages are short.
_LEAST_SECONDS = 0.1


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    share: done, in [0, 1]. seconds: since it began, without compiling. steps: scene-steps done.
    """

    share: float
    seconds: float
    steps: int

    @property
    def seconds_left(self):
        """Time expected until the end [s]; infinite at the beginning."""
        return self.seconds * (1.0 / self.share - 1.0) if self.share > 0.0 else math.inf

    def __str__(self):
        """How fast it goes."""
        return f"{1e-6 * self.steps / max(self.seconds, 1e-9):.3g} M scene steps/s"


class Stages:
    """Passes the progress of stages on as that of the whole.

    progress: called with a Progress, or None for nobody. ends: ascending shares of the whole at
    which the stages end.
    """

    def __init__(self, progress, ends):
        self.progress, self.ends, self.stage = progress, ends, 0
        self.before = Progress(0.0, 0.0, 0)
        self.told = -math.inf

    def __call__(self, progress):
        """Take note of the present stage's progress; the stage ends with a share of 1."""
        begin, end = self.before.share, self.ends[self.stage]
        share = end if progress.share == 1.0 else begin + (end - begin) * progress.share
        seconds = self.before.seconds + progress.seconds
        whole = Progress(float(share), seconds, self.before.steps + progress.steps)
        if progress.share == 1.0:
            self.stage, self.before = self.stage + 1, whole
        late = time.perf_counter() - self.told > _LEAST_SECONDS
        if self.progress is not None and (late or self.stage == len(self.ends)):
            self.told = time.perf_counter()
            self.progress(whole)
