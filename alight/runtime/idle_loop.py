"""`python -m alight.runtime.idle_loop CPU PARENT`: keeps one processor busy with nothing, and gives way to everything.

Real-time processes take the processor from it at once, others by their weight, which is 68 times its own where the kernel shares
its time among sessions. It ends where it cannot make itself so light, and with its parent.
"""

import errno
import os
import sys
import time
from pathlib import Path

AUTOGROUP = Path("/proc/self/autogroup")
"""Where a process says what its session weighs; not there where the kernel does not weigh sessions."""

_LIGHTEST = "19"
_ROUNDS = 20_000
"""About a millisecond between two looks at whether the parent lives."""
_TRIES = 10
_TRY_AGAIN_S = 0.2


def main(cpu: int, parent: int) -> int:
    """Loop until the parent is gone; the exit status is 1 where this would stand in somebody's way."""
    os.sched_setaffinity(0, {cpu})
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    if not _weigh_nothing(AUTOGROUP):
        return 1
    while os.getppid() == parent:
        for _ in range(_ROUNDS):
            pass
    return 0


def _weigh_nothing(autogroup: Path) -> bool:
    """With automatic groups the kernel shares its time among sessions first: a lowest priority counts only within one."""
    for _ in range(_TRIES):
        try:
            if not autogroup.read_text(encoding="ascii").strip():
                return True  # this session is in no such group, which is refused with EINVAL when written to
            autogroup.write_text(_LIGHTEST, encoding="ascii")
        except FileNotFoundError:
            return True  # there are no such groups
        except OSError as error:
            if error.errno != errno.EAGAIN:  # asked too often, by anybody
                return False
            time.sleep(_TRY_AGAIN_S)
        else:
            return True
    return False


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
