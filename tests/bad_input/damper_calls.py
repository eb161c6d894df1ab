"""Every public call of ca_damper, by its name in the docs, with what it takes beside defaults."""

import functools

import numpy as np

import ca_damper as ca
from ca_damper import excitation, goals
from tests.bad_input.blast_calls import path
from tests.made_response import response

OSCILLATOR, FILLING = ca.Oscillator(), ca.RigidMass()
STRUCTURE = ca.ModalStructure([1.0, 2.0], [3.0], 0.01, [[1.0], [0.0]])
SIGNAL = excitation.sines(1.0, 1e-3, 0.1)
SCENES = {"particles": 2, "seed": 1, "dt": 1e-3, "frequency": 6.0, "base_amplitude": 1e-3}
HELD = {"mass": 0.1, "stiffness": 100.0, "damping": 0.1}
TABLE = {**SCENES, **HELD}
SILENT = {"progress": None}
CYCLES = {"transient_cycles": 1, "measured_cycles": 1}


def started():
    """A batch of a rigid mass, about to step."""
    batch = ca.Batch(FILLING, ca.SceneTable(2, 1, 1e-3), measured_cycles=1)
    batch.start("rest")
    return batch


def on_new_batch(name):
    """A method of a batch of its own at each call."""
    return lambda **options: getattr(started(), name)(**options)


def on_new_table(name):
    """Likewise of a table."""
    return lambda **options: getattr(ca.SceneTable(**TABLE), name)(**options)


def each_cycle(**options):
    """All that ``measure_each`` gives."""
    return list(started().measure_each(**options))


@functools.cache
def cycles():
    """Cycles of a rigid mass."""
    return started().run(1, 1)


@functools.cache
def made_film():
    """A film of two grains."""
    batch = ca.Batch(ca.Automaton(), ca.SceneTable(2, 1, 1e-4), mount="base")
    batch.start("rest")
    return ca.film(batch, 40, sample_every=10, frame_every=20, progress=None)


def answer():
    """Response with effects on demand."""
    options = {"seeds": 1, "dt": 1e-3, **CYCLES, "effects": "auto", **SILENT}
    return ca.frequency_response(FILLING, particles=[2], ratios=[1.0], **options)


def damper_calls():
    """Rows (name, function, arguments); names with "#" are variants of a call."""
    return [*_fillings(), *_batches(), *_structures(), *_excitations(), *_answers()]


def _fillings():
    yield "Automaton", functools.partial(ca.Automaton, rules="paper"), {}
    placed = functools.partial(ca.Automaton, rules="place")
    yield "Automaton#place", placed, {"friction": 0.3, "wall_friction": 0.3}
    yield "Spheres", ca.Spheres, {}
    placed = {"start": [[0.01, 0.01], [0.03, 0.03]], "start_velocity": [[0.0, 0.0], [0.0, 0.0]]}
    yield "Spheres#start", ca.Spheres, placed
    yield "Spheres#sizes", ca.Spheres, {"sizes": [(3, 6e-3), (2, 4e-3)]}
    for name, filling in (("Automaton", ca.Automaton()), ("Spheres", ca.Spheres())):
        yield f"{name}.clearance", filling.clearance, {"particles": 10}
        high = {"particles": 10, "clearance": 0.024}
        yield f"{name}.with_clearance", filling.with_clearance, high
    yield "RigidMass", ca.RigidMass, {}


