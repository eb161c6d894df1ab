"""What does a crack cost on a scattered mesh, by the law of its bonds and the size of elements?

A notched plate is pulled apart slowly, with the paper's laws of bonds and with ``CohesiveCrack``.
The characteristic length E G / f_t^2 is a fifth of the way that the crack runs. A plane crack would
spend G times the area of that plane. The slower the load, the less is spent beside the crack.

A bar is stretched until it breaks everywhere. Into how many pieces is known for one law, and a row
of masses and springs tells what any law gives without a mesh.

    python experiments/crack_energy.py --speed 0.005

Writes energy.png, cracks.csv, bars.csv and summary.json to results/crack_energy/.
"""

import sys
import warnings
from functools import partial
from itertools import product
from types import SimpleNamespace

import numpy as np

from cases import stretched_bar
from cases.trust.plates import comes_apart, material_of, notched, plate, pulled
from taichi_dem import effects
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, GREEN, RED, picture
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.output.fracture import crack_areas

NAME = "crack_energy"
SETTINGS = {
    "meshes": (2, 1, study.whole(1, 20), "random meshes of each size, default 2"),
    "sizes": (2, 1, study.whole(1, 3), "sizes of elements, coarse first, default 2"),
    "speed": (0.02, 0.02, study.number(1e-3, 1.0), "of both ends [m/s], default 0.02"),
    "bars": (4, 2, study.whole(2, 100), "bars of each kind, default 4"),
    "rates": (2, 1, study.whole(1, 2), "rates of strain of bars, default 2"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Length and width of the plate, and depth of the notch [m]; elements in a characteristic length.
LENGTH, WIDTH, DEPTH, ELEMENTS = 0.05, 0.05, 0.015, (2.0, 2.8, 4.0)
#: E [Pa] and strength of bonds [Pa]; cohesion over strength; characteristic length over the way.
YOUNG, STRENGTH, COHESION, SHARE = 32e9, 3e6, 3.0, 0.2
CRACK_LENGTH = SHARE * (WIDTH - DEPTH)
ENERGY = CRACK_LENGTH * STRENGTH**2 / YOUNG
#: Time in which the ends take up their speed, between looks [s], and way after which runs end [m].
RAMP, LOOK, FAR = 5e-5, 1e-5, 6e-6
LAWS = {
    "paper": lambda: [effects.Softening(), effects.ShearSlip()],
    "cohesive crack": lambda: [effects.CohesiveCrack()],
}
#: Rates of strain of bars [1/s].
RATES = (1000.0, 100.0)
#: What counts as agreement of the energy.
LOW, HIGH = 0.95, 1.08
TABLE = study.Table(
    law=("law", "law"),
    elements=("elements", "elements in a length", ".1f", "1"),
    seed=("seed", "mesh", "d", "1"),
    bodies=("bodies", "bodies", "d", "1"),
    energy=("energy", "energy / (G plane)", ".3f", "1"),
    beside=("beside", "share beside", ".3f", "1"),
    area=("area", "broken area / plane", ".3f", "1"),
    open=("open", "left open", ".1e", "1"),
)


def parted(law, elements, seed, speed):
    """Pull a plate on a random mesh apart. Subject of TABLE."""
    edge = CRACK_LENGTH / elements
    mesh = notched(plate(LENGTH, WIDTH, edge, seed, in_rows=False), LENGTH, DEPTH)
    options = {"tensile_strength": STRENGTH, "fracture_energy": ENERGY, "density": 2450.0}
    more = {"friction_angle": 30.0, "cohesion": COHESION * STRENGTH, "damping_ratio": 0.1}
    material = material_of(mesh, YOUNG, 0.2, **options, **more)
    laws = [*LAWS[law](), effects.BondDamping()]
    simulation = pulled(mesh, material, laws, speed, RAMP, unbonded=["notch"])
    looks, step = range(1, round(FAR / speed / LOOK) + 1), simulation.method.dt0
    comes_apart(simulation, (round(look * LOOK / step) for look in looks))
    made = {"law": law, "elements": elements, "seed": seed, "bodies": mesh.body_count}
    return SimpleNamespace(**made, **spent(simulation, edge))


def spent(simulation, edge):
    """Energy and area of the crack by those of its plane, and the share spent beside it."""
    broken, plane = simulation.state.broken(), (WIDTH - DEPTH) * edge
    # Slip, release and softening of each bond.
    taken = simulation.readings.bonds()[:, 2:].sum(axis=1)
    area = crack_areas(simulation.model)[broken].sum()
    residual = simulation.energy_balance.account()["residual"]
    return {
        "energy": taken.sum() / (ENERGY * plane),
        "beside": taken[~broken].sum() / taken.sum(),
        "area": area / plane,
        "open": abs(residual) / taken.sum(),
    }


def draw(axes, made, value):
    """A value of all plates over the elements in a characteristic length."""
    for law, colour in zip(LAWS, (RED, BLUE)):
        found = [(one.elements, getattr(one, value)) for one in made if one.law == law]
        axes.plot(*zip(*found), "o", color=colour, label=law)
    most = 1.1 * max(getattr(one, value) for one in made)
    axes.set(xlabel="elements in a characteristic length [1]", ylim=(0.0, most))


def picture_energy(path, made):
    """Energy over that of the plane, and the share that is spent beside the crack."""
    with picture(path, 1, 2, size=(7.6, 3.4)) as (_, (left, right)):
        left.axhspan(LOW, HIGH, color=GREEN, alpha=0.3, lw=0.0)
        draw(left, made, "energy")
        draw(right, made, "beside")
        left.set_ylabel("energy over G times the plane's area [1]")
        right.set_ylabel("share spent beside the crack [1]")
        left.legend()


def run(options):
    """Pull all plates apart, stretch bars, compare, picture."""
    at, made = study.output_paths(options.out), []
    runs = [*product(ELEMENTS[: options.sizes], LAWS, range(options.meshes))]
    with ProgressBar(NAME) as bar, warnings.catch_warnings():
        # The notch only opens: nothing has to touch in it.
        warnings.filterwarnings("ignore", "faces of the mesh are unbonded", UserWarning)
        for done, (elements, law, seed) in enumerate(runs):
            bar.count(done, len(runs))
            made.append(parted(law, elements, seed, options.speed))
    rows = TABLE.rows(made)
    TABLE.show(rows)
    study.write_rows(at("cracks.csv"), rows)
    picture_energy(at("energy.png"), made)
    laws, figures = [*LAWS["cohesive crack"](), effects.BondDamping()], {}
    bars = [*stretched_bar.fragmented(RATES[: options.rates], laws, options.bars)]
    stretched_bar.TABLE.show(bars)
    study.write_rows(at("bars.csv"), bars)
    for row in bars:
        figures.update(stretched_bar.TABLE.figures(row, "bar_{name}_{rate:g}_{key}"))
    for law, n in product(LAWS, ELEMENTS[: options.sizes]):
        these = [one for one in made if (one.law, one.elements) == (law, n)]
        for value in ("energy", "beside"):
            mean = float(np.mean([getattr(one, value) for one in these]))
            figures[f"{law.replace(' ', '_')}_{value}_{n:g}"] = mean, "1"
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
