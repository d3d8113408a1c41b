"""The recorder's edge to the disk: the files of one flight, one after the other."""

import os
from collections.abc import Mapping
from pathlib import Path

from alight.runtime.clock import NS_PER_S, nanoseconds
from schemas.settings import Settings
from services.recorder import layout
from services.recorder.channels import channels
from services.recorder.entry import Entry, Picture
from services.recorder.held_space import HeldSpace
from services.recorder.host import Host
from services.recorder.part_file import PartFile
from services.recorder.picture import PictureEncoder, PictureError
from services.recorder.pre_trigger import PreTriggerRing
from services.recorder.provenance import Document, documents, provenance
from services.recorder.quota import Quota
from services.recorder.tally import Tally

_MAX_PARTS = 100_000
_BYTES_PER_MB = 1_000_000
_ROOM_TO_GO_ON_BYTES = 16 * _BYTES_PER_MB
"""A recording that the disk had no room for goes on once so much is free."""
_TRY_AGAIN_S = 5.0
_SHORTEST_PART_NS = NS_PER_S


class FlightFileError(ValueError):
    """A recording that cannot be begun: one line with the path, the key and the remedy."""


class FlightFile:
    """Writes entries into MCAP files. After it is open nothing raises: what fails is counted in `tally`.

    The files depend on nothing but the settings and what is added, in that order: no clock, no process id; unless a host
    is given, whose name and clocks then stand in them, too.
    """

    def __init__(self, settings: Settings, host: Host | None = None) -> None:
        """Create the first file and write its head; with `recorder.pre_trigger_s` only see that this could be done.

        Raises:
            FlightFileError: If it cannot.
        """
        recorder = settings.recorder
        self.tally = Tally()
        self.failure: str | None = None
        self._settings = settings
        self._host = host
        self._first_path = recorder.directory / recorder.file_name
        self._channels = tuple(channels(settings))
        self._documents = {document.name: document for document in documents(settings)}
        self._pictures = PictureEncoder(recorder)
        self._quota = Quota(recorder.directory, round(recorder.quota_mb * _BYTES_PER_MB))
        self._part: PartFile | None = None
        self._earlier_bytes = 0
        self._number = 0
        self._lost_already = 0
        self._sync_due_ns = 0
        self._try_again_ns = 0
        self._oldest_open_ns: int | None = None
        self._ring: PreTriggerRing | None = None
        self._open_directory()
        if recorder.pre_trigger_s > 0.0:
            limit_bytes = round(recorder.pre_trigger_mb * _BYTES_PER_MB)
            self._ring = PreTriggerRing(nanoseconds(recorder.pre_trigger_s), limit_bytes)
        else:
            self._begin_first()

    @property
    def path(self) -> Path:
        """The file that is written now, or that was written last."""
        return self._first_path if self._part is None else self._part.path

    @property
    def quota_exceeded_bytes(self) -> int:
        """By how much this recording alone is longer than all may be."""
        return self._quota.exceeded_bytes

    def add(self, entry: Entry) -> None:
        """Write one entry, or keep it for when a landing is asked for."""
        made = self._made(entry)
        if made is None:
            return
        if self._ring is not None:
            self.tally.not_wanted += self._ring.add(made)
            return
        if self._oldest_open_ns is None:
            self._oldest_open_ns = made.received_at_ns
        self._write(made)

    def keep_document(self, document: Document) -> None:
        """Put a document beside the messages, unless it is there already; every further part begins with it, too."""
        if self._documents.get(document.name) == document:
            return
        self._documents[document.name] = document
        if self._part is not None:
            self._part.add_attachment(document.name, document.media_type, document.data)

    def trigger(self) -> None:
        """A landing is asked for: what was kept is written, and all that follows."""
        if self._ring is None:
            return
        kept, self._ring = self._ring.empty(), None
        self._go_on("begun")
        for entry in kept:
            self._write(entry)

    def tick(self, now_ns: int) -> None:
        """Let nothing wait in memory for longer than the flush period; begin the next file if it is time."""
        if self._part is None:
            self._try_again(now_ns)
            return
        self._part.flush()
        self._note_handed_over()
        if now_ns >= self._sync_due_ns and self._host is not None and self._settings.recorder.sync_period_s > 0.0:
            self._part.begin_sync()
            self._sync_due_ns = now_ns + nanoseconds(self._settings.recorder.sync_period_s)
        self._quota.look(self._earlier_bytes + self._part.size_bytes)
        self._look_at_disk()

    def finish(self) -> None:
        """Write the index and close."""
        self._end_part("stopped")

    def _made(self, entry: Entry) -> Entry | None:
        if not isinstance(entry.data, Picture):
            return entry
        try:
            data = self._pictures.encode(entry.data.header, entry.data.pixels)
        except PictureError:
            self.tally.pictures_refused += 1
            return None
        return Entry(entry.channel, data, entry.sequence, entry.received_at_ns, entry.logged_at_ns, entry.stamp_ns)

    def _write(self, entry: Entry) -> None:
        assert isinstance(entry.data, bytes)
        if self._part is not None and self._is_long_enough(self._part, entry.logged_at_ns):
            self._end_part("rotated")
            self._go_on("rotated")
        part = self._part
        if part is None:
            self.tally.lost_disk += 1
            return
        part.add_message(entry.channel, entry.data, entry.sequence, entry.logged_at_ns, entry.stamp_ns)
        self.tally.recorded += 1
        self._look_at_disk()

    def _is_long_enough(self, part: PartFile, now_ns: int) -> bool:
        recorder = self._settings.recorder
        if part.begun_ns is None or now_ns - part.begun_ns < _SHORTEST_PART_NS:
            return False
        by_size = recorder.rotate_mb > 0.0 and part.size_bytes >= recorder.rotate_mb * _BYTES_PER_MB
        by_time = recorder.rotate_s > 0.0 and now_ns - part.begun_ns >= nanoseconds(recorder.rotate_s)
        return by_size or by_time

    def _note_handed_over(self) -> None:
        if self._host is not None and self._oldest_open_ns is not None:
            waited_us = (self._host.now_ns() - self._oldest_open_ns) // 1000
            self.tally.at_risk_max_us = max(self.tally.at_risk_max_us, waited_us)
        self._oldest_open_ns = None

    def _look_at_disk(self) -> None:
        if self._part is None:
            return
        error = self._part.failure or self._part.full
        if error is not None:
            self.failure = error.strerror or str(error)
            self._end_part("disk failed")

    def _end_part(self, reason: str) -> None:
        part, self._part = self._part, None
        if part is None:
            return
        about = {
            "reason": reason,
            "detail": self.failure or "",
            "messages": str(part.messages),
            "lost": self._newly_lost(),
        }
        counts = {f"since_start_{name}": str(value) for name, value in self.tally.counters().items()}
        endings: list[tuple[str, Mapping[str, str]]] = [(layout.ENDING, about | counts)]
        if self._host is not None:
            endings.append((layout.HOST, self._host.description()))
        part.finish(endings)
        self._earlier_bytes += part.size_bytes
        self._quota.look(self._earlier_bytes)

    def _open_directory(self) -> None:
        directory = self._first_path.parent
        try:
            directory.mkdir(parents=True, exist_ok=True)
            HeldSpace(directory).release()
        except OSError as error:
            raise self._refusal(error) from error

    def _begin_first(self) -> None:
        try:
            self._begin("begun")
        except OSError as error:
            raise self._refusal(error) from error

    def _try_again(self, now_ns: int) -> None:
        if self._ring is not None or now_ns < self._try_again_ns:
            return
        self._try_again_ns = now_ns + nanoseconds(_TRY_AGAIN_S)
        if _free_bytes(self._first_path.parent) >= _ROOM_TO_GO_ON_BYTES:
            self._go_on("resumed")

    def _go_on(self, reason: str) -> None:
        try:
            self._begin(reason)
        except OSError as error:
            self.failure = error.strerror or str(error)
        else:
            self.failure = None

    def _begin(self, reason: str) -> None:
        self._quota.look(self._earlier_bytes)
        part = self._create()
        part.add_metadata(layout.PROVENANCE, provenance(self._settings))
        about = {"reason": reason, "part": str(self._number), "lost_before": self._newly_lost()}
        part.add_metadata(layout.BEGINNING, about)
        if self._host is not None:
            part.add_metadata(layout.HOST, self._host.description())
        for document in self._documents.values():
            part.add_attachment(document.name, document.media_type, document.data)
        self._part = part
        self.tally.parts += 1

    def _newly_lost(self) -> str:
        lost, self._lost_already = self.tally.lost - self._lost_already, self.tally.lost
        return str(lost)

    def _create(self) -> PartFile:
        while self._number < _MAX_PARTS:
            self._number += 1
            try:
                return PartFile(layout.part(self._first_path, self._number), self._settings.recorder, self._channels)
            except FileExistsError:
                continue
        raise OSError(0, f"there are {_MAX_PARTS} files already")

    def _refusal(self, error: OSError) -> FlightFileError:
        return FlightFileError(
            f"recorder.directory: {self._first_path} cannot be written ({error.strerror or error}): "
            "choose another folder with --set recorder.directory=DIR"
        )


def _free_bytes(directory: Path) -> int:
    try:
        state = os.statvfs(directory)
    except OSError:
        return 0
    return state.f_bavail * state.f_frsize