def _batches():
    yield "SceneTable", ca.SceneTable, TABLE
    yield "SceneTable.change", on_new_table("change"), TABLE
    yield "SceneTable.drive", on_new_table("drive"), {"frequency": 5.0, "dt": 1e-3}
    yield "SceneTable.column", ca.SceneTable(**TABLE).column, {"name": "dt"}
    yield "SceneTable.row", ca.SceneTable(**TABLE).row, {"s": 0}
    yield "Batch", ca.Batch, {"filling": FILLING, "table": ca.SceneTable(**TABLE)}
    yield "Batch.start", ca.Batch(FILLING, ca.SceneTable(2, 1, 1e-3)).start, {}
    yield "Batch.drive", on_new_batch("drive"), {"frequency": 6.0}
    yield "Batch.run", on_new_batch("run"), {**CYCLES, **SILENT}
    yield "Batch.measure_each", each_cycle, {"cycles": 1, **SILENT}
    yield "Batch.advance", on_new_batch("advance"), {"steps": 2, **SILENT}
    yield "Batch.snapshot", on_new_batch("snapshot"), {"s": 0}
    yield "film", ca.film, {"batch": started(), "steps": 4, "frame_every": 2, **SILENT}
    page = {"path": path("f.html"), "scenes": [0], "open_browser": False}
    yield "runs.film.Film.show", made_film().show, page
    for name in ("mean_of", "per_step", "harmonic", "harmonic_by_cycle"):
        yield f"report.measures.Cycles.{name}", getattr(cycles(), name), {"name": "x"}
    yield "report.measures.Cycles.loss_factor", cycles().loss_factor, {"mass": 0.1}
    yield "report.measures.Cycles.damping_ratio", cycles().damping_ratio, HELD


def _structures():
    yield "Oscillator", ca.Oscillator, {}
    for name in ("transfer", "rms", "steady_state", "right_hand_side"):
        yield f"Oscillator.{name}", getattr(OSCILLATOR, name), {"frequency": 6.0}
    yield "Oscillator.peak", OSCILLATOR.peak, {}
    yield "Oscillator.scaled", OSCILLATOR.scaled, {"mass": 0.2, "base_amplitude": 1e-3}
    grain = {"particle_mass": 0.01, "restitution": 0.5, "clearance": 0.01, "frequency": 6.0}
    yield "ImpactDamper", ca.ImpactDamper, {"oscillator": OSCILLATOR, **grain}
    damper = ca.ImpactDamper(OSCILLATOR, **grain)
    yield "ImpactDamper.free", damper.free, {"t": 0.01}
    for name in ("motion", "position"):
        yield f"ImpactDamper.{name}", getattr(damper, name), {"u": 0.1, "t": 0.01}
    for name in ("start", "is_stable", "rms"):
        yield f"ImpactDamper.{name}", getattr(damper, name), {"u": 0.1}
    modes = {"masses": [1.0, 2.0], "frequencies": [3.0], "damping_ratios": 0.01}
    yield "ModalStructure", ca.ModalStructure, {**modes, "shapes": [[1.0], [0.0]]}
    matrices = {"mass": [1.0], "stiffness": [[1e3]], "damping_ratios": 0.01}
    yield "ModalStructure.from_matrices", ca.ModalStructure.from_matrices, matrices
    yield "ModalStructure.recoil", STRUCTURE.recoil, {"place": 0}
    yield "ModalStructure.modal", STRUCTURE.modal, {"motion": [1.0, 0.0]}
    asked = {"frequency": 3.0, "added_masses": [0.1, 0.0]}
    yield "ModalStructure.transfer", STRUCTURE.transfer, asked
    yield "Box", ca.Box, {"place": 0, "particles": 3}
    yield "collect_and_collide", ca.collect_and_collide, {"amplitude": 1e-2, "gap": 1e-3}
    time = np.linspace(0.0, 50.0, 500)
    fall = np.exp(-0.02 * time) * np.cos(time)
    yield "logarithmic_decrement", ca.logarithmic_decrement, {"x": fall}


