"""`python -m aeroflutter`."""

import sys

from aeroflutter.cli import main

if __name__ == "__main__":
    sys.exit(main())
