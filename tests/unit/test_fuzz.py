"""The fuzzer: ends are told apart, crashes and hangs cost one scene, a seed draws one scene."""

import math
import time
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import InputError, SimulationDiverged
from taichi_dem.diagnostics.energy_balance import EnergyBalance, open_account, unexplained_share
from taichi_dem.diagnostics.step_resolution import StepResolution
from tests.fuzz import blast_scene, damper_scene
from tests.fuzz.__main__ import options, seeds_of, table
from tests.fuzz.blast_run import judge, same_bits
from tests.fuzz.ends import (
    DIVERGED,
    LONG,
    REFUSED,
    RIGHT,
    UNEXPLAINED,
    WARNED,
    End,
    OutOfTime,
    Wrong,
    end_of,
)
from tests.fuzz.workers import KINDS, Worker, end_of_seed, ends, trial_of


def raising(error):
    def attempt():
        raise error

    return attempt


def overflowing():
    return np.float64(1e308) * np.float64(10.0)


def advising():
    warnings.warn("list SphereContact too", UserWarning, stacklevel=1)
    return ()


@pytest.mark.parametrize(
    ("attempt", "name"),
    [
        (lambda: (), RIGHT),
        (advising, RIGHT),
        (lambda: ("the step is too long",), WARNED),
        (raising(InputError("dt must be positive, got -1")), REFUSED),
        (raising(InputError("dt must be\npositive")), UNEXPLAINED),
        (raising(InputError("")), UNEXPLAINED),
        (raising(SimulationDiverged("diverged at t = 1 s")), DIVERGED),
        (raising(OutOfTime()), LONG),
        (raising(Wrong("momentum error 1")), UNEXPLAINED),
        (raising(AttributeError("no member")), UNEXPLAINED),
        (raising(KeyboardInterrupt()), UNEXPLAINED),
        (raising(SystemExit(1)), UNEXPLAINED),
        (overflowing, UNEXPLAINED),
    ],
)
def test_every_end_has_its_class(attempt, name):
    assert end_of(attempt).name == name


def result(velocity=0.0, momentum=0.0, residual=0.0, unresolved=()):
    """A made-up result with one joule of kinetic energy."""
    frame = dict.fromkeys(("position", "rotation", "velocity", "damage"), np.zeros(3))
    report = SimpleNamespace(
        linear_momentum_error=momentum,
        energy_balance={"kinetic": 1.0, "residual": residual},
        round_off_J=0.0,
        unresolved=unresolved,
    )
    return SimpleNamespace(
        history={"kinetic_J": np.ones(2)},
        peak_speed=np.ones(2),
        frames=[SimpleNamespace(**{**frame, "velocity": np.full(3, velocity)})],
        report=report,
    )


def test_sound_figures_pass():
    judge(result(momentum=1e-12, residual=-0.01))
    judge(result(residual=-0.9, unresolved=("the step is too long",)))


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        ({"velocity": math.nan}, "velocity of a frame"),
        ({"velocity": math.inf, "unresolved": ("too long",)}, "velocity of a frame"),
        ({"momentum": 1e-6}, "momentum error"),
        ({"momentum": math.nan}, "momentum error"),
        ({"residual": 0.9}, "unexplained, and no warning"),
        ({"residual": math.nan}, "unexplained, and no warning"),
    ],
)
def test_wrong_figures_are_found(figures, words):
    with pytest.raises(Wrong, match=words):
        judge(result(**figures))


def test_one_bit_is_a_difference():
    same_bits(result(1.0), result(1.0), "again")
    with pytest.raises(Wrong, match="other bits by again: velocity"):
        same_bits(result(1.0), result(np.nextafter(1.0, 2.0)), "again")


SERVING = """
import os, sys, time
for line in sys.stdin:
    if int(line) == 4:
        os._exit(11)
    if int(line) == 7:
        time.sleep(600.0)
    print(0, "threads", sys.argv[2], flush=True)
"""


class Fake(Worker):
    """A worker that crashes at seed 4 and hangs at seed 7."""

    program = "-c", SERVING

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.patience = 2.0


def test_a_crash_and_a_hang_cost_one_scene_each_and_are_named():
    found = dict(ends(range(12), 2, 1.0, math.inf, Fake))
    assert sorted(found) == list(range(12))
    assert found.pop(4) == End(UNEXPLAINED, "the process ended with code 11")
    assert found.pop(7) == End(UNEXPLAINED, "no answer: it hangs")
    assert all(end == End(RIGHT, f"threads {1 + seed % 2}") for seed, end in found.items())


def test_no_scene_begins_when_the_time_is_over():
    assert len(list(ends(range(100), 2, 1.0, time.monotonic(), Fake))) == 2


