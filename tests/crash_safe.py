"""Tests spread over workers by file, so that a worker that dies stops nothing and loses no test.

The scheduler of pytest-xdist 3.8 gives the files of a dead worker to others, those that are done as
well: a worker that is given a file without a test left waits for ever, and the session with it.

The test in which a worker died runs once more in another worker, and the summary names it: what it
died of may be left from the tests before. A test in which a second worker dies has failed.
A test that hangs, also in a kernel, ends its worker after ``MOST_SECONDS``.
"""

import faulthandler

import pytest

#: Longest time of one test [s]; the longest takes two minutes on a busy machine.
MOST_SECONDS = 900

_DIED, _SCHEDULING = pytest.StashKey(), pytest.StashKey()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """End a worker whose test hangs, by a thread that needs no Python."""
    if not hasattr(item.config, "workerinput"):
        return (yield)
    faulthandler.dump_traceback_later(MOST_SECONDS, exit=True)
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Take the place of ``--dist loadfile``; None for all others."""
    if config.getoption("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class CrashSafeScheduling(LoadFileScheduling):
        """Files by worker; of a dead worker's files, tests that are not done run in others.

        Every second worker takes the last file instead of the first: files of one folder, whose
        scenes have much in common, then mostly run in one worker and compile their kernels once.
        """

        def _assign_work_unit(self, node):
            if self.nodes.index(node) % 2:
                self.workqueue.move_to_end(next(reversed(self.workqueue)), last=False)
            super()._assign_work_unit(node)

        def remove_node(self, node):
            """Take a worker away; return the test that has killed two, None without one."""
            left = _unfinished(self.assigned_work.pop(node))
            if not left:
                return None
            tests = next(iter(left.values()))
            test = next(test for test, done in tests.items() if not done)
            tests[test] = test in config.stash[_DIED]
            config.stash[_DIED].append(test)
            self.workqueue.update(_unfinished(left))
            for other in self.assigned_work:
                self._reschedule(other)
            return test if tests[test] else None

        def _reschedule(self, node):
            """Give a worker files until it has two tests, which it needs to begin, if there are."""
            if node not in self.registered_collections:
                return  # It has just begun in the place of another.
            super()._reschedule(node)
            while not node.shutting_down and self._pending_of(self.assigned_work[node]) < 2:
                super()._reschedule(node)

    config.stash[_DIED] = []
    config.stash[_SCHEDULING] = CrashSafeScheduling(config, log)
    return config.stash[_SCHEDULING]


def _unfinished(files):
    """Files with a test that is not done."""
    return {name: tests for name, tests in files.items() if not all(tests.values())}


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    """Let no session pass that has left tests out."""
    scheduling = session.config.stash.get(_SCHEDULING, None)
    if scheduling is not None and scheduling.has_pending and session.exitstatus == 0:
        session.exitstatus = 1


def pytest_terminal_summary(terminalreporter, config):
    """Name the tests in which a worker died."""
    for test in config.stash.get(_DIED, ()):
        terminalreporter.write_line(f"WORKER DIED in {test}; it ran once more in another")
