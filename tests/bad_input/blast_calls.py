"""Every public call of taichi_dem, by its name in the docs, with arguments that it takes."""

import functools
import os
import tempfile
from dataclasses import fields
from functools import partial

import numpy as np

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    At,
    Checkpoint,
    Collector,
    Every,
    Goal,
    ImplicitDashpots,
    Material,
    Mesh,
    Multirate,
    ProgressBar,
    Receivers,
    Scene,
    Simulation,
    StepControl,
    Table,
    Targets,
    Uniform,
    calibrate,
    checked_mesh,
    effects,
    elastic_report,
    estimated_effects,
    goals,
    in_space_order,
    join,
    mesh_stiffness,
    methods,
    needed_effects,
    quality_report,
    read_mesh,
    runtime,
    shapes,
    simulate,
    solve,
    step_report,
    with_body_group,
    write_paraview,
)
from taichi_dem.calibration.calibrate import Match
from taichi_dem.mesh.face_groups import with_inner_group
from taichi_dem.mesh.shapes import bar, pair, single
from tests.bad_input.options import ROCK
from tests.made_result import made_result

PAIR, BAR, METHOD = pair(), bar(1.0, 0.3, (3, 1, 1)), Uniform(1e-7)
CUT = with_inner_group(PAIR, "notch", lambda x: x[:, 0] < 1.0)
SCENE, ALONE = Scene(PAIR, CONCRETE), Scene(single(), CONCRETE)
ELASTIC = {**ROCK, "damping_ratio": 0.05}
MESH = {
    **{"points": PAIR.points, "tetrahedra": PAIR.tetrahedra, "groups": {**PAIR.groups}},
    **{"source": "", "keep_coincident": False, "body_groups": {"ore": [0]}},
}
ROOM = {"neighbours_per_body": 20, "pairs_per_body": 20, "spheres_per_body": 20}
STEP = {"distance": 1e-5, "control": StepControl(), "dashpot": "full"}
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
    return Simulation(ALONE, METHOD)


def run(**options):
    """A run of three steps; one without a report's figures shows nothing."""
    return simulate(ALONE, method=METHOD, until=3e-7, progress=None, **options)


def blast_calls():
    """Rows (name, function, valid arguments); names with "#" are variants of a call."""
    return [*_scenes(), *_effects(), *_questions(), *_results()]


def _scenes():
    every = {"time_s": 1.0, "steps": 2, "samples": 3, "wall_s": 1.0}
    yield from ((f"Every#{name}", Every, {name: value}) for name, value in every.items())
    yield "At", At, {"times_s": [0.0, 1.0]}
    yield "Checkpoint", Checkpoint, {"path": "run.npz", "every_steps": 5}
    yield "Checkpoint#s", Checkpoint, {"path": "run.npz", "every_s": 5.0, "every_wall_s": 3.0}
    yield "Collector", Collector, {"when": Every(steps=2), "read": len}
    implicit = {"dt": 4e-7, "sweeps": (2, 20), "tolerance": 1e-8, "theta": 0.5, "refresh": 3e-5}
    yield "ImplicitDashpots", ImplicitDashpots, implicit
    concrete = {field.name: getattr(CONCRETE, field.name) for field in fields(Material)}
    yield "Material", Material, concrete
    yield "Material.from_elastic", Material.from_elastic, ELASTIC
    yield "Mesh", Mesh, {**MESH, "notes": (), "unread": ()}
    yield "checked_mesh", checked_mesh, {**MESH, "weld_tolerance": 0.0}
    yield "Mesh.group_faces", PAIR.group_faces, {"name": "left"}
    yield "Mesh.group_bodies", PAIR.body_group("ore", everywhere).group_bodies, {"name": "ore"}
    yield "Mesh.bonded_by", CUT.bonded_by, {"shares": {"notch": 0.5}}
    yield "Mesh.group", PAIR.group, {"name": "new", "chosen": everywhere}
    yield "Mesh.body_group", PAIR.body_group, {"name": "new", "chosen": everywhere}
    by = {"by": (1.0, 0.0, 0.0), "turned": (0.0, 0.0, 1.0), "about": (0.0, 0.0, 0.0)}
    yield "Mesh.moved", PAIR.moved, by
    yield "with_body_group", with_body_group, {"mesh": PAIR, "name": "n", "chosen": everywhere}
    yield "methods.check_method", methods.check_method, {"method": METHOD}
    yield "Multirate", Multirate, {"dt0": 1e-7, "neighbour": "held", **STEP}
    yield "Uniform", Uniform, {"dt0": 1e-7, **STEP}
    control = {"safety": 0.25, "angle": 0.02, "criteria": ("load",), "wake": ("hit",)}
    more = {"level_jump": 2, "ahead": 2.0, "dashpot_floor": 0.5}
    yield "StepControl", StepControl, {**control, **more}
    yield "Receivers", Receivers, {"points": {"a": (0.0, 0.0, 0.0)}, "when": Every(steps=1)}
    listed = {"effects": [], "loads": (), "unbonded": (), "weaker": {}, "materials": {}}
    options = {"max_speed": 1e3, "sleep": 0.0, "velocity": None, "spin": None, **listed}
    yield "Scene", Scene, {"mesh": PAIR, "material": CONCRETE, **options}
    yield "Scene.effect", SCENE.effect, {"role": "softening"}
    yield "Scene.damped", SCENE.damped, {"touching": True}
    yield "Scene.has", SCENE.has, {"name": "softening"}
    apart = PAIR.moved(by=(9.0, 0.0, 0.0))
    yield "join", partial(join, PAIR, apart), {"names": ["a", "b"], "bonded": False}
    yield "in_space_order", in_space_order, {"mesh": PAIR}
    read = {"scale": 1.0, "weld_tolerance": 0.0, "keep_coincident": False}
    yield "read_mesh", read_mesh, {"path": PAPER_BLOCK, **read}
    yield "runtime.start", runtime.start, {"arch": "cpu", "threads": 2, "debug": False}
    length = {"width": 0.5, "height": 0.5, "element": 0.5}
    yield "shapes.beam", shapes.beam, {"length": 1.0, **length}
    yield "shapes.block", shapes.block, {"size": 1.0, "element": 0.5}
    yield "shapes.cylinder", shapes.cylinder, {"radius": 1.0, "height": 1.0, "element": 1.0}
    plate = {"width": 1.0, "height": 1.0, "thickness": 0.2, "element": 0.2, "notch": None}
    yield "shapes.plate", shapes.plate, {"hole": (0.5, 0.5, 0.3), **plate}


