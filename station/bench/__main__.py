"""`make bench`, or `python -m station.bench [NAME...]`, or `python -m station.bench campaign --flights 1000`: prints the tables."""

import sys
from collections.abc import Iterator

from station.bench.calibration import bench_calibration
from station.bench.campaign import bench_campaign
from station.bench.detection_approach import bench_detection_approach
from station.bench.detection_corners import bench_detection_corners
from station.bench.detection_range import bench_detection_range
from station.bench.detection_time import bench_detection_time
from station.bench.estimation import bench_estimation
from station.bench.fix import bench_fix
from station.bench.geodesy import bench_geodesy
from station.bench.lockstep import bench_lockstep
from station.bench.nested import bench_nested
from station.bench.nested_landing import bench_nested_landing
from station.bench.overhead import bench_overhead
from station.bench.paper_tables import bench_paper_tables
from station.bench.real_pictures import bench_real_pictures
from station.bench.recording import bench_recording
from station.bench.replay import bench_replay
from station.bench.stages import bench_stages

BENCHES = {
    "overhead": bench_overhead,
    "stages": bench_stages,
    "fix": bench_fix,
    "geodesy": bench_geodesy,
    "estimation": bench_estimation,
    "lockstep": bench_lockstep,
    "campaign": bench_campaign,
    "nested": bench_nested,
    "nested-landing": bench_nested_landing,
    "paper-tables": bench_paper_tables,
    "calibration": bench_calibration,
    "real-pictures": bench_real_pictures,
    "replay": bench_replay,
    "recording": bench_recording,
    "detection-range": bench_detection_range,
    "detection-approach": bench_detection_approach,
    "detection-corners": bench_detection_corners,
    "detection-time": bench_detection_time,
}
WITH_OPTIONS = {
    "campaign": bench_campaign,
    "paper-tables": bench_paper_tables,
    "detection-range": bench_detection_range,
    "detection-approach": bench_detection_approach,
    "detection-corners": bench_detection_corners,
    "detection-time": bench_detection_time,
    "real-pictures": bench_real_pictures,
}
"""Those that take options of their own when named alone."""


def main() -> int:
    """Run the named benches, or all."""
    if sys.argv[1:] and sys.argv[1] in WITH_OPTIONS and (len(sys.argv) == 2 or sys.argv[2].startswith("-")):
        WITH_OPTIONS[sys.argv[1]](sys.argv[2:])
        return 0
    if {"-h", "--help"} & set(sys.argv[1:]):
        print("\n".join(_help()))
        return 0
    names = sys.argv[1:] or list(BENCHES)
    unknown = [name for name in names if name not in BENCHES]
    if unknown:
        sys.stderr.write(f"no such bench: {', '.join(unknown)}; there are {', '.join(BENCHES)}\n")
        return 2
    for name in names:
        BENCHES[name]()
    return 0


def _help() -> Iterator[str]:
    yield "usage: python -m station.bench [NAME...]\n\nPrints the tables of the named benches, or of all:\n"
    for name, bench in BENCHES.items():
        yield f"  {name:19} {(sys.modules[bench.__module__].__doc__ or '').splitlines()[0]}"
    yield f"\nThese take options when named alone (NAME --help lists them): {', '.join(WITH_OPTIONS)}."


if __name__ == "__main__":
    sys.exit(main())
