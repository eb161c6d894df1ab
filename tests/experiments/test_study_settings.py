"""Settings of a study in one table: what options, the full and the quick job make of them."""

import argparse
from types import SimpleNamespace

import pytest

from taichi_dem.kit import study

TABLE = {
    "most_seeds": (5, 2, study.whole(1, 9), "how many"),
    "ratios": ((1.0, 2.0), (1.0,)),
}


@pytest.mark.parametrize(
    ("line", "seeds", "ratios"),
    [
        ([], 5, (1.0, 2.0)),
        (["--quick"], 2, (1.0,)),
        (["--quick", "--most-seeds", "9"], 9, (1.0,)),
    ],
)
def test_an_option_comes_before_the_quick_job_and_that_before_the_full(line, seeds, ratios):
    made = study.add_settings(argparse.ArgumentParser(), TABLE)
    made.add_argument("--quick", action="store_true")
    options = made.parse_args(line)
    study.take_settings(options, TABLE)
    assert (options.most_seeds, options.ratios) == (seeds, ratios)


def test_a_setting_without_a_type_is_no_option_and_defaults_are_set():
    made = study.add_settings(study.parser("some", ""), TABLE, threads=1)
    assert made.parse_args([]).threads == 1
    with pytest.raises(study.command_line.InputError):
        made.parse_args(["--ratios", "1"])


def test_a_parser_takes_settings_and_defaults_at_once(tmp_path):
    made = study.parser("some", "", settings=TABLE, threads=1, out=str(tmp_path / "new"))
    options = made.parse_args(["--most-seeds", "9"])
    assert (options.threads, options.most_seeds, made.settings) == (1, 9, TABLE)
    assert study.begin(options) == tmp_path / "new" and (tmp_path / "new").is_dir()


def test_a_job_that_the_interruption_came_before_begins_anew(tmp_path):
    options = SimpleNamespace(out=str(tmp_path), resume=True, checkpoint_every={})
    path = tmp_path / "some.npz"
    assert study.checkpoint_of(options, "some")["resume"] == str(path)
    assert study.checkpoint_of(options, "some", may_be_new=True)["resume"] is None
    path.touch()
    assert study.checkpoint_of(options, "some", may_be_new=True)["resume"] == str(path)


def test_all_that_is_not_compiling_since_the_start_counts_as_running(tmp_path, monkeypatch, capsys):
    written = {}
    monkeypatch.setattr(study.summary, "write_summary", lambda *_, **found: written.update(found))
    monkeypatch.setattr(study.summary.time, "perf_counter", lambda: 107.5)
    study.finish(SimpleNamespace(out=str(tmp_path), started=100.0), "some", {}, 2.0)
    assert (written["compile_seconds"], written["run_seconds"]) == (2.0, 5.5)
