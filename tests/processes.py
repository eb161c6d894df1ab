"""Programs run in processes of their own, as a user starts them."""

import os

#: Switches that importing the package sets in its process, and that a user's shell has not.
_OF_THE_PACKAGE = ("TI_LOG_LEVEL", "TI_SKIP_VERSION_CHECK", "ENABLE_TAICHI_HEADER_PRINT")


def users_environment(**more):
    """Environment of a user's shell, with more variables set."""
    mine = {name: value for name, value in os.environ.items() if name not in _OF_THE_PACKAGE}
    return {**mine, **more}
