"""Runs of structures with boxes: bits, restarts, steps, output, and what is refused."""

import hashlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Box,
    Empty,
    InputError,
    ModalStructure,
    RigidMass,
    SceneTable,
    SimulationDiverged,
    Spheres,
    excitation,
    runtime,
    shake_structure,
)
from ca_damper.engine.modal_mount import MOST_MODES, ModalMount
from ca_damper.excitation import Excitation, SineForce
from taichi_dem import Checkpoint
from taichi_dem.kit.checkpoint import Interrupted
from tests.ca_modes.frames import frame, two_storeys
from tests.ca_oscillator.kicks import BAD_SEED, Kicks

ROOT = Path(__file__).resolve().parents[2]
BOXES = (Box(1, 20), Box(0, 7))
ARRAYS = ("time_s", "base", "x", "v", "force", "rms", "peak")


def motion(duration=0.3, size=1e-3):
    return excitation.sines([4.5, 13.0], [size, 0.3 * size], duration)


def shaken(**changes):
    given = {"filling": Automaton(), "structure": two_storeys(), "boxes": BOXES}
    given.update(excitation=motion(), seeds=[5, 6, 7], interval=2e-3, progress=None)
    return shake_structure(**{**given, **changes})


def batch_of(columns, excitation, **options):
    """A batch of groups with boxes at places 1 and 0, which compiles nothing after ``shaken``."""
    mount = ModalMount(two_storeys(), [1, 0])
    table = SceneTable(*columns)
    same = {"structure": mount, "recorded_samples": 1, "excitation": excitation}
    batch = Batch(Automaton(), table, **same)
    batch.start(**options)
    return batch


def digest():
    made = shaken(boxes=[*BOXES, Box(1, 4)])
    return hashlib.sha256(b"".join(getattr(made, name).tobytes() for name in ARRAYS)).hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 3])
def test_number_of_threads_changes_no_bit(threads):
    assert runtime.settings().threads == 2
    program = (
        f"from taichi_dem import runtime; runtime.start(threads={threads}); "
        "from tests.ca_modes.test_runs import digest; print(digest())"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == digest()


def test_a_group_is_the_same_alone_and_among_others():
    together = shaken()
    for j, seed in enumerate(together.seeds):
        alone = shaken(seeds=[seed])
        for name in ("x", "v", "force", "rms", "peak"):
            assert np.array_equal(getattr(alone, name)[..., 0], getattr(together, name)[..., j])
    assert not np.array_equal(together.x[..., 0], together.x[..., 1])


def test_amplitudes_run_side_by_side_in_a_batch():
    """Groups under signals of their own, each to the bits that it has alone."""
    signals = motion(0.2), motion(0.2, size=2e-3)
    particles, seeds, rest = [20, 7], [5, 8], (1e-4, 5.0)
    together = batch_of((particles * 2, seeds * 2, *rest), tuple(np.repeat(signals, 2)))
    record = together.run(0, 1).record
    for k, one in enumerate(signals):
        alone = batch_of((particles, seeds, *rest), one).run(0, 1).record
        assert np.array_equal(alone, record[2 * k : 2 * k + 2])


def test_launches_in_pieces_change_no_bit():
    batches = [batch_of(([20, 7], [5, 6], 1e-4, 10.0), motion(), velocity=0.3) for _ in range(2)]
    batches[0].advance(1000)
    for part in (1, 0, 17, 982):
        batches[1].advance(part)
    whole, parts = (batch.sample() for batch in batches)
    assert all(np.array_equal(whole[name], parts[name]) for name in whole)


def test_a_table_s_sine_drives_all_modes():
    """As the transfer function says; ``drive`` goes on at another frequency."""
    storeys = np.array([[800.0, -400.0], [-400.0, 400.0]])
    heavy = ModalStructure.from_matrices([0.2, 0.15], storeys, [0.3, 0.3])
    table = SceneTable([30, 0], 1, 1e-4, 4.0, 1e-3)
    batch = Batch(RigidMass(gravity=0.0), table, structure=ModalMount(heavy, [1]))
    batch.start()
    for frequency in (4.0, 9.0):
        batch.drive(frequency)
        cycles = batch.run(20, 1)
        wanted = 1e-3 * heavy.transfer(frequency, [0.0, 30 * 0.2e-3])[::-1]
        # First harmonics of sums over steps are exact; the start has decayed.
        left = 0.02 * np.exp(-0.3 * 2.0 * np.pi * heavy.frequencies[0] * 20.0 / frequency)
        assert np.abs(cycles.harmonic("x")) == pytest.approx(np.abs(wanted), abs=left + 1e-10)


def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    file, whole = tmp_path / "run.npz", shaken()

    def stop(progress):
        if progress.phase == "running":
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Interrupted):
        shaken(progress=stop, checkpoint=Checkpoint(file))
    resumed = shaken(resume=file)
    for name in ARRAYS:
        assert np.array_equal(getattr(whole, name), getattr(resumed, name)), name
    other = ModalStructure.from_matrices([0.2, 0.15], np.diag([800.0, 400.0]), 0.01)
    for changes in ({"structure": other}, {"boxes": BOXES[::-1]}, {"displacement": 1e-3}):
        with pytest.raises(InputError, match="another job"):
            shaken(resume=file, **changes)


def test_a_high_mode_chooses_its_own_step():
    stiff = ModalStructure.from_matrices([0.2, 0.15], np.diag([800.0, 0.15e7]), 0.01)
    highest = stiff.frequencies[1]
    assert highest > 500.0
    made = shaken(filling=RigidMass(), structure=stiff, excitation=motion(0.05), seeds=1)
    # Steps are shortened to make a whole number of samples, of 40.3 steps here.
    assert made.report.dt_s[0] == pytest.approx(2e-3 / 41.0)
    assert made.report.dt_s[0] * highest <= 1.0 / 40.0
    with pytest.raises(InputError, match=r"dt must be at most 4\.96e-05 s, 40 steps to a cycle"):
        shaken(filling=RigidMass(), structure=stiff, dt=1e-4)


