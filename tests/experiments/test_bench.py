"""The bench: waits of cold and of warm processes, shares of the floors, its files and its history.

No time is compared with another one.
"""

import contextlib
import json
from types import SimpleNamespace

import pytest

import _bench_blast
import _bench_block
import _bench_history
import _bench_start
import bench
from _bench_figure import Figure, by_turns
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.plot_style import picture
from taichi_dem.kit.study.floors import CACHE, MULTIPLY_ADD, Work
from tests.experiments.contract import figure_report, start
from tests.figures import defects

RATES = {CACHE: 8.0, MULTIPLY_ADD: 2.0}


@pytest.fixture
def processes(monkeypatch):
    """Jobs of new processes as (function, cache, whether its cache was empty); none is started."""
    made = []

    def call_in_process(work, *, cache, **arguments):
        cold = cache not in [seen for _, seen, _ in made]
        made.append((work.__name__, cache, cold))
        both = [8.0, 7.0] if cold else [3.0, 2.0]
        return both if work is _bench_start.two_scenes else float(cold)

    monkeypatch.setattr(_bench_start, "call_in_process", call_in_process)
    return made


def test_waits_are_those_of_a_cold_and_of_a_warm_process(processes):
    found = {one.name: one.values for one in _bench_start.measure(quick=False)}
    rounds = _bench_start.ROUNDS
    assert found["first_scene_cold_seconds"] == [8.0] * rounds
    assert found["first_scene_warm_seconds"] == [3.0] * rounds
    # Of a warm process too.
    assert found["second_scene_seconds"] == [2.0] * rounds
    assert len({cache for _, cache, _ in processes}) == rounds
    # A run of one scene fills the cache and is not counted.
    assert len(found["ten_scenes_seconds"]) == _bench_start.TEN
    assert [function for function, *_ in processes].count("ten_scenes") == _bench_start.TEN + 1


def test_a_quick_bench_measures_each_wait_once_and_no_ten_scenes(processes):
    found = {one.name: one.values for one in _bench_start.measure(quick=True)}
    assert found["second_scene_seconds"] == [2.0]
    assert "ten_scenes_seconds" not in found and len(processes) == 2


@pytest.mark.parametrize(
    ("unit", "value", "share"),
    # Of a work that takes 4 s at least.
    [("s", 16.0, 0.25), ("ms", 16000.0, 0.25), ("steps/s", 0.1, 0.4), ("million/s", 1e-7, 0.4)],
)
def test_a_share_of_the_floor_is_least_time_over_time(unit, value, share):
    one = Figure("some", unit, [0.0, value, 2.0 * value], "", Work(bytes=32, flops=6))
    assert one.share(RATES) == pytest.approx(share)
    assert one._replace(work=None).share(RATES) is None


def test_candidates_take_turns():
    called = []
    works = {"a": (lambda: called.append("a"), 3), "b": (lambda: called.append("b"), 2)}
    assert by_turns(works) == {"a": [None] * 3, "b": [None] * 2}
    assert "".join(called) == "ababa"


def test_gain_of_a_second_thread_is_that_of_the_busiest(monkeypatch):
    one = {"bodies": 6, "busy": 1.8, "gain": 0.9, "seconds": [0.5], "bandwidth": 8e9}
    found = {"implicit": {**one, "work": [2e9, 0.0]}}
    monkeypatch.setattr(_bench_block, "thread_gains", lambda *_: found)
    gain, floor, *speeds = _bench_block.measure(quick=False)
    assert gain.values == [1.8]
    assert [one.values for one in speeds] == [[2.0], [500.0]]
    rates = {floor.name: 1e9 * floor.middle}
    assert [one.share(rates) for one in speeds] == [0.5, 0.5]


def test_the_finest_run_is_extrapolated_by_its_evaluations(monkeypatch):
    monkeypatch.setattr(_bench_blast, "EVALUATIONS", 100)
    runs = [SimpleNamespace(seconds=2.0, evaluations=5, work=Work(bytes=8))]
    early, whole = _bench_blast.finest_run(runs)
    assert early.values == [2.0] and whole.values == [40.0]
    # The share of the floor stays that of what was run.
    assert whole.share(RATES) == early.share(RATES) == 0.5


