"""What a refusal must be: one sentence. A call that hangs ends the process (tests/conftest.py)."""

from hypothesis import settings

from taichi_dem import InputError

#: The same examples at every run, none of them kept in a folder.
steady = settings(derandomize=True, database=None, deadline=None, max_examples=6)


def answer(call, *words):
    """What a call returns, or the sentence that refuses it, which holds these words."""
    try:
        return call()
    except InputError as refusal:
        sentence = str(refusal)
    assert "\n" not in sentence and len(sentence) < 700
    assert all(word in sentence for word in words), sentence
    return sentence


def assert_refused(call, *words):
    """Refused in one sentence that holds these words."""
    assert isinstance(answer(call, *words), str)
