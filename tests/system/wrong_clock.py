"""Runs a service on a host whose clock is wrong: `python -m tests.system.wrong_clock SERVICE SECONDS_AHEAD [OPTIONS]`."""

import sys
import time

from alight.runtime.clock import nanoseconds
from alight.runtime.service import main

if __name__ == "__main__":
    service, ahead_ns = sys.argv[1], nanoseconds(float(sys.argv[2]))
    right_ns = time.time_ns
    time.time_ns = lambda: right_ns() + ahead_ns
    sys.argv = [f"services.{service}", *sys.argv[3:]]
    sys.exit(main(service))