@pytest.fixture
def made(tmp_path, monkeypatch):
    """A bench of made-up figures, as a function that runs it and returns the content of its files.

    seconds: of its wait.
    """
    monkeypatch.setattr(bench, "Floors", lambda: SimpleNamespace(measure=lambda: RATES))
    monkeypatch.setattr(bench.runtime, "settings", lambda: bench.runtime.Settings("cpu", 1, False))

    def run(*seconds, quick=True):
        def waits(quick):
            return [Figure("some_seconds", "s", seconds, "<= 2")]

        def rates(quick):
            return [Figure("a rate", "1/s", [4.0], "", Work(bytes=1))]

        monkeypatch.setattr(bench, "PARTS", (rates, waits))
        bench.run(SimpleNamespace(out=str(tmp_path), quick=quick))
        lines = (tmp_path / "bench_history.jsonl").read_text().splitlines()
        return json.loads((tmp_path / "bench.json").read_text()), [*map(json.loads, lines)]

    return run


def test_named_waits_are_keys_of_the_file_with_their_medians(made, capsys):
    assert len(bench.PARTS) == 4
    content, _ = made(3.0, 1.0, 2.0)
    assert content["some_seconds"] == 2.0 and "a rate" not in content
    assert {"processor", "versions", "arch", "threads", "debug"} < set(content)
    names = [figure["name"] for figure in content["figures"]]
    assert names == [*RATES, "a rate", "some_seconds"]
    # A byte at 8 a second, four times a second.
    assert [figure["share_of_floor"] for figure in content["figures"]] == [None, None, 0.5, None]
    assert "1 .. 3" in capsys.readouterr().out


def test_each_run_is_a_line_of_the_history(made):
    made(1.0)
    _, runs = made(3.0, 2.0)
    assert [run["medians"]["some_seconds"] for run in runs] == [1.0, 2.5]
    assert runs[1]["shares"] == {"a rate": 0.5} and runs[1]["floors"] == pytest.approx(RATES)
    assert {"commit", "date", "processor"} < set(runs[1])


def test_a_line_that_is_no_run_is_refused(tmp_path):
    path = tmp_path / "bench_history.jsonl"
    path.write_text("{}\nhalf a li\n")
    with pytest.raises(InputError, match="line 2"):
        _bench_history.add_run(str(path), {})


def run_at(commit, seconds, share, **changed):
    """A run in the history, with two figures of long names."""
    long = "block of 96000, multirate_controlled, two threads over one"
    alike = {"processor": "some processor", "arch": "cpu", "threads": 1, "quick": False}
    return {
        **{"commit": commit, "medians": {"first_seconds": seconds, long: 2345.6}},
        **{"units": {"first_seconds": "s", long: "steps/s"}, "shares": {long: share}},
        **{**alike, **changed},
    }


HISTORY = [run_at("4051992", 2.0, 0.1), run_at("373f0b8", 1.0, 0.3), run_at("b63df8a+", 4.0, 0.2)]


def test_the_last_run_of_each_commit_is_shown_if_it_can_be_compared():
    other = [run_at("4be5758", 9.0, 0.9, quick=True), run_at("057f332", 9.0, 0.9, threads=2)]
    again = run_at("4051992", 5.0, 0.1)
    assert _bench_history.alike([*HISTORY, *other, again]) == [*HISTORY[1:], again]


def test_speeds_are_those_of_the_first_run_and_shares_of_the_floor():
    assert _bench_history.speeds_of("first_seconds", HISTORY) == [(0, 100), (1, 200), (2, 50)]
    (long,) = HISTORY[0]["shares"]
    assert _bench_history.shares_of(long, HISTORY) == [(0, 10), (1, 30), (2, 20)]


@pytest.mark.parametrize("count", [1, 3])
def test_the_picture_says_what_it_shows(tmp_path, monkeypatch, count):
    found = []

    @contextlib.contextmanager
    def watched(*shape, **options):
        with picture(*shape, **options) as (figure, axes):
            yield figure, axes
            figure.canvas.draw()
            found.append(defects(figure))

    monkeypatch.setattr(_bench_history, "picture", watched)
    path = tmp_path / "bench.png"
    _bench_history.draw_history(str(path), HISTORY[:count])
    assert path.is_file() and found == [[]]


@pytest.mark.slow
def test_a_quick_bench_writes_its_files_and_a_picture_without_defects(tmp_path):
    folder = tmp_path / "results"
    report = figure_report(folder)
    done = start("bench", "--quick", "--threads", "1", "--out", folder, report=report)
    assert done.returncode == 0, done.stderr
    assert json.loads(report.read_text()) == {"figures": 1, "defects": []}
    content = json.loads((folder / "bench.json").read_text())
    assert {"first_scene_cold_seconds", "second_scene_seconds"} < set(content)
    shares = [one["share_of_floor"] for one in content["figures"]]
    assert any(share is not None for share in shares)
