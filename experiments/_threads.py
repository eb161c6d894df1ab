"""Gain of a second thread for whole steps of a large block, and the least work of steps.

See ``taichi_dem.kit.study.floors`` for that work.
"""

import time

import numpy as np

from _blast import METHODS, paper_effects
from taichi_dem import CONCRETE, InputError, Scene, Simulation, effects, read_mesh, runtime
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study import call_in_process
from taichi_dem.kit.study.floors import CACHE, Copy, Work
from taichi_dem.kit.timing import busiest_seconds, thread_seconds
from taichi_dem.mesh.shapes import bar, in_space_order

#: How often runs on one and on two threads take turns.
ROUNDS = 2
#: Edge of the boxes of the bar that stands for a block [m]: more bodies make it larger.
BOX = 0.05
#: What every step writes of bodies and bonds, and what it reads besides; also the laws of bonds.
WRITTEN = "slot position orientation velocity spin angular_momentum bond_drag".split()
READ = (
    *("bond_frame", "vertex_master", "vertex_slave", "bond_stiffness", "bond_slots", "bond_pair"),
    *("unit_area", "tables.dashpot.coefficient", "broken_tick"),
    *("mass_inverse", "inertia_inverse", "level", "last_tick"),
)
#: The visit of a bond, in f64 and without regard to how things are stored. It reads two numbers of
#: bodies (8 bytes), the symmetric 6x6 block (21 numbers), the branch (3), the twist of the last
#: visit (6), and of both bodies twist (6), symmetric inverse inertia (6) and inverse mass (1). It
#: writes the twist of the visit (6) and those of both bodies (12): 74 numbers. Operations: the
#: twist of a bond is 6 differences, a cross product (9) and its difference (3), before and after
#: (36); less the last one (6), times the block (66), its square (5); the moment at the other body
#: (12), two products of 3x3 matrices with vectors (30), two with masses (6), and 12 sums: 173.
VISIT = Work(bytes=8 + 8 * 74, flops=173)


def bytes_a_step(engine):
    """Bytes that a step of all bodies and bonds must read, and those that it must write."""
    parts = FieldMemory(engine.tables, "constant"), FieldMemory(engine.state, "saved")
    fields = {name: field for part in parts for name, field in part.fields.items()}
    laws = [name for name in fields if name.startswith("tables.bond.")]

    def size(names):
        return sum(engine.values(fields[name]).nbytes for name in names if name in fields)

    return size([*WRITTEN, *READ, *laws]), size(WRITTEN)


def counts_of(simulation):
    """Numbers of evaluated bonds, and of visits of bonds in sweeps, since the start."""
    counts = simulation.values(simulation.schedule.evaluations).tolist()
    # Those of the third count are both.
    return counts[5], counts[2] - counts[5]


def work_since(simulation, before=(0, 0), store=CACHE):
    """Least work of a run since it had some ``counts_of``; store: floor that holds for its bytes.

    A bond that is evaluated stands for its share of a step of all bodies, and each visit of a sweep
    comes to that. Contacts, searches and changes of lists are left out.
    """
    evaluated, visits = (now - then for now, then in zip(counts_of(simulation), before))
    share = sum(bytes_a_step(simulation.engine)) / simulation.model.bond_count
    return Work(share * evaluated, store=store) + VISIT * visits


def thread_job(mesh, cells, methods, threads, steps, repeats, arch=""):
    """Result of ``whole_steps`` in a process of its own: threads cannot change within one."""
    job = {"mesh": mesh, "cells": cells, "methods": [*methods], "steps": steps, "repeats": repeats}
    title = f"on {threads} threads{arch and ' of '}{arch}"
    return call_in_process(whole_steps, arch=arch, threads=threads, title=title, **job)


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
        raise InputError("one thread and two threads must give the same bits, but do not")

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
    block = bar(BOX * cells[0], BOX * cells[1], cells)
    return Scene(in_space_order(block), CONCRETE, [*blown, gas])


def whole_steps(mesh, cells, methods, steps, repeats):
    """Whole steps by the parallel driver, two of them to warm up; for a JSON file.

    By method, seconds: of a step, one a repeat. busy: the same of what the busiest thread took of
    the cores. work: least bytes and operations of a step. digest: of where bodies end. bandwidth:
    of a copy in memory by these threads [B/s]. One method after the other, as 100,000 bodies take
    2.4 GB.
    """
    scene, found = scene_of(mesh, cells), {}
    for name in methods:
        make, step = METHODS[name]
        simulation = Simulation(scene, make(step), "parallel")
        # A copy of each: its arrays are cleared with all others.
        found[name] = {**timed_steps(simulation, steps, repeats), "bandwidth": Copy().bandwidth()}
        runtime.clear()
    return found


def timed_steps(simulation, steps, repeats):
    """Steps of a simulation from the second on, see ``whole_steps``."""
    simulation.advance_to(2)
    seconds, busy, counts = [], [], counts_of(simulation)
    for k in range(repeats):
        started, before = time.perf_counter(), thread_seconds()
        simulation.advance_to(2 + (k + 1) * steps)
        seconds.append((time.perf_counter() - started) / steps)
        spent = busiest_seconds(before, thread_seconds())
        busy.append(None if spent is None else spent / steps)
    motion, work = simulation.state.motion(), work_since(simulation, counts)
    each = 1.0 / (steps * repeats)
    return {
        "seconds": seconds,
        "busy": busy,
        "bodies": simulation.model.body_count,
        "work": [each * work.bytes, each * work.flops],
        "digest": digest(*(np.ascontiguousarray(motion[key]) for key in ("position", "velocity"))),
    }
