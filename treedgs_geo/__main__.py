"""``python -m treedgs_geo``: the same command line as ``treedgs``."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
