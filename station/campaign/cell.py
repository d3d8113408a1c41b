"""The process in which flights are flown, one after the other: `python -m station.campaign.cell`.

It has a process of its own because a flight may crash it, or hang. Lines of JSON: on standard input the tasks, on standard
output first which software this is, then one row for each task. It ends when its input ends, whatever it is doing: so no
cell outlives the campaign that started it, however that ended.
"""

import faulthandler
import gc
import json
import os
import queue
import signal
import sys
import threading
from typing import TextIO

from station.campaign.flight_task import FlightTask
from station.campaign.fly_task import fly_task
from station.campaign.software import software

_GARBAGE_THRESHOLD = 50_000
"""Looking for garbage less often makes a flight about a tenth quicker; it makes little that reference counting leaves."""


def main() -> None:
    """Fly what is asked for until the input ends."""
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a campaign that is stopped by Ctrl-C ends its cells itself
    replies = _own_output()
    tasks: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin, tasks), daemon=True).start()
    gc.freeze()
    gc.set_threshold(_GARBAGE_THRESHOLD, 20, 20)
    _say(replies, {"software": software()})
    while True:
        row = fly_task(FlightTask.model_validate_json(tasks.get()))
        _say(replies, row)


def _own_output() -> TextIO:
    """Standard output, for replies alone: what anything else prints goes to standard error."""
    kept = os.dup(1)
    os.dup2(2, 1)
    return os.fdopen(kept, "w", encoding="utf-8")


def _read(stream: TextIO, tasks: "queue.SimpleQueue[str]") -> None:
    for line in stream:
        tasks.put(line)
    os._exit(0)


def _say(replies: TextIO, reply: dict[str, object]) -> None:
    replies.write(json.dumps(reply) + "\n")
    replies.flush()


if __name__ == "__main__":
    main()
