"""Hard cases of the blast: bodies that swing while their steps differ by much."""

import numpy as np

from _hard_cases import _blast_scenes as scenes
from _hard_cases._case import Curves, Limit, Measured, cases_of
from taichi_dem import CONCRETE, Multirate, StepControl
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import single

#: Edges of the scan [m]: frequency times largest step runs through a factor of four.
SCAN = tuple(np.geomspace(0.02, 0.32, 16))
#: Height of the light neighbour over that of the others.
LIGHT = 0.06
#: Largest step times the fastest frequency: of the paper's rule well below the limit of the
#: springs, and beyond the first resonance, pi, which step control has to avoid by itself.
BELOW, BEYOND = 0.3, 4.0
MULTIRATE = ("multirate_drifted", "multirate_held")
CASES, case = cases_of("blast")


@case(("controlled", *MULTIRATE))
def step_ratio_resonance(method, quick):
    """Undamped trios swing while their bodies step at 1 to 16 to one another: nothing is gained."""
    return _scan(method, BEYOND if method == "controlled" else BELOW, quick)


@case((), (MULTIRATE, "came from nowhere"))
def step_ratio_beyond_resonance(method, quick):
    """The same at largest steps up to 1.3 times half a period of the light body."""
    return _scan(method, BEYOND, quick)


def _scan(method, ratio, quick):
    """Trios from edges of 2 to 32 cm in one run, ratio: largest step times fastest frequency."""
    islands = {f"{edge:.3f}": _trio(edge) for edge in SCAN}
    # sqrt(k A / m) of the smallest trio's light body, a pyramid of mass rho A h / 3.
    height = LIGHT * SCAN[0] * np.sqrt(2.0 / 3.0)
    dt0 = ratio / np.sqrt(3.0 * CONCRETE.normal_stiffness / (CONCRETE.density * height))
    control = StepControl() if method == "controlled" else None
    neighbour = "drifted" if method == "multirate_drifted" else "held"
    way = Multirate(dt0, 0.05 * dt0, neighbour, control=control)
    tracks = scenes.follow(islands, [], way, (500 if quick else 20000) * dt0)
    gain = np.array([(one.kinetic() / one.kinetic()[0]).max() - 1.0 for one in tracks.values()])
    jump = max(np.ptp(one.motion["level"], axis=1).max() for one in tracks.values())
    limits = (
        # An explicit step of w dt makes the energy beat by (w dt)^2 / 4.
        Limit("kinetic energy / given - 1", float(gain.max()), 0.25 * BELOW**2, "(w dt)^2 / 4"),
        Limit("3 / levels between neighbours", 3.0 / max(1.0, float(jump)), 1.0, "steps differ"),
    )
    first = next(iter(tracks.values()))
    kept = first.kinetic() / first.kinetic()[0]
    lines = {method: (1e6 * first.time_s, kept)}
    return Measured(
        limits, Curves("time [µs]", "kinetic energy / given [1]", lines), first.compile_s
    )


def _trio(edge):
    """A regular body, a flat neighbour on one face and a regular one on another, in motion."""
    middle = single(edge)
    corners = middle.points[middle.tetrahedra[0]]
    points, bodies = [*corners], [[0, 1, 2, 3]]
    for k, share in ((0, LIGHT), (1, 1.0)):
        face = [j for j in range(4) if j != k]
        centre = corners[face].mean(axis=0)
        bodies.append([*face, len(points)])
        points.append(centre + share * (centre - corners[k]))
    mesh = checked_mesh(points, bodies, {})
    return scenes.Island.of((mesh, 0.0), velocity=[[0, 0, 0], [0.5, 0, 0], [0, 0.05, 0]])
