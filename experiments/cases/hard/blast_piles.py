"""Hard cases of the blast: loose blocks that stand, fall, slide and flow."""

from functools import partial

import numpy as np
from scipy.optimize import linprog

from cases.hard import Cases
from cases.hard.blast_run import Run
from cases.meshes import GRAVITY, STEP, brick, hexahedron, loose, softened
from taichi_dem import ImplicitDashpots
from taichi_dem.mesh.mesh import with_inner_group
from taichi_dem.mesh.shapes import bar, placed_together

case = CASES = Cases("blast")
#: What counts as standing, and as falling, after TIME [m, s].
STANDS, FALLS, TIME = 5e-5, 1e-3, 0.12
#: Half of a house of cards: from the axis to its foot, widths of foot and top, height [m].
SPAN, WIDE, TALL = 0.16, 0.04, 0.2
#: Its outline, inner foot first.
CARD = np.array([[0.0, SPAN], [0.0, SPAN + WIDE], [TALL, 0.0], [TALL - WIDE, 0.0]])
#: Radii of an arch [m], and angles of its joints, from the plate to the plate.
INNER, OUTER, JOINTS = 0.2, 0.3, np.linspace(0.0, np.pi, 6)
#: Walls of a funnel: half of its mouth, length and thickness [m], slope.
MOUTH, WALL, THICK, SLOPE = 0.05, 0.3, 0.05, np.pi / 3.0


