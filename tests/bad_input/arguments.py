"""Valid arguments of public calls: by the name of a parameter, or of a call where it has others."""

import dataclasses
import functools
import os
import tempfile

import numpy as np

import ca_damper as ca
import taichi_dem as td
from ca_damper import excitation
from taichi_dem import effects, goals
from taichi_dem.mesh.mesh import with_inner_group
from taichi_dem.mesh.shapes import bar, pair, single
from tests.made_response import response
from tests.made_result import made_result

METHOD = td.Uniform(1e-7)
PAIR = pair().body_group("ore", lambda x: x[:, 0] < 1e9)
CUT = with_inner_group(PAIR, "notch", lambda x: x[:, 0] < 1.0)
SCENE, ALONE = td.Scene(CUT, td.CONCRETE), td.Scene(single(), td.CONCRETE)
ROCK = {
    **{"young": 32e9, "poisson": 0.2, "density": 2450.0, "tensile_strength": 5e6},
    **{"fracture_energy": 100.0, "friction_angle": 40.0, "cohesion": 10e6},
}
OF_BAR = td.Scene(bar(1.0, 0.3, (3, 1, 1)), td.Material.from_elastic(**ROCK))
SIGNAL = excitation.sines(1.0, 1e-3, 0.1)
STRUCTURE = ca.ModalStructure([1.0, 2.0], [3.0], 0.01, [[1.0], [0.0]])
GRAIN = ca.ImpactDamper(ca.Oscillator(), 0.01, 0.5, 0.01, 6.0)
#: Columns of a table of scenes.
TABLE = {
    **{"particles": 2, "seed": 1, "dt": 1e-3, "frequency": 6.0, "base_amplitude": 1e-3},
    **{"mass": 0.1, "stiffness": 100.0, "damping": 0.1},
}
_folder = functools.cache(tempfile.mkdtemp)


def path(name, *lines):
    """Name of a file in a folder of these calls, with these lines in it if any."""
    where = os.path.join(_folder(), name)
    if lines:
        with open(where, "w") as file:
            file.write("\n".join([*lines, ""]))
    return where


@functools.cache
def result():
    """A result that is made up but for its report, which is that of three steps."""
    short = td.simulate(ALONE, method=METHOD, until=3e-7, progress=None)
    return dataclasses.replace(made_result(), report=short.report)


@functools.cache
def simulation():
    """A simulation of one body."""
    return td.Simulation(ALONE, METHOD)


def started():
    """A batch of a rigid mass, about to step."""
    batch = ca.Batch(ca.RigidMass(), ca.SceneTable(2, 1, 1e-3), measured_cycles=1)
    batch.start("rest")
    return batch


@functools.cache
def cycles():
    """Cycles of a rigid mass."""
    return started().run(1, 1)


@functools.cache
def film():
    """A film of two grains."""
    batch = ca.Batch(ca.Automaton(), ca.SceneTable(2, 1, 1e-4), mount="base")
    batch.start("rest")
    return ca.film(batch, 40, sample_every=10, frame_every=20, progress=None)


@functools.cache
def on_demand():
    """A response with effects on demand."""
    short = {**ALWAYS[ca], "particles": 2, "ratios": [1.0], "effects": "auto"}
    del short["duration"], short["open_browser"]
    return ca.frequency_response(ca.RigidMass(), **short)


