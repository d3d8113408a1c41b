"""`python -m services.simulator`: run this service alone; it needs no station."""

import sys

from alight.runtime.service import main

if __name__ == "__main__":
    sys.exit(main("simulator"))
