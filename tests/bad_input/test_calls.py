"""No public call of either package takes a value that it cannot mean: one sentence refuses it."""

import numpy as np
import pytest

import ca_damper
import taichi_dem
from taichi_dem import InputError
from taichi_dem.kit.validation import shown
from tests.bad_input.calls import calls
from tests.bad_input.kinds import wrong_values

#: Wrong values of each parameter that are tried; all of them by ``make attack``.
COUNTS = 4, pytest.param(1000, marks=pytest.mark.attack)


def fault(function, valid, name, value, text):
    """What is wrong with how a value is refused, in words; "" where nothing is.

    The sentence names the parameter, the value and what must be; where more than one number is
    asked for, the parameter or the part of the value.
    """
    try:
        function(**{**valid, name: value})
    except InputError as refusal:
        sentence = str(refusal)
    except Exception as error:
        return f"ends in {error!r} at"
    else:
        return "takes"
    parts = value if isinstance(value, list) else []
    told = [name in sentence, any(shown(part) in sentence for part in (value, *parts))]
    of_one_number = text.split(",")[0] in ("float", "int", "bool")
    enough = all(told) and " must " in sentence if of_one_number else any(told)
    return (
        "" if enough and "\n" not in sentence and len(sentence) < 700 else f"says {sentence!r} of"
    )


def faults(package, count, seed):
    """Faults of so many wrong values of each parameter, drawn by a seed."""
    draw = np.random.default_rng(seed)
    for name, function, valid, types in calls(package):
        function(**valid)
        for key, text in types.items():
            wrong = wrong_values(name, key, text)
            for k in draw.permutation(len(wrong))[:count]:
                why = fault(function, valid, key, wrong[k], text)
                if why:
                    yield f"{name}.{key} {why} {shown(wrong[k])}"


@pytest.mark.parametrize("package", [taichi_dem, ca_damper], ids=["blast", "damper"])
@pytest.mark.parametrize("count", COUNTS)
def test_no_parameter_takes_what_it_cannot_mean(package, count, tmp_path, monkeypatch):
    """Some of the wrong values of its kind, or all."""
    monkeypatch.chdir(tmp_path)
    assert not [*faults(package, count, seed=0)]