#: Functions that take more than values.
BOUND = {"join": functools.partial(td.join, PAIR, PAIR.moved(by=(9.0, 0.0, 0.0)))}
#: What users ask objects: methods by the class in the docs, and how an object is made.
METHODS = {
    td: {
        "Mesh": ("group_faces group_bodies bonded_by group body_group moved", lambda: CUT),
        "Material": ("from_elastic", lambda: td.Material),
        "Scene": ("effect damped", lambda: SCENE),
        "effects.GasPressure": ("pressure_at", effects.GasPressure),
        "effects.Pressure": ("triangle", lambda: effects.Pressure),
        "Goal": ("check_scene value", lambda: goals.body_displacement(0)),
        "Simulation": ("reset advance_to report", simulation),
        "ProgressBar": ("at count", lambda: td.ProgressBar("x")),
        "result.Result": ("frame fragments fragment_of_body rose attenuation write show", result),
        "output.hole_monitor.Attenuation": (
            "power_law",
            lambda: result().attenuation(group="left", radius=0.01),
        ),
    },
    ca: {
        "Automaton": ("clearance with_clearance", ca.Automaton),
        "Spheres": ("clearance with_clearance", ca.Spheres),
        "SceneTable": ("change drive column row", lambda: ca.SceneTable(**TABLE)),
        "Batch": ("start drive run measure_each advance snapshot", started),
        "runs.film.Film": ("show", film),
        "report.measures.Cycles": (
            "mean_of per_step harmonic harmonic_by_cycle loss_factor damping_ratio",
            cycles,
        ),
        "Oscillator": ("transfer rms steady_state right_hand_side peak scaled", ca.Oscillator),
        "ImpactDamper": ("free motion position start is_stable rms", lambda: GRAIN),
        "ModalStructure": ("from_matrices recoil modal transfer", lambda: STRUCTURE),
        "excitation.Signal": ("at scaled", lambda: SIGNAL),
        "AmplitudeResponse": ("write_csv", lambda: ca.AmplitudeResponse([1e-3], [response()])),
        "Response": ("write_csv", response),
        "Goal": ("values", ca.goals.peak_ratio),
    },
}
#: Given wherever it is taken: what is quiet and short.
ALWAYS = {
    td: {"progress": None, "open_browser": False},
    ca: {
        **{"progress": None, "open_browser": False, "seeds": 1, "dt": 1e-3},
        **{"transient_cycles": 1, "measured_cycles": 1, "duration": 0.01},
    },
}
#: What has to be given, by the name of its parameter.
VALUES = {
    **{"amplitude": 1.0, "amplitudes": 1e-3, "body": 0, "boxes": ca.Box(0, 2), "clearance": 0.024},
    **{"cycles": 1, "damping_ratios": 0.01, "done": 1, "element": 0.5, "excitation": SIGNAL},
    **{
        "factor": 2.0,
        "fall": 1e-4,
        "filling": ca.RigidMass(),
        "folder": path("out"),
        "fracture_energy": 100.0,
    },
    **{"frequencies": 1.0, "function": len, "gap": 1e-3, "group": "left", "groups": PAIR.groups},
    **{"height": 0.5, "length": 1.0, "macro_step": 1, "masses": [1.0, 2.0], "mesh": PAIR},
    **{"material": td.CONCRETE, "method": METHOD, "name": "x", "nearest": 0.01, "u": 0.1},
    **{"normal": (1.0, 0.0, 0.0), "peak": 1e6, "place": 0, "points": PAIR.points, "ratio": 1.0},
    **{"path": path("file"), "ratios": [0.9, 1.0], "read": len, "rise": 1e-4, "s": 0, "t": 0.01},
    **{"role": "softening", "scene": ALONE, "share": 0.5, "shear_energy": 500.0, "size": 1.0},
    **{"steps": 2, "structure": STRUCTURE, "term": "kinetic", "tetrahedra": PAIR.tetrahedra},
    **{"thickness": 0.2, "time_s": 0.01, "times": [0.0, 1e-4], "title": "x", "total": 2},
    **{"unit": "m", "until": 3e-7, "values": [0.0, 1e6], "velocity": (1.0, 0.0, 0.0)},
    **{"when": td.Every(steps=2), "width": 0.5, **TABLE},
}


#: Values of a call by its name in the docs, beside those or in their place. Of a variant, "call#",
#: these alone are tried.
def _of_blast():
    chosen = {"name": "new", "chosen": lambda x: x[:, 0] < 1e9}
    return {
        "Every#time_s": {"time_s": 1.0},
        "Every#steps": {"steps": 2},
        "Every#samples": {"samples": 3},
        "Every#wall_s": {"wall_s": 1.0},
        "At": {"times_s": [0.0, 1.0]},
        "Material": vars(td.CONCRETE),
        "Material.from_elastic": ROCK,
        "Mesh": {"body_groups": {"ore": [0]}},
        "Mesh.group_faces": {"name": "left"},
        "Mesh.group_bodies": {"name": "ore"},
        "Mesh.bonded_by": {"shares": {"notch": 0.5}},
        "Mesh.group": chosen,
        "Mesh.body_group": chosen,
        "Uniform": {"distance": 1e-5, "control": td.StepControl()},
        "Multirate": {"control": td.StepControl()},
        "Collector": {"read": len},
        "Receivers": {"points": {"a": (0.0, 0.0, 0.0)}},
        "Scene": {"mesh": CUT, "effects": [], "sleep": 0.0},
        "join": {"names": ["a", "b"]},
        "read_mesh": {"path": td.PAPER_BLOCK},
        "runtime.start": {"threads": 2},
        "shapes.cylinder": {"radius": 1.0, "height": 1.0, "element": 1.0},
        "shapes.plate": {"width": 1.0, "height": 1.0, "element": 0.2, "hole": (0.5, 0.5, 0.3)},
        "effects.Pressure": {"times": [0.0, 1e-4]},
        "effects.MixedMode": {"exponent": 1.5},
        "elastic_report": {"scene": OF_BAR},
        "mesh_stiffness": {"mesh": OF_BAR.mesh, "material": OF_BAR.material},
        "estimated_effects": {"scene": SCENE},
        "step_report": {"scene": SCENE},
        "Goal.check_scene": {"scene": SCENE},
        "Goal.value": {"result": result()},
        "simulate": {"samples": 1},
        "solve": {"goal": goals.peak_speed(0), "tolerance": 0.5, "budget_s": 60.0},
        "needed_effects": {"result": result()},
        "write_paraview": {"model": result().model, "frames": result().frames},
        "result.Result.frame": {"number": 1},
        "result.Result.rose": {"axis": (0.0, 0.0, 1.0)},
        "result.Result.attenuation": {"group": "left", "radius": 0.01},
    }