def _excitations():
    where = "excitation"
    yield f"{where}.Excitation", excitation.Excitation, {"base": SIGNAL}
    nodes = {"value": [0.0, 1.0, 1.0, 0.0], "bend": [0.0] * 4}
    yield f"{where}.Signal#", excitation.Signal, {"step": 0.1, "label": "x", **nodes}
    yield f"{where}.Signal.at", SIGNAL.at, {"time_s": 0.01}
    yield f"{where}.Signal.scaled", SIGNAL.scaled, {"factor": 2.0}
    time = np.arange(100) * 0.01
    samples = {"time_s": time, "values": np.sin(10.0 * time), "of": "acceleration"}
    yield f"{where}.from_samples", excitation.from_samples, samples
    with open(path("s.csv"), "w") as file:
        file.writelines(["time_s,force_N\n", *(f"{0.01 * k},{k * (49 - k)}\n" for k in range(50))])
    yield f"{where}.from_csv", excitation.from_csv, {"path": path("s.csv"), "column": "force_N"}
    with open(path("s.at2"), "w") as file:
        file.write("PEER\n\nACCELERATION IN UNITS OF G\nNPTS= 50, DT= .01 SEC\n")
        file.writelines(f"{k * (49 - k):e}\n" for k in range(50))
    yield f"{where}.from_at2", excitation.from_at2, {"path": path("s.at2")}
    noise = {"frequencies": [1.0, 10.0], "density": [1.0, 1.0], "duration": 1.0}
    yield f"{where}.random_vibration", excitation.random_vibration, noise
    tones = {"frequencies": 1.0, "amplitudes": 1.0, "duration": 1.0}
    yield f"{where}.sines", excitation.sines, tones
    chirp = {"low": 1.0, "high": 5.0, "amplitude": 1.0, "duration": 1.0}
    yield f"{where}.sweep", excitation.sweep, chirp


def _answers():
    found, many = response(), ca.AmplitudeResponse([1e-3], [response()])
    yield "AmplitudeResponse.write_csv", many.write_csv, {"path": path("x.csv")}
    yield "Response.write_csv", found.write_csv, {"path": path("x.csv")}
    goal = {"name": "x", "unit": "m", "kind": "value", "function": len, "ratios": (1.0,)}
    yield "Goal", ca.Goal, goal
    yield "Goal.values", goals.peak_ratio().values, {"response": found}
    for name in ("apparent_mass_at", "loss_factor_at", "rms_at"):
        yield f"goals.{name}", getattr(goals, name), {"ratio": 1.0}
    yield "goals.response_curve", goals.response_curve, {"ratios": [0.9, 1.0]}
    filled = {"filling": FILLING, "particles": 2, "seeds": 1, **SILENT}
    swept = {**filled, **CYCLES, "dt": 1e-3, "ratios": [0.9, 1.0]}
    yield "frequency_response", ca.frequency_response, {**swept, "base_amplitude": 1e-3}
    yield "sweep_up_and_down", ca.sweep_up_and_down, swept
    window = {"excitation": SIGNAL, "duration": 0.01, "dt": 1e-3, "seeds": 1, **SILENT}
    yield "shake", ca.shake, {**filled, **window}
    boxes = {"filling": FILLING, "structure": STRUCTURE, "boxes": ca.Box(0, 2)}
    yield "shake_structure", ca.shake_structure, {**boxes, **window}
    ways = {"amplitudes": 1e-3, "frequencies": 6.0, "particles": 10, "clearances": 0.024}
    once = {"seeds": 1, "dt": 1e-3, **CYCLES, **SILENT}
    yield "damper_map", ca.damper_map, {"filling": ca.Automaton(), **ways, **once}
    found = {"structure": OSCILLATOR, "motion": 1e-3, "mass": 6e-3, "box": (0.06, 0.096)}
    found |= {"particles": 5, "seeds": 2, "heights": 1, "cycles": (1, 1), "confirm": ca.Automaton()}
    yield "best_damper", ca.best_damper, found
    asked = {"goal": goals.rms_at(1.0), "tolerance": 0.5, "budget_s": 60.0, "ratios": (0.9, 1.1)}
    yield "solve_response", ca.solve_response, {**filled, **asked}
    yield "needed_effects", ca.needed_effects, {"result": answer()}
