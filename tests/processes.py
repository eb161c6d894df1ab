"""Programs in processes of their own, as a user starts them: in pipes, or on a terminal (a pty)."""

import fcntl
import os
import pty
import re
import struct
import subprocess
import termios
from typing import NamedTuple

#: Variable that names the architecture of ``pytest --arch``, for the processes of tests too.
_ARCH = "TEST_ARCH"
#: Switches that importing the package sets in its process, and that a user's shell has not.
_OF_THE_PACKAGE = ("TI_LOG_LEVEL", "TI_SKIP_VERSION_CHECK", "ENABLE_TAICHI_HEADER_PRINT")
#: The size that a test runner gives its own output, which is not that of a terminal of one's own.
_OF_THE_TERMINAL = ("COLUMNS", "LINES")
#: What a terminal obeys instead of showing: colours, moves of the cursor, lines erased.
_ORDERS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
#: What a program writes to a pipe as a phase of a job begins, and while a long one goes on.
_PHASE = re.compile(r".+: (compiling|stepping|running|drawing)( .+)?")


def choose_arch(arch):
    """Let all tests of this run use an architecture."""
    os.environ[_ARCH] = arch


def chosen_arch():
    """The architecture of this run: "cpu" or "cuda"."""
    return os.environ[_ARCH]


def users_environment(**more):
    """Environment of a user's shell, with more variables set."""
    dropped = (*_OF_THE_PACKAGE, *_OF_THE_TERMINAL)
    mine = {name: value for name, value in os.environ.items() if name not in dropped}
    return {**mine, **more}


class Seen(NamedTuple):
    """A program that has ended: its exit code, all that it sent, and that as text alone."""

    returncode: int
    raw: str

    @property
    def text(self):
        return without_orders(self.raw).replace("\r\n", "\n").replace("\r", "\n")


def without_orders(text):
    """A text without colours and moves of the cursor."""
    return _ORDERS.sub("", text)


def run_in_terminal(command, columns=100, term="xterm-256color", **options):
    """Run a command with all three standard streams on a terminal of its own; returns a Seen.

    term: kind of terminal. options: of ``subprocess.Popen``, such as another stdout.
    """
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    environment = users_environment(TERM=term)
    streams = {"stdin": theirs, "stdout": theirs, "stderr": theirs, **options}
    process = subprocess.Popen(command, env=environment, **streams)
    os.close(theirs)
    sent = b"".join(iter(lambda: _read(ours), b""))
    os.close(ours)
    return Seen(process.wait(), sent.decode())


def _read(descriptor):
    """What waits there, or nothing once the other side is closed (Linux then says EIO)."""
    try:
        return os.read(descriptor, 65536)
    except OSError:
        return b""


def phases_of(text):
    """Lines of standard error that tell a phase of a program, and all others."""
    lines = text.splitlines()
    phases = [line for line in lines if _PHASE.fullmatch(line)]
    return phases, [line for line in lines if line not in phases]
