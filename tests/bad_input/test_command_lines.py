"""Bad command lines of all experiments: exit code 2, one sentence, nothing written, at once."""

import importlib.util
import os
import sys

import pytest

from tests.bad_input.refusals import ends_within
from tests.experiments.contract import FOLDER

#: Script and what it is given; words of the sentence.
LINES = [
    *(
        ("blast_fracture", ("--until", text), ("--until", text))
        for text in ("0", "-1", "1e999", "x")
    ),
    ("blast_fracture", ("--until", "0.9", "--dt0", "1e-300"), ("dt must", "1e-300")),
    ("blast_fracture", ("--until", "0.9", "--dt0", "1e-50"), ("until", "0.9")),
    ("blast_fracture", ("--dt0", "1e-9" * 200), ("--dt0", "...")),
    ("blast_fracture", ("--frames", "9" * 5000), ("--frames", "1 to 10000")),
    ("blast_fracture", ("--frames", "1.5"), ("--frames", "'1.5'")),
    ("blast_fracture", ("--mesh", "a\0b.msh"), ("name of a file",)),
    ("blast_fracture", ("--mesh", "{folder}"), ("is a folder",)),
    ("blast_fracture", ("--mesh", "{file}"), ("cannot be read",)),
    ("blast_fracture", ("--mesh", "/dev/null"), ("is no file",)),
    ("blast_fracture", ("--mesh", "{pipe}"), ("is no file",)),
    ("blast_fracture", ("--mesh", ""), ("name of a file",)),
    ("blast_fracture", ("--mesh", "x" * 300 + ".msh"), ("does not exist",)),
    ("blast_fracture", ("--out", "a\0b"), ("name of a file", "a\\x00b")),
    ("blast_fracture", ("--out", "{file}"), ("writable",)),
    ("blast_fracture", ("--out", "{file}/below"), ("writable",)),
    ("blast_fracture", ("--out", "{folder}/" + "x" * 300), ("writable", "too long")),
    ("blast_fracture", ("--out",), ("--out", "argument")),
    (
        "blast_fracture",
        ("--until", "0.9", "--dt0", "1e-9", "--checkpoint-every", "1steps"),
        ("every_steps must be at least 900",),
    ),
    ("blast_fracture", ("--checkpoint-every", "-5s"), ("--checkpoint-every",)),
    ("blast_fracture", ("--checkpoint-every", "1" * 400 + "steps"), ("--checkpoint-every",)),
    ("blast_fracture", ("extra",), ("extra",)),
    ("blast_fracture", ("--sweep", "none.csv"), ("table none.csv cannot be read",)),
    ("blast_fracture", ("--sweep", "{folder}"), ("cannot be read",)),
    ("blast_fracture", ("--sweep", "{file}", "--workers", "0"), ("--workers", "1 to 1024")),
    ("blast_fracture", ("--workers", "2"), ("left out without --sweep",)),
    ("damper_response", ("--sweep", "{file}"), ("at least one row",)),
    ("blast_fracture", ("--accuracy", "0"), ("--accuracy", "up to 100%")),
    ("blast_fracture", ("--accuracy", "1 percent"), ("--accuracy", "up to 100%")),
    (
        "blast_fracture",
        ("--accuracy", "1%", "--resume"),
        ("accuracy must be left out with resume",),
    ),
    ("blast_fracture", ("--accuracy", "1%", "--dt0", "1e-7"), ("left out with dt0: it chooses",)),
    ("blast_fracture", ("--with", "gravity\n,dust"), ("effect must be one of",)),
    ("accuracy_on_request", ("--prices", "0"), ("--prices", "1 to 30")),
    ("accuracy_on_request", ("--blasts", "121"), ("--blasts", "1 to 120")),
    ("blast_methods", ("--methods", "implicit,implicit"), ("--methods", "twice")),
    ("blast_methods", ("--methods", "magic"), ("magic", "paper_uniform")),
    ("blast_methods", ("--methods", ""), ("method must be one of",)),
    ("blast_methods", ("--doublings", "21"), ("--doublings", "0 to 20")),
    ("blast_methods", ("--stable-until", "nan"), ("--stable-until", "nan")),
    ("blast_ensemble", ("--members", "1"), ("--members", "2 to 100000")),
    ("blast_ensemble", ("--jitter", "0.06"), ("--jitter", "[0, 0.05)")),
    ("blast_ensemble", ("--scatter", "-0.1"), ("--scatter", "[0, 0.2)")),
    ("blast_ensemble", ("--mesh", "none.msh"), ("does not exist",)),
    ("blast_multirate", ("--early", "0"), ("--early",)),
    ("blast_multirate", ("--early", "1e-4", "--until", "1e-5"), ("early",)),
    ("blast_multirate", ("--repeats", "0"), ("--repeats", "1 to 100")),
    ("blast_sweeps", ("--mesh", "none.msh"), ("does not exist",)),
    ("cost_of_accuracy_blast", ("--mesh", "none.msh"), ("does not exist",)),
    ("cost_of_accuracy_damper", ("--arch", "tpu"), ("--arch", "tpu")),
    ("cost_of_effects", ("--until", "inf"), ("--until", "inf")),
    ("damper_cost", ("--particles", "0"), ("--particles", "1 to 160")),
    ("damper_cost", ("--particles", "5,5"), ("--particles", "twice")),
    ("damper_cost", ("--particles", "1;2"), ("--particles",)),
    ("damper_patterns", ("--frequency", "0.1"), ("--frequency", "0.5")),
    ("damper_patterns", ("--amplitude", "-3"), ("--amplitude",)),
    ("damper_patterns", ("--dt", "0.5"), ("dt must lie in", "0.5")),
    ("damper_patterns", ("--accounting", "static"), ("--accounting", "landing")),
    ("damper_rebound", ("--restitution", "0.1"), ("--restitution", "0.3")),
    ("damper_rebound", ("--dt", "0.9"), ("dt", "0.9")),
    ("damper_rebound", ("--ca-dt", "0.9"), ("dt", "0.9")),
    ("damper_response", ("--fillings", "sand"), ("sand", "dem")),
    ("damper_response", ("--fillings", ""), ("fillings must be",)),
    ("damper_response", ("--particles", "-1"), ("--particles", "0 to 160")),
    ("damper_response", ("--seeds", "1001"), ("--seeds", "1 to 1000")),
    ("damper_response", ("--dem-dt", "0.9"), ("dt must lie in", "0.9")),
    ("damper_response", ("--ca-dt", "1e-12"), ("dt must lie in", "1e-12")),
    ("damper_response", ("--resume",), ("resume must be left out",)),
    ("damper_response", ("--accuracy", "0"), ("--accuracy", "up to 100%")),
    ("damper_response", ("--accuracy", "nan"), ("--accuracy", "up to 100%")),
    ("damper_response", ("--accuracy", "101%"), ("--accuracy", "up to 100%")),
    ("damper_response", ("--accuracy", "%"), ("--accuracy", "up to 100%")),
    ("damper_response", ("--accuracy", "1%", "--resume"), ("accuracy must be left out",)),
    ("damper_validity", ("--seeds", "0"), ("--seeds", "1 to 1000")),
    ("demo_damper", ("--particles", "161"), ("--particles", "0 to 160")),
    ("demo_damper", ("--amplitude", "0"), ("--amplitude",)),
    ("demo_damper", ("--seed", "-1"), ("--seed",)),
    ("demo_damper", ("--dt", "0.9"), ("dt must lie in", "0.9")),
    ("demo_damper", ("--filling", "water"), ("--filling", "automaton")),
    ("demo_fracture_law", ("--steps", "3"), ("--steps", "200")),
    ("demo_multirate", ("--speed", "1e9"), ("--speed", "(0, 50)")),
    ("demo_multirate", ("--speed", "0.19"), ("speed must be at least 0.2 m/s", "0.19")),
    ("demo_multirate", ("--quick", "--speed", "0.9"), ("speed must be at least 1 m/s", "0.9")),
    ("demo_step_too_large", ("--peak", "0"), ("--peak",)),
    ("demo_wave_and_spall", ("--cells", "5"), ("--cells", "20 to 160")),
    ("hard_cases", ("--only", "nonsense"), ("nonsense",)),
    ("trust", ("--only", "nonsense"), ("nonsense", "bar_wave")),
    ("trust", ("--meshes", "0"), ("--meshes", "1 to 100")),
    ("trust", ("--sizes", "4"), ("--sizes", "1 to 3")),
    ("trust", ("--seed", "-1"), ("--seed",)),
    ("hard_cases", ("--columns", "0"), ("--columns", "1 to 8")),
]


