"""Processes that run scenes: one that crashes or hangs loses its scene, and is replaced."""

import os
import subprocess
import sys
import tempfile
import time
from collections import deque
from typing import Any

from taichi_dem.kit import runtime
from tests.fuzz import blast_scene, damper_scene
from tests.fuzz.blast_run import run_blast
from tests.fuzz.blast_scene import BlastScene
from tests.fuzz.damper_scene import DamperScene, run_damper
from tests.fuzz.ends import ENDS, UNEXPLAINED, End, end_of
from tests.processes import users_environment
from tests.scenes import ROOT

#: A seed takes the kind of its remainder.
KINDS = (*blast_scene.KINDS, *damper_scene.KINDS)
#: Threads that a scene may have; even and odd seeds take turns.
THREADS = (1, 2)
#: Time in which a worker may compile [s], beside the time of its scene.
COMPILING = 400.0
#: Time in which a worker may write the kernels that it has compiled [s].
LEAVING = 60.0


def trial_of(seed):
    """Scene of a seed, and the function that runs it."""
    kind = KINDS[seed % len(KINDS)]
    if isinstance(kind, blast_scene.Kind):
        return BlastScene(seed, kind), run_blast
    return DamperScene(seed, kind), run_damper


def end_of_seed(seed, seconds):
    """End of the scene of a seed, which may take some seconds."""
    trial, run = trial_of(seed)
    return end_of(lambda: run(trial, seconds))


def serve(threads, seconds):
    """Run the scenes whose seeds come in, a line each; their ends go out likewise."""
    answers = os.fdopen(os.dup(1), "w")
    with tempfile.TemporaryFile() as said:
        # What a library below prints belongs to no answer, and is found.
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
        runtime.start(threads=threads)
        for line in sys.stdin:
            began = os.lseek(said.fileno(), 0, os.SEEK_END)
            end = end_of_seed(int(line), seconds)
            sys.stderr.flush()
            sys.stdout.flush()
            more = os.pread(said.fileno(), 2000, began).decode(errors="replace").strip()
            if more and end.name != UNEXPLAINED:
                end = End(UNEXPLAINED, f"printed {' '.join(more.split())[:300]}")
            answers.write(f"{ENDS.index(end.name)} {end.words}\n")
            answers.flush()


class Worker:
    """A process that serves scenes, with a queue of seeds.

    patience: time for an answer [s].
    """

    #: Program that reads seeds and writes ends.
    program = "-m", "tests.fuzz"

    def __init__(self, threads, seconds, seeds):
        self.threads, self.seconds, self.seeds = threads, seconds, deque(seeds)
        self.patience = 3.0 * seconds + COMPILING
        self.process: Any = None
        self.seed = self.deadline = None

    def begin(self):
        """Hand out the next seed, if there is one, to the process or to a new one."""
        if self.process is None:
            command = [sys.executable, *self.program, "--serve", str(self.threads)]
            command += ["--time-limit", str(self.seconds)]
            self.process = subprocess.Popen(
                command, cwd=ROOT, env=users_environment(PYTHONPATH=str(ROOT)),
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            os.set_blocking(self.process.stdout.fileno(), False)
            self.answer = b""
        self.seed = self.seeds.popleft()
        self.deadline = time.monotonic() + self.patience
        self.process.stdin.write(f"{self.seed}\n".encode())
        self.process.stdin.flush()

    def poll(self):
        """(seed, End) of the scene under way, once it has ended in one way or another."""
        self.answer += self.process.stdout.read() or b""
        if self.answer.endswith(b"\n"):
            number, _, words = self.answer.decode().strip().partition(" ")
            self.answer = b""
            return self.seed, End(ENDS[int(number)], words)
        code = self.process.poll()
        if code is not None:
            self.close()
            return self.seed, End(UNEXPLAINED, f"the process ended with code {code}")
        if time.monotonic() > self.deadline:
            self.process.kill()
            self.close()
            return self.seed, End(UNEXPLAINED, "no answer: it hangs")
        return None

    def close(self):
        """Let the process end, which then writes its kernels for the next one; else end it."""
        if self.process is not None:
            self.process.stdin.close()
            try:
                self.process.wait(LEAVING)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
            self.process.stdout.close()
            self.process = None


def ends(seeds, jobs, seconds, until, worker=Worker):
    """(seed, End) of all seeds as they come, none begun after a time ``until`` (monotonic [s])."""
    shares = [[s for s in seeds if s % len(THREADS) == k] for k in range(len(THREADS))]
    each = max(1, jobs // len(THREADS))
    waiting = deque(
        worker(threads, seconds, share[k::each])
        for k in range(each)
        for threads, share in zip(THREADS, shares)
        if share[k::each]
    )
    running = []
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                running.append(waiting.popleft())
                running[-1].begin()
            for one in list(running):
                found = one.poll()
                if found is not None:
                    yield found
                    if one.seeds and time.monotonic() < until:
                        one.begin()
                    else:
                        one.close()
                        running.remove(one)
            if time.monotonic() > until:
                waiting.clear()
            time.sleep(0.002)
    finally:
        for one in running:
            one.close()
