"""The waits before the first step: which process is cold, which is warm, and their keys."""

import json
from types import SimpleNamespace

import pytest

import _bench_start
import bench


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
    found = {name: values for name, _, values, _ in _bench_start.measure(quick=False)}
    assert found["first_scene_cold_seconds"] == [8.0] * 5
    assert found["first_scene_warm_seconds"] == [3.0] * 5
    # Of a warm process too.
    assert found["second_scene_seconds"] == [2.0] * 5
    assert len({cache for _, cache, _ in processes}) == 5
    # Six runs of ten scenes: the first of them fills the cache and is not counted.
    assert len(found["ten_scenes_seconds"]) == 5
    assert [function for function, *_ in processes].count("ten_scenes") == 6


def test_a_quick_bench_measures_each_wait_once_and_no_ten_scenes(processes):
    found = {name: values for name, _, values, _ in _bench_start.measure(quick=True)}
    assert found["second_scene_seconds"] == [2.0]
    assert "ten_scenes_seconds" not in found and len(processes) == 2


def test_named_waits_are_keys_of_the_file_with_their_medians(tmp_path, monkeypatch, capsys):
    def waits(quick):
        return [("some_seconds", "s", [3.0, 1.0, 2.0], "<= 2")]

    def rates(quick):
        return [("a rate", "1/s", [4.0], "")]

    assert len(bench.PARTS) == 4
    monkeypatch.setattr(bench, "PARTS", (rates, waits, rates, rates))
    monkeypatch.setattr(bench.runtime, "settings", lambda: bench.runtime.Settings("cpu", 1, False))
    bench.run(SimpleNamespace(out=str(tmp_path), quick=True))
    content = json.loads((tmp_path / "bench.json").read_text())
    assert content["some_seconds"] == 2.0 and "a rate" not in content
    assert [figure["name"] for figure in content["figures"]].count("a rate") == 3
    assert "1 .. 3" in capsys.readouterr().out
