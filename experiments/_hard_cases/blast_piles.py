"""Hard cases of the blast: loose blocks that stand, fall, slide and flow."""

from functools import partial

import numpy as np

from _hard_cases._blast_run import Run
from _hard_cases._statics import least_friction
from _piles import GRAVITY, STEP, brick, hexahedron, loose, softened
from taichi_dem import ImplicitDashpots
from taichi_dem.kit.study.cases import Cases
from taichi_dem.mesh.mesh import with_inner_group
from taichi_dem.mesh.shapes import bar, placed_together

case = CASES = Cases("blast")
ZERO = (0.0, 0.0, 0.0)
#: What counts as standing, and as falling, after TIME [m, s].
STANDS, FALLS, TIME = 5e-5, 1e-3, 0.12


def piled(trial, parts, friction, step=STEP, fixed=("plate_left",), **more):
    """A run of blocks on parts held at groups ``fixed``, which come first; limits on energy."""
    blocks = {name: (mesh, ZERO) for name, mesh in parts.items()}
    mesh = placed_together(blocks, keep_coincident=True)
    methods = {"implicit": ImplicitDashpots(step)}
    options = {"methods": methods, "material": softened(friction), "effects": loose(fixed=fixed)}
    held = [name.split("_")[0] for name in fixed]
    free = slice(sum(parts[name].body_count for name in held), None)
    run = Run(trial, mesh, TIME, bodies=free, **options, **more)
    account_closes(trial, run)
    return run


def account_closes(trial, run):
    """Energy is neither made nor lost beyond what the account explains."""
    report = run.result.report
    residual = report.energy_residual_fraction
    trial.limit("energy from nowhere", abs(residual), 0.05, "the specification")
    trial.limit("momentum error", report.linear_momentum_error, 1e-9, "rounding")


def plate(half):
    """A plate below x = 0 of a half width [m]."""
    return brick((0.05, 2 * half, 2 * half), (-0.05, -half, -half))


def way_of(trial, run):
    """Largest way of a body at every sample [m], drawn."""
    way = np.linalg.norm(run.moved, axis=2).max(axis=1)
    run.draw("way [mm]", 1e3 * way)
    return way


