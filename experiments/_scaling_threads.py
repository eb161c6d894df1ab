"""Gain of a second thread, or of a device, for whole steps of a large block."""

import time

import numpy as np

from _bench_work import counts_of, work_since
from _blast import METHODS, paper_effects
from taichi_dem import CONCRETE, InputError, Scene, Simulation, effects, read_mesh
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.study import call_in_process
from taichi_dem.kit.study.floors import Copy
from taichi_dem.kit.study.machine import busiest_seconds, thread_seconds
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.mesh.shapes import bar

#: How often runs on one and on two threads take turns.
ROUNDS = 2
#: Length and width of the bar that stands for a block [m].
BAR = (2.0, 1.0)


def thread_job(mesh, cells, methods, threads, steps, repeats):
    """Result of ``whole_steps`` in a process of its own: threads cannot change within one."""
    job = {"mesh": mesh, "cells": cells, "methods": [*methods], "steps": steps, "repeats": repeats}
    return call_in_process(whole_steps, threads=threads, title=f"on {threads} threads", **job)


def thread_gains(mesh, cells, methods, steps, rounds, repeats):
    """Time of one thread over that of two, a dict of figures by method; the bits must be the same.

    Runs on one and on two threads take turns, as what else keeps the cores busy changes. busy: the
    same of what the busiest thread took of the cores, None where the system does not tell. seconds:
    those of a step on two threads; work: the least of such a step.
    """
    turns = (1, 2) * rounds
    found = [thread_job(mesh, cells, methods, threads, steps, repeats) for threads in turns]
    return {
        name: gain_of(*([one[name] for one in found[k::2]] for k in (0, 1))) for name in methods
    }


def gain_of(single, double):
    """Figures of ``thread_gains``; single, double: results of runs on one and on two threads."""
    if len({one["digest"] for one in (*single, *double)}) > 1:
        raise InputError("one thread and two threads must give the same bits, and do not")

    def gain(name):
        least = [min(value for one in runs for value in one[name]) for runs in (single, double)]
        return least[0] / least[1]

    told = None not in single[0]["busy"]
    return {
        **{key: double[-1][key] for key in ("bodies", "work", "bandwidth")},
        "gain": gain("seconds"),
        "busy": gain("busy") if told else None,
        "seconds": [value for one in double for value in one["seconds"]],
    }


def scene_of(mesh, cells):
    """The paper's effects on a mesh file, or on a bar of some boxes under the same gas."""
    if mesh:
        return Scene(in_space_order(read_mesh(mesh)), CONCRETE, paper_effects())
    blown = [e for e in paper_effects() if e.name != "gas_pressure"]
    gas = effects.GasPressure(group="left")
    return Scene(in_space_order(bar(*BAR, cells)), CONCRETE, [*blown, gas])


def whole_steps(mesh, cells, methods, steps, repeats):
    """Whole steps by the parallel driver, methods by turns, two steps to warm up; for a JSON file.

    By method, seconds: of a step, one a repeat. busy: the same of what the busiest thread took of
    the cores. work: least bytes and operations of a step. digest: of where bodies end.
    """
    scene, runs = scene_of(mesh, cells), {}
    for name in methods:
        make, step = METHODS[name]
        runs[name] = TimedSteps(Simulation(scene, make(step), "parallel"), steps)
    for _ in range(repeats):
        for run in runs.values():
            run.repeat()
    bandwidth = Copy().bandwidth()
    return {name: {**run.result(), "bandwidth": bandwidth} for name, run in runs.items()}


class TimedSteps:
    """A simulation, two steps from its start, of which some steps are timed again and again."""

    def __init__(self, simulation, steps):
        self.simulation, self.steps, self.done = simulation, steps, 2
        self.seconds, self.busy = [], []
        simulation.advance_to(self.done)
        self.before = counts_of(simulation)

    def repeat(self):
        """Time another few steps."""
        self.done += self.steps
        started, before = time.perf_counter(), thread_seconds()
        self.simulation.advance_to(self.done)
        self.seconds.append((time.perf_counter() - started) / self.steps)
        spent = busiest_seconds(before, thread_seconds())
        self.busy.append(None if spent is None else spent / self.steps)

    def result(self):
        """See ``whole_steps``."""
        motion, steps = self.simulation.state.motion(), self.done - 2
        place = (np.ascontiguousarray(motion[key]) for key in ("position", "velocity"))
        work = work_since(self.simulation, self.before)
        return {
            "seconds": self.seconds,
            "busy": self.busy,
            "bodies": self.simulation.model.body_count,
            "work": [work.bytes / steps, work.flops / steps],
            "digest": digest(*place),
        }
