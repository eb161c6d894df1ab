"""Waves leave through a quiet boundary; its dashpots are exact, stable at any step, and booked."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    SimulationDiverged,
    StepControl,
    Uniform,
    effects,
    simulate,
    step_report,
)
from taichi_dem.closed_forms import LinearBonds, _carried
from taichi_dem.engine.model import Model
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.wave_moduli import _STRAINS, _body_sums, wave_moduli
from tests.boundaries.waves import (
    QUIET,
    UNDAMPED,
    advanced,
    plane_bar,
    rollers,
    share_left,
    with_pulse,
)

TWIST = np.array([1e-6, -2e-6, 5e-7, 2e-5, 1e-5, -3e-5])


def braked_body(speeds, method, steps):
    """Twists of a single body on a quiet boundary after some steps, and the matrices M and C."""
    scene = Scene(single(), CONCRETE, [effects.QuietBoundary("base", *speeds)])
    simulation = Simulation(scene, method)
    model = simulation.model
    simulation.state.set_motion(model.centre, velocity=TWIST[:3], spin=TWIST[3:])
    simulation.start()
    simulation.advance_to(steps)
    motion = simulation.motion()
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = model.body_mass[0] * np.eye(3), model.body_inertia[0]
    corners = model.mesh.points[model.mesh.groups["base"][0]]
    vector = 0.5 * np.cross(corners[1] - corners[0], corners[2] - corners[0])
    area = np.linalg.norm(vector)
    out = np.outer(vector, vector) / area**2
    law = CONCRETE.density * (speeds[0] * out + speeds[1] * (np.eye(3) - out))
    levers = [_carried(corner - model.centre[0]) for corner in corners]
    block = sum(area / 3.0 * lever.T @ law @ lever for lever in levers)
    return np.append(motion["velocity"], motion["spin"]), mass, block, simulation


@pytest.mark.parametrize(
    "method",
    [
        Uniform(2e-6),
        pytest.param(Multirate(2e-6, 1e-3), marks=pytest.mark.slow),
        ImplicitDashpots(2e-6),
    ],
)
def test_a_body_alone_slows_down_by_the_trapezoidal_rule(method):
    """(M + dt C / 2) u' = (M - dt C / 2) u, and half a step at either end: u is what is recorded.

    Recorded is the mean of before and after: u_n = (1 + Z)^-1 (1 - Z) u_n-1, Z = M^-1 C dt / 2.
    Turning couples at second order in the spin alone, 3e-5 x 2e-5 s here: 1e-8 of the twist.
    """
    found, mass, block, simulation = braked_body((4000.0, 2500.0), method, 20)
    half = np.linalg.solve(mass, block) * 1e-6
    once = np.linalg.solve(np.eye(6) + half, np.eye(6) - half)
    assert np.abs(found - np.linalg.matrix_power(once, 20) @ TWIST).max() < 1e-7 * 3e-5
    account = simulation.energy_balance.account()
    assert abs(account["residual"]) < 1e-13 * simulation.energy_balance.start_energy
    assert account["ground_dashpot"] > 0.1 * simulation.energy_balance.start_energy
    assert max(simulation.energy_balance.momentum_errors()) < 1e-12


def test_the_error_of_a_step_is_of_second_order():
    """Against exp(-M^-1 C t): a quarter at half the step, within the next order's 15 %."""
    errors = []
    for step, steps in ((4e-6, 10), (2e-6, 20)):
        found, mass, block, _ = braked_body((1000.0, 600.0), Uniform(step), steps)
        values, vectors = np.linalg.eig(np.linalg.solve(mass, block))
        exact = (vectors * np.exp(-4e-5 * values)) @ np.linalg.solve(vectors, TWIST)
        errors.append(np.abs(found - exact).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize(
    ("boxes", "share"), [(20, 0.0), (30, 0.0), (40, 0.0), (20, 0.25), (30, 0.25), (40, 0.25)]
)
def test_a_plane_wave_leaves_no_more_than_5_percent_of_its_energy(boxes, share):
    """After 1.2 of the time in which a wave runs through the bar, all of it has met an end once.

    Expected: the impedance is right within 15 % (``wave_moduli``), which reflects 0.6 %; waves as
    short as a few elements, of which a Gaussian of 0.1 m has fewer the finer the mesh, come late.
    """
    simulation = with_pulse(plane_bar(boxes, 2, share), [*rollers(), *QUIET])
    model = simulation.model
    moduli, _ = wave_moduli(model, model.mesh.groups["right"])
    speed = np.sqrt(moduli.mean() / model.material.density)
    left = share_left(simulation, 1.2 / speed)
    assert left < 0.05


def ends_of(impedance):
    """Boundaries whose dashpots are a share of a wave's impedance: none of it is a free end."""
    speed = 1500.0 * impedance
    return [effects.QuietBoundary(group, speed, speed) for group in ("left", "right")]


def test_a_free_end_doubles_the_velocity_and_a_fixed_one_reverses_it():
    """What leaves is what the boundary takes: dashpots without a coefficient leave all.

    At the end of a free bar the velocities of both waves of 1/2 add up; a fixed one has none there,
    and the waves come back reversed, so that they meet in the middle again as -1.
    """
    mesh = plane_bar(30)
    free = with_pulse(mesh, [*rollers(), *ends_of(1e-12)])
    ends = free.model.centre[:, 0] > 1.0 - 1.0 / 60
    largest = 0.0
    for step in range(1200, 3000, 60):
        advanced(free, step * 2e-7)
        largest = max(largest, free.motion()["velocity"][ends, 0].mean())
    assert largest == pytest.approx(1.0, abs=0.1)
    assert share_left(free, 3000 * 2e-7) == pytest.approx(1.0, abs=1e-4)
    held = with_pulse(mesh, [*rollers(), *ends_of(1e9)])
    middle, least = np.abs(held.model.centre[:, 0] - 0.5) < 1.0 / 60, 0.0
    for step in range(2700, 4500, 60):
        advanced(held, step * 2e-7)
        least = min(least, held.motion()["velocity"][middle, 0].mean())
    assert least == pytest.approx(-1.0, abs=0.15)


def test_a_shear_wave_leaves_too():
    """Polarised along y, with rollers along z alone and free sides: a bar two boxes thick bends.

    So the block is one of sides that move along y together: rollers hold x and z.
    """
    sides = [effects.Roller(name, (1, 0, 0)) for name in ("bottom", "top")]
    sides += [effects.Roller(name, (0, 0, 1)) for name in ("back", "front")]
    simulation = with_pulse(plane_bar(30), [*sides, *QUIET], way=(0.0, 1.0, 0.0))
    model = simulation.model
    _, moduli = wave_moduli(model, model.mesh.groups["right"])
    left = share_left(simulation, 1.4 / np.sqrt(moduli.mean() / model.material.density))
    assert left < 0.05


METHODS = {
    "uniform": Uniform(2e-6),
    "limited": Uniform(2e-6, dashpot="limited"),
    "multirate": Multirate(2e-6, 1e-4),
    "drifted": Multirate(2e-6, 1e-4, "drifted"),
    "controlled": Multirate(4e-6, 1e-3, control=StepControl()),
    "solved": ImplicitDashpots(2e-6),
}


#: Methods that the quick tests compile.
QUICK = ("uniform",)
EACH = [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in METHODS]


@pytest.mark.parametrize("name", EACH)
def test_no_dashpot_is_too_stiff_for_a_step(name):
    """A hundred thousand times the wave's impedance holds the ends as if they were fixed.

    The energy never grows, as the trapezoidal rule takes some in every step, beside the ripple of
    a leapfrog near its limit: (w dt)^2 / 4 of it at most.
    """
    stiff = [effects.QuietBoundary(group, 1e8, 1e8) for group in ("left", "right")]
    simulation = with_pulse(plane_bar(8), [*rollers(), *stiff], METHODS[name])
    for step in range(20, 420, 20):
        account = advanced(simulation, step * 2e-6)
        held = account["kinetic"] + account["bond_strain"]
        assert held < 1.25 * simulation.energy_balance.start_energy
    ends = np.isin(np.arange(simulation.model.body_count), simulation.model.topology.outer_body)
    assert np.isfinite(simulation.motion()["velocity"][ends]).all()
    assert max(simulation.energy_balance.momentum_errors()) < 1e-10


def test_springs_bear_the_same_step_with_a_boundary_and_without():
    """At 0.95 of the limit of the mesh nothing grows, however stiff the ends; at twice it does.

    Up to a thousand times the impedance: at a million times it rounds too much.

    The limit of ``step_report`` is that of equal pairs, which meshes bear, up to twice as much.
    """
    for impedance in (1e-12, 1.0, 1e3):
        listed = [*rollers(), *ends_of(impedance)]
        limit = step_report(Scene(plane_bar(8), UNDAMPED, listed)).borne("solved").min()
        simulation = with_pulse(plane_bar(8), listed, Uniform(0.95 * limit), width=0.2)
        simulation.advance_to(400)
        assert np.abs(simulation.motion()["velocity"]).max() < 3.0
        with pytest.raises(SimulationDiverged):
            with_pulse(plane_bar(8), listed, Uniform(2.5 * limit), width=0.2).advance_to(4000)


@pytest.mark.parametrize("names", [QUICK, pytest.param(METHODS, marks=pytest.mark.slow)])
def test_all_methods_agree_and_close_the_account(names):
    """Velocities after the wave met the ends; steps of 2e-6 s err by (w dt)^2 / 24 at w = c / l."""
    found = {}
    for name in names:
        simulation = with_pulse(plane_bar(8), [*rollers(), *QUIET], METHODS[name], width=0.2)
        account = advanced(simulation, 2.4e-4)
        energy = simulation.energy_balance.start_energy
        assert abs(account["residual"]) < 1e-3 * energy
        assert 0.1 * energy < account["ground_dashpot"] < energy
        found[name] = simulation.motion()["velocity"]
    for name in found:
        assert np.abs(found[name] - found["uniform"]).max() < 1e-2 * np.abs(found["uniform"]).max()


def pushed():
    """A push at one end, and quiet boundaries on the other and on a side."""
    push = effects.Pressure.triangle("left", 3e6, 2e-5, 4e-5)
    return [push, effects.QuietBoundary("right"), effects.QuietBoundary("top")]


def blown():
    """A damped bar that is pushed at one end and quiet at the other."""
    return Scene(plane_bar(8), CONCRETE, [effects.BondDamping(), *pushed()])


QUIETLY = {"until": 2e-4, "progress": None, "samples": 4, "frames": 2}


@pytest.mark.slow
@pytest.mark.parametrize("method", [Multirate(1e-7, 1e-6), ImplicitDashpots(1e-6)])
def test_drivers_and_threads_give_the_same_bits(method):
    runs = [
        simulate(blown(), method=method, driver=driver, **{**QUIETLY, "until": 4e-5})
        for driver in ("resident", "parallel")
    ]
    for name in ("position", "velocity", "rotation"):
        first, second = (getattr(run.frames[-1], name) for run in runs)
        assert np.array_equal(first, second)
    assert runs[0].report.energy_balance == runs[1].report.energy_balance


def test_a_restarted_run_has_the_same_bits(tmp_path):
    """The impulses of the step before are the first guess of the next: a checkpoint holds them."""
    method, path = ImplicitDashpots(1e-6), tmp_path / "half.npz"
    whole = simulate(blown(), method=method, **QUIETLY)
    keep = Checkpoint(path, every_s=1e-4)
    simulate(blown(), method=method, checkpoint=keep, **{**QUIETLY, "until": 1e-4})
    rest = simulate(blown(), method=method, resume=path, **QUIETLY)
    assert np.array_equal(whole.frames[-1].position, rest.frames[-1].position)
    assert whole.report.energy_balance == rest.report.energy_balance


@pytest.mark.slow
def test_bodies_at_the_boundary_sleep_until_a_wave_comes():
    """Left out is at most the share asked for; a body at rest has no force of a dashpot."""
    method = ImplicitDashpots(1e-6)
    scenes = [Scene(plane_bar(8), CONCRETE, word, loads=pushed()) for word in ("all", "auto")]
    whole, part = (simulate(scene, method=method, **QUIETLY) for scene in scenes)
    assert part.report.certificate.holds and part.report.certificate.asleep > 0.05
    for term in ("ground_dashpot", "kinetic"):
        first, second = (run.report.energy_balance[term] for run in (whole, part))
        assert second == pytest.approx(first, rel=1e-4)
    uses = {use.effect: use for use in part.report.effect_activity}
    assert uses["quiet_boundary"].what == "bodies braked" and uses["quiet_boundary"].events > 0


def test_numbering_of_the_bodies_changes_what_is_nonlinear_alone():
    """Bonds are evaluated in the frame of the body of lower number: of second order in a strain."""
    mesh = plane_bar(8, 2, 0.2)
    order = np.random.default_rng(3).permutation(mesh.body_count)
    other = replace(mesh, tetrahedra=mesh.tetrahedra[order])
    apart = []
    for speed in (10.0, 1.0):
        found = []
        for one in (mesh, other):
            listed = [*rollers(), *QUIET]
            simulation = with_pulse(one, listed, Uniform(1e-6), (speed, 0.0, 0.0), 0.2)
            advanced(simulation, 2e-4)
            found.append(simulation.motion()["velocity"])
        apart.append(np.abs(found[0][order] - found[1]).max())
    assert apart[0] / apart[1] == pytest.approx(100.0, rel=0.2)
    assert apart[1] < 1e-4


def test_moduli_follow_stiffness_and_size():
    """Linear in the stiffness, and in the size where that is per area; the same however turned."""
    mesh = plane_bar(6, 3, 0.2)
    faces = mesh.groups["right"]
    first = wave_moduli(Model(mesh, UNDAMPED, []), faces)
    stiff = replace(UNDAMPED, normal_stiffness=900e9, shear_stiffness=180e9)
    for found, times in (
        (wave_moduli(Model(mesh, stiff, []), faces), 2.0),
        (wave_moduli(Model(replace(mesh, points=3.0 * mesh.points), UNDAMPED, []), faces), 3.0),
        (
            wave_moduli(
                Model(replace(mesh, points=np.roll(mesh.points, 1, 1)), UNDAMPED, []), faces
            ),
            1.0,
        ),
    ):
        for one, other in zip(first, found):
            assert np.allclose(times * one, other, rtol=1e-9)


def test_energies_of_strained_bodies_are_those_of_the_bonds_as_matrices():
    """u^T K u, u the strain's displacements less 0.7 D^-1 K u of bodies with four bonds."""
    model = Model(plane_bar(3, 2, 0.2), UNDAMPED, [])
    stiffness, count = LinearBonds(model.mesh, UNDAMPED).stiffness, model.body_count
    sums = _body_sums(model, np.arange(count))
    givers = np.flatnonzero((model.topology.body_bond >= 0).all(axis=1))
    assert len(givers) > 5
    for k, strain in enumerate(_STRAINS):
        motion = np.zeros((count, 6))
        motion[:, :3] = model.centre @ strain
        force = (stiffness @ motion.ravel()).reshape(count, 6)
        for i in givers:
            own = slice(6 * i, 6 * i + 6)
            motion[i] -= 0.7 * np.linalg.solve(stiffness[own, own], force[i])
        energy = motion.ravel() @ stiffness @ motion.ravel()
        assert sums[:, 7 * k].sum() == pytest.approx(energy, rel=1e-9)


def test_moduli_of_a_row_of_boxes_are_near_those_of_its_waves():
    """The centre of a wave's energy moves at c_p: within 10 %, as stated, on two meshes."""
    for share in (0.0, 0.25):
        simulation = with_pulse(plane_bar(40, 2, share), [*rollers(), *ends_of(1e-12)])
        model = simulation.model
        moduli, _ = wave_moduli(model, model.mesh.groups["right"])
        x, times = model.centre[:, 0], np.array([1.0e-4, 2.0e-4])
        place = []
        for time_s in times:
            advanced(simulation, time_s)
            energy = model.body_mass * simulation.motion()["velocity"][:, 0] ** 2 * (x > 0.5)
            place.append((energy * x).sum() / energy.sum())
        measured = (place[1] - place[0]) / 1e-4
        assert measured == pytest.approx(np.sqrt(moduli.mean() / model.material.density), rel=0.1)


def test_a_body_on_two_quiet_boundaries_has_the_dashpots_of_both():
    """And each is booked apart, also where rollers hold it."""
    listed = [*rollers(), effects.QuietBoundary("right"), effects.QuietBoundary("top")]
    scene = Scene(bar(0.2, 0.2, (2, 2, 2)), UNDAMPED, listed)
    for method in (Uniform(1e-6), ImplicitDashpots(1e-6)):
        simulation = Simulation(scene, method)
        simulation.state.set_motion(simulation.model.centre, velocity=[1.0, 0.5, 0.0])
        simulation.start()
        account = advanced(simulation, 4e-5)
        heats = [simulation.energy_balance.ground_heats(k).sum() for k in range(2)]
        assert min(heats) > 0.0
        assert sum(heats) == pytest.approx(account["ground_dashpot"], rel=1e-12)
        assert abs(account["residual"]) < 5e-3 * simulation.energy_balance.start_energy