class Pile(Run):
    """A run of blocks on parts held at groups ``fixed``, which come first; limits on energy."""

    def __init__(self, trial, parts, friction, step=STEP, fixed=("plate_left",), **more):
        blocks = {name: (mesh, (0.0, 0.0, 0.0)) for name, mesh in parts.items()}
        mesh = placed_together(blocks, keep_coincident=True)
        held = [name.split("_")[0] for name in fixed]
        options = {"material": softened(friction), "effects": loose(fixed=fixed), **more}
        options["bodies"] = slice(sum(parts[name].body_count for name in held), None)
        super().__init__(trial, mesh, TIME, methods={"implicit": ImplicitDashpots(step)}, **options)
        report = self.result.report
        residual = abs(report.energy_residual_fraction)
        trial.limit("energy from nowhere", residual, 0.05, "the specification")
        trial.limit("momentum error", report.linear_momentum_error, 1e-9, "rounding")

    def way(self):
        """Largest way of a body at every sample [m]."""
        return np.linalg.norm(self.moved, axis=2).max(axis=1)

    def stands(self):
        """Nothing moves once the weight has come to rest."""
        way = self.way()
        late = abs(way[-1] - way[len(way) // 2])
        self.trial.limit("late way / a thousandth of a block", late / STANDS, 1.0, "it stands")

    def falls(self):
        """Something has moved."""
        self.trial.limit("1 mm / way", FALLS / self.way()[-1], 1.0, "it falls")

    def nothing_below(self):
        """No body has got into the plate."""
        self.depth("below the plate", -self["position"][:, :, 0].min())

    def depth(self, where, depth):
        """How deep a body has got into another [m]."""
        formula = "none gets through"
        self.trial.limit(f"depth {where} / 1 mm", max(0.0, depth) / 1e-3, 1.0, formula)

    def no_energy_made(self):
        """Energy of motion and weight never exceeds what there was."""
        weight = GRAVITY * (self["position"][:, :, 0] @ self.mass)
        energy = (self.kinetic_energy + weight - weight[0]) / self.kinetic_energy.max()
        rise, formula = energy.max() - energy[0], "kinetic + weight <= at the start"
        self.trial.limit("energy made / most of motion", rise, 1e-3, formula)


def plate(half):
    """A plate below x = 0 of a half width [m]."""
    return brick((0.05, 2 * half, 2 * half), (-0.05, -half, -half))


@case(["implicit"], pyramid_100=100, pyramid_300=300)
def pyramid(trial, ratio):
    """Four small blocks bear one that is {0} times as heavy, and stand."""
    small, gap = 0.05, 1e-9
    large = small * ratio ** (1.0 / 3.0)
    parts, far = {"plate": plate(large)}, 0.5 * large - small
    for k, (y, z) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        corner = gap, y * far - 0.5 * small, z * far - 0.5 * small
        parts[f"foot{k}"] = brick((small,) * 3, corner)
    parts["top"] = brick((large,) * 3, (small + 2 * gap, -0.5 * large, -0.5 * large))
    Pile(trial, parts, 0.5).stands()


def wedge(corners):
    """Block 0.1 m deep over corners (up, along) [m]: 0 and 1 below, 3 and 2 above."""

    def place(unit):
        up, out, depth = unit.T[:, :, None]
        low, high = (corners[k] + out * (corners[m] - corners[k]) for k, m in ((0, 1), (3, 2)))
        return np.hstack([low + up * (high - low) + [1e-9, 0.0], 0.1 * (depth - 0.5)])

    return hexahedron(place)


def house():
    """Outlines of two cards that lean on each other, one after the other, (2, 4, 2) [m]."""
    apart = np.array([0.0, 1e-9])
    return np.stack([CARD + apart, CARD[::-1] * [1.0, -1.0] - apart])


def arch():
    """Outlines of the five wedges of an arch, (5, 4, 2) [m]."""
    ends = np.stack([np.sin(JOINTS), np.cos(JOINTS)], axis=1)
    near, far = INNER * ends, OUTER * ends
    return np.stack([near[:-1], far[:-1], far[1:], near[1:]], axis=1)


# The sides of an arch slide, where places are exact; cards turn about their feet, and the outermost
# ray bears within the edges.
@case(
    ["implicit"],
    house_of_cards_stands=("House of cards", house(), 1.25, "stands"),
    house_of_cards_falls=("House of cards", house(), 0.98, "falls"),
    arch_stands=("Arch", arch(), 1.02, "stands"),
    arch_falls=("Arch", arch(), 0.98, "falls"),
)
def leaning(trial, _, stones, share, outcome):
    """{0} with {2:g} of the least friction of rigid wedges: it {3}."""
    parts = {"plate": plate(0.35)}
    parts.update({f"stone{k}": wedge(corners) for k, corners in enumerate(stones)})
    run = Pile(trial, parts, share * least_friction(stones))
    getattr(run, outcome)()


def least_friction(stones, accuracy=1e-4):
    """Least friction coefficient with which wedges in a row can stand.

    stones: polygons (n, 4, 2) of one thickness, corners (up, along): 0 and 1 on the joint with the
    stone before, 3 and 2 on that with the stone after; gravity acts against the first coordinate.
    Found by bisection: at each end of each joint some force within the cone of friction holds all
    stones (Livesley, Int. J. Numer. Meth. Engng. 12 (1978) 1853).
    """
    low, high = 0.0, 2.0
    while high - low > accuracy:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _stand(stones, middle) else (middle, high)
    return high


def _stand(stones, friction):
    """Whether forces exist that hold all stones."""
    count = len(stones)
    rows, weight = np.zeros((count, 3, count + 1, 4)), np.zeros((count, 3))
    for k, corners in enumerate(stones):
        area, centre = _area(corners)
        weight[k, 0] = area
        for joint, ends, sign in ((k, corners[[0, 1]], 1.0), (k + 1, corners[[3, 2]], -1.0)):
            along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            across = np.array([along[1], -along[0]])
            edges = across + friction * along, across - friction * along
            force = sign * np.repeat(edges, 2, axis=0)
            arm = np.tile(ends, (2, 1)) - centre
            rows[k, :2, joint] = force.T
            rows[k, 2, joint] = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    whole = rows.reshape(3 * count, -1)
    found = linprog(np.zeros(whole.shape[1]), A_eq=whole, b_eq=weight.ravel(), bounds=(0, None))
    return found.status == 0


def _area(corners):
    """Area of a polygon (positive from the first coordinate to the second), and its centre."""
    x, y = corners.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    next_too = corners + np.roll(corners, -1, axis=0)
    return abs(cross.sum()) / 2.0, (next_too * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())


@case(("implicit",))
def column_collapse(trial):
    """A column of 18 loose tetrahedra falls apart on a plate: no energy is made."""
    column = bar(0.15, 0.05, (3, 1, 1))
    column = with_inner_group(column, "joints", lambda x: np.ones(len(x), dtype=bool))
    run = Pile(trial, {"plate": plate(0.3), "column": column}, 0.3, unbonded=["column_joints"])
    run.no_energy_made()
    run.falls()
    run.nothing_below()


@case(["implicit"], rod_pushed=(1.0, "pushed"), rod_drawn=(-1.0, "drawn"))
def jammed_rod(trial, way, _):
    """A rod that leans by 30 degrees is {1} over a plate of friction 2.5, which jams it."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    lean = np.array([[c, -s], [s, c]])

    def place(unit):
        size = unit * [0.3, 0.02, 0.02]
        return np.column_stack([size[:, :2] @ lean + [0.011, 0.0], size[:, 2]])

    parts = {"plate": plate(0.3), "rod": hexahedron(place)}
    count = parts["plate"].body_count
    velocity = np.outer(np.arange(count + 6) >= count, (-0.5, 2.0 * way, 0.0))
    run = Pile(trial, parts, 2.5, 2e-6, velocity=velocity)
    run.no_energy_made()
    run.nothing_below()


def wall(unit, side):
    """A wall of a funnel, on one side of it; its inner face is the block's left side."""
    out, up, along = (unit * [THICK, WALL, 0.3]).T
    x = up * np.sin(SLOPE) - out * np.cos(SLOPE)
    y = MOUTH + up * np.cos(SLOPE) + out * np.sin(SLOPE)
    return np.column_stack([x, side * y, along - 0.15])


@case(("implicit",))
def funnel(trial):
    """Nine blocks fall through a funnel of two plates: none gets through a wall."""
    parts = {f"wall{k}": hexahedron(partial(wall, side=side)) for k, side in enumerate((-1.0, 1.0))}
    bodies = sum(mesh.body_count for mesh in parts.values())
    for k in range(9):
        corner = 0.12 + 0.05 * (k // 3), 0.05 * (k % 3) - 0.07, 0.01 * k - 0.06
        parts[f"block{k}"] = brick((0.04, 0.04, 0.04), corner)
    velocity = np.outer(np.arange(bodies + 54) >= bodies, (-2.0, 0.0, 0.0))
    run = Pile(trial, parts, 0.3, STEP, ("wall0_right", "wall1_right"), velocity=velocity)
    run.no_energy_made()
    x, y = run["position"][:, :, 0], abs(run["position"][:, :, 1])
    behind = (y - MOUTH) * np.sin(SLOPE) - x * np.cos(SLOPE)
    along = (y - MOUTH) * np.cos(SLOPE) + x * np.sin(SLOPE)
    run.depth("in a wall", np.where((along > 0.0) & (along < WALL), behind, -np.inf).max())
    trial.limit("6 / bodies below", 6.0 / max(1e-9, (x[-1] < 0.0).sum()), 1.0, "blocks leave it")