def test_a_lost_structure_is_told_in_words():
    """A start beyond any motion that means something."""
    with pytest.raises(SimulationDiverged, match="lost its container"):
        shaken(filling=RigidMass(), velocity=1e7)


def test_a_lost_structure_does_not_end_the_others():
    """All places of its group are nan, those of another seed have the bits that they have alone."""
    given = {"filling": Kicks(1e-4, diverges_at=500), "boxes": [Box(1, 2), Box(0, 3)]}
    with pytest.warns(UserWarning, match="2 of 4 scenes diverged"):
        made = shaken(**given, seeds=[BAD_SEED, 5])
    alone = shaken(**given, seeds=[5])
    for name in ("x", "v", "force", "rms", "peak"):
        assert np.isnan(getattr(made, name)[..., 0]).all()
        assert np.array_equal(getattr(made, name)[..., 1], getattr(alone, name)[..., 0])
    assert np.array_equal(made.time_s, alone.time_s)


def test_a_history_is_written_with_a_column_a_place(tmp_path):
    made = shaken(filling=RigidMass(), seeds=[3], interval=0.1)
    made.write_csv(tmp_path / "history.csv")
    lines = (tmp_path / "history.csv").read_text().splitlines()
    wanted = ("x_m_place0", "x_m_place1", "force_N_box0", "force_N_box1")
    assert lines[0] == ",".join(["time_s", "base_m", *(f"{name}_seed3" for name in wanted)])
    assert len(lines) == 5
    assert made.relative + made.base[:, None, None] == pytest.approx(made.x)


SINE = SineForce(0.1, 3.0)
MANY = ModalStructure.from_matrices(np.ones(17), np.diag(np.arange(1.0, 18.0)), 0.01)
REFUSED = [
    ({"boxes": []}, "boxes must be a Box or a list of at least one, got"),
    ({"boxes": 3}, "boxes must be a Box or a list of at least one, got 3"),
    ({"boxes": [(0, 3)]}, "boxes must be"),
    ({"boxes": Box(2, 3)}, "place of a box must be a whole number from 0 to 1, got 2"),
    ({"boxes": Box(1, 10**7)}, "particles must be a whole number from 0 to 1000000"),
    ({"structure": None}, "structure must be"),
    ({"structure": MANY}, f"modes of a structure with boxes.* from 1 to {MOST_MODES}, got 17"),
    ({"excitation": None}, "excitation must be a Signal"),
    ({"excitation": [motion()] * 2}, "one for all scenes"),
    ({"excitation": Excitation(motion(), SINE)}, "force_place must be a place for a force"),
    ({"force_place": 0}, "force_place must be None without a force in the excitation, got 0"),
    (
        {"excitation": Excitation(motion(), SINE), "force_place": 2},
        "force_place must be a whole number from 0 to 1, got 2",
    ),
    ({"excitation": Excitation(force=SINE), "force_place": 0}, "duration must be given"),
    ({"duration": 9.0, "interval": 0.1}, "within its excitation"),
    ({"dt": 0.0}, "dt must be"),
    ({"interval": float("nan")}, "interval must be"),
    ({"seeds": []}, "seeds"),
    ({"displacement": [1.0, 2.0, 3.0]}, "displacement must be a finite number or 2, one for each"),
    ({"velocity": float("nan")}, "velocity must be a finite number or 2"),
    ({"velocity": "fast"}, "velocity must be a finite number or 2"),
    ({"structure": frame(2), "displacement": 1e-3}, "displacement must be a sum of the modes"),
    ({"filling": None}, "filling must be one such as"),
    ({"filling": Empty()}, "particles must be"),
    ({"filling": Spheres(start=((0.03, 0.02),)), "boxes": Box(1, 2)}, "particles must be 1, as"),
    ({"effects": "some"}, "effects must be one of"),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED)
def test_what_cannot_be_shaken_is_refused(changes, words):
    given = {"filling": RigidMass(), "structure": two_storeys(), "boxes": BOXES, "seeds": 1}
    with pytest.raises(InputError, match=words):
        shake_structure(**{**given, "excitation": motion(), "progress": None, **changes})


def test_a_batch_refuses_scenes_that_make_no_groups():
    mount = ModalMount(two_storeys(), [1])
    given = {"structure": mount, "excitation": motion(), "recorded_samples": 1}
    with pytest.raises(InputError, match="scenes must be a multiple of 2"):
        Batch(RigidMass(), SceneTable([3, 0, 3], 1, 1e-4), **given)
    with pytest.raises(InputError, match="dt must be the same in all scenes of a group"):
        Batch(RigidMass(), SceneTable([3, 0], 1, [1e-4, 2e-4]), **given)
    with pytest.raises(InputError, match="mount must be 'spring' for boxes on a structure"):
        Batch(RigidMass(), SceneTable([3, 0], 1, 1e-4), mount="floor", **given)
    with pytest.raises(InputError, match="structure must be"):
        Batch(RigidMass(), SceneTable([3, 0], 1, 1e-4), structure=two_storeys())
    with pytest.raises(InputError, match="boxes must be at least one"):
        ModalMount(two_storeys(), [])
    batch = Batch(RigidMass(), SceneTable([3, 0], 1, 1e-4), **given)
    with pytest.raises(InputError, match="start must be one of rest"):
        batch.start("empty")
    with pytest.raises(InputError, match="frequency must be the same"):
        batch.change(frequency=[6.0, 7.0])
    assert (batch.table.column("frequency") == 6.0).all()
