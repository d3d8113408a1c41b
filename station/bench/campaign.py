"""A big campaign: undisturbed, killed twice, and on Dask with a worker killed; the same results each time, and how quick."""

import argparse
import os
import resource
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from station.bench.campaign_process import CampaignProcess, dask_cluster
from station.bench.table import print_table
from station.campaign.ledger import FLIGHTS
from station.campaign.local_crew import cores
from station.campaign.spec import read_spec
from station.campaign.summary import summary_text
from station.campaign.tables import RESULTS, read_results

SPEC = Path(__file__).parents[1] / "campaign" / "examples" / "thousand.toml"
LIMIT_S = 3 * 3600.0
_NOTHING_KEPT = "\n[keep]\nworst = 0\nfailed = 0\n"


def bench_campaign(words: Sequence[str] = ()) -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(prog="python -m station.bench campaign")
    parser.add_argument(
        "--flights", type=int, default=24, help="of the undisturbed and the killed campaign (default 24)"
    )
    parser.add_argument("--dask-flights", type=int, help="of the campaign on Dask (default: as many)")
    parser.add_argument("--scaling-flights", type=int, default=12, help="for each count of cores (default 12)")
    parser.add_argument("--out", type=Path, help="keep everything here")
    arguments = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as folder:
        out: Path = arguments.out or Path(folder)
        out.mkdir(parents=True, exist_ok=True)
        spec = out / "spec.toml"
        spec.write_text(SPEC.read_text(encoding="utf-8") + _NOTHING_KEPT, encoding="utf-8")
        _scaling(spec, out, arguments.scaling_flights)
        _same_results(spec, out, arguments.flights, arguments.dask_flights or arguments.flights)


def _scaling(spec: Path, out: Path, flights: int) -> None:
    rows, alone_hz = [], 0.0
    for jobs in sorted({1, cores()}):
        cpu_before_s = _cpu_of_children_s()
        took_s = _undisturbed(spec, out / f"jobs-{jobs}", flights, ("--jobs", str(jobs)))
        cpu_s = (_cpu_of_children_s() - cpu_before_s) / flights
        rate_hz = flights / took_s
        alone_hz = alone_hz or rate_hz
        cells = (
            f"{took_s:.1f}",
            f"{rate_hz:.2f}",
            f"{rate_hz / alone_hz:.2f}",
            f"{cpu_s:.2f}",
            f"{os.getloadavg()[0]:.1f}",
        )
        rows.append((str(jobs), str(flights), *cells))
    head = ("cores", "flights", "took, s", "flights/s", "times one core", "CPU a flight, s", "load of the machine")
    print_table("Scaling, from the start of the command to its end", head, rows)


def _cpu_of_children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _same_results(spec: Path, out: Path, flights: int, dask_flights: int) -> None:
    undisturbed, killed, on_dask = out / "undisturbed", out / "killed", out / "dask"
    took = {undisturbed: _undisturbed(spec, undisturbed, flights), killed: _killed_twice(spec, killed, flights)}
    took[on_dask] = _with_a_worker_killed(spec, on_dask, dask_flights)
    reference = read_results(undisturbed / RESULTS)
    rows = []
    for folder, taken_s in took.items():
        found = read_results(folder / RESULTS)
        lines = (folder / FLIGHTS).read_bytes().count(b"\n")
        same = "same bytes" if _bytes(folder) == _bytes(undisturbed) else _compared(found, reference)
        rows.append((folder.name, str(len(found)), str(lines), f"{taken_s:.0f}", f"{len(found) / taken_s:.2f}", same))
    head = ("campaign", "flights", "lines in the ledger", "took, s", "flights/s", "results against undisturbed")
    print_table(
        "Undisturbed, killed twice (SIGKILL of the process group), on Dask with one of two workers killed", head, rows
    )
    print("\n".join(summary_text(reference, list(read_spec(spec).listed))))


def _undisturbed(spec: Path, out: Path, flights: int, options: Sequence[str] = ()) -> float:
    began_s = time.monotonic()
    CampaignProcess(spec, out, ("--flights", str(flights), *options)).finish(LIMIT_S)
    return time.monotonic() - began_s


def _killed_twice(spec: Path, out: Path, flights: int) -> float:
    began_s = time.monotonic()
    for share in (1 / 3, 2 / 3):
        campaign = CampaignProcess(spec, out, ("--flights", str(flights)))
        campaign.wait_for_flights(round(share * flights), LIMIT_S)
        campaign.kill()
    CampaignProcess(spec, out, ("--flights", str(flights))).finish(LIMIT_S)
    return time.monotonic() - began_s


def _with_a_worker_killed(spec: Path, out: Path, flights: int) -> float:
    with dask_cluster(out.with_suffix(".cluster")) as cluster:
        began_s = time.monotonic()
        campaign = CampaignProcess(spec, out, ("--flights", str(flights), "--cluster", cluster.address))
        campaign.wait_for_flights(flights // 2, LIMIT_S)
        cluster.workers[0].kill()
        cluster.start_worker()
        campaign.finish(LIMIT_S)
        return time.monotonic() - began_s


def _compared(found: Sequence[object], reference: Sequence[object]) -> str:
    differing = sum(one != other for one, other in zip(found, reference, strict=False))
    return f"first {min(len(found), len(reference))} rows: {differing} differ"


def _bytes(folder: Path) -> bytes:
    return (folder / RESULTS).read_bytes()
