"""Every public call of taichi_dem, by its name in the docs, with what it takes beside defaults."""

import functools
import inspect
import os
import tempfile
from dataclasses import fields
from functools import partial

import taichi_dem as td
from taichi_dem import effects, goals, runtime, shapes
from taichi_dem.mesh.mesh import with_inner_group
from taichi_dem.mesh.shapes import bar, pair, single
from tests.made_result import made_result

PAIR, BAR, METHOD = pair(), bar(1.0, 0.3, (3, 1, 1)), td.Uniform(1e-7)
CUT = with_inner_group(PAIR, "notch", lambda x: x[:, 0] < 1.0)
SCENE, ALONE = td.Scene(PAIR, td.CONCRETE), td.Scene(single(), td.CONCRETE)
ROCK = {
    **{"young": 32e9, "poisson": 0.2, "density": 2450.0, "tensile_strength": 5e6},
    **{"fracture_energy": 100.0, "friction_angle": 40.0, "cohesion": 10e6},
}
MESH = {"points": PAIR.points, "tetrahedra": PAIR.tetrahedra, "groups": {**PAIR.groups}}
_folder = functools.cache(tempfile.mkdtemp)


def path(name):
    """Name of a file in a folder of these calls."""
    return os.path.join(_folder(), name)


def everywhere(x):
    """All of a mesh."""
    return x[:, 0] < 1e9


@functools.cache
def result():
    """A result without a run."""
    return made_result()


@functools.cache
def simulation():
    """A simulation of one body."""
    return td.Simulation(ALONE, METHOD)


def run(**options):
    """A run of three steps; one without a report's figures shows nothing."""
    return td.simulate(ALONE, method=METHOD, until=3e-7, progress=None, **options)


def blast_calls():
    """Rows (name, function, arguments); names with "#" are variants of a call."""
    return [*_scenes(), *_effects(), *_questions(), *_results()]


def _scenes():
    every = {"time_s": 1.0, "steps": 2, "samples": 3, "wall_s": 1.0}
    yield from ((f"Every#{name}", td.Every, {name: value}) for name, value in every.items())
    yield "At", td.At, {"times_s": [0.0, 1.0]}
    yield "Checkpoint", td.Checkpoint, {"path": "run.checkpoint"}
    yield "Collector", td.Collector, {"when": td.Every(steps=2), "read": len}
    yield "ImplicitDashpots", td.ImplicitDashpots, {}
    concrete = {field.name: getattr(td.CONCRETE, field.name) for field in fields(td.Material)}
    yield "Material", td.Material, concrete
    yield "Material.from_elastic", td.Material.from_elastic, ROCK
    yield "Mesh", td.Mesh, {**MESH, "body_groups": {"ore": [0]}}
    yield "checked_mesh", td.checked_mesh, MESH
    yield "Mesh.group_faces", PAIR.group_faces, {"name": "left"}
    yield "Mesh.group_bodies", PAIR.body_group("ore", everywhere).group_bodies, {"name": "ore"}
    yield "Mesh.bonded_by", CUT.bonded_by, {"shares": {"notch": 0.5}}
    chosen = {"name": "new", "chosen": everywhere}
    yield "Mesh.group", PAIR.group, chosen
    yield "Mesh.body_group", PAIR.body_group, chosen
    yield "Mesh.moved", PAIR.moved, {}
    yield "Multirate", td.Multirate, {"control": td.StepControl()}
    yield "Uniform", td.Uniform, {"distance": 1e-5, "control": td.StepControl()}
    yield "StepControl", td.StepControl, {}
    yield "Receivers", td.Receivers, {"points": {"a": (0.0, 0.0, 0.0)}}
    yield "Scene", td.Scene, {"mesh": CUT, "material": td.CONCRETE, "effects": [], "sleep": 0.0}
    yield "Scene.effect", SCENE.effect, {"role": "softening"}
    yield "Scene.damped", SCENE.damped, {}
    yield "join", partial(td.join, PAIR, PAIR.moved(by=(9.0, 0.0, 0.0))), {"names": ["a", "b"]}
    yield "in_space_order", td.in_space_order, {"mesh": PAIR}
    yield "read_mesh", td.read_mesh, {"path": td.PAPER_BLOCK}
    yield "runtime.start", runtime.start, {"threads": 2}
    length = {"width": 0.5, "height": 0.5, "element": 0.5}
    yield "shapes.beam", shapes.beam, {"length": 1.0, **length}
    yield "shapes.block", shapes.block, {"size": 1.0, "element": 0.5}
    yield "shapes.cylinder", shapes.cylinder, {"radius": 1.0, "height": 1.0, "element": 1.0}
    plate = {"width": 1.0, "height": 1.0, "thickness": 0.2, "element": 0.2}
    yield "shapes.plate", shapes.plate, {"hole": (0.5, 0.5, 0.3), **plate}


