"""Build the documentation as static pages: ``make docs``, into results/docs.

    python -m docs.site FOLDER

Open FOLDER/index.html: it needs neither a server nor a network.
"""

import argparse
import sys

from docs.site.builder import build
from taichi_dem import InputError


def main(arguments=None):
    """Build the site; returns the exit code, 2 with a sentence where it cannot be built."""
    made = argparse.ArgumentParser(prog="python -m docs.site", description=__doc__.split("\n")[0])
    made.add_argument("folder", nargs="?", default="results/docs", help="folder of the site")
    try:
        print(f"The first page is {build(made.parse_args(arguments).folder)}")
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
