"""Runs that ``cost_of_effects.py`` makes in processes of their own, and what they cost."""

import time
from functools import partial

import numpy as np

from _blast import EFFECTS
from _effects_stripped import elastic_step_seconds
from ca_damper import Automaton, Batch, Oscillator, SceneTable, Spheres
from taichi_dem import CONCRETE, PAPER_BLOCK, ImplicitDashpots, Scene, read_mesh, simulate
from taichi_dem.kit.allocation import field_bytes
from taichi_dem.kit.errors import SimulationDiverged

FILLINGS = {"spheres": Spheres, "automaton": partial(Automaton, rules="paper")}
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
        "hole_mm": float(result.series["hole_radial_displacement_mm"][-1]),
        "broken_faces": report.broken_faces,
        "shares": {use.effect: use.share for use in report.effect_activity},
    }


def damper(filling, options, particles, step, ratios, seeds, cycles):
    """A response curve; cycles: before measuring, and measured."""
    started = time.process_time()
    batch = damper_batch(filling, options, particles, step, ratios, seeds, cycles[1])
    batch.start("rigid")
    batch.advance(0)
    ready = time.process_time()
    try:
        measured = batch.run(*cycles)
    except SimulationDiverged as error:
        return {"failed": str(error)}
    return {
        "compile_s": ready - started,
        "run_s": time.process_time() - ready,
        "steps": batch.report().scene_steps,
        "memory_MB": 1e-6 * field_bytes(),
        "rms_mm": (1e3 * measured.rms).reshape(len(seeds), len(ratios)).tolist(),
    }


def damper_batch(filling, options, particles, step, ratios, seeds, measured_cycles):
    """Scenes of the paper's oscillator; ratios: of frequencies to its natural one, each seed."""
    oscillator = Oscillator()
    frequency, seed = np.meshgrid(np.array(ratios) * oscillator.natural_frequency, seeds)
    scenes = particles, seed.ravel(), step, frequency.ravel(), oscillator.base_amplitude
    made = FILLINGS[filling](**options)
    table = SceneTable(*scenes)
    return Batch(made, table, measured_cycles=measured_cycles, if_diverged="raise")


def absent(substeps, repeats):
    """Seconds of some substeps of an elastic block: as composed, and with what is by hand."""
    return elastic_step_seconds(read_mesh(PAPER_BLOCK), substeps, repeats)