def _effects():
    group = {"group": "left"}
    yield "effects.FaceContact", effects.FaceContact, {"divisions": 5, "skin": 0.01, **ROOM}
    spheres = {"divisions": 5, "outer_faces": True, "skin": 0.01, **ROOM}
    yield "effects.SphereContact", effects.SphereContact, spheres
    yield "effects.Fixed", effects.Fixed, group
    gas = {"peak": 5e8, "rise": 1e-4, "decay_ratio": 2.75, "start": 0.0}
    yield "effects.GasPressure", effects.GasPressure, {**group, **gas}
    times = {"times": [0.0, 1e-4]}
    yield "effects.GasPressure.pressure_at", effects.GasPressure().pressure_at, times
    yield "effects.Gravity", effects.Gravity, {"acceleration": (0.0, -9.81, 0.0)}
    moved = {"velocity": (1.0, 0.0, 0.0), "frequency": 0.0, "ramp": 0.0, "history": None}
    yield "effects.PrescribedMotion", effects.PrescribedMotion, {**group, **moved}
    yield "effects.Pressure", effects.Pressure, {**group, "values": [0.0, 1e6], **times}
    pulse = {"peak": 1e6, "rise": 1e-4, "fall": 1e-4}
    yield "effects.Pressure.triangle", effects.Pressure.triangle, {**group, **pulse}
    quiet = {"p_speed": 3e3, "s_speed": 2e3}
    yield "effects.QuietBoundary", effects.QuietBoundary, {**group, **quiet}
    yield "effects.Roller", effects.Roller, {**group, "normal": (1.0, 0.0, 0.0)}
    yield "effects.SlipWeakening", effects.SlipWeakening, {"fracture_energy": 100.0}
    yield "effects.StickingFriction", effects.StickingFriction, {"stiffness_ratio": 0.8}


