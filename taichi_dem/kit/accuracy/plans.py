"""Plans of questions that were answered in this session: what later runs can say for nothing."""

from collections.abc import Hashable

from taichi_dem.kit import runtime

_known: dict[Hashable, str] = {}
_sessions: list[runtime.Session] = []


def remember(key: Hashable, sentence: str) -> None:
    """Keep a sentence about runs of a kind until the session of Taichi ends.

    key: the kind, such as ``scene.kind_of`` returns. sentence: without a full stop, such as
    ``parting`` makes; a later one takes its place.
    """
    _of_session()[key] = sentence


def recall(key: Hashable) -> str:
    """The sentence that is remembered about runs of a kind, "" where there is none."""
    return _of_session().get(key, "")


def parting(from_s: float, until_s: float) -> str:
    """Sentence about twins: runs that differ by one rounding.

    from_s: time from which their outputs differ by more than rounding [s], infinite where they did
    not in a run until ``until_s`` [s].
    """
    if from_s <= until_s:
        return f"runs that differ by one rounding part from {from_s:.2g} s"
    return f"runs that differ by one rounding stay together until {until_s:.2g} s"


def _of_session():
    """Sentences of the running session; those of another are forgotten."""
    if _sessions != [runtime.session()]:
        _sessions[:] = [runtime.session()]
        _known.clear()
    return _known
