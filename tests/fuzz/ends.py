"""How a random scene may end, and the one function that tells which it was."""

import traceback
import warnings
from typing import NamedTuple

from taichi_dem import InputError, SimulationDiverged

#: Ends in the order of the table. Long: still stepping when the scene's time was over. Warned: the
#: run said in its report that its numbers are not to be trusted.
RIGHT, WARNED, LONG, REFUSED, DIVERGED, UNEXPLAINED = ENDS = (
    *("right", "right, with a warning in its report", "stopped, too long to wait for"),
    *("refused in one sentence", "named as diverged", "unexplained"),
)
#: Letters of a sentence that a user still reads.
_LONGEST = 1000


class End(NamedTuple):
    """One of ENDS, and what was said."""

    name: str
    words: str = ""


class OutOfTime(Exception):
    """The time of a scene is over; raised by an observer, so that the run was still answering."""


class Wrong(AssertionError):
    """A figure that mechanics does not allow, in words."""


def end_of(attempt):
    """End of a function that runs a scene and returns the warnings of its report."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            # Sentences of the packages about what a scene lists in vain.
            warnings.simplefilter("ignore", UserWarning)
            said = attempt()
        return End(WARNED, said[0]) if said else End(RIGHT)
    except OutOfTime:
        return End(LONG)
    except Wrong as error:
        return End(UNEXPLAINED, str(error))
    except InputError as error:
        return _in_one_sentence(REFUSED, error)
    except SimulationDiverged as error:
        return _in_one_sentence(DIVERGED, error)
    except BaseException as error:
        places = traceback.extract_tb(error.__traceback__)
        # The last line of ours: below it, a library may have warned.
        place = [one for one in places if "site-packages" not in one.filename][-1]
        where = f"{place.filename.rpartition('/')[2]}:{place.lineno}"
        return End(UNEXPLAINED, f"{type(error).__name__} in {where}: {_shortened(error)}")


def _in_one_sentence(name, error):
    words = str(error)
    if not words.strip() or "\n" in words or len(words) > _LONGEST:
        return End(UNEXPLAINED, f"{type(error).__name__} not in one sentence: {_shortened(words)}")
    return End(name, words)


def _shortened(words):
    return " ".join(str(words).split())[:300]
