"""What is flown so far: one line of JSON a flight, appended when it is done. Losing power costs the line being written."""

import fcntl
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from station.campaign.crew import Flown
from station.campaign.row import Row
from station.campaign.spec import CampaignSpec, SpecError

FLIGHTS = "flights.jsonl"
CAMPAIGN = "campaign.json"


@dataclass(frozen=True)
class Timing:
    """What one flight cost; it stands apart from the results, which are the same on every machine."""

    took_s: float
    by: str


class Ledger:
    """The folder of one campaign, for one process at a time."""

    def __init__(self, out: Path, spec: CampaignSpec, software: str) -> None:
        """Begin the campaign, or go on with it.

        Raises:
            SpecError: If the folder holds another campaign, one of other software, or one that is running.
        """
        out.mkdir(parents=True, exist_ok=True)
        self.rows: dict[int, Row] = {}
        """By index, what was flown, in this run and in earlier ones."""
        self.timings: dict[int, Timing] = {}
        self._software = software
        self._path = out / FLIGHTS
        self._file = self._path.open("ab")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._file.close()
            raise SpecError(f"{out}: a campaign is running there; wait for it, or name another --out") from None
        try:
            _agree(out / CAMPAIGN, spec, software)
        except SpecError:
            self._file.close()
            raise
        self._read()

    def add(self, flown: Flown) -> bool:
        """Write a flight down, once: it is on the disk when this returns.

        Returns:
            Whether it was new.

        Raises:
            SpecError: If other software flew it.
        """
        if flown.software != self._software:
            raise SpecError(
                f"{flown.by} flies with other software ({flown.software}) than this campaign ({self._software}): install the same"
            )
        index = int(flown.row["index"])
        if index in self.rows:
            return False
        line = json.dumps({"row": flown.row, "took_s": round(flown.took_s, 4), "by": flown.by})
        self._file.write(line.encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self._take(line)
        return True

    def __enter__(self) -> "Ledger":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def _read(self) -> None:
        """Take in what is there; a line that a killed process left unfinished is cut off."""
        whole = 0
        for line in self._path.read_bytes().splitlines(keepends=True):
            try:
                if not line.endswith(b"\n"):
                    break
                self._take(line.decode())
            except (ValueError, KeyError):
                break
            whole += len(line)
        self._file.truncate(whole)

    def _take(self, line: str) -> None:
        entry = json.loads(line)
        index = int(entry["row"]["index"])
        self.rows.setdefault(index, entry["row"])
        self.timings.setdefault(index, Timing(entry["took_s"], entry["by"]))


def _agree(path: Path, spec: CampaignSpec, software: str) -> None:
    said = {"name": spec.name, "digest": spec.digest, "software": software}
    if not path.exists():
        fresh = path.with_suffix(".new")
        fresh.write_text(json.dumps(said | {"spec": spec.model_dump(mode="json")}, indent=2) + "\n", encoding="utf-8")
        fresh.replace(path)
        return
    begun: Mapping[str, str] = json.loads(path.read_text(encoding="utf-8"))
    if begun["digest"] != spec.digest:
        raise SpecError(
            f"{path.parent}: another campaign was begun there (`{begun['name']}`, digest {begun['digest'][:12]}; this is "
            f"`{spec.name}`, digest {spec.digest[:12]}); name another --out, or undo the change of the spec"
        )
    if begun["software"] != software:
        raise SpecError(
            f"{path.parent}: begun with other software ({begun['software']}; this is {software}), whose flights may differ; "
            "name another --out, or go on with that software"
        )
