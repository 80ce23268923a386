"""The line that shows the motor while it is driven."""

import re
import threading
import time
from pathlib import Path

import pytest

from calib.capture.live import LiveLine, describe, live_line
from calib.capture.motor import Reading
from tests.calib.capture.virtual import bench


def readings(folder: Path) -> list[tuple[str, float, Reading]]:
    """What a trial of 1 s shows, in virtual time."""
    seen: list[tuple[str, float, Reading]] = []
    bench(load=1.5).capture(folder, 0.6, live=lambda *newest: seen.append(newest))
    return seen


def test_it_has_speed_current_temperature_and_the_time_left(tmp_path: Path) -> None:
    seen = readings(tmp_path)
    driven = seen[140]  # 0.9 s into the drive
    found = re.fullmatch(r"f0_60: ([\d.]+) turns/s, ([\d.]+) A, (\d+) degrees C, 1 s left", describe(*driven))
    assert found
    measured = driven[2].measured
    assert float(found[1]) == pytest.approx(0.6, abs=0.01)
    assert float(found[2]) == pytest.approx(2.69e-3 * abs(measured.current), abs=0.006)
    assert float(found[2]) > 0.1
    assert int(found[3]) == measured.temperature
    assert len(seen) > 200
    assert seen[0][1] - seen[0][2].time_s > 2
    assert seen[-1][1] - seen[-1][2].time_s < 0.05


def test_a_terminal_that_takes_nothing_holds_up_neither_the_loop_nor_the_end(tmp_path: Path) -> None:
    seen, reached, stuck = readings(tmp_path), threading.Event(), threading.Event()

    def write(_text: str) -> None:
        reached.set()
        stuck.wait(30)

    line = LiveLine(write)
    line(*seen[0])
    assert reached.wait(10)
    began = time.monotonic()
    for newest in seen:
        line(*newest)
    assert time.monotonic() - began < 0.2
    line.end()
    assert time.monotonic() - began < 5
    stuck.set()


def test_a_log_gets_no_line(tmp_path: Path) -> None:
    with (tmp_path / "log").open("w") as log, live_line(log) as line:
        assert line is None
    with live_line(None) as line:
        assert line is None
