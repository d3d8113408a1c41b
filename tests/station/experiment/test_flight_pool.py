"""Who kills an experiment finds no flights going on behind his back."""

import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def wait_until(met, limit_s: float = 60.0) -> bool:
    end_s = time.monotonic() + limit_s
    while not met() and time.monotonic() < end_s:
        time.sleep(0.05)
    return bool(met())


def test_a_flight_ends_with_the_process_that_asked_for_it_even_if_that_is_killed(tmp_path) -> None:
    script = tmp_path / "experiment.py"
    script.write_text(
        textwrap.dedent(
            """
            import os, sys, time
            from pathlib import Path
            from station.experiment.flight_pool import flight_pool

            def fly(told: Path) -> None:
                told.with_suffix(".new").write_text(str(os.getpid()))
                told.with_suffix(".new").rename(told)
                time.sleep(600.0)

            if __name__ == "__main__":
                with flight_pool(1) as pool:
                    pool.submit(fly, Path(sys.argv[1])).result()
            """
        )
    )
    told = tmp_path / "pid"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    experiment = subprocess.Popen([sys.executable, str(script), str(told)], env=environment)
    try:
        assert wait_until(told.exists)
        worker = int(told.read_text())
        assert is_running(worker)
    finally:
        experiment.kill()
        experiment.wait()
    assert wait_until(lambda: not is_running(worker))
