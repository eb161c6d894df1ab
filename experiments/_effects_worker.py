"""One measurement of ``cost_of_effects.py`` in a process of its own.

    python _effects_worker.py JOB.json

The job names a function of this file and its arguments; what it measured is printed as JSON.
"""

import json
import time

import numpy as np

from _blast import EFFECTS
from _damper_response import OSCILLATOR
from _demo import set_moving
from _stripped import ByHand
from ca_damper import Automaton, Batch, SceneTable, Spheres
from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    ImplicitDashpots,
    Scene,
    Simulation,
    Uniform,
    read_mesh,
    runtime,
    simulate,
)
from taichi_dem.kit.allocation import field_bytes
from taichi_dem.kit.errors import SimulationDiverged
from taichi_dem.kit.study import read_job
from taichi_dem.step.drivers import Resident, Step

FILLINGS = {"spheres": Spheres, "automaton": Automaton}
PEAK = 575e6


def blast(names, until, step, ulps):
    """The paper's block with some effects.

    ulps: by which the peak of the gas pressure differs; nobody would notice but a chaotic run.
    """
    peak = PEAK + ulps * np.spacing(PEAK)
    acting = [EFFECTS[n](peak=peak) if n == "gas_pressure" else EFFECTS[n]() for n in names]
    scene = Scene(read_mesh(PAPER_BLOCK), CONCRETE, acting)
    started = time.process_time()
    try:
        result = simulate(scene, method=ImplicitDashpots(step), until=until, samples=25)
    except SimulationDiverged as error:
        return {"failed": str(error)}
    report = result.report
    return {
        "compile_s": time.process_time() - started - report.run_cpu_seconds,
        "run_s": report.run_cpu_seconds,
        "steps": report.substeps,
        "memory_MB": 1e-6 * field_bytes(),
        "hole_mm": float(result.history["hole_radial_displacement_mm"][-1]),
        "broken": report.broken_faces,
        "shares": {use.effect: use.share for use in report.effect_activity},
        "missed": report.needs,
    }


def damper(filling, options, particles, step, ratios, seeds, cycles):
    """A response curve; cycles: before measuring, and measured."""
    frequency, seed = np.meshgrid(np.array(ratios) * OSCILLATOR.natural_frequency, seeds)
    made = FILLINGS[filling](**options)
    table = SceneTable(particles, seed.ravel(), step, frequency.ravel(), OSCILLATOR.base_amplitude)
    started = time.process_time()
    batch = Batch(made, table, measured_cycles=cycles[1])
    batch.start("rigid")
    batch.advance(0)
    ready = time.process_time()
    try:
        measured = batch.run(*cycles)
    except SimulationDiverged as error:
        return {"failed": str(error)}
    report = batch.report()
    return {
        "compile_s": ready - started,
        "run_s": time.process_time() - ready,
        "steps": report.scene_steps,
        "memory_MB": 1e-6 * field_bytes(),
        "rms_mm": (1e3 * measured.rms).reshape(len(seeds), len(ratios)).tolist(),
        "shares": {use.effect: use.share for use in report.effect_activity},
    }


def absent(substeps, repeats):
    """Seconds of some substeps of an elastic block: as composed, and with what is by hand."""
    runs = {"composed": _elastic(None), "by_hand": _elastic(ByHand)}
    seconds = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            started = time.process_time()
            run(substeps)
            seconds[name].append(time.process_time() - started)
    return seconds


def _elastic(cls):
    """A function that takes an elastic block, its bodies shaken, some substeps on."""
    step = 1e-8
    simulation = Simulation(Scene(read_mesh(PAPER_BLOCK), CONCRETE, []), Uniform(step), "resident")
    set_moving(simulation, np.random.default_rng(1).normal(size=simulation.model.centre.shape))
    simulation.start()
    driver = simulation.driver
    if cls is not None:
        engine = simulation.loan.engine
        advance = cls(engine.tables, engine.state, engine.schedule, None)
        driver = Resident(Step(advance, engine.schedule, None))
    driver.prepare()
    return lambda substeps: driver._run(1 << 60, substeps)


def main():
    """Do a job and print what it measured."""
    job = read_job()
    runtime.start(job["arch"], 1)
    work = {"blast": blast, "damper": damper, "absent": absent}[job["kind"]]
    print(json.dumps(work(**job["arguments"])))


if __name__ == "__main__":
    main()