def stands(trial, run):
    """Nothing moves once the weight has come to rest."""
    way = way_of(trial, run)
    late = abs(way[-1] - way[len(way) // 2])
    trial.limit("late way / a thousandth of a block", late / STANDS, 1.0, "it stands")


def falls(trial, run):
    """Something has moved."""
    trial.limit("1 mm / way", FALLS / way_of(trial, run)[-1], 1.0, "it falls")


def pyramid(trial, ratio):
    """Four feet below a block that is so many times as heavy."""
    small, gap = 0.05, 1e-9
    large = small * ratio ** (1.0 / 3.0)
    parts, far = {"plate": plate(large)}, 0.5 * large - small
    for k, (y, z) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        corner = gap, y * far - 0.5 * small, z * far - 0.5 * small
        parts[f"foot{k}"] = brick((small,) * 3, corner)
    parts["top"] = brick((large,) * 3, (small + 2 * gap, -0.5 * large, -0.5 * large))
    stands(trial, piled(trial, parts, 0.5))


for ratio in (100, 300):
    question = f"Four small blocks bear one that is {ratio} times as heavy, and stand."
    case.add(f"pyramid_{ratio}", question, partial(pyramid, ratio=ratio), ["implicit"])


#: Half of a house of cards: from the axis to its foot, widths of foot and top, height [m].
SPAN, WIDE, TALL = 0.16, 0.04, 0.2
#: Its outline, inner foot first.
CARD = np.array([[0.0, SPAN], [0.0, SPAN + WIDE], [TALL, 0.0], [TALL - WIDE, 0.0]])
#: Radii of an arch [m], and angles of its joints, from the plate to the plate.
INNER, OUTER, JOINTS = 0.2, 0.3, np.linspace(0.0, np.pi, 6)


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


def leaning(trial, outlines, share):
    """Wedges that bear each other, at a share of the least friction of rigid ones."""
    stones = outlines()
    parts = {"plate": plate(0.35)}
    parts.update({f"stone{k}": wedge(corners) for k, corners in enumerate(stones)})
    run = piled(trial, parts, share * least_friction(stones))
    (stands if share > 1.0 else falls)(trial, run)


#: Shares of the least friction at which they stand and fall. The sides of an arch slide, where
#: places are exact; cards turn about their feet, and the outermost ray bears within the edges.
LEANING = {"house_of_cards": (house, 1.25, 0.98), "arch": (arch, 1.02, 0.98)}
for name, (outlines, *shares) in LEANING.items():
    for share, word in zip(shares, ("stands", "falls")):
        title = name.replace("_", " ").capitalize()
        question = f"{title} with {share:g} of the least friction: it {word}."
        built = partial(leaning, outlines=outlines, share=share)
        case.add(f"{name}_{word}", question, built, ["implicit"])


@case(("implicit",))
def column_collapse(trial):
    """A column of 18 loose tetrahedra falls apart on a plate: no energy is made."""
    column = bar(0.15, 0.05, (3, 1, 1))
    column = with_inner_group(column, "joints", lambda x: np.ones(len(x), dtype=bool))
    run = piled(trial, {"plate": plate(0.3), "column": column}, 0.3, unbonded=["column_joints"])
    no_energy_made(trial, run)
    falls(trial, run)
    nothing_below(trial, run)


def nothing_below(trial, run):
    """No body has got into the plate."""
    depth = max(0.0, -run["position"][:, :, 0].min())
    trial.limit("depth below the plate / 1 mm", depth / 1e-3, 1.0, "none gets through")


def jammed_rod(trial, way):
    """A rod that leans by 30 degrees slides on a plate, whose friction jams it."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    lean = np.array([[c, -s], [s, c]])

    def place(unit):
        size = unit * [0.3, 0.02, 0.02]
        return np.column_stack([size[:, :2] @ lean + [0.011, 0.0], size[:, 2]])

    parts = {"plate": plate(0.3), "rod": hexahedron(place)}
    count = parts["plate"].body_count
    velocity = np.outer(np.arange(count + 6) >= count, (-0.5, 2.0 * way, 0.0))
    run = piled(trial, parts, 2.5, 2e-6, velocity=velocity)
    no_energy_made(trial, run)
    nothing_below(trial, run)


def no_energy_made(trial, run):
    """Energy of motion and weight never exceeds what there was."""
    weight = GRAVITY * (run["position"][:, :, 0] @ run.mass)
    energy = (run.kinetic_energy + weight - weight[0]) / run.kinetic_energy.max()
    rise, formula = energy.max() - energy[0], "kinetic + weight <= at the start"
    trial.limit("energy made / most of motion", rise, 1e-3, formula)
    run.draw("energy / most of motion [1]", energy)


for way, word in ((1.0, "pushed"), (-1.0, "drawn")):
    question = f"A rod that leans by 30 degrees is {word} over a plate of friction 2.5."
    case.add(f"rod_{word}", question, partial(jammed_rod, way=way), ["implicit"])


#: Walls of a funnel: half of its mouth, length and thickness [m], slope.
MOUTH, WALL, THICK, SLOPE = 0.05, 0.3, 0.05, np.pi / 3.0


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
    run = piled(trial, parts, 0.3, STEP, ("wall0_right", "wall1_right"), velocity=velocity)
    no_energy_made(trial, run)
    x, y = run["position"][:, :, 0], abs(run["position"][:, :, 1])
    behind = (y - MOUTH) * np.sin(SLOPE) - x * np.cos(SLOPE)
    along = (y - MOUTH) * np.cos(SLOPE) + x * np.sin(SLOPE)
    inside = np.where((along > 0.0) & (along < WALL), behind, -np.inf).max()
    trial.limit("depth in a wall / 1 mm", max(0.0, inside) / 1e-3, 1.0, "none gets through")
    trial.limit("6 / bodies below", 6.0 / max(1e-9, (x[-1] < 0.0).sum()), 1.0, "blocks leave it")
