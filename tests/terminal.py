"""Programs as a user sees them: run on a terminal of their own (a pty) instead of in pipes."""

import fcntl
import os
import pty
import re
import struct
import subprocess
import termios
from typing import NamedTuple

#: What a terminal obeys instead of showing: colours, moves of the cursor, lines erased.
_ORDERS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Seen(NamedTuple):
    """A program that has ended: its exit code, all that it sent, and that as text alone."""

    returncode: int
    raw: str

    @property
    def text(self):
        return _ORDERS.sub("", self.raw).replace("\r\n", "\n").replace("\r", "\n")


def run_in_terminal(command, columns=100, **options):
    """Run a command with all three standard streams on a terminal of its own; returns a Seen."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    environment = {**os.environ, "TERM": "xterm-256color"}
    streams = {"stdin": theirs, "stdout": theirs, "stderr": theirs}
    process = subprocess.Popen(command, env=environment, **streams, **options)
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
