"""`make bench`, or `python -m station.bench [NAME...]`, or `python -m station.bench campaign --flights 1000`: prints the tables."""

import sys

from station.bench.campaign import bench_campaign
from station.bench.lockstep import bench_lockstep
from station.bench.nested import bench_nested
from station.bench.overhead import bench_overhead
from station.bench.recording import bench_recording
from station.bench.replay import bench_replay
from station.bench.stages import bench_stages

BENCHES = {
    "overhead": bench_overhead,
    "stages": bench_stages,
    "lockstep": bench_lockstep,
    "campaign": bench_campaign,
    "nested": bench_nested,
    "replay": bench_replay,
    "recording": bench_recording,
}


def main() -> int:
    """Run the named benches, or all."""
    if sys.argv[1:2] == ["campaign"]:
        bench_campaign(sys.argv[2:])
        return 0
    names = sys.argv[1:] or list(BENCHES)
    unknown = [name for name in names if name not in BENCHES]
    if unknown:
        sys.stderr.write(f"no such bench: {', '.join(unknown)}; there are {', '.join(BENCHES)}\n")
        return 2
    for name in names:
        BENCHES[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main())
