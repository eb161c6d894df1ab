"""Programs run in processes of their own, as a user starts them."""

import os

#: Switches that importing the package sets in its process, and that a user's shell has not.
_OF_THE_PACKAGE = ("TI_LOG_LEVEL", "TI_SKIP_VERSION_CHECK", "ENABLE_TAICHI_HEADER_PRINT")
#: The size that a test runner gives its own output, which is not that of a terminal of one's own.
_OF_THE_TERMINAL = ("COLUMNS", "LINES")


def users_environment(**more):
    """Environment of a user's shell, with more variables set."""
    dropped = (*_OF_THE_PACKAGE, *_OF_THE_TERMINAL)
    mine = {name: value for name, value in os.environ.items() if name not in dropped}
    return {**mine, **more}
