"""Structured logs: one JSON object a line."""

import json
import logging
import sys
import time
from pathlib import Path

_STANDARD = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName"}


class JsonLines(logging.Formatter):
    """Formats a record as one JSON object: time (UTC), level, service, event, then whatever `extra` holds."""

    def __init__(self, service: str) -> None:
        super().__init__()
        self._service = service

    def format(self, record: logging.LogRecord) -> str:
        """See `logging.Formatter.format`."""
        moment = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created)) + f".{int(record.msecs):03d}Z"
        line: dict[str, object] = {"at": moment, "level": record.levelname.lower(), "service": self._service}
        line["event"] = record.getMessage()
        line |= {key: value for key, value in vars(record).items() if key not in _STANDARD and key != "service"}
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)


class OncePerSecond(logging.Filter):
    """Lets each event of each topic through once a second at most, so that a flood of bad input does not fill a disk."""

    def __init__(self) -> None:
        super().__init__()
        self._last_s: dict[tuple[str, str], float] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """See `logging.Filter.filter`."""
        if record.levelno < logging.WARNING:
            return True
        lane = (record.getMessage(), str(getattr(record, "topic", "")))
        if record.created - self._last_s.get(lane, 0.0) < 1.0:
            return False
        self._last_s[lane] = record.created
        return True


def configure_logs(service: str, file: Path | None = None) -> None:
    """Send this process's logs, as JSON lines, to standard error or to the end of a file."""
    handler = logging.StreamHandler(sys.stderr) if file is None else logging.FileHandler(file, encoding="utf-8")
    handler.setFormatter(JsonLines(service))
    handler.addFilter(OncePerSecond())
    root = logging.getLogger()
    root.handlers = [handler]
    root.setLevel(logging.INFO)
