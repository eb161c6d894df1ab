"""What a refusal must be, and values that no option of a kind may take."""

import contextlib
import math
import signal

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st

from taichi_dem import InputError
from taichi_dem.kit.validation import shown

#: The same examples at every run, none of them kept in a folder.
steady = settings(derandomize=True, database=None, deadline=None, max_examples=6)


class Endless(Exception):
    """A call that gives no answer."""


@contextlib.contextmanager
def ends_within(seconds):
    """Raise Endless where the block takes longer [s]; Windows has no alarm and just waits."""

    def ring(*_):
        raise Endless(f"no answer in {seconds} s")

    if hasattr(signal, "SIGALRM"):
        before = signal.signal(signal.SIGALRM, ring)
        signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        if hasattr(signal, "SIGALRM"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)


def sentence_of(call):
    """The one sentence with which call() is refused; a test fails on all else, a hang too."""
    with pytest.raises(InputError) as refusal, ends_within(20.0):
        call()
    sentence = str(refusal.value)
    assert "\n" not in sentence
    assert len(sentence) < 700
    return sentence


def assert_refused(call, *words):
    """Refused in a sentence that holds these words."""
    sentence = sentence_of(call)
    for word in words:
        assert word in sentence, sentence


def assert_names(call, name, value):
    """Refused in a sentence that names an option, its value, and what must be."""
    assert_refused(call, name, "must", shown(value))


_NO_NUMBER = ["1", "", None, True, 1j, [], {}, b"1", object, np.array([1.0, 2.0]), np.array("x")]
_NO_FLOAT = [*_NO_NUMBER, math.nan, math.inf, -math.inf, np.float32("nan"), 10**400, -(10**400)]
_NO_SIZE = [*_NO_FLOAT, -1, -1e-300, 1e-61, 5e-324, 1e61, 1e308]
_NO_WORD = [3, 1.5, None, True, "", "nonsense", [], ("both",), {}, b"both", np.array([1.0, 2.0])]
#: What no option of a kind may take, by kind.
WRONG = {
    "positive": [*_NO_SIZE, 0, 0.0, -0.0],
    "zero or positive": _NO_SIZE,
    "share": [*_NO_FLOAT, -1e-9, 1.0 + 1e-9, 2],
    "up to one": [*_NO_FLOAT, -1, -1e-300, 1.5, 1e61],
    "poisson": [*_NO_FLOAT, -1, -1.5, 0.51, 2],
    "whole": [*_NO_FLOAT, 1.5, 2.0, -1, 2**70],
    "word": _NO_WORD,
    "words": [*_NO_WORD, "load", ("load", "colour"), [3]],
    "flag": [0, 1, "True", None, [], 1.0],
    "three numbers": [
        *(0.0, None, "abc", (1, 2), (1, 2, 3, 4), (1, 2, math.nan), (1, 2, "3"), [[1, 2, 3]]),
        *((0, 0, 10**400), (0, 0, 1e200), {1: 2}),
    ],
    "group": [3, None, "", [], True, 'a"b', "a\nb", b"hole"],
    "numbers": [None, "abc", b"ab", [], {1: 2}, True, 3j, *([x] for x in _NO_NUMBER)],
    "history": [3, "ab", [1], [[0], [1], [2]], [[0, 1], [1]], [[1, 0], [1, 1]], [[0], ["1"]]],
    "names": [None, 3, "notch", [3], [None], {"notch"}],
    "shares": [None, 3, "notch", [("notch", 0.5)], *({"notch": x} for x in (0, -1, 2, "1", None))],
    "materials": [None, 3, "ore", [("ore", 0.5)], *({"ore": x} for x in (0, "concrete", None))],
    "path": ["", None, 3, [], "a\0b", b"run.npz", True],
    "object": [None, 3, "x", [], object],
}

_OF_ANY_TYPE = st.one_of(
    st.none(),
    st.text(max_size=5),
    st.booleans(),
    st.binary(max_size=3),
    st.complex_numbers(),
    st.lists(st.floats(), max_size=3),
    st.dictionaries(st.integers(), st.integers(), max_size=2),
)
_NOT_FINITE = st.sampled_from([math.nan, math.inf, -math.inf])
_HUGE = st.integers(min_value=10**61) | st.floats(min_value=1e61)
_BELOW = st.floats(max_value=-1e-300) | st.integers(max_value=-1)
_TINY = st.floats(min_value=5e-324, max_value=9e-61)
#: Examples of the same, drawn.
DRAWN = {
    "positive": _OF_ANY_TYPE | _NOT_FINITE | _HUGE | _BELOW | _TINY | st.just(0.0),
    "zero or positive": _OF_ANY_TYPE | _NOT_FINITE | _HUGE | _BELOW | _TINY,
    "share": _OF_ANY_TYPE | _NOT_FINITE | _HUGE | _BELOW,
    "whole": _OF_ANY_TYPE | st.floats() | _HUGE | st.integers(max_value=-1),
    "word": _OF_ANY_TYPE.filter(lambda value: value not in ("list", "full", "cells")) | st.floats(),
    "flag": _OF_ANY_TYPE.filter(lambda value: not isinstance(value, bool)) | st.floats(),
    "three numbers": st.floats() | st.lists(st.floats(), max_size=2) | _OF_ANY_TYPE,
    "path": _OF_ANY_TYPE.filter(lambda value: not isinstance(value, str)) | st.floats(),
}
DRAWN["three numbers"] = DRAWN["three numbers"].filter(
    lambda value: not isinstance(value, (list, str)) or len(value) != 3
)
