"""Plugin of ``make test-quadrants``: a list of the tests that fail, grouped by reason."""

import platform
import re
from collections import Counter, defaultdict
from pathlib import Path

#: Most tests named of a reason.
NAMED = 8


def pytest_addoption(parser):
    """Where the list goes."""
    parser.addoption("--quadrants-report", default="results/quadrants.txt")


def pytest_configure(config):
    """Collect in the process that sees all results: a worker of xdist sees its own only."""
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Report(config.getoption("--quadrants-report")))


def reason_of(report):
    """Why a test failed, in one line without numbers, addresses and paths that differ by test."""
    crash = getattr(report.longrepr, "reprcrash", None)
    text = crash.message if crash else str(report.longrepr)
    line = next((line for line in text.splitlines() if line.strip()), "no reason given")
    line = re.sub(r"0x[0-9a-f]+|/\S+|'[^']*'|\"[^\"]*\"", "…", line.strip())
    return re.sub(r"-?\d[\d.e+-]*", "#", line)[:110]


class Report:
    """Outcomes of all tests, written at the end."""

    def __init__(self, path):
        self.path, self.counts = Path(path), Counter()
        self.failed, self.folders = defaultdict(list), defaultdict(Counter)

    def pytest_runtest_logreport(self, report):
        """Note the call of a test, and whatever failed or was skipped before or after it."""
        if report.when != "call" and report.outcome == "passed":
            return
        self.counts[report.outcome] += 1
        self.folders[report.nodeid.rpartition("/")[0]][report.outcome] += 1
        if report.failed:
            self.failed[reason_of(report)].append(report.nodeid)

    def pytest_sessionfinish(self):
        """Write the list."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.write_text("\n".join(self.lines()) + "\n", encoding="utf-8")

    def lines(self):
        """Lines of the list: counts, by folder, and reasons with their tests, most first."""
        import quadrants

        version = ".".join(map(str, quadrants.__version__))
        yield f"Quadrants {version} in place of Taichi, Python {platform.python_version()}"
        yield _words(self.counts)
        for folder, counts in sorted(self.folders.items()):
            yield f"  {folder}: {_words(counts)}"
        for reason, tests in sorted(self.failed.items(), key=lambda item: -len(item[1])):
            yield f"\n{len(tests)} failed: {reason}"
            yield from (f"    {test}" for test in tests[:NAMED])
            if len(tests) > NAMED:
                yield f"    and {len(tests) - NAMED} more"

    def pytest_terminal_summary(self, terminalreporter):
        """Say where the list is."""
        terminalreporter.write_line(f"What differs is listed in {self.path}")


def _words(counts):
    return ", ".join(f"{counts[outcome]} {outcome}" for outcome in ("passed", "failed", "skipped"))
