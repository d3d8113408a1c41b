"""`alight campaign`, killed and on a cluster that loses a worker: the same results as undisturbed, to the byte."""

import contextlib
import json
import os
import signal
import time
from pathlib import Path

import pytest

from station.bench.campaign_process import CampaignProcess, dask_cluster
from station.campaign.ledger import FLIGHTS
from station.campaign.tables import RESULTS, TIMINGS, read_results

pytestmark = pytest.mark.system

SPEC = Path(__file__).parents[2] / "station" / "campaign" / "examples" / "thousand.toml"
FLIGHTS_WANTED = 10
LIMIT_S = 300.0


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example's flights, with a recording of the worst one."""
    path = tmp_path_factory.mktemp("spec") / "short.toml"
    path.write_text(SPEC.read_text() + "\n[keep]\nworst = 1\nfailed = 0\n")
    return path


def campaign(spec: Path, out: Path, *options: str) -> CampaignProcess:
    return CampaignProcess(spec, out, ("--flights", str(FLIGHTS_WANTED), *options))


@pytest.fixture(scope="module")
def undisturbed(spec: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("campaigns") / "undisturbed"
    campaign(spec, out).finish(LIMIT_S)
    return out


def indices(out: Path) -> list[int]:
    return sorted(json.loads(line)["row"]["index"] for line in (out / FLIGHTS).read_bytes().splitlines())


def test_a_campaign_flies_everything_and_keeps_the_worst(undisturbed: Path) -> None:
    rows = read_results(undisturbed / RESULTS)
    assert [row["index"] for row in rows] == list(range(FLIGHTS_WANTED))
    assert len(read_results(undisturbed / TIMINGS)) == FLIGHTS_WANTED
    assert len({row["simulator.wind.gust_mps"] for row in rows}) == FLIGHTS_WANTED
    landed = [row for row in rows if row["landed"]]
    assert len(landed) >= FLIGHTS_WANTED // 2
    worst = max(landed, key=lambda row: row["touchdown_error_m"])
    assert [path.name for path in (undisturbed / "flights").iterdir()] == [f"{worst['index']:06d}"]
    said = undisturbed.with_suffix(".log").read_text()
    assert f"landed     {len(landed)} of {FLIGHTS_WANTED}" in said
    assert "went otherwise" not in said


def test_killed_and_stopped_it_ends_complete_and_the_same_to_the_byte(
    spec: Path, undisturbed: Path, tmp_path: Path
) -> None:
    out = tmp_path / "killed"
    alone = campaign(spec, out)
    alone.wait_for_flights(2, LIMIT_S)
    alone.process.kill()
    alone.process.wait()
    wait_until_nobody_is_left(alone.process.pid)
    with_its_cells = campaign(spec, out)
    with_its_cells.wait_for_flights(4, LIMIT_S)
    with_its_cells.kill()
    stopped = campaign(spec, out)
    stopped.wait_for_flights(6, LIMIT_S)
    os.killpg(stopped.process.pid, signal.SIGINT)
    assert stopped.process.wait(LIMIT_S) == 130
    assert stopped.output.endswith("stopped; the same command goes on from here\n")
    assert "Traceback" not in stopped.output
    flown_before = indices(out)
    last = campaign(spec, out)
    last.finish(LIMIT_S)
    assert f"resuming   {len(flown_before)} of {FLIGHTS_WANTED} are flown" in last.output
    assert indices(out) == list(range(FLIGHTS_WANTED))
    assert (out / RESULTS).read_bytes() == (undisturbed / RESULTS).read_bytes()


def wait_until_nobody_is_left(group: int) -> None:
    """No cell outlives its campaign, even if only the campaign's own process was killed."""
    deadline_s = time.monotonic() + 60.0
    while time.monotonic() < deadline_s and processes_of_group(group):
        time.sleep(0.05)
    assert processes_of_group(group) == []


def test_on_dask_with_a_worker_killed_nothing_is_lost_and_nothing_counted_twice(
    spec: Path, undisturbed: Path, tmp_path: Path
) -> None:
    out = tmp_path / "dask"
    with dask_cluster(tmp_path / "cluster", workers=2) as cluster:
        running = campaign(spec, out, "--cluster", cluster.address)
        running.wait_for_flights(3, LIMIT_S)
        cluster.workers[0].kill()
        running.finish(LIMIT_S)
    assert indices(out) == list(range(FLIGHTS_WANTED))
    assert (out / RESULTS).read_bytes() == (undisturbed / RESULTS).read_bytes()
    assert {line["by"].partition(":")[2] != "" for line in map(json.loads, (out / FLIGHTS).open())} == {True}


def test_another_spec_is_refused_by_its_digest(spec: Path, undisturbed: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text(spec.read_text().replace("seed = 2026", "seed = 2027"))
    refused = campaign(other, undisturbed)
    assert refused.process.wait(LIMIT_S) == 2
    assert "another campaign was begun there (`thousand`, digest " in refused.output


def test_no_scheduler_is_said_with_what_to_do(spec: Path, tmp_path: Path) -> None:
    alone = campaign(spec, tmp_path / "alone", "--cluster", "tcp://127.0.0.1:9")
    assert alone.process.wait(LIMIT_S) == 1
    assert "no scheduler answers there" in alone.output
    assert "the same command goes on from there" in alone.output


def processes_of_group(group: int) -> list[int]:
    """Process ids, without those that only wait to be collected."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, pgrp = stat.read_text().rpartition(")")[2].split()[:3]
            if int(pgrp) == group and state != "Z":
                found.append(int(stat.parent.name))
    return found
