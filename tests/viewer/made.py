"""Results and films made without a run, whose frames hold drawn numbers; and pages read back."""

import base64
import json
import re
from types import SimpleNamespace

import numpy as np

from ca_damper import Automaton, Spheres
from ca_damper.report.record import Frame as DamperFrame
from ca_damper.runs.film import Film
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import topology_of
from taichi_dem.output.record import Frame
from taichi_dem.result import Result
from tests.turns import matrix, quaternion

MESH = bar(0.4, 0.1, (4, 1, 1))
UNTIL_S = 4e-6


def block(count=5, mesh=MESH, breaks=True):
    """Result of a bar with so many frames: it moves, turns, and every third bond breaks."""
    draw, topology = np.random.default_rng(1), topology_of(mesh)
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    model = SimpleNamespace(
        **{"mesh": mesh, "topology": topology, "centre": centre},
        **{"body_count": mesh.body_count, "bond_count": topology.bond_count},
    )
    broken = np.linspace(1e-6, UNTIL_S, topology.bond_count)
    broken[np.arange(len(broken)) % 3 >= int(breaks)] = np.nan
    since = {"slip": np.where(draw.random(mesh.body_count) < 0.5, 2e-6, np.nan)}
    frames = tuple(block_frame(centre, time_s, draw) for time_s in np.linspace(0.0, UNTIL_S, count))
    report = SimpleNamespace(outcome="implicit, 4e-06 s simulated, <10> of 30 bonds broken")
    method, peak = SimpleNamespace(dt0=4e-7), np.zeros(mesh.body_count)
    parts = None, method, model, {}, frames, broken, peak, report
    return Result(*parts, acting_since=since)


def block_frame(centre, time_s, draw):
    """Bodies moved and turned by amounts that grow with time."""
    count, share = len(centre), time_s / UNTIL_S
    displacement = 0.02 * share * draw.normal(size=(count, 3))
    turns = [quaternion(draw.normal(size=3), 2.0 * share) for _ in range(count)]
    return Frame(
        time_s=float(time_s),
        position=centre + displacement,
        rotation=np.array([matrix(turn) for turn in turns]),
        displacement=displacement,
        velocity=30.0 * share * draw.normal(size=(count, 3)),
        angular_momentum=np.zeros((count, 3)),
        level=draw.integers(0, 4, count),
        damage=draw.random(count),
        bound=np.zeros(count, dtype=int),
    )


def damper(particles=(3, 5), count=6, filling=None, **options):
    """Film of scenes with so many particles each."""
    draw, box = np.random.default_rng(2), Spheres()
    size = np.array([box.width, box.height])
    frames = tuple(
        tuple(
            DamperFrame(
                *(0.02 * k, 0.01 * np.sin(k + s), 0.002 * np.cos(k)),
                *(size * draw.uniform(0.1, 0.9, (number, 2)), draw.normal(size=(number, 2))),
            )
            for k in range(count)
        )
        for s, number in enumerate(particles)
    )
    return Film({}, frames, Automaton() if filling is None else filling, **options)


def data_of(page):
    """Data of a page by name."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.text)
    return json.loads(found[1], parse_constant=no_number)


def no_number(text):
    """JSON has no infinity and no NaN: a browser refuses them."""
    raise AssertionError(text)


def unpacked(packed):
    """Array of what ``pack`` made."""
    kind = np.dtype(packed["kind"]).newbyteorder("<")
    return np.frombuffer(base64.b64decode(packed["data"], validate=True), kind)


def of_frames(packed):
    """Values of what ``quantise`` made, (frames, n), and half a step of each frame, (frames, 1)."""
    scale = np.array(packed["scale"])[:, None]
    return unpacked(packed).reshape(len(scale), -1) * scale, 0.5 * scale