def test_table_names_seeds_of_each_unexplained_end():
    found = {name: [] for name in (RIGHT, WARNED, LONG, REFUSED, DIVERGED, UNEXPLAINED)}
    found[RIGHT] = [(1, "")] * 3
    found[UNEXPLAINED] = [(5, "momentum error 1"), (8, "momentum error 2"), (9, "it hangs")]
    lines = table(found, 2.0)
    assert lines[0] == "6 scenes in 2 s, 3.0 a second"
    assert "unexplained 2 times, by seeds 5 8: momentum error 1" in lines
    assert "unexplained 1 times, by seeds 9: it hangs" in lines


def built(seed):
    """All of a scene in words, or why it cannot be made."""
    trial, _ = trial_of(seed)
    try:
        trial.build()
    except InputError as error:
        return str(error)
    return str(trial)


def test_a_seed_draws_one_scene():
    words = [built(seed) for seed in range(18)]
    assert words == [built(seed) for seed in range(18)]
    # Refusals may be the same by chance.
    assert len(set(words)) > 15


@pytest.mark.filterwarnings("ignore::UserWarning")  # as ``ends`` does: what is drawn is odd
def test_most_scenes_can_be_made():
    """Else the runs would test refusals only: a tenth is spoilt, and chance spoils some more."""
    made = 0
    for seed in range(54):
        trial, _ = trial_of(seed)
        try:
            trial.build()
            made += 1
        except InputError:
            pass
    assert made > 30


def test_kinds_that_are_wanted_are_drawn():
    seeds = seeds_of(options(["--kinds", "0,3", "--seed", "30", "--number", "4"]))
    assert [seed % len(KINDS) for seed in seeds] == [0, 3, 0, 3]
    assert seeds[0] >= 30


@pytest.mark.parametrize("kind", [0, len(blast_scene.KINDS) + 7])
def test_scenes_of_one_kind_end_explained(kind):
    for seed in range(kind, kind + 12 * len(KINDS), len(KINDS)):
        end = end_of_seed(seed, 5.0)
        assert end.name != UNEXPLAINED, (seed, end.words)


#: Seeds whose ends were unexplained once, and what was wrong.
MENDED = {
    41: "0 times infinity where contacts have no damping, in the report of limited dashpots",
    3967: "a runaway overflowed the look for shared volume before it was named",
    8586: "a neighbour of infinite height met a warning of NumPy before it was refused",
    313: "dashpots stopped the first motion within a step: heat was booked wrong, unsaid",
    6096: "grains by the rules of place that were pushed out of their box had no name",
    42037: "a search for bodies whose place was no number wrote where no cell is",
    687: "a step beyond the limit of dashpots left nearly all energy open, and nothing said so",
    50929: "the momentum of a runaway overflowed in the report of the run",
    40741: "what a support takes from a load left no momentum to measure an error by",
}


def test_the_momentum_of_a_runaway_is_reported_without_a_warning():
    """Speeds of 1e200 m/s, whose squares are beyond all numbers: no error is known then."""
    made = object.__new__(EnergyBalance)
    made.model, made.start_momentum = SimpleNamespace(body_count=2), np.zeros(6)
    made.readings = SimpleNamespace(momentum=lambda: np.array([[1e200] * 6 + [0.0] * 8] * 2))
    assert not any(error < 1.0 for error in made.momentum_errors())


def test_an_open_account_is_said():
    account = {"kinetic": 1.0, "bond_dashpot": -3.0, "residual": 2.1}
    assert unexplained_share(account) == pytest.approx(2.1 / 4.0)
    assert "2.1 J unexplained" in open_account(account, 0.0)[0]
    assert open_account({**account, "residual": 1.9}, 0.0) == ()
    assert open_account({"kinetic": 1e-20, "residual": 1e-19}, 1e-20) == ()
    assert open_account({**account, "residual": math.nan}, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", MENDED)
def test_ends_that_were_mended_stay_so(seed):
    end = end_of_seed(seed, 5.0)
    assert end.name != UNEXPLAINED, end.words


def test_limited_dashpots_of_no_damping_keep_their_share():
    """Before its first recording a step counts as infinite; a warning would be an error here."""
    made = object.__new__(StepResolution)
    materials = SimpleNamespace(of_contacts=lambda name: 0.0)
    made.model, made.contacts, made.limited = SimpleNamespace(materials=materials), object(), True
    made.pair_share, made.step, made.lightest = np.ones(2), np.full(2, np.inf), np.ones(2)
    made.state = SimpleNamespace(contact_heat=SimpleNamespace(to_numpy=lambda: np.zeros((2, 5))))
    assert (made._contact_shares() == 1.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_scenes_of_every_kind_end_explained(kind):
    assert len(KINDS) == len(blast_scene.KINDS) + len(damper_scene.KINDS)
    for seed in range(kind, kind + 8 * len(KINDS), len(KINDS)):
        end = end_of_seed(seed, 5.0)
        assert end.name != UNEXPLAINED, (seed, end.words)
