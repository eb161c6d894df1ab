"""The live pages: built from their sources, whole in themselves, with the package's own physics."""

import json
import re

import numpy as np
import pytest

from docs.site.live.build import OUT, PAGES, built, source
from taichi_dem import Material, Scene, Simulation, Uniform, checked_mesh, effects
from tests.structures import filled
from tests.viewer.test_pages import unpacked

STEPS = 100


def page(name):
    """Text of a page as it is shipped."""
    return (OUT / f"{name}.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_what_its_sources_make(name):
    assert page(name) == built(name), "build it: .venv/bin/python docs/site/live/build.py"


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_small_and_asks_for_nothing_from_elsewhere(name):
    text = page(name)
    assert len(text.encode()) <= 80_000
    assert not re.search(r"https?:|<script src|@import|url\(|<img", text)


@pytest.mark.parametrize("name", PAGES)
def test_each_of_five_reasons_leads_to_a_page(name):
    reasons = re.findall(r"<li>(.*?)</li>", page(name))
    assert len(reasons) == 5
    for reason in reasons:
        assert (OUT / re.search(r'<a href="([^"#]+)', reason)[1]).resolve().is_file(), reason


@pytest.fixture(scope="module")
def run():
    """``run(scripts, text)``: what a text of JavaScript makes after scripts of the pages."""
    engine = pytest.importorskip("py_mini_racer", reason="needs mini-racer: pip install mini-racer")

    def made(scripts, text):
        context = engine.MiniRacer()
        return json.loads(context.eval("".join(map(source, scripts)) + text))

    return made


def mesh_of(data):
    """The mesh of a page's bodies."""
    points = unpacked(data["points"]).astype(float).reshape(-1, 3)
    tetrahedra = unpacked(data["tetrahedra"]).reshape(-1, 4).astype(np.int32)
    return checked_mesh(points, tetrahedra, {"left": tetrahedra[:1, 1:]})


def moved(run, data, velocity, options):
    """Displacement and velocity of the bodies of a page after some steps, and what broke."""
    mesh = mesh_of(data)
    arrays = mesh.points.tolist(), mesh.tetrahedra.ravel().tolist(), velocity.ravel().tolist()
    script = """
        const [points, tetrahedra, velocity, material, options] = INPUT;
        const solid = new Solid(Float64Array.from(points.flat()), tetrahedra, material, options);
        solid.strike(velocity);
        for (let step = 0; step < STEPS; step++) solid.step();
        const way = [...solid.x].map((place, k) => place - solid.centre[k]);
        JSON.stringify([way, [...solid.v], [...solid.broken], solid.near.length]);"""
    script = script.replace("INPUT", json.dumps([*arrays, data["material"], options]))
    way, speed, broken, near = run(["solid.js"], script.replace("STEPS", str(STEPS)))
    return np.reshape(way, (-1, 3)), np.reshape(speed, (-1, 3)), np.array(broken), near


def simulated(data, velocity, listed, method):
    """The same by the kernels."""
    scene = Scene(mesh_of(data), Material(**data["material"]), listed, velocity=velocity)
    simulation = Simulation(scene, method)
    simulation.advance_to(STEPS)
    motion = simulation.state.stored()
    way = motion["position"] - simulation.model.centre
    return way, motion["velocity"], simulation.state.broken()


def blow(data, size, reach):
    """Velocities of a blow against the middle of a solid, with a part along it."""
    centre = mesh_of(data).points[mesh_of(data).tetrahedra].mean(axis=1)
    square = ((centre - 0.5 * (centre.max(axis=0) + centre.min(axis=0)))[:, :2] ** 2).sum(axis=1)
    velocity = np.zeros_like(centre)
    velocity[:, 2] = -size * np.maximum(0.0, 1.0 - square / reach**2)
    velocity[:, 0] = 0.1 * velocity[:, 2]
    return velocity


def assert_same(found, expected):
    """Motions that agree to 1e-9 of the largest, some thousand times what order of sums changes."""
    for mine, theirs in zip(found, expected):
        assert np.abs(mine - theirs).max() <= 1e-9 * np.abs(theirs).max()


def test_struck_plate_breaks_and_touches_as_in_the_kernels(run):
    _, data, _ = PAGES["strike_here"]()
    velocity = blow(data, 30.0, 0.07)
    way, speed, broken, near = moved(run, data, velocity, {"dt": data["dt"]})
    contact = effects.SphereContact(outer_faces=False)
    laws = effects.BondDamping(), effects.Softening(), effects.ShearSlip(), effects.Friction()
    listed = filled("paper", *laws, contact)
    *motion, expected = simulated(data, velocity, listed, Uniform(data["dt"]))
    assert_same((way, speed), motion)
    assert broken.sum() > 10 and near > 0
    assert (broken == 1).tolist() == expected.tolist()
