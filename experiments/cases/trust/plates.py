"""Plates on random meshes, with the material and the step that they need."""

import numpy as np

from taichi_dem import ImplicitDashpots, Scene, Simulation, effects, step_report
from taichi_dem.elasticity.mesh_stiffness import mesh_stiffness
from taichi_dem.materials import Material
from taichi_dem.mesh.mesh import checked_mesh, with_cut

#: Shift of inner points, as a share of their distance.
JITTER = 0.25
#: Least distance of points without rows, in edges: one of them on the square of an edge.
DISTANCE = 0.78


def plate(length, height, edge, seed, layers=1, in_rows=True):
    """Plate of triangles about points ``edge`` apart in rows, one of them at half the height.

    length, height, edge [m]: along x, along y, of the elements; the thickness is as many edges as
    there are layers. Points on the outline and in the middle row move along it only. Groups: left,
    right, bottom, top, back, front.
    """
    draw = np.random.default_rng(seed)
    # Numbers say which way a prism is cut: in order of the rows all would be cut alike.
    points = (_points if in_rows else _scattered)(length, height, edge, draw)
    flat = draw.permutation(points)
    triangles = _triangles(flat)
    layer = [np.column_stack([flat, np.full(len(flat), k * edge)]) for k in range(layers + 1)]
    grid = np.vstack(layer)
    bodies = np.vstack([_prisms(triangles, len(flat), k) for k in range(layers)])
    faces = np.sort(bodies[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    outer, count = np.unique(faces, axis=0, return_counts=True)
    outer = outer[count == 1]
    sides = [(axis, end) for axis in range(3) for end in (0.0, 1.0)]
    sizes, groups = (length, height, layers * edge), {}
    for name, (axis, end) in zip(("left", "right", "bottom", "top", "back", "front"), sides):
        on = np.isclose(grid[outer, axis], end * sizes[axis], atol=1e-9 * length)
        groups[name] = outer[on.all(axis=1)]
    return checked_mesh(grid, bodies, groups)


def _points(length, height, edge, draw):
    """Points in the plane, (n, 2)."""
    half = max(1, round(0.5 * height / (edge * np.sqrt(0.75))))
    along, rows = max(1, round(length / edge)), []
    for row in range(2 * half + 1):
        shift = 0.5 * (row % 2)
        x = np.unique(np.clip(np.arange(along + 1) + shift, 0, along)) * length / along
        x = np.unique(np.append(x, 0.0))
        y = np.full(len(x), 0.5 * height * row / half)
        x[1:-1] += JITTER * edge * draw.uniform(-1, 1, len(x) - 2)
        if row not in (0, half, 2 * half):
            y += JITTER * edge * draw.uniform(-1, 1, len(y))
        rows.append(np.column_stack([x, y]))
    return np.vstack(rows)


def _scattered(length, height, edge, draw):
    """Points in the plane, (n, 2): evenly on the outline, inside anywhere but near others."""
    from scipy.stats.qmc import PoissonDisk

    sides = [np.linspace(0.0, side, round(side / edge) + 1) for side in (length, height)]
    x, y = (grid.ravel() for grid in np.meshgrid(*sides))
    outline = np.isin(x, (0.0, length)) | np.isin(y, (0.0, height))
    low = 0.5 * edge
    inner = np.array([length - edge, height - edge])
    sampler = PoissonDisk(2, radius=DISTANCE * edge / inner.max(), seed=draw)
    found = low + inner.max() * sampler.fill_space()
    within = (found <= low + inner).all(axis=1)
    return np.vstack([np.column_stack([x, y])[outline], found[within]])


def _triangles(points):
    """Delaunay triangles without flat ones, anticlockwise."""
    from scipy.spatial import Delaunay

    found = Delaunay(points).simplices
    corner = points[found]
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    found[area < 0.0] = found[area < 0.0][:, [0, 2, 1]]
    return found[np.abs(area) > 1e-6 * np.median(np.abs(area))]


def _prisms(triangles, points, layer):
    """Three tetrahedra for each prism on a triangle; neighbours match as low numbers go first."""
    low = np.sort(triangles, axis=1) + layer * points
    up = low + points
    a, b, c = low.T
    d, e, f = up.T
    parts = [np.column_stack(rows) for rows in ((a, b, c, f), (a, b, e, f), (a, d, e, f))]
    return np.vstack(parts)


def material_of(mesh, young, poisson, axes=(0, 1), **options):
    """A material of which a mesh shows this Young's modulus [Pa] along axes."""
    made = Material.from_elastic(young=young, poisson=poisson, **options)
    shown = mesh_stiffness(mesh, made).young_along[list(axes)]
    scale = young / float(np.mean(shown))
    return Material.from_elastic(young=scale * young, poisson=poisson, **options)


def notched(whole, length, depth):
    """A plate with a notch of a depth at half its length [m]."""
    return with_cut(whole, "notch", (0.5 * length, 0, 0), (1, 0, 0), lambda x: x[:, 1] < depth)


def pulled(mesh, material, laws, speed, ramp=0.0, **options):
    """Simulation of a solid whose ends move apart, at a speed [m/s] after a ramp [s].

    options: of the scene.
    """
    drives = [
        effects.PrescribedMotion(group, (way * speed, 0, 0), ramp=ramp)
        for group, way in (("left", -1), ("right", 1))
    ]
    scene = Scene(mesh, material, [*laws, *drives], **options)
    return Simulation(scene, ImplicitDashpots(springs_step(scene)))


def comes_apart(simulation, steps):
    """Advance to numbers of steps until both ends are in different pieces; whether they are."""
    x = simulation.model.centre[:, 0]
    for step in steps:
        simulation.advance_to(step)
        piece = simulation.model.pieces(simulation.state.broken())
        if piece[x.argmin()] != piece[x.argmax()]:
            return True
    return False


def springs_step(scene):
    """Half of the largest step that the springs of all bonds allow [s]."""
    return 0.5 * float(step_report(scene).borne("solved").min())
