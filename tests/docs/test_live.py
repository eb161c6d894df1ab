"""The live pages: built from their sources, whole in themselves, with the package's own physics."""

import json
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from ca_damper import Batch, RigidMass, SceneTable, Spheres
from docs.site.live.build import OUT, PAGES, SOLID, built, source
from taichi_dem import ImplicitDashpots, Material, Scene, Simulation, Uniform, checked_mesh, effects
from taichi_dem.mesh.topology import face_vertices, skin, topology_of
from tests.ca_spheres.rig import put
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
    bare = checked_mesh(points, tetrahedra, {})
    body, face, _ = skin(topology_of(bare), np.zeros(0, dtype=int))
    return replace(bare, groups={"left": face_vertices(bare, body[:1], face[:1])})


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
    way, speed, broken, near = run(SOLID, script.replace("STEPS", str(STEPS)))
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


def test_what_sleeps_changes_places_by_less_than_its_share(run):
    """Bodies wait for a wave to come, which leaves out a share of what it brings."""
    _, data, _ = PAGES["strike_here"]()
    velocity, awake = blow(data, 3.0, 0.1), {"dt": data["dt"], "held": data["held"]}
    (way, *_), (slept, *_) = (
        moved(run, data, velocity, {**awake, "sleep": share}) for share in (0.0, data["sleep"])
    )
    assert not way[data["held"]].any()
    assert 0.0 < np.abs(slept - way).max() <= data["sleep"] * np.abs(way).max()


#: Pages with a bar; method of the kernels, and where in the step their dashpots act.
SWEPT = {"tolerance": 1e-12, "sweeps": (2, 1000)}
WAYS = [
    ("one_step_too_far", Uniform(4e-8), 0.0),
    ("one_step_too_far", ImplicitDashpots(4e-7, **SWEPT), 0.5),
    ("what_one_percent_costs", ImplicitDashpots(4e-7, theta=1.0, **SWEPT), 1.0),
]


@pytest.mark.parametrize(("name", "method", "theta"), WAYS)
def test_pushed_bar_moves_as_in_the_kernels(run, name, method, theta):
    """Sweeps go on until the order of visits has no part in what is found."""
    _, data, _ = PAGES[name]()
    velocity = blow(data, 1.0, 0.2)
    options = {"dt": method.dt0, "theta": theta, "effects": {"contact": False}, **SWEPT}
    found = moved(run, data, velocity, options)[:2]
    listed = filled("bonds", effects.BondDamping(), effects.Softening(), effects.ShearSlip())
    assert_same(found, simulated(data, velocity, listed, method)[:2])


def boxed(filling, numbers, motion):
    """Displacement and velocity of a box let go from 30 mm, after some steps, and its batch."""
    # A frequency by which a cycle has whole steps, which are then of the length asked for.
    batch = Batch(filling, SceneTable(len(motion[0]), 1, numbers["dt"], 5.0, 0.0))
    batch.start(displacement=0.03)
    if isinstance(filling, Spheres):
        put(batch.device, *motion)
    batch.advance(STEPS)
    return [batch.sample()[name][0] for name in ("x", "v")], batch


def test_grains_shake_their_box_as_in_the_kernels(run):
    """Thrown at each other and at the walls; fixed ones move with their box."""
    scripts, numbers, _ = PAGES["hear_the_grains"]()
    places = 6.3e-3 * np.stack(np.mgrid[:9, :4], axis=-1).reshape(-1, 2) + 3.1e-3
    velocities = np.random.default_rng(1).uniform(-0.5, 0.5, places.shape)
    script = """
        const [numbers, places, velocities] = INPUT, found = [];
        for (const free of [true, false]) {
          const box = new Damper(numbers, places, { free, displacement: 0.03, velocities });
          for (let step = 0; step < STEPS; step++) box.step();
          found.push([box.x, box.v], [...box.velocity]);
        }
        JSON.stringify(found);"""
    given = json.dumps([numbers, places.ravel().tolist(), velocities.ravel().tolist()])
    script = script.replace("INPUT", given).replace("STEPS", str(STEPS))
    free, speed, fixed, _ = run(scripts, script)
    of_free, batch = boxed(Spheres(), numbers, (places, velocities))
    of_grains = batch.snapshot(0)["velocity"]
    of_fixed, _ = boxed(RigidMass(), numbers, (places, velocities))
    assert np.abs(of_grains - velocities).max() > 0.1
    found = free, fixed, np.reshape(speed, (-1, 2))
    assert_same(found, map(np.array, (of_free, of_fixed, of_grains)))


#: Pages, an address of each, and what they then show.
SHOWN = [
    ("strike_here", "tap=0.255,0.17&speed=20&at=0.1", r"[1-9]\d* of 532 bonds broke"),
    ("one_step_too_far", "step=100&at=10", "stopped after"),
    ("what_one_percent_costs", "method=last", "being computed|right end moves"),
    ("hear_the_grains", "at=0.5", "after 0.5 s"),
]


@pytest.mark.parametrize(("name", "hash_", "shown"), SHOWN)
def test_a_browser_opens_a_page_and_what_its_address_asks_for(name, hash_, shown):
    """Without an error in its console; a blow that the address asks for breaks the plate."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("needs a browser: apt-get install chromium")
    flags = "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr"
    command = [browser, *flags, "--virtual-time-budget=1000", "--dump-dom"]
    address = f"{(OUT / name).with_suffix('.html').as_uri()}#{hash_}"
    done = subprocess.run([*command, address], capture_output=True, text=True, timeout=100)
    assert "CONSOLE" not in done.stderr, done.stderr
    assert re.search(shown, done.stdout)
