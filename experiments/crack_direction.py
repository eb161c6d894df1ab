"""Do cracks run along the rows of a mesh?

A square plate with a notch in the middle of its left side is pulled along y, so that its crack runs
straight along x. A structured plate whose rows are turned by 15 degrees breaks along a row. The
same points scattered, as by ``shapes.plate(scatter=...)``, have no rows: their cracks are a little
rough but keep the direction.

    python experiments/crack_direction.py             # two minutes
    python experiments/crack_direction.py --seeds 20

The direction is the principal axis of the broken faces' centres, weighted by their areas. Writes
cracks.png, directions.csv and summary.json to results/crack_direction/.
"""

import sys
from functools import partial
from types import SimpleNamespace

import numpy as np

from taichi_dem import ImplicitDashpots, Scene, Simulation, effects, step_report
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, RED, picture
from taichi_dem.materials import Material
from taichi_dem.mesh.mesh import with_cut
from taichi_dem.mesh.shapes import divided, drawn_out
from taichi_dem.output.fracture import crack_areas
from taichi_dem.simulate import run_simulation

NAME = "crack_direction"
SETTINGS = {
    "element": (4e-3, 5e-3, study.number(2e-3, 8e-3), "edge of an element [m], default 0.004"),
    "seeds": (5, 1, study.whole(1, 100), "number of scattered plates, default 5"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Side of the plate and depth of the notch [m], turn of the rows, and error allowed [degrees].
SIZE, NOTCH, TURN, ALLOWED = 0.1, 0.03, 15.0, 5.0
#: E [Pa], density [kg/m3] and strength [Pa] of the plate.
YOUNG, DENSITY, STRENGTH = 32e9, 2450.0, 3e6
ROCK = Material.from_elastic(
    **{"young": YOUNG, "poisson": 0.2, "density": DENSITY, "tensile_strength": STRENGTH},
    **{"fracture_energy": 2.0, "friction_angle": 30.0, "cohesion": 6e6, "damping_ratio": 0.1},
)
#: Times that a wave crosses the plate until an even strain is at the strength, and when runs end,
#: as a share of that: at 0.75 all plates were divided.
TRANSITS, END = 10.0, 0.8
SIDES = {"left": (0, 0.0), "right": (0, SIZE), "bottom": (1, 0.0), "top": (1, SIZE)}
TABLE = study.Table(
    mesh=("name", "mesh"),
    bodies=("bodies", "bodies", "d", "1"),
    angle_deg=("angle", "direction [°]", ".1f", "degree"),
    area=("area", "broken area / plane", ".2f", "1"),
)


def plate(element, scatter):
    """Plate of one layer whose rows are turned against its sides, or whose points are scattered."""
    angle = np.radians(TURN)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = SIZE * np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) @ turn

    def side(axis, place):
        return lambda points: np.abs((points @ turn.T)[..., axis] - place) < 1e-6 * element

    sides = {name: side(*at) for name, at in SIDES.items()}
    made = drawn_out([divided(corners, element)], element, element, sides, scatter)
    made = made.moved(turned=(0.0, 0.0, -TURN), about=(0.0, 0.0, 0.0))
    middle = (0.0, 0.5 * SIZE, 0.0)
    return with_cut(made, "notch", middle, (0, 1, 0), lambda x: x[:, 0] < NOTCH)


def broken_plate(element, scatter=None):
    """Pull a plate apart. scatter: seed, None for the rows. Subject of TABLE, with the Result."""
    mesh = plate(element, scatter)
    strained = TRANSITS * SIZE / np.sqrt(YOUNG / DENSITY)
    rate = STRENGTH / YOUNG / strained
    half = 0.5 * rate * SIZE
    pulls = [effects.PrescribedMotion(k, (0, v, 0)) for k, v in (("top", half), ("bottom", -half))]
    laws = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    scene = Scene(mesh, ROCK, [*laws, *pulls], unbonded=["notch"])
    step = 0.8 * float(step_report(scene).borne("solved").min())
    simulation = Simulation(scene, ImplicitDashpots(step))
    # An even strain rate from the start, so that no wave starts at the ends.
    centre = simulation.model.centre
    velocity = np.outer(rate * (centre[:, 1] - 0.5 * SIZE), (0, 1, 0))
    simulation.state.set_motion(centre, velocity=velocity)
    name = "rows" if scatter is None else f"seed {scatter}"
    result = run_simulation(simulation, until=END * strained, samples=1, title=name)
    broken = np.flatnonzero(~np.isnan(result.broken_time))
    faces, areas = result.model.topology.vertices[broken], crack_areas(result.model)[broken]
    angle = direction(mesh.points[faces].mean(axis=1), areas)
    area = areas.sum() / ((SIZE - NOTCH) * element)
    made = {"name": name, "bodies": mesh.body_count, "angle": angle, "area": float(area)}
    return SimpleNamespace(**made, mesh=mesh, faces=faces, result=result)


def direction(places, areas):
    """Angle from x of the principal axis of places (n, 3) in the plane, by areas (n,) [degrees]."""
    x, y = (places[:, :2] - np.average(places[:, :2], axis=0, weights=areas)).T
    xx, xy, yy = ((areas * one).sum() for one in (x * x, x * y, y * y))
    return float(np.degrees(0.5 * np.arctan2(2.0 * xy, xx - yy)))


def draw(axes, made, title, colour):
    """The front of a plate, with the edges of broken faces in it."""
    x, y, z = 1e3 * made.mesh.points.T
    axes.triplot(x, y, made.mesh.group_faces("front"), color=GREY, lw=0.3)
    edges = made.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges = edges[(z[edges] > 0.999 * z.max()).all(axis=1)]
    axes.plot(x[edges].T, y[edges].T, color=colour, lw=2.0)
    axes.plot([0.0, 1e3 * NOTCH], [500.0 * SIZE] * 2, color="black", lw=1.5)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title=title)


def picture_cracks(path, made):
    """A plate in rows, a scattered one, and directions of all."""
    with picture(path, 1, 3, size=(9.2, 3.6)) as (_, (*panels, last)):
        for axes, one, colour in zip(panels, made, (RED, BLUE)):
            draw(axes, one, f"{one.name}: {one.angle:.1f}°", colour)
        names, angles = [one.name for one in made], [one.angle for one in made]
        last.axhspan(-ALLOWED, ALLOWED, color=GREEN, alpha=0.2, lw=0.0, label=f"± {ALLOWED:g}°")
        last.axhline(0.0, color=GREY, lw=0.8, label="exact")
        last.axhline(-TURN, color=GREY, ls=":", label="a row of the mesh")
        last.scatter(range(len(made)), angles, c=[RED] + [BLUE] * (len(made) - 1), zorder=3)
        last.set_xticks(range(len(made)), names, rotation=90)
        last.set(ylabel="direction of the crack [°]", ylim=(-18.0, 12.0))
        last.legend(loc="upper left", ncols=3)


def run(options):
    """Break all plates, compare, picture."""
    at, seeds = study.output_paths(options.out), range(1, options.seeds + 1)
    made = [broken_plate(options.element, scatter) for scatter in (None, *seeds)]
    rows = TABLE.rows(made)
    TABLE.show(rows)
    study.write_rows(at("directions.csv"), rows)
    picture_cracks(at("cracks.png"), made)
    angles = np.array([one.angle for one in made])
    figures = {
        "rows_angle_deg": (angles[0], "degree"),
        "scattered_largest_deg": (float(np.abs(angles[1:]).max()), "degree"),
        "scattered_mean_deg": (float(angles[1:].mean()), "degree"),
    }
    study.finish(options, NAME, figures, [one.result.report for one in made])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
