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
from tests.damper import response
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
    heard = td.Received((0.0, 0.0, 0.0), 0, np.zeros(1), np.zeros((1, 3)), np.ones((1, 3)))
    return dataclasses.replace(made_result(), report=short.report, receivers={"near": heard})


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
    short = {"particles": 2, "seeds": 1, "ratios": [1.0], "dt": 1e-3, "progress": None}
    short |= {"transient_cycles": 1, "measured_cycles": 1, "effects": "auto"}
    return ca.frequency_response(ca.RigidMass(), **short)


#: Functions that take more than values.
BOUND = {"join": functools.partial(td.join, PAIR, PAIR.moved(by=(9.0, 0.0, 0.0)))}
#: How an object is made whose methods users call, by its class in the docs.
OBJECTS = {
    td: {
        "Mesh": lambda: CUT,
        "Material": lambda: td.CONCRETE,
        "Scene": lambda: SCENE,
        "effects.GasPressure": effects.GasPressure,
        "effects.Pressure": lambda: effects.Pressure("left", 1.0),
        "Goal": lambda: goals.body_displacement(0),
        "Simulation": simulation,
        "ProgressBar": lambda: td.ProgressBar("x"),
        "result.Result": result,
        "output.hole_monitor.Attenuation": lambda: result().attenuation(group="left", radius=0.01),
    },
    ca: {
        "Automaton": ca.Automaton,
        "Spheres": ca.Spheres,
        "SceneTable": lambda: ca.SceneTable(**TABLE),
        "Batch": started,
        "runs.film.Film": film,
        "report.measures.Cycles": cycles,
        "Oscillator": ca.Oscillator,
        "ImpactDamper": lambda: ca.ImpactDamper(ca.Oscillator(), 0.01, 0.5, 0.01, 6.0),
        "ModalStructure": lambda: STRUCTURE,
        "excitation.Signal": lambda: SIGNAL,
        "AmplitudeResponse": lambda: ca.AmplitudeResponse([1e-3], [response()]),
        "Response": response,
        "Goal": ca.goals.peak_ratio,
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
#: What has to be given, by the first word of its type, and by the name of its parameter.
BY_TYPE = {"int": 1, "float": 1.0, "str": "x", "callable": len, "path": path("x.png")}
VALUES = {
    **{"amplitude": 1.0, "amplitudes": 1e-3, "boxes": ca.Box(0, 2), "clearance": 0.024},
    **{"damping_ratios": 0.01, "excitation": SIGNAL, "filling": ca.RigidMass(), "gap": 1e-3},
    **{
        "folder": path("out"),
        "geometry": effects.BodyGeometry(),
        "group": "left",
        "groups": PAIR.groups,
        "masses": [1.0, 2.0],
    },
    **{"material": td.CONCRETE, "mesh": PAIR, "method": METHOD, "normal": (1.0, 0.0, 0.0)},
    **{"points": PAIR.points, "ratios": [0.9, 1.0], "s": 0, "scene": ALONE, "time_s": 0.01},
    **{"stress": (-1e5, 0.0, 0.0, 0.0, 0.0, 0.0)},
    **{"structure": STRUCTURE, "term": "kinetic", "tetrahedra": PAIR.tetrahedra, "until": 3e-7},
    **{"times": [0.0, 1e-4], "values": [0.0, 1e6], "velocity": (1.0, 0.0, 0.0)},
    **{"when": td.Every(steps=2), **TABLE},
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
        "Goal": {"function": len},
        "Material": vars(td.CONCRETE),
        "Material.from_elastic": ROCK,
        "Mesh.group_faces": {"name": "left"},
        "Mesh.group_bodies": {"name": "ore"},
        "Mesh.bonded_by": {"shares": {"notch": 0.5}},
        "Mesh.group": chosen,
        "Mesh.body_group": chosen,
        "Receivers": {"points": {"a": (0.0, 0.0, 0.0)}},
        "Scene": {"mesh": CUT, "effects": [], "sleep": 0.0},
        "read_mesh": {"path": td.PAPER_BLOCK},
        "runtime.start": {"threads": 2},
        "shapes.plate": {"element": 0.2},
        "effects.Pressure": {"times": [0.0, 1e-4]},
        "elastic_report": {"scene": OF_BAR},
        "mesh_stiffness": {"material": OF_BAR.material},
        "estimated_effects": {"scene": SCENE},
        "step_report": {"scene": SCENE},
        "Goal.value": {"result": result()},
        "simulate": {"samples": 1},
        "solve": {"goal": goals.peak_speed(0), "tolerance": 0.5, "budget_s": 60.0},
        "needed_effects": {"result": result()},
        "write_paraview": {"model": result().model, "frames": result().frames},
        "result.Result.attenuation": {"group": "left"},
        "result.Result.peak_velocities": {"source": (0.0, 0.0, 0.0)},
    }


def _of_damper():
    time = np.arange(500) * 0.01
    csv = path("s.csv", "time_s,force_N", *(f"{0.01 * k},{k * (49 - k)}" for k in range(50)))
    head = "PEER", "", "ACCELERATION IN UNITS OF G", "NPTS= 50, DT= .01 SEC"
    at2 = path("s.at2", *head, *(f"{k * (49 - k):e}" for k in range(50)))
    signal = {"label": "x", "step": 0.1, "value": [0.0, 1.0, 1.0, 0.0], "bend": [0.0] * 4}
    of_damper = {"motion": 1e-3, "mass": 6e-3, "box": (0.06, 0.096), "seeds": 2}
    quick = {"particles": 5, "heights": 1, "cycles": (1, 1), "confirm": ca.Automaton()}
    vibration = {"frequencies": [1.0, 10.0], "density": [1.0, 1.0], "duration": 1.0}
    return {
        "needed_effects": {"result": on_demand()},
        "Automaton.with_clearance": {"particles": 10},
        "Spheres": {},
        "Spheres#two": {"start": [(0.01, 0.01), (0.03, 0.03)], "start_velocity": [(0.0, 0.0)] * 2},
        "Spheres#sizes": {"sizes": [(3, 6e-3), (2, 4e-3)]},
        "SceneTable": TABLE,
        "SceneTable.change": TABLE,
        "SceneTable.column": {"name": "dt"},
        "Batch": {"table": ca.SceneTable(**TABLE)},
        "film": {"batch": started(), "steps": 4, "frame_every": 2},
        "ImpactDamper": {"oscillator": ca.Oscillator(), "restitution": 0.5},
        "ModalStructure": {"frequencies": [3.0], "shapes": [[1.0], [0.0]]},
        "ModalStructure.from_matrices": {"mass": [1.0], "stiffness": [[1e3]]},
        "ModalStructure.modal": {"motion": [1.0, 0.0]},
        "logarithmic_decrement": {"x": np.exp(-0.2 * time) * np.cos(10.0 * time)},
        "excitation.Signal#": signal,
        "excitation.from_samples": {"time_s": time, "values": np.sin(time)},
        "excitation.from_csv": {"path": csv},
        "excitation.from_at2": {"path": at2},
        "excitation.random_vibration": vibration,
        "Goal": {"ratios": (1.0,)},
        "Goal.values": {"response": response()},
        "damper_map": {"filling": ca.Automaton(), "particles": 10, "clearances": 0.024},
        "best_damper": {"oscillator": ca.Oscillator(), **of_damper, **quick},
        "solve_response": {"goal": ca.goals.rms_at(1.0), "tolerance": 0.5, "budget_s": 60.0},
    }


OWN = {td: _of_blast, ca: _of_damper}
