"""A sentence that refuses a value prints value and bound so that they differ; the bound holds."""

import ast
import math
import re
from pathlib import Path

import numpy as np
import pytest

from ca_damper import Empty, InputError, excitation, shake
from ca_damper.scenes.clock import MOST_STEPS_PER_CYCLE
from ca_damper.window import window
from taichi_dem.kit.validation import between, told_apart

#: Words of a sentence that names a bound.
BOUNDED = re.compile(r"at most|at least|must be (below|above)|must end within|from|[\[(]")
ROOT = Path(__file__).resolve().parents[2]


def pairs(count):
    """Bounds at random and values beside them, as near as the next number."""
    rng = np.random.default_rng(13)
    bounds = rng.uniform(1.0, 10.0, count) * 10.0 ** rng.integers(-12, 12, count)
    aways, sides = rng.uniform(-16.0, 0.0, count), rng.choice([-1, 1], count)
    for bound, away, side in zip(bounds, aways, sides):
        near = float(bound) * (1.0 + side * 10.0**away)
        yield (near if near != bound else math.nextafter(bound, side * math.inf)), float(bound)
        rounded = float(f"{bound:.3g}")
        if rounded != bound:
            yield rounded, float(bound)


@pytest.mark.parametrize("digits", [2, 3, 6])
def test_a_value_and_its_bound_read_as_two_numbers_and_the_bound_is_allowed(digits):
    for value, bound in pairs(1000):
        got, limit = told_apart(value, bound, digits)
        assert float(got) != float(limit)
        assert (float(got) < float(limit)) == (value < bound)
        assert float(limit) >= bound if value < bound else float(limit) <= bound


def test_a_bound_in_fewest_digits():
    assert told_apart(70.0, 60.0) == ("70", "60")
    assert told_apart(60.0, 59.99999) == ("60", "59.99999")
    assert told_apart(0.00833, 0.008326) == ("0.00833", "0.008326")
    assert told_apart(1.0, 1.0) == ("1", "1")


def test_a_number_between_bounds_reads_so():
    with pytest.raises(InputError, match=r"from 0 to 0\.3333327, got 0\.333333$"):
        between("share", 0.333333, 0.0, 0.33333279)
    with pytest.raises(InputError, match=r"from 0\.1 to 1, got 0\.09$"):
        between("share", 0.09, 0.1, 1.0)


def test_a_run_that_ends_just_after_its_excitation_says_by_what():
    still = excitation.sines(6.0, 0.0, duration=59.9999)
    with pytest.raises(InputError, match="within its excitation") as found:
        shake(Empty(), still, particles=0, seeds=1, duration=60.0, progress=None)
    assert "59.9999 s, got 60 s" in str(found.value)
    with pytest.raises(InputError, match="duration must be at most 60 s in steps") as found:
        window(60.00001, 60.0 / MOST_STEPS_PER_CYCLE, 1.0)
    assert "got 60.00001" in str(found.value)


def sentences():
    """(place, parts of the text) of each refusal of both packages: text, or a formatted value."""
    for package in ("taichi_dem", "ca_damper", "experiments"):
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Raise) and node.exc is not None:
                    for text in ast.walk(node.exc):
                        if isinstance(text, ast.JoinedStr):
                            yield f"{path.relative_to(ROOT)}:{node.lineno}", text.values


def is_rounded(part):
    """Whether a part is a value that a format rounds."""
    spec = getattr(part, "format_spec", None)
    return spec is not None and any(str(one.value)[-1:] in "gfe" for one in spec.values)


def test_no_refusal_rounds_a_bound_and_the_value_beside_it():
    """Both rounded, they may read alike: told_apart gives texts of both."""
    found = []
    for place, parts in sentences():
        said = [k for k, part in enumerate(parts) if isinstance(part, ast.Constant)]
        got = next((k for k in said if str(parts[k].value).endswith(("got ", "was "))), None)
        if got is None or not is_rounded(parts[got + 1]):
            continue
        words = "".join(str(parts[k].value) for k in said if k <= got)
        bounds = [part for part in parts[:got] if is_rounded(part)]
        if bounds and BOUNDED.search(words):
            found.append(place)
    assert found == []
