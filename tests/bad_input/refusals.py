"""What a refusal must be: one sentence, soon."""

import contextlib
import signal

import pytest
from hypothesis import settings

from taichi_dem import InputError

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


def assert_refused(call, *words):
    """Refused in one sentence that holds these words; a hang is no answer."""
    with pytest.raises(InputError) as refusal, ends_within(20.0):
        call()
    sentence = str(refusal.value)
    assert "\n" not in sentence and len(sentence) < 700
    for word in words:
        assert word in sentence, sentence
