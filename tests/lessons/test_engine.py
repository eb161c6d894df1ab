"""One thread does all the work, what is waited for first; it ends and begins anew."""

import threading

import pytest

from _engine import Engine
from taichi_dem import InputError, runtime


@pytest.fixture
def own():
    """An engine of its own; Taichi is free for it."""
    runtime.stop()
    made = Engine(threads=1)
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


def test_what_somebody_waits_for_comes_before_what_is_prepared(own):
    """The first piece holds the thread until all others are there; then ranks decide."""
    gate, done = threading.Event(), []
    own.prepare(gate.wait)
    for name in ("prepared", "prepared later"):
        own.prepare(done.append, name)
    asker = threading.Thread(target=own.ask, args=(done.append, "asked"))
    asker.start()
    while own._work.qsize() < 3:
        asker.join(0.001)
    gate.set()
    asker.join()
    own.prepare(done.append, "last")
    while len(done) < 4:
        asker.join(0.001)
    assert done == ["asked", "prepared", "prepared later", "last"]


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


def test_a_fault_reaches_who_asked_and_the_next_is_answered(own):
    def fault():
        raise InputError("no")

    with pytest.raises(InputError, match="no"):
        own.ask(fault)
    assert own.ask(lambda: 1) == 1


def test_closing_ends_taichi_and_what_is_prepared(own):
    gate, done = threading.Event(), []
    own.prepare(gate.wait)
    own.prepare(done.append, 1)
    threading.Timer(0.05, gate.set).start()
    own.close()
    assert done == [] and runtime.settings() is None
    own.close()