def _effects():
    group, times = {"group": "left"}, {"times": [0.0, 1e-4]}
    more = {
        "PrescribedMotion": {**group, "velocity": (1.0, 0.0, 0.0)},
        "Pressure": {**group, "values": [0.0, 1e6], **times},
        "Roller": {**group, "normal": (1.0, 0.0, 0.0)},
        "MixedMode": {"shear_energy": 500.0, "exponent": 1.5},
        "SlipWeakening": {"fracture_energy": 100.0},
        **dict.fromkeys(("Fixed", "QuietBoundary"), group),
    }
    for name in effects.__all__:
        if inspect.signature(getattr(effects, name)).parameters:
            yield f"effects.{name}", getattr(effects, name), more.get(name, {})
    yield "effects.GasPressure.pressure_at", effects.GasPressure().pressure_at, times
    pulse = {"peak": 1e6, "rise": 1e-4, "fall": 1e-4}
    yield "effects.Pressure.triangle", effects.Pressure.triangle, {**group, **pulse}


def _questions():
    rock = td.Material.from_elastic(**ROCK)
    yield "Goal", td.Goal, {"name": "x", "unit": "m", "function": len}
    of_body = goals.body_displacement(0)
    yield "Goal.check_scene", of_body.check_scene, {"scene": SCENE}
    yield "Goal.value", of_body.value, {"result": result()}
    yield "goals.body_displacement", goals.body_displacement, {"body": 0}
    yield "goals.displacement", goals.displacement, {"group": "left"}
    yield "goals.energy_share", goals.energy_share, {"term": "kinetic"}
    yield "goals.hole_displacement", goals.hole_displacement, {}
    yield "goals.peak_speed", goals.peak_speed, {"body": 0}
    yield "elastic_report", td.elastic_report, {"scene": td.Scene(BAR, rock)}
    yield "estimated_effects", td.estimated_effects, {"scene": SCENE, "until": 1e-5}
    yield "mesh_stiffness", td.mesh_stiffness, {"mesh": BAR, "material": rock}
    yield "step_report", td.step_report, {"scene": SCENE}
    yield "Simulation", td.Simulation, {"scene": ALONE, "method": METHOD}
    moving = simulation()
    yield "Simulation.reset", moving.reset, {"scene": ALONE, "method": METHOD}
    yield "Simulation.advance_to", moving.advance_to, {"macro_step": 1}
    yield "Simulation.report", moving.report, {}
    told = {"scene": ALONE, "until": 3e-7, "progress": None}
    yield "simulate", td.simulate, {**told, "method": METHOD, "samples": 1}
    asked = {"goal": goals.peak_speed(0), "tolerance": 0.5, "budget_s": 60.0}
    yield "solve", td.solve, {**told, **asked}
    yield "needed_effects", td.needed_effects, {"result": run()}


def _results():
    done, bar_title = result(), td.ProgressBar("x")
    yield "ProgressBar", td.ProgressBar, {"title": "x"}
    yield "ProgressBar.at", bar_title.at, {"share": 0.5}
    yield "ProgressBar.count", bar_title.count, {"done": 1, "total": 2}
    series = {"folder": path("pv"), "model": done.model, "frames": done.frames}
    yield "write_paraview", td.write_paraview, series
    where = "result.Result"
    yield f"{where}.write", run().write, {"folder": path("o")}
    page = {"path": path("v.html"), "open_browser": False}
    yield f"{where}.show", run(frames=1).show, page
    for name in ("frame", "fragments", "fragment_of_body"):
        key = "number" if name == "frame" else "frame"
        yield f"{where}.{name}", getattr(done, name), {key: 1}
    yield f"{where}.rose", done.rose, {"axis": (0.0, 0.0, 1.0)}
    yield f"{where}.attenuation", done.attenuation, {"group": "left", "radius": 0.01}
    law = done.attenuation(group="left", radius=0.01).power_law
    yield "output.hole_monitor.Attenuation.power_law", law, {"nearest": 0.01}
