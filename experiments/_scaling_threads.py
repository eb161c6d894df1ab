"""Gain of a second thread, or of a device, for whole steps of a large block."""

import time

import numpy as np

from _blast import METHODS, paper_effects
from taichi_dem import CONCRETE, InputError, Scene, Simulation, effects, read_mesh
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study import call_in_process
from taichi_dem.kit.study.machine import busiest_seconds, memory_bandwidth, thread_seconds
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.mesh.shapes import bar

#: How often runs on one and on two threads take turns.
ROUNDS = 2
#: Length and width of the bar that stands for a block [m].
BAR = (2.0, 1.0)


def thread_job(mesh, cells, method, threads, steps, repeats):
    """Result of ``whole_steps`` in a process of its own: threads cannot change within one."""
    job = {"mesh": mesh, "cells": cells, "method": method, "steps": steps, "repeats": repeats}
    return call_in_process(whole_steps, threads=threads, title=f"on {threads} threads", **job)


def thread_gain(mesh, cells, method, steps, rounds, repeats):
    """Time of one thread over that of two, a row of figures; the bits must be the same.

    Runs on one and on two threads take turns, as what else keeps the cores busy changes. busy: the
    same of what the busiest thread took of the cores, None where the system does not tell. seconds:
    those of a step on two threads.
    """
    turns = (1, 2) * rounds
    found = [thread_job(mesh, cells, method, threads, steps, repeats) for threads in turns]
    if len({one["digest"] for one in found}) > 1:
        raise InputError("one thread and two threads must give the same bits, and do not")

    def least(name, first):
        return min(value for one in found[first::2] for value in one[name])

    told = None not in found[0]["busy"]
    return {
        **{key: found[-1][key] for key in ("bodies", "bytes", "bandwidth")},
        "gain": least("seconds", 0) / least("seconds", 1),
        "busy": least("busy", 0) / least("busy", 1) if told else None,
        "seconds": [value for one in found[1::2] for value in one["seconds"]],
    }


def scene_of(mesh, cells):
    """The paper's effects on a mesh file, or on a bar of some boxes under the same gas."""
    if mesh:
        return Scene(in_space_order(read_mesh(mesh)), CONCRETE, paper_effects())
    blown = [e for e in paper_effects() if e.name != "gas_pressure"]
    gas = effects.GasPressure(group="left")
    return Scene(in_space_order(bar(*BAR, cells)), CONCRETE, [*blown, gas])


def whole_steps(mesh, cells, method, steps, repeats):
    """Seconds of whole steps by the parallel driver, two of them to warm up; for a JSON file.

    seconds: of a step, one a repeat. busy: the same of what the busiest thread took of the cores.
    digest: of where bodies end.
    """
    make, step = METHODS[method]
    simulation = Simulation(scene_of(mesh, cells), make(step), "parallel")
    simulation.advance_to(2)
    seconds, busy = [], []
    for k in range(repeats):
        started, before = time.perf_counter(), thread_seconds()
        simulation.advance_to(2 + (k + 1) * steps)
        seconds.append((time.perf_counter() - started) / steps)
        spent = busiest_seconds(before, thread_seconds())
        busy.append(None if spent is None else spent / steps)
    motion = simulation.state.motion()
    return {
        "seconds": seconds,
        "busy": busy,
        "bodies": simulation.model.body_count,
        "bytes": bytes_a_step(simulation.loan.engine),
        "bandwidth": memory_bandwidth(),
        "digest": digest(*(np.ascontiguousarray(motion[key]) for key in ("position", "velocity"))),
    }


def bytes_a_step(engine):
    """Bytes that a step of all bodies must move at least: the model read, the state written too."""
    kept = FieldMemory(engine.tables, "constant"), FieldMemory(engine.state, "saved")
    read, written = (sum(array.nbytes for array in part.read().values()) for part in kept)
    return read + 2 * written
