"""`alight campaign SPEC.toml`: fly many, on all cores or on a cluster, and say how they went."""

import argparse
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from station.campaign.crew import Crew, CrewError
from station.campaign.dask_crew import DaskCrew
from station.campaign.draw import FlightTasks
from station.campaign.flight_task import FlightTask
from station.campaign.fly_task import rehearse
from station.campaign.ledger import Ledger
from station.campaign.local_crew import LocalCrew, cores
from station.campaign.progress_bar import ProgressBar
from station.campaign.recordings import folder_of, make_recordings, worth_keeping
from station.campaign.row import Row
from station.campaign.software import software
from station.campaign.spec import CampaignSpec, SpecError, read_spec
from station.campaign.summary import summary_text
from station.campaign.tables import TableError, check_parquet, write_results, write_timings
from station.mcap_parts import FlightRecordError
from station.out_folder import make_folder
from station.report.error import ReportError

EPILOG = """\
A campaign that was stopped or killed goes on where it was when the same command is given again.

exit status: 0 if all flights are flown, whatever became of them; 1 if some are not; 2 if the spec is at fault.
docs/campaigns.md says what a spec can vary, and what the results hold.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = EPILOG
    parser.add_argument("spec", type=Path, metavar="SPEC.toml", help="what to fly; see station/campaign/examples")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to write (default campaigns/<name>)")
    parser.add_argument("--flights", type=_positive, metavar="N", help="instead of `flights` in the spec")
    parser.add_argument(
        "--jobs", type=_positive, metavar="N", help="flights at a time on this machine (default: one a core)"
    )
    parser.add_argument("--cluster", metavar="ADDRESS", help="fly on a Dask cluster, such as tcp://192.0.2.1:8786")
    parser.add_argument(
        "--report", action="store_true", help="write a report with pictures, and one of each recorded flight"
    )


def run(arguments: argparse.Namespace) -> int:
    """Fly the campaign; the exit status."""
    try:
        check_parquet()
        spec = read_spec(arguments.spec, arguments.flights)
        tasks = FlightTasks(spec, arguments.spec)
        _rehearse(tasks[0], arguments.spec)
        out: Path = arguments.out or Path("campaigns") / spec.name
        make_folder(out, f"--out {out}")
        with Ledger(out, spec, software()) as ledger:
            return _run(spec, tasks, ledger, out, arguments)
    except (SpecError, TableError, OSError) as error:
        sys.stderr.write(f"alight campaign: {error}\n")
        return 2
    except CrewError as error:
        sys.stderr.write(f"alight campaign: {error}\nwhat is flown is kept: the same command goes on from there\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("\nstopped; the same command goes on from here\n")
        return 130


def _run(
    spec: CampaignSpec, tasks: Mapping[int, FlightTask], ledger: Ledger, out: Path, arguments: argparse.Namespace
) -> int:
    missing = [index for index in tasks if index not in ledger.rows]
    print(f"campaign   {spec.name}, {spec.total} flights, digest {spec.digest[:12]}; writing {out}")
    if len(missing) < spec.total:
        print(f"resuming   {spec.total - len(missing)} of {spec.total} are flown")
    if missing:
        _fly(missing, tasks, ledger, arguments, spec.time_limit_s)
    rows = {index: ledger.rows[index] for index in tasks}
    results = write_results(list(rows.values()), out, spec.digest)
    write_timings({index: ledger.timings[index] for index in tasks}, out)
    for line in summary_text(list(rows.values()), list(spec.listed)):
        print(line)
    _keep(spec, tasks, rows, out, arguments)
    print(f"results    {results}")
    return _report(rows, out, spec.name) if arguments.report else 0


def _fly(
    missing: list[int],
    tasks: Mapping[int, FlightTask],
    ledger: Ledger,
    arguments: argparse.Namespace,
    time_limit_s: float,
) -> None:
    jobs = min(arguments.jobs or cores(), len(missing))
    crew: Crew = DaskCrew(arguments.cluster, time_limit_s) if arguments.cluster else LocalCrew(jobs, time_limit_s)
    bar = ProgressBar(len(tasks), len(tasks) - len(missing))
    began_s, flown_here = time.monotonic(), 0
    try:
        for flown in crew.fly(tasks[index] for index in missing):
            if ledger.add(flown):
                flown_here += 1
                bar.count(landed=bool(flown.row["landed"]))
    finally:
        crew.close()
        bar.end()
    took_s = time.monotonic() - began_s
    print(f"flew       {flown_here} in {took_s:.1f} s ({flown_here / took_s:.2f} flights/s)")


def _keep(
    spec: CampaignSpec,
    tasks: Mapping[int, FlightTask],
    rows: Mapping[int, Row],
    out: Path,
    arguments: argparse.Namespace,
) -> None:
    indices = worth_keeping(rows.values(), spec.keep)
    if not indices:
        return
    crew = LocalCrew(min(arguments.jobs or cores(), len(indices)), spec.time_limit_s)
    try:
        for kept in make_recordings(indices, tasks, rows, out, crew):
            if not kept.same:
                print(
                    f"note: flight {kept.index} went otherwise when it was flown once more, on this machine, for its recording"
                )
    finally:
        crew.close()
    print(f"recorded   flights {', '.join(str(index) for index in indices)} in {folder_of(out, 0).parent}")


def _report(rows: Mapping[int, Row], out: Path, name: str) -> int:
    from station.report.campaign import write_campaign_report  # noqa: PLC0415 - draws, which takes a second to load

    try:
        page = write_campaign_report(list(rows.values()), out, f"Campaign {name}")
    except (ReportError, FlightRecordError) as error:
        sys.stderr.write(f"alight campaign: no report: {error}\n")
        return 1
    print(f"report     {page}")
    return 0


def _rehearse(task: FlightTask, path: Path) -> None:
    try:
        rehearse(task)
    except Exception as error:
        raise SpecError(f"{path}: flight {task.index} cannot begin: {error}") from error


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("at least 1")
    return number