def _of_damper():
    time = np.arange(500) * 0.01
    csv = path("s.csv", "time_s,force_N", *(f"{0.01 * k},{k * (49 - k)}" for k in range(50)))
    head = "PEER", "", "ACCELERATION IN UNITS OF G", "NPTS= 50, DT= .01 SEC"
    at2 = path("s.at2", *head, *(f"{k * (49 - k):e}" for k in range(50)))
    budget = {"tolerance": 0.5, "budget_s": 60.0}
    return {
        "needed_effects": {"result": on_demand()},
        "Automaton": {"rules": "paper"},
        "Automaton.with_clearance": {"particles": 10},
        "Automaton#": {"rules": "place", "friction": 0.3, "wall_friction": 0.3},
        "Spheres": {},
        "Spheres#two": {"start": [(0.01, 0.01), (0.03, 0.03)], "start_velocity": [(0.0, 0.0)] * 2},
        "Spheres#sizes": {"sizes": [(3, 6e-3), (2, 4e-3)]},
        "SceneTable": TABLE,
        "SceneTable.change": TABLE,
        "SceneTable.column": {"name": "dt"},
        "Batch": {"table": ca.SceneTable(**TABLE)},
        "Batch.change": TABLE,
        "film": {"batch": started(), "steps": 4, "frame_every": 2},
        "runs.film.Film.show": {"path": path("film.html"), "scenes": [0]},
        "ImpactDamper": {"oscillator": ca.Oscillator(), "particle_mass": 0.01, "restitution": 0.5},
        "ModalStructure": {"frequencies": [3.0], "shapes": [[1.0], [0.0]]},
        "ModalStructure.from_matrices": {"mass": [1.0], "stiffness": [[1e3]]},
        "ModalStructure.modal": {"motion": [1.0, 0.0]},
        "ModalStructure.transfer": {"frequency": 3.0, "added_masses": [0.1, 0.0]},
        "logarithmic_decrement": {"x": np.exp(-0.2 * time) * np.cos(10.0 * time)},
        "excitation.Excitation": {"base": SIGNAL},
        "excitation.Signal#": {
            "label": "x",
            "step": 0.1,
            "value": [0.0, 1.0, 1.0, 0.0],
            "bend": [0.0] * 4,
        },
        "excitation.from_samples": {"time_s": time, "values": np.sin(time), "of": "acceleration"},
        "excitation.from_csv": {"path": csv, "column": "force_N"},
        "excitation.from_at2": {"path": at2},
        "excitation.random_vibration": {
            **{"frequencies": [1.0, 10.0], "density": [1.0, 1.0], "duration": 1.0}
        },
        "excitation.sweep": {"low": 1.0, "high": 5.0},
        "Goal": {"ratios": (1.0,)},
        "Goal.values": {"response": response()},
        "frequency_response": {"base_amplitude": 1e-3},
        "damper_map": {"filling": ca.Automaton(), "particles": 10, "clearances": 0.024},
        "best_damper": {
            **{"structure": ca.Oscillator(), "motion": 1e-3, "mass": 6e-3, "box": (0.06, 0.096)},
            **{"particles": 5, "seeds": 2, "heights": 1, "cycles": (1, 1)},
            "confirm": ca.Automaton(),
        },
        "solve_response": {"goal": ca.goals.rms_at(1.0), "ratios": (0.9, 1.1), **budget},
    }


OWN = {td: _of_blast, ca: _of_damper}
