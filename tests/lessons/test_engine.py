"""One thread does all the work, whoever asks; it ends and begins anew."""

import threading

import pytest

from taichi_dem import InputError, runtime
from taichi_dem.kit.session_thread import SessionThread


@pytest.fixture
def own():
    """An engine of its own; Taichi is free for it."""
    runtime.stop()
    made = SessionThread(threads=1)
    yield made
    made.close()


def test_all_who_ask_are_answered_on_one_thread_that_is_not_theirs(own):
    asked = [own.ask(threading.get_ident)]

    def other():
        asked.append(own.ask(threading.get_ident))

    asker = threading.Thread(target=other)
    asker.start()
    asker.join()
    assert asked[0] == asked[1] != threading.get_ident()
    assert own.ask(runtime.settings).threads == 1


def test_work_may_ask_for_more_work(own):
    assert own.ask(lambda: own.ask(lambda: 3) + 1) == 4


def test_what_is_kept_is_made_once_and_forgotten_at_the_end(own):
    made = []
    for _ in range(2):
        own.ask(own.kept, "key", lambda: made.append(1))
    assert len(made) == 1
    own.close()
    own.ask(own.kept, "key", lambda: made.append(1))
    assert len(made) == 2


def test_a_remembered_function_is_called_once_with_the_same_numbers(own):
    called = []

    @own.remember
    def double(number):
        called.append(number)
        return 2 * number

    assert [own.ask(double, number) for number in (1, 1, 2)] == [2, 2, 4]
    assert called == [1, 2]


def test_a_fault_reaches_who_asked_and_the_next_is_answered(own):
    def fault():
        raise InputError("no")

    with pytest.raises(InputError, match="no"):
        own.ask(fault)
    assert own.ask(lambda: 1) == 1


def test_closing_ends_taichi_after_what_has_been_asked_for(own):
    begun, done = threading.Event(), []

    def work():
        begun.set()
        done.append(runtime.settings())

    asker = threading.Thread(target=own.ask, args=(work,))
    asker.start()
    begun.wait()
    own.close()
    asker.join()
    assert done[0] is not None and runtime.settings() is None
    own.close()
