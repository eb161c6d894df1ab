"""Build the live pages: one HTML file each, with its scripts and the package's numbers inside.

python docs/site/live/build.py
"""

import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader

import taichi_dem as dem
from ca_damper import Oscillator, Spheres
from ca_damper.spheres.contact_law import pair_numbers, wall_numbers
from taichi_dem.kit.viewer import pack
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import body_properties, faces_of_group, topology_of
from taichi_dem.shapes import beam, plate

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "live"
#: Scripts of bonded bodies, in their order.
SOLID = ["vectors.js", "bodies.js", "contact.js", "solved.js", "solid.js"]
#: Concrete of the paper, with dashpots that an explicit step of half a microsecond bears.
BRISK = replace(dem.CONCRETE, normal_damping=1.13e6, shear_damping=5.05e5, contact_damping=3e3)


def rounded(mesh, groups):
    """A mesh with points that single precision holds, and groups joined from some of its own."""
    joined = {
        name: np.concatenate([mesh.group_faces(one) for one in parts])
        for name, parts in groups.items()
    }
    points = mesh.points.astype(np.float32).astype(float)
    return dem.checked_mesh(points, mesh.tetrahedra, joined)


def packed(mesh, material, held=""):
    """Mesh and material as a page has them, and bodies of a group that is held."""
    bodies = faces_of_group(mesh, topology_of(mesh), held)[0] if held else []
    return {
        "points": pack(mesh.points, "float32"),
        "tetrahedra": pack(mesh.tetrahedra, "uint16"),
        "held": sorted({*map(int, bodies)}),
        "material": asdict(material),
    }


def strike_here():
    """A plate that is held at its rim."""
    made = plate(width=0.51, height=0.34, thickness=0.06, element=0.06, scatter=4)
    mesh = rounded(made, {"rim": ("left", "right", "bottom", "top")})
    numbers = {"dt": 5e-7, "sleep": 1e-3}
    words = {"bodies": mesh.body_count, "sleep": "a thousandth"}
    return SOLID, packed(mesh, BRISK, "rim") | numbers, words


def one_step_too_far():
    """A bar, and the bond whose dashpots limit its step."""
    mesh, limits = struck_bar()
    limit, worst = limits["bond_dashpot"].min(), int(limits["bond_dashpot"].argmin())
    other = stiffest_neighbour(mesh, worst)
    numbers = {"limit": float(f"{limit:.3g}"), "worst": worst, "other": other}
    words = {"worst": worst, "other": other, "limit": f"{1e9 * limit:.0f}"}
    words["springs"] = f"{1e9 * limits['bond_stiffness'].min():,.0f}"
    return SOLID, packed(mesh, dem.CONCRETE) | middle_of(mesh) | numbers, words


def what_one_percent_costs():
    """A bar, and numbers of steps in the time that is asked for."""
    mesh, limits = struck_bar()
    until = 6e-5
    most = until / limits["bond_dashpot"].min()
    steps = {
        "explicit": [math.ceil(1.02 * most * 2.0 ** (k / 8.0)) for k in range(9)],
        "solved": [round(30.0 * 2.0 ** (0.375 * k)) for k in range(9)],
        "true": 1000,
    }
    right = mesh.points[:, 0].max() - 1e-6
    end = np.flatnonzero((mesh.points[mesh.tetrahedra][:, :, 0] > right).any(axis=1))
    numbers = {"until": until, "steps": steps, "end": end.tolist()}
    return SOLID, packed(mesh, dem.CONCRETE) | numbers, {"until": round(1e6 * until)}


def hear_the_grains():
    """The paper's box on its spring, and its spheres."""
    spheres, container = Spheres(), Oscillator()
    numbers = {
        "dt": spheres.default_dt,
        "width": spheres.width,
        "height": spheres.height,
        "gravity": spheres.gravity,
        "grain": {"radius": spheres.radius, "mass": spheres.particle_mass},
        "container": asdict(container) | {"frequency": container.natural_frequency},
        "pair": pair_numbers(spheres),
        "wall": wall_numbers(spheres),
    }
    return ["grains.js"], numbers, {"mass": round(1e3 * container.mass)}


def struck_bar():
    """A bar of the paper's concrete, and its largest stable steps."""
    mesh = rounded(beam(length=0.4, width=0.1, height=0.1, element=0.06, scatter=3), {})
    scene = dem.Scene(mesh, dem.CONCRETE, [dem.effects.BondDamping()])
    return mesh, dem.step_report(scene).limits


def stiffest_neighbour(mesh, body):
    """The body behind the bond of a body that couples them most, by its area over their masses."""
    top = topology_of(mesh)
    vectors = area_vectors(mesh.points, top.vertices)
    mass = body_properties(mesh, 1.0)[0]
    rate = np.linalg.norm(vectors, axis=1) * (1.0 / mass[top.master] + 1.0 / mass[top.slave])
    mine = (top.master == body) | (top.slave == body)
    bond = np.flatnonzero(mine)[rate[mine].argmax()]
    return int(top.master[bond] + top.slave[bond] - body)


def middle_of(mesh):
    """Middle of a mesh [m]."""
    return {"middle": (0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))).tolist()}


PAGES = {
    page.__name__: page
    for page in (strike_here, one_step_too_far, what_one_percent_costs, hear_the_grains)
}


def source(name):
    """Text of a file of this folder."""
    return (HERE / name).read_text(encoding="utf-8")


def built(name):
    """A page as text."""
    scripts, data, words = PAGES[name]()
    environment = Environment(loader=FileSystemLoader(HERE), autoescape=False, trim_blocks=True)
    page = environment.get_template(f"{name}.html")
    return page.render(scripts=scripts, data=json.dumps(data), source=source, **words)


if __name__ == "__main__":
    OUT.mkdir(exist_ok=True)
    for title in PAGES:
        (OUT / f"{title}.html").write_text(built(title), encoding="utf-8")
        print(f"{OUT / title}.html: {(OUT / title).with_suffix('.html').stat().st_size:,} bytes")