@pytest.fixture(scope="module")
def scripts():
    """``scripts(name)``: an experiment, loaded into this process once."""
    sys.path.insert(0, str(FOLDER))
    loaded = {}

    def load(name):
        if name not in loaded:
            spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
            loaded[name] = sys.modules[name] = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(loaded[name])
        return loaded[name]

    yield load
    sys.path.remove(str(FOLDER))


@pytest.fixture
def places(tmp_path):
    """Names in a folder that hold something else than is asked for."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "file.msh").write_text("x")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.msh")
    return {name: str(tmp_path / name) for name in ("folder", "file.msh", "pipe.msh")}


def called(word):
    """A word of a command line as the name of a test."""
    return " ".join(word)[:40] if isinstance(word, tuple) else word


@pytest.mark.parametrize(("name", "line", "words"), LINES, ids=called)
def test_a_bad_line_is_one_sentence_and_writes_nothing(
    scripts, capsys, tmp_path, monkeypatch, places, name, line, words
):
    from taichi_dem.kit import study

    names = {"folder": places["folder"], "file": places["file.msh"], "pipe": places["pipe.msh"]}
    line = [word.format(**names) for word in line]
    monkeypatch.chdir(tmp_path)
    module, before = scripts(name), everything(tmp_path)
    with ends_within(20.0):
        given = ["--threads", "2", "--out", str(tmp_path / "out"), *line]
        code = study.main(module.run, module.options_parser(), given)
    said = capsys.readouterr().err
    assert code == 2, said
    assert said.endswith("\n") and said.count("\n") == 1
    assert len(said) < 1200
    for word in words:
        assert word in said, said
    assert everything(tmp_path) == before


@pytest.mark.parametrize(
    ("name", "line", "word"),
    [
        ("make_meshes", ("--out", "{file}"), "writable"),
        ("make_meshes", ("--size", "2"), "--size"),
        ("gallery", ("--only", "none"), "only must name"),
        ("gallery", ("--out", "{file}"), "writable"),
    ],
)
def test_a_tool_ends_in_one_sentence_too(scripts, capsys, places, name, line, word):
    code = scripts(name).main([part.format(file=places["file.msh"]) for part in line])
    said = capsys.readouterr().err
    assert code == 2, said
    assert word in said and said.count("\n") == 1


def everything(folder):
    """All names below a folder."""
    return sorted(str(path) for path in folder.rglob("*"))
