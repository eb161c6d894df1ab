"""A run that goes on from a checkpoint has the bits of one that was never stopped."""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    InputError,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.engine import ENGINES, BlastEngine
from taichi_dem.kit.allocation import CapacityError, assign
from taichi_dem.kit.checkpoint import read_checkpoint, write_checkpoint
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.laws.contact_contracts import Geometry
from taichi_dem.mesh.mesh import with_cut
from taichi_dem.mesh.shapes import bar
from taichi_dem.output.record import Recorder
from taichi_dem.saved_run import saved_run
from taichi_dem.state.tables import LEAST
from taichi_dem.state.timeline import MACRO_TICKS
from tests.scenes import bar_scene
from tests.structures import filled

CONTROLLED = Multirate(8e-8, 1e-5, control=StepControl(dashpot_floor=1e-8), dashpot="limited")
#: A kind of contact, and a method; the end [s].
CASES = {
    "controlled": (effects.SphereContact, CONTROLLED),
    "implicit": (effects.SphereContact, ImplicitDashpots(4e-7, refresh=1e-5)),
    "bodies": (effects.BodyContact, CONTROLLED),
}
UNTIL = 8.4e-5
#: Share of the way at which a checkpoint is made: some of the bonds are broken, and bodies meet.
SHARE = 0.5
#: A resident call goes this many substeps before the checkpoint: an odd number, so that bodies
#: that step by two or more of them wait for impulses.
ODD = 5


class Run:
    """A started simulation of the bar, with all that a checkpoint takes of it."""

    def __init__(self, kind, method, simulation=None):
        self.simulation = simulation or Simulation(bar_scene(kind=kind), method)
        self.recorder = Recorder(self.simulation, "left")
        self.simulation.start()
        self.saved = saved_run(self.simulation, self.recorder)
        self.last = round(UNTIL / method.dt0)

    def resume(self, path):
        """Put it where a checkpoint is."""
        self.saved.restore(read_checkpoint(path, self.saved.identity), path)

    def go_half(self):
        """A share of the way, and a few substeps on: there no largest step nor search ends."""
        simulation = self.simulation
        simulation.advance_to(round(SHARE * self.last))
        self.recorder.sample()
        simulation.driver.substeps = ODD
        simulation.driver.run(self.last * MACRO_TICKS)

    def finish(self):
        """Go on to the end; all that can be compared there."""
        self.recorder.snapshot()
        self.simulation.advance_to(self.last)
        self.simulation.sample()
        self.recorder.sample()
        missing = self.simulation.followed.missing_effects
        columns, frame = self.recorder.history(), self.recorder.frames[-1]
        told = {
            "account": self.simulation.energy_balance.account(),
            "momentum": self.simulation.energy_balance.momentum_errors(),
            "searches": self.simulation.searches,
            "needs": missing.findings(missing.volume),
            "frames": len(self.recorder.frames),
            "near": self.simulation.contacts.store.near_table()[0].tolist(),
        }
        arrays = {
            **self.saved.memory().read(),
            **columns,
            "damage": frame.damage,
            "stress": frame.stress,
        }
        return {**arrays, **{name: np.array(repr(value)) for name, value in told.items()}}


def differing(first, second):
    """Names under which the bits differ."""
    assert set(first) == set(second)
    return [name for name in first if first[name].tobytes() != second[name].tobytes()]


@pytest.fixture(
    scope="module",
    params=["controlled", "implicit", pytest.param("bodies", marks=pytest.mark.slow)],
)
def case(request):
    """Each of them in turn."""
    return CASES[request.param]


@pytest.fixture(scope="module")
def run(case):
    """A run at its start."""
    return Run(*case)


@pytest.fixture(scope="module")
def straight(run, tmp_path_factory):
    """Checkpoint on the way, what the run came to, and what its constant fields were before."""
    constant = FieldMemory(run.simulation, "constant")
    before, path = constant.read(), tmp_path_factory.mktemp("saved") / "run.checkpoint"
    run.go_half()
    run.saved.write(path)
    broken, ticks = run.simulation.report().broken_faces, run.simulation.state.tick[None]
    lagging = (run.simulation.values(run.simulation.state.last_tick) < ticks).any()
    strain = run.simulation.energy_balance.account()["sphere_strain"]
    end = run.finish()
    return path, (broken, ticks, lagging, strain), end, differing(before, constant.read())


def test_the_checkpoint_falls_where_it_is_hard(run, straight):
    """Bodies touch, and where steps differ some wait for their time within a largest step."""
    _, (broken, ticks, lagging, strain), end, _ = straight
    assert strain > 0.0
    assert 0 < broken < (run.simulation.values(run.simulation.state.broken_tick) >= 0).sum()
    assert int(end["searches"].item()) > 5
    if run.simulation.method.name.startswith("multirate"):
        assert ticks % MACRO_TICKS
        assert lagging


def test_constant_fields_do_not_change(straight):
    assert straight[3] == []


def test_a_resumed_run_has_the_bits_of_a_straight_one(run, straight):
    """Other values stand in all fields before, those of no use hereafter in the scratch ones."""
    path, _, end, _ = straight
    for field in FieldMemory(run.simulation, "scratch").fields.values():
        assign(field, 1)
    run.resume(path)
    assert differing(end, run.finish()) == []


