"""Whole steps of a large block on some threads: their time, and the bytes that they must move."""

import time

import numpy as np
import taichi as ti

from cases.blast import METHODS, paper_effects
from taichi_dem import CONCRETE, InputError, Scene, Simulation, effects, read_mesh, runtime
from taichi_dem.kit import backend
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study import call_in_process, on_device
from taichi_dem.mesh.shapes import bar, in_space_order

#: Edge of the boxes of the bar that stands for a block [m]: more bodies make it larger.
BOX = 0.05
#: What every step writes of bodies and bonds, and what it reads besides; also the laws of bonds.
WRITTEN = "slot position orientation velocity spin angular_momentum bond_drag".split()
READ = (
    *("bond_frame", "vertex_master", "vertex_slave", "bond_stiffness", "bond_slots", "bond_pair"),
    *("unit_area", "tables.dashpot.coefficient", "broken_tick"),
    *("mass_inverse", "inertia_inverse", "level", "last_tick"),
)
#: The visit of a bond in a sweep. It reads two numbers of bodies, the symmetric 6x6 block (21
#: numbers), the branch (3), the twist of the last visit (6), and of both bodies twist (6),
#: symmetric inverse inertia (6) and inverse mass (1). It writes the twist of the visit (6) and
#: those of both bodies (12): 74 numbers.
VISIT_BYTES = 8 + 8 * 74
#: Numbers of an array far beyond every cache, and numbers that one instruction may take at once.
LARGE, LANES = 1 << 24, 8


def bytes_a_step(engine):
    """Least bytes that a step of all bodies and bonds moves, each number once."""
    parts = FieldMemory(engine.tables, "constant"), FieldMemory(engine.state, "saved")
    fields = {name: field for part in parts for name, field in part.fields.items()}
    laws = [name for name in fields if name.startswith("tables.bond.")]
    moved = [*WRITTEN, *WRITTEN, *READ, *laws]
    return sum(engine.values(fields[name]).nbytes for name in moved if name in fields)


def counts_of(simulation):
    """Numbers of evaluated bonds, and of visits of bonds in sweeps, since the start."""
    counts = simulation.values(simulation.schedule.evaluations).tolist()
    # Those of the third count are both.
    return np.array([counts[5], counts[2] - counts[5]])


def thread_job(mesh, cells, methods, threads, steps, repeats, arch=""):
    """Result of ``whole_steps`` in a process of its own: threads cannot change within one."""
    job = {"mesh": mesh, "cells": cells, "methods": [*methods], "steps": steps, "repeats": repeats}
    title = f"on {threads} threads{arch and ' of '}{arch}"
    return call_in_process(whole_steps, arch=arch, threads=threads, title=title, **job)


def thread_gains(mesh, cells, methods, steps, rounds, repeats):
    """Time of one thread over that of two by method, with the bodies; the bits must be the same.

    Runs on one and on two threads take turns, as what else keeps the cores busy changes.
    """
    turns = (1, 2) * rounds
    found = [thread_job(mesh, cells, methods, threads, steps, repeats) for threads in turns]
    return {name: gain_of([one[name] for one in found]) for name in methods}


def gain_of(runs):
    """Gain and bodies of runs on one and on two threads in turns."""
    if len({one["digest"] for one in runs}) > 1:
        raise InputError("one thread and two threads must give the same bits, but do not")
    single, double = (min(min(one["seconds"]) for one in runs[k::2]) for k in (0, 1))
    return {"bodies": runs[0]["bodies"], "gain": single / double}


def scene_of(mesh, cells):
    """The paper's effects on a mesh file, or on a bar of some boxes under the same gas."""
    if mesh:
        return Scene(in_space_order(read_mesh(mesh)), CONCRETE, paper_effects())
    blown = [e for e in paper_effects() if e.name != "gas_pressure"]
    gas = effects.GasPressure(group="left")
    block = bar(BOX * cells[0], BOX * cells[1], cells)
    return Scene(in_space_order(block), CONCRETE, [*blown, gas])


def whole_steps(mesh, cells, methods, steps, repeats):
    """Whole steps by the parallel driver, two of them to warm up; for a JSON file.

    By method, seconds: of a step, one a repeat. bytes: least ones of a step. digest: of where
    bodies end. bandwidth: of a copy in memory by these threads [B/s]. One method after the other,
    as 100,000 bodies take 2.4 GB.
    """
    scene, found = scene_of(mesh, cells), {}
    for name in methods:
        make, step = METHODS[name]
        simulation = Simulation(scene, make(step), "parallel")
        # A copy of each: its arrays are cleared with all others.
        found[name] = {**timed_steps(simulation, steps, repeats), "bandwidth": bandwidth()}
        runtime.clear()
    return found


def timed_steps(simulation, steps, repeats):
    """Steps of a simulation from the second on, see ``whole_steps``."""
    simulation.advance_to(2)
    seconds, counts = [], counts_of(simulation)
    for k in range(repeats):
        started = time.perf_counter()
        simulation.advance_to(2 + (k + 1) * steps)
        seconds.append((time.perf_counter() - started) / steps)
    bonds, visits = (counts_of(simulation) - counts) / (steps * repeats)
    # An evaluated bond stands for its share of a step of all bodies.
    share, motion = bytes_a_step(simulation.engine), simulation.state.motion()
    return {
        "seconds": seconds,
        "bodies": simulation.model.body_count,
        "bytes": share * bonds / simulation.model.bond_count + VISIT_BYTES * visits,
        "digest": digest(*(np.ascontiguousarray(motion[key]) for key in ("position", "velocity"))),
    }


def bandwidth(repeats=5):
    """Bytes a second that copies of a large array by all threads read and write, the best."""
    entries, lanes = int(min(LARGE, backend.most_entries())), 1 if on_device() else LANES
    a, b = (ti.Vector.field(lanes, ti.f64, shape=entries // lanes) for _ in range(2))
    seconds = []
    for _ in range(1 + repeats):
        started = time.perf_counter()
        copy(a, b)
        ti.sync()
        seconds.append(time.perf_counter() - started)
    return 16.0 * entries / min(seconds[1:])


@ti.kernel
def copy(a: ti.template(), b: ti.template()):
    """Copy a field into another."""
    for k in a:
        b[k] = a[k]
