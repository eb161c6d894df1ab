"""Functions called in new processes."""

import os

import pytest

from taichi_dem import InputError, runtime
from taichi_dem.kit.study import call_in_process, call_rounds


def whereabouts(numbers, word):
    """What a process knows of its job."""
    settings = runtime.settings()
    cache = os.environ.get("TI_OFFLINE_CACHE_FILE_PATH", "")
    return {"pid": os.getpid(), "threads": settings.threads, "cache": cache, "sum": sum(numbers)}


def failing():
    raise InputError("there is no such sand")


def test_a_function_is_called_elsewhere_with_its_threads_and_its_cache(tmp_path):
    cache = str(tmp_path / "cache")
    found = call_in_process(whereabouts, threads=2, cache=cache, numbers=[1, 2], word="x")
    assert found.pop("pid") != os.getpid()
    assert found == {"threads": 2, "cache": cache, "sum": 3}
    assert os.path.isdir(cache)


def test_failure_of_the_process_is_a_sentence():
    with pytest.raises(InputError, match=r"(?s)the run by hand ended with: .*no such sand"):
        call_in_process(failing, title="by hand")


def test_calls_take_turns_and_each_keeps_its_cache(tmp_path):
    told = []
    calls = {name: (whereabouts, {"numbers": [k], "word": name}) for k, name in enumerate("ab")}
    found = call_rounds(calls, 2, 1, lambda *turn: told.append(turn))
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert [one["sum"] for one in found["b"]] == [1, 1]
    caches = {name: {one["cache"] for one in turns} for name, turns in found.items()}
    assert len(caches["a"]) == 1 and caches["a"] != caches["b"]
    assert len({one["pid"] for turns in found.values() for one in turns}) == 4
    # Nothing was compiled.
    assert found["a"][0]["compiled_kB"] == 0.0