def _questions():
    rock = Material.from_elastic(**ROCK)
    goal = {"name": "x", "unit": "m", "function": len, "kind": "value"}
    yield "Goal", Goal, {**goal, "averaged": False, "check": len}
    of_body = goals.body_displacement(0)
    yield "Goal.check_scene", of_body.check_scene, {"scene": SCENE}
    yield "Goal.value", of_body.value, {"result": result()}
    yield "goals.body_displacement", goals.body_displacement, {"body": 0}
    yield "goals.displacement", goals.displacement, {"group": "left"}
    yield "goals.energy_share", goals.energy_share, {"term": "kinetic"}
    yield "goals.hole_displacement", goals.hole_displacement, {"group": "hole"}
    speed = {"distance": 0.5, "group": "hole"}
    yield "goals.peak_particle_velocity", goals.peak_particle_velocity, speed
    yield "goals.peak_speed", goals.peak_speed, {"body": 0}
    strengths = {"tension": 3e6, "brazilian": 3e6, "compression": 30e6}
    yield "Targets", Targets, {"young": 30e9, "poisson": 0.2, **strengths}
    wanted = {"targets": Targets(young=30e9), "tolerance": 0.5, "slip_energy": 1e3, "seed": 1}
    yield "calibrate", calibrate, {"mesh": BAR, "material": rock, **wanted}
    yield "elastic_report", elastic_report, {"scene": Scene(BAR, rock)}
    yield "estimated_effects", estimated_effects, {"scene": SCENE, "until": 1e-5}
    yield "mesh_stiffness", mesh_stiffness, {"mesh": BAR, "material": rock}
    yield "quality_report", quality_report, {"mesh": BAR, "material": CONCRETE}
    yield "step_report", step_report, {"scene": BAR, "material": CONCRETE}
    yield "Simulation", Simulation, {"scene": ALONE, "method": METHOD, "driver": "resident"}
    yield "Simulation#brute", Simulation, {"scene": ALONE, "method": METHOD, "brute_force": False}
    moving = simulation()
    yield "Simulation.reset", moving.reset, {"scene": ALONE, "method": METHOD}
    yield "Simulation.advance_to", moving.advance_to, {"macro_step": 1, "on_call": None}
    yield "Simulation.report", moving.report, {"brief": False}
    told = {"scene": ALONE, "until": 3e-7, "progress": None}
    kept = {"output": None, "checkpoint": None, "resume": None, "observers": ()}
    rows = {"driver": "resident", "samples": 1, "frames": 1, "title": "x"}
    yield "simulate", simulate, {**told, "method": METHOD, **rows, **kept}
    asked = {"tolerance": 0.5, "confidence": 0.95, "budget_s": 60.0, "plan": None}
    yield "solve", solve, {**told, "goal": goals.peak_speed(0), **asked}
    yield "needed_effects", needed_effects, {"result": run(), "tolerance": 0.01}


def _results():
    done, bar_title = result(), ProgressBar("x")
    yield "ProgressBar", ProgressBar, {"title": "x"}
    yield "ProgressBar.at", bar_title.at, {"share": 0.5}
    yield "ProgressBar.count", bar_title.count, {"done": 1, "total": 2}
    columns = {"time_s": np.arange(3.0), "x": np.arange(3.0)}
    yield "Table", Table, {"columns": columns, "units": {"x": "m"}, "index": "time_s"}
    yield "Table.write_csv", Table(columns).write_csv, {"path": path("t.csv")}
    series = {"folder": path("pv"), "model": done.model, "frames": done.frames, "name": "x"}
    yield "write_paraview", write_paraview, {**series, "acting_since": {}}
    where, on = "result.Result", {"axis": (0.0, 0.0, 1.0), "sectors": 12}
    yield f"{where}.mean_displacement", done.mean_displacement, {"bodies": np.arange(2)}
    yield f"{where}.write", run().write, {"folder": path("o")}
    page = {"path": path("v.html"), "open_browser": False}
    yield f"{where}.show", run(frames=1).show, page
    yield f"{where}.write_xyz", done.write_xyz, {"path": path("v.xyz"), "of": "bodies"}
    glb = {"path": path("v.glb"), "colour": "speed", "seconds": 1.0}
    yield f"{where}.write_gltf", done.write_gltf, glb
    yield f"{where}.frame", done.frame, {"number": 1}
    yield f"{where}.fragments", done.fragments, {"frame": 1}
    yield f"{where}.bodies", done.bodies, {"frame": 1}
    yield f"{where}.rose", done.rose, on
    yield f"{where}.attenuation", done.attenuation, {"group": "left", "radius": 0.01}
    law = done.attenuation(group="left", radius=0.01).power_law
    where = "output.attenuation.Attenuation"
    yield f"{where}.power_law", law, {"nearest": 0.01, "inner_only": False}
    quality, step = quality_report(BAR, CONCRETE), step_report(ALONE)
    for name in ("worst", "price"):
        yield f"stability.quality.QualityReport.{name}", getattr(quality, name), {"count": 1}
    for name in ("worst", "price", "work_share"):
        yield f"stability.step_report.StepReport.{name}", getattr(step, name), {"count": 1}
    met = Match("young", 1.0, 1.0, True).is_met
    yield "calibration.calibrate.Match.is_met", met, {"tolerance": 0.1}
