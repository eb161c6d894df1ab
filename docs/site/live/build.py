"""Build the live pages: one HTML file each, with its scripts and the package's numbers inside.

python docs/site/live/build.py
"""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader

import taichi_dem as dem
from taichi_dem.kit.viewer import pack
from taichi_dem.mesh.topology import faces_of_group, topology_of
from taichi_dem.shapes import plate

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "live"
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
    return ["solid.js"], packed(mesh, BRISK, "rim") | numbers, words


PAGES = {page.__name__: page for page in (strike_here,)}


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
