"""Standard output of a program whose reader may leave before its end."""

import contextlib
import os
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def lasting_output() -> Iterator[None]:
    """Discard prints in the block silently once their reader has left."""
    for number, name in ((1, "stdout"), (2, "stderr")):
        if getattr(sys, name) is None:
            # Closed from the beginning: keep the next file that is opened from taking its number.
            setattr(sys, name, _opened_nowhere(number))
    output = _LastingOutput(sys.stdout)
    with contextlib.redirect_stdout(output):
        yield
    output.flush()


def _opened_nowhere(number):
    nowhere = os.open(os.devnull, os.O_WRONLY)
    if nowhere != number:
        os.dup2(nowhere, number)
        os.close(nowhere)
    return os.fdopen(number, "w")


class _LastingOutput:
    """A text stream that drops text which can no longer be written, as its reader has left."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text):
        """Write text, or drop it."""
        try:
            self._stream.write(self._encodable(text))
        except OSError as error:
            self._drop(error)
        return len(text)

    def _encodable(self, text):
        """The text, with question marks for characters that the encoding of the stream lacks."""
        encoding = self._stream.encoding or "utf-8"
        return text.encode(encoding, "replace").decode(encoding)

    def flush(self):
        """Flush the buffer, or drop its contents."""
        try:
            self._stream.flush()
        except OSError as error:
            self._drop(error)

    def _drop(self, error):
        if not isinstance(error, BrokenPipeError):
            with contextlib.suppress(OSError):
                print(f"standard output cannot be written to: {error.strerror}", file=sys.stderr)
        # The buffer keeps unsent text, and Python would complain of it at the exit.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)

    def __getattr__(self, name):
        return getattr(self._stream, name)
