"""Jobs of ``cost_of_effects.py``: what is measured, and the processes that measure it."""

import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from taichi_dem.kit.study import Timing, ask_worker


@dataclass
class Job:
    """One measurement and what came of its repeats.

    group: "blast", "spheres", "automaton" or "absent". label: for tables. kind, arguments: as the
    worker takes them. results: of every repeat, the first with an empty cache of kernels.
    compiled_kB: size of the kernels that the first left there.
    """

    group: str
    label: str
    kind: str
    arguments: dict
    results: list = field(default_factory=list)
    compiled_kB: float = 0.0

    @property
    def failed(self):
        """The sentence of a run that diverged, or ""."""
        return self.first.get("failed", "")

    @property
    def first(self):
        """What the first repeat measured."""
        return self.results[0]

    @property
    def step_ms(self):
        """Timing of a step, its seconds in ms of CPU, over all repeats."""
        return Timing.of([1e3 * r["run_s"] / r["steps"] for r in self.results])


def run_all(jobs, repeats, workers, arch, bar):
    """Run every job ``repeats`` times (``absent`` once), some at a time; returns wall seconds.

    bar: a ProgressBar.
    All first runs come before all second ones, so that a busy minute of the machine does not fall
    on one job alone.
    """
    started, done = time.perf_counter(), 0
    rounds = [[job for job in jobs if k == 0 or job.kind != "absent"] for k in range(repeats)]
    total = sum(map(len, rounds))
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        places = {id(job): Path(folder, str(k)) for k, job in enumerate(jobs)}
        for some in rounds:
            for _ in pool.map(lambda job: _measure(job, places[id(job)], arch), some):
                done += 1
                bar.count(done, total)
    return time.perf_counter() - started


def _measure(job, place, arch):
    """Run a job once in a process of its own, with a kernel cache of its own at a place."""
    place.mkdir(exist_ok=True)
    cache = {"TI_OFFLINE_CACHE": "1", "TI_OFFLINE_CACHE_FILE_PATH": str(place)}
    task = {"kind": job.kind, "arch": arch, "arguments": job.arguments}
    worker = Path(__file__).with_name("_effects_worker.py")
    job.results.append(ask_worker(worker, task, f"of {job.label}", **cache))
    if not job.compiled_kB:
        job.compiled_kB = 1e-3 * sum(p.stat().st_size for p in place.rglob("*.tic"))
