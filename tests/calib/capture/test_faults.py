"""Random faults: whatever happens, the motor ends stopped and what was logged is readable."""

import os
import random
import signal
from pathlib import Path

import pytest

from calib.capture import CaptureError, TrialResult
from swimcal.motor_log import load_motor
from swimcal.session import load_session
from tests.calib.capture.virtual import Bench, bench
from tests.calib.motor.faults import ALL_FAULTS, Faults
from tests.cases import later


def a_sequence(seed: int) -> tuple[Bench, random.Random]:
    draw = random.Random(seed)
    kinds = tuple(draw.sample(ALL_FAULTS, draw.choice((1, 2, 4, len(ALL_FAULTS)))))
    faults = Faults(seed, kinds, draw.choice((0.002, 0.01, 0.05, 0.3)), draw.choice((0, 30, draw.randrange(400))))
    one = bench(faults, load=draw.uniform(0, 2), latency_s=draw.choice((1e-3, 4e-3, 16e-3)), seed=seed)
    if draw.random() < 0.2:
        number = draw.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
        one.events.append((draw.uniform(0, 5), lambda: os.kill(os.getpid(), number)))
    return one, draw


def check(seed: int, out: Path) -> str:
    """Runs one sequence; how it ended."""
    one, draw = a_sequence(seed)
    speeds = (draw.uniform(0.1, 1.1), draw.uniform(0.1, 1.1))
    results: list[TrialResult] = []
    failure: CaptureError | None = None
    try:
        results = one.capture(out, *speeds, seconds=draw.uniform(0.5, 2.0), coded=draw.random() < 0.1)
    except CaptureError as error:
        failure = error
    confirmed = not any("did not confirm" in line for line in (*one.messages, str(failure)))
    assert not confirmed or not one.motor["torque_enable"], seed
    assert failure is None or str(failure)
    assert one.stopped_soon, seed
    for log in out.glob("trials/*.motor.csv"):
        load_motor(log)
    if (out / "session.toml").exists():
        names = [trial.name for trial in load_session(out).trials]
        assert names[: len(results)] == [result.name for result in results]
    assert not list(out.glob(".session.toml*")), seed
    return type(failure).__name__


@pytest.mark.parametrize("chunk", [0, 3, *later(*range(10), *range(100, 220))])
def test_random_faults_end_with_a_stopped_motor_and_a_readable_log(tmp_path: Path, chunk: int) -> None:
    ends = {check(seed, tmp_path / str(seed)) for seed in range(10 * chunk, 10 * chunk + 10)}
    assert ends <= {"NoneType", "MotorFault", "NoAnswer", "Interrupted", "UserError"}
