"""`alight recording info FILE`: what is in a recording, and what is missing."""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from alight.runtime.clock import NS_PER_S, seconds
from schemas import topics
from station.mcap_parts import EmptyRecordingError, FlightRecordError, PartsReader
from station.part_story import PartStory
from station.recording.inventory import Inventory, gaps, picture_name, take_inventory

_CUT_SHORT = "cut short"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight recording info`."""
    parser.add_argument("flight", type=Path, metavar="FLIGHT", help="a recording (flight.mcap) or its folder")
    parser.add_argument("--json", action="store_true", help="for programs")


def run(arguments: argparse.Namespace) -> int:
    """Print what is there; returns 1 if the file is none or holds no messages."""
    flight: Path = arguments.flight
    try:
        reader = PartsReader(flight / "flight.mcap" if flight.is_dir() else flight)
        inventory = take_inventory(reader)
        if not inventory.messages:
            raise EmptyRecordingError(flight, reader.defects())
    except FlightRecordError as error:
        print(f"alight recording info: {error}", file=sys.stderr)
        return 1
    lacking = [*reader.defects(), *gaps(inventory)]
    if arguments.json:
        print(json.dumps(_facts(reader, inventory, lacking), indent=1))
        return 0
    for line in (*_head(reader, inventory), "", *_table(inventory), "", *_missing(lacking)):
        print(line)
    return 0


def _head(reader: PartsReader, inventory: Inventory) -> Iterator[str]:
    duration_s = seconds(inventory.end_ns - inventory.begin_ns)
    yield f"{_time(inventory.begin_ns)} to {_time(inventory.end_ns)} UTC, {duration_s:.1f} s"
    for part in reader.parts:
        reason = _CUT_SHORT if part.ending is None else part.ending.get("reason", "")
        yield f"{part.path}  {part.path.stat().st_size / 1e6:.1f} MB, {reason}"
    if reader.versions:
        yield ", ".join(f"{name} {value}" for name, value in reader.versions.items())
    for host in reader.parts[0].hosts[:1]:
        yield _host(reader.parts, host)


def _host(parts: list[PartStory], host: Any) -> str:
    hosts = [one for part in parts for one in part.hosts]
    offsets_ns = [int(one["wall_minus_monotonic_ns"]) for one in hosts]
    drift_ms = (offsets_ns[-1] - offsets_ns[0]) / 1e6
    kept = {"true": "kept by NTP or PTP", "false": "kept by nobody"}.get(host.get("clock_synchronised", ""), "unknown")
    return f"recorded on {host.get('hostname')} ({host.get('system')}); its clock was {kept} and moved by {drift_ms:.3f} ms"


def _table(inventory: Inventory) -> Iterator[str]:
    yield f"{'topic':28} {'messages':>9} {'a second':>9} {'longest gap, s':>15} {'missing':>8}"
    for channel in inventory.channels.values():
        missing = channel.not_written + (channel.not_received or 0)
        gap_s = seconds(channel.longest_gap_ns)
        yield f"{channel.name:28} {channel.messages:>9} {channel.rate_hz:>9.1f} {gap_s:>15.2f} {missing:>8}"
        if channel.name == topics.FRAME.name:
            yield f"{picture_name():28} {inventory.pictures:>9}"


def _missing(lacking: list[str]) -> Iterator[str]:
    if not lacking:
        yield "nothing is missing"
    for line in lacking:
        yield f"missing: {line}"


def _facts(reader: PartsReader, inventory: Inventory, lacking: list[str]) -> dict[str, Any]:
    return {
        "begin_ns": inventory.begin_ns,
        "end_ns": inventory.end_ns,
        "versions": reader.versions,
        "parts": [{"path": str(part.path), "ending": part.ending, "hosts": part.hosts} for part in reader.parts],
        "channels": [
            {name: value for name, value in asdict(channel).items() if not name.startswith("_")}
            for channel in inventory.channels.values()
        ],
        "pictures": inventory.pictures,
        "missing": lacking,
    }


def _time(at_ns: int) -> str:
    return f"{datetime.fromtimestamp(at_ns // NS_PER_S, UTC):%Y-%m-%d %H:%M:%S}.{at_ns % NS_PER_S // 1_000_000:03d}"
