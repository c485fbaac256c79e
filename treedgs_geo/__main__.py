"""``python -m treedgs_geo``: the same command line as ``treedgs``."""

import sys

if __name__ == "__main__":
    if not (sys.flags.isolated or getattr(sys.flags, "safe_path", False)):
        # -m has put the current folder first: a json.py that lies there with the data is not to be executed.
        del sys.path[0]
    from .cli import main

    sys.exit(main())
