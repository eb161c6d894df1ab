"""Do single charges shake the rock as theory and measurements say?

Two checks of the tunnel. First, a short charge in a long hole in rock that stays elastic: Heelan
(1953) has its lobes, P as 1 - 2 (c_s / c_p)^2 cos^2 of the angle from the hole, S as the sine of
twice the angle. Two wave lengths away the near field is as large as P: that of theory (Aki and
Richards, eq. 4.29) is taken from ours. Amplitudes are at 8 elements in a wave of shear; the two
wave speeds alone are fitted. Expected: both lobes within 10 % of their peaks, P largest across the
hole, S at 45 degrees.

Second, single holes parallel to a free face, with the gas of the first paper. Blair and Armstrong
(2001) found that the peak velocity behind a hole does not depend on its burden, and that holes in
damaged rock shake less. Expected of ours: less behind smaller burdens, by up to a third, as the
face sends back the opposite wave, and less from damaged rock; a difference smaller than the bars,
half of the range over the meshes, is not distinguished.

    python experiments/tunnel_checks.py            # needs Gmsh, ``make mesh``
    python experiments/tunnel_checks.py --quick    # radiation alone in coarse rock, without Gmsh

Damaged rock: bonds of 0.3 of the area within 0.6 m of the hole, or the cracks of an earlier shot in
the same hole, closed again; each with a given pressure over time and with gas that expands. Writes
tunnel_checks.png, lobes.csv, peaks.csv and summary.json to results/tunnel_checks/.
"""

import sys
from functools import partial

import numpy as np

import taichi_dem as dem
from _radiation import ELEMENTS, coarse_eighth, eighth_by_gmsh, radiated
from _tunnel import GROWTH, LENGTH, PEAK, RISE, ROCK, UNCHARGED
from _tunnel_checks import BEHIND, DAMAGED, MIDDLES, REACH, draw, figures_of_lobes, figures_of_shots
from taichi_dem import effects
from taichi_dem.kit import study
from taichi_dem.mesh.boreholes import Hole, drilled_rock, with_charges
from taichi_dem.mesh.mesh import checked_mesh, with_inner_group