def light_scene(pulse=5e6, share=1.0):
    """A bar of 12 bodies without contact, quick to compile; share: of bonds in its middle."""
    gas = effects.GasPressure("left", peak=pulse, rise=1e-5)
    acting = filled("bonds", effects.BondDamping(), gas)
    mesh = with_cut(bar(0.1, 0.05, (2, 1, 1)), "joint", (0.05, 0, 0), (1, 0, 0))
    return Scene(mesh, CONCRETE, acting, weaker={"joint": share})


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    """A straight run through ``simulate``, and the checkpoint at its half."""
    path = tmp_path_factory.mktemp("light") / "run.checkpoint"
    job = {"method": Uniform(2e-8), "samples": 5, "frames": 2}
    half = simulate(light_scene(), until=5e-6, checkpoint=Checkpoint(path), **job)
    assert half.report.substeps > 0
    return path, job


def test_simulate_goes_on_to_a_later_time(light, tmp_path):
    """Its samples and frames follow those that were saved; the old end is no mark any more."""
    path, job = light
    whole = simulate(light_scene(), until=1e-5, **job)
    rest = simulate(light_scene(), until=1e-5, resume=path, **job)
    marks = np.round(1e6 * rest.series["time_s"], 9).tolist()
    assert marks == [0, 1, 2, 3, 4, 5, 6, 8, 10]
    assert len(rest.frames) == 5 - 1
    assert np.array_equal(rest.frames[-1].position, whole.frames[-1].position)
    for name, column in whole.series.items():
        assert rest.series[name][-1] == column[-1], name


@pytest.mark.parametrize(
    ("scene", "change", "words"),
    [
        (light_scene(share=0.5), {}, "bonded shares"),
        (light_scene(pulse=6e6), {}, "of another effects: .*5000000.0.*6000000.0"),
        (
            light_scene(),
            {"until": 1e-6},
            "until must be at least 5e-06 s, where .* begins, got 1e-06",
        ),
    ],
)
def test_what_does_not_belong_together_is_refused(light, scene, change, words):
    path, job = light
    with pytest.raises(InputError, match=words):
        simulate(scene, resume=path, **{"until": 1e-5, **job, **change})


def test_every_array_of_a_checkpoint_must_be_there_and_like_its_own(light, tmp_path):
    """Whatever is forged is refused where it is read, not where it is used later."""
    path, job = light
    simulation = Simulation(light_scene(), job["method"])
    simulation.start()
    run = saved_run(simulation, Recorder(simulation, "left"))
    arrays = read_checkpoint(path, run.identity)
    assert {name.split("/")[0] for name in arrays} == {"field", *run.owners}
    for name, array in arrays.items():
        other = np.float32 if array.dtype != np.float32 else np.float64
        for forged in (None, array[None], array.astype(other), np.zeros((3, 3, 3, 3))):
            given = {key: own for key, own in arrays.items() if key != name}
            if forged is not None:
                given[name] = forged
            with pytest.raises(InputError, match="is of another version"):
                run.restore(given, path)
    forged = tmp_path / "forged.checkpoint"
    write_checkpoint(forged, run.identity, {**arrays, "field/state.tick": np.array(np.nan)})
    simulation.close()
    with pytest.raises(InputError, match=r"field state\.tick differs"):
        simulate(light_scene(), resume=forged, until=1e-5, **job)


#: Room for pairs, contacts and neighbours that is too short, on the way or at the start.
SHORT = {"pairs": (4, 2**16, 2**16), "neighbours": (2**14, 2**16, 16)}


def refused(*_):
    """No memory."""
    raise CapacityError("full")


@pytest.mark.parametrize("case", ["controlled"], indirect=True)
@pytest.mark.parametrize("lists", ["pairs", pytest.param("neighbours", marks=pytest.mark.slow)])
def test_lists_that_grow_give_the_bits_of_long_ones(case, run, straight, lists, monkeypatch):
    """A search that finds no room is made again, in an engine with more, when there is memory."""
    # The other run's engine is the one with more room.
    run.simulation._engine.owner = None
    with monkeypatch.context() as short:
        short.setattr(Geometry, "at_start", (0.0, 0.0, 0.0))
        short.setattr(ENGINES, "least", (*LEAST[:2], *SHORT[lists]))
        short.setattr(BlastEngine, "is_idle", False)
        simulation = Simulation(bar_scene(kind=case[0]), case[1])
    assert simulation.engine.capacity[2:] == SHORT[lists]
    grown = Run(*case, simulation)
    if lists == "pairs":
        with monkeypatch.context() as poor, pytest.raises(CapacityError):
            poor.setattr(ENGINES, "borrow", refused)
            grown.go_half()
    grown.go_half()
    end = grown.finish()
    assert simulation.engine.capacity == LEAST
    alike = [name for name in end if name.startswith("state.") or "." not in name]
    first, second = ({name: one[name] for name in alike} for one in (end, straight[2]))
    assert len(alike) > 30 and differing(first, second) == []