NAME = "tunnel_checks"
SETTINGS = {
    "meshes": (3, 1, study.whole(1, 20), "meshes of rock that breaks, 3"),
    "elastic": (1, 1, study.whole(1, 20), "meshes of elastic rock, 1"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
LIMITS = dem.StepControl(safety=0.4, dashpot_floor=2e-7)
METHOD = dem.Multirate(1.6e-6, 1e-4, control=LIMITS, dashpot="limited")
#: Burdens [m]; rock behind the hole, its height and depth [m].
BURDENS = 0.2, 0.4, 0.8
ROOM, HEIGHT, DEPTH = 2.0, 2.0, 1.5
#: Edges of elements near and far [m]; end [s].
NEAR, FAR, END = 0.06, 0.25, 5.2e-4
#: Share of bonds that is left in weaker rock.
LEFT = 0.3
QUIET = "right", "bottom", "top", "back"


def shot(burden, mesh, damage="", cracks=(), gas=effects.GasPressure):
    """The result of a shot; cracks: faces that are open from the start."""
    hole = Hole(burden, 0.5 * HEIGHT, LENGTH, charge_from_m=UNCHARGED)
    size = burden + ROOM, HEIGHT, DEPTH
    rock = drilled_rock(size, [hole], NEAR, FAR, growth=GROWTH, seed=2 * mesh)
    rock, _ = with_charges(rock, DEPTH, [hole])
    options = {}
    if damage == "cracked":
        rock = checked_mesh(rock.points, rock.tetrahedra, {**rock.groups, damage: cracks})
        options["unbonded"] = [damage]
    elif damage == "weaker":
        axis = burden, 0.5 * HEIGHT
        rock = with_inner_group(rock, damage, lambda x: np.hypot(*(x[:, :2] - axis).T) < REACH)
        options["weaker"] = {damage: LEFT}
    loads = [gas("stage_1", peak=PEAK, rise=RISE), *map(effects.QuietBoundary, QUIET)]
    scene = dem.Scene(rock, ROCK, "auto", loads=loads, **options)
    yz = 0.5 * HEIGHT, DEPTH - 0.5 * (LENGTH + UNCHARGED)
    places = {f"at {away} m": (burden + away, *yz) for away in BEHIND}
    receivers = dem.Receivers(places, when=dem.Every(time_s=3.2e-6))
    told = {"observers": [receivers], "title": f"burden {burden:g} m, mesh {mesh} {damage}"}
    return dem.simulate(scene, method=METHOD, until=END, **told)


def shots(mesh):
    """Peak velocities [m/s] by case and what is known of all shots on a mesh."""
    results = {f"{burden:g} m": shot(burden, mesh) for burden in BURDENS}
    results["fresh, gas expands"] = shot(DAMAGED, mesh, gas=effects.ExpandingGas)
    for end, gas in (("", effects.GasPressure), (", gas expands", effects.ExpandingGas)):
        fresh = results[f"fresh{end}" if end else f"{DAMAGED:g} m"]
        cracks = fresh.model.topology.vertices[~np.isnan(fresh.broken_time)]
        results[f"cracked{end}"] = shot(DAMAGED, mesh, "cracked", cracks, gas)
        results[f"weaker{end}"] = shot(DAMAGED, mesh, "weaker", gas=gas)
    reports = [result.report for result in results.values()]
    seconds = [sum(getattr(one, f"{k}_seconds") for one in reports) for k in ("compile", "run")]
    peaks = {
        name: [float(np.hypot.reduce(one.velocity.T).max()) for one in result.receivers.values()]
        for name, result in results.items()
    }
    return {"peaks": peaks, "seconds": seconds, "broken": [one.broken_faces for one in reports]}


def radiation(mesh, quick):
    """What a charge in elastic rock radiates, on a mesh."""
    if quick:
        return radiated(coarse_eighth(), dem.Uniform(6e-7), 6e-6)
    method = dem.Multirate(1.6e-6, 1e-4, control=dem.StepControl(safety=0.4))
    return radiated(eighth_by_gmsh(mesh), method, 8e-6)


def write_tables(at, made, peaks):
    """Both tables: amplitudes times distance, per gas and volume, and peak velocities."""
    rows = [
        (wave, elements, angle, mesh, ours, exact)
        for mesh, one in enumerate(made)
        for wave, *of_wave in zip("PS", one["ours"], one["far"])
        for elements, *lobes in zip(ELEMENTS, *of_wave)
        for angle, ours, exact in zip(MIDDLES, *lobes)
    ]
    study.write_rows(at("lobes.csv"), rows, "wave elements angle_deg mesh ours theory")
    rows = [
        (name, mesh, away, speed)
        for name, table in peaks.items()
        for mesh, row in enumerate(table)
        for away, speed in zip(BEHIND, row)
    ]
    study.write_rows(at("peaks.csv"), rows, "burden_or_damage mesh behind_m peak_m_s")


def run(options):
    """Both checks, their tables, figures and picture."""
    at, fired = study.output_paths(options.out), []
    if options.quick:
        print("Left out: holes beside a free face and in damaged rock, whose meshes Gmsh makes.")
    else:
        fired = [shots(mesh) for mesh in range(options.meshes)]
    made = [radiation(mesh, options.quick) for mesh in range(options.elastic)]
    names = fired[0]["peaks"] if fired else ()
    peaks = {name: np.array([one["peaks"][name] for one in fired]) for name in names}
    write_tables(at, made, peaks)
    figures = {**figures_of_lobes(made), **(figures_of_shots(peaks) if fired else {})}
    seconds = tuple(np.sum([one["seconds"] for one in (*made, *fired)], axis=0).tolist())
    study.finish(
        options, NAME, figures, seconds, draw=partial(draw, at(f"{NAME}.png"), made, peaks)
    )


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
