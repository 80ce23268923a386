from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from swimcal.mjcf import DRY as DRY_SCENE
from swimcal.motor_log import load_motor
from swimcal.runs import CrankTurn, Runs
from swimcal.session import load_session
from swimcal.twin import Twin
from swimsynth.plan import SyntheticPlan, SyntheticTrial, in_image
from swimsynth.session import make_session, read_truth
from swimsynth.simulate import TrueRun, simulate_dry_runs, simulate_swims
from tests.swimsynth.plans import DRY, MOTOR, SLOW, dry_plan, files_of, small_plan

FRAMES_PER_S = 60.0


@lru_cache(maxsize=1)
def run() -> TrueRun:
    (only,) = simulate_dry_runs(dry_plan())
    return only


def swing_px(true: TrueRun, marker: int, start_s: float, end_s: float) -> float:
    """How far a marker moves in a stretch."""
    seen = (true.time_s >= start_s) & (true.time_s <= end_s)
    return float(np.ptp(true.position_px[seen, marker], axis=0).max())


def turn_of(log_file: Path) -> CrankTurn:
    """The crank's turn that a log tells, on the clock of the video."""
    log = load_motor(log_file)
    return CrankTurn.measured(log.time_s, log.position_rad).shifted(MOTOR.clock_offset_s, MOTOR.clock_rate)


def test_the_tail_rests_before_the_codes_and_wiggles_in_them() -> None:
    assert swing_px(run(), 8, 0.0, MOTOR.starts_s + 0.4) < 1.0
    assert swing_px(run(), 8, MOTOR.starts_s + 0.5, MOTOR.starts_s + 4.5) > 10
    assert swing_px(run(), 8, MOTOR.ends_s, 14.5) < 1.0


def test_driven_by_its_log_on_the_clock_of_the_video_the_twin_moves_as_the_tracks_do(tmp_path: Path) -> None:
    """With a motor so strong that the tail's springs do not hold it back once more."""
    folder = make_session(tmp_path / "s", dry_plan())
    turn, plan, motor = turn_of(folder / "trials" / "dry.motor.csv"), dry_plan(), run().motor
    runs = Runs(np.zeros((1, 5)), np.array([0.88]), np.array([DRY["phase_rad"]]), turns=(turn,))
    crank = plan.swimmer.crank.model_copy(update={"speed_gain_n_m_s": 1e5})
    strong = plan.swimmer.model_copy(update={"crank": crank})
    twin = Twin(strong, plan.markers, replace(DRY_SCENE, timestep_s=plan.air_timestep_s))
    again = twin.simulate(runs, run().time_s)
    (trial,) = plan.dry_runs
    apart_px = np.linalg.norm(in_image(again.marker_m[0], trial, plan) - run().position_px, axis=2)

    assert apart_px.max() < 1.5
    assert motor is not None
    assert turn.mean_hz(*motor.steady_s) == pytest.approx(run().frequency_hz, rel=2e-3)


def logged_swim() -> SyntheticPlan:
    """A swim from rest, from code to code."""
    return small_plan(slow={"seconds": 14.5, "motor": MOTOR, "phase_rad": 1.0})


def test_a_swim_with_a_log_is_pushed_coasts_and_swims_in_the_drive() -> None:
    swim, other = simulate_swims(logged_swim())
    pushed, coasting = (
        np.linalg.norm(swim.position_px[at + 1, 0] - swim.position_px[at, 0]) * FRAMES_PER_S / 965 for at in (0, 40)
    )

    assert 0.1 < pushed < 0.15
    assert coasting < pushed
    assert swim.speed_m_s == pytest.approx(0.13, abs=0.02)
    assert swim.frequency_hz == pytest.approx(SLOW["frequency_hz"], rel=0.02)
    assert other.motor is None
    assert other.speed_m_s == simulate_swims(small_plan())[1].speed_m_s


@pytest.mark.long
def test_the_session_names_the_log_but_not_its_clock(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "s", logged_swim().model_copy(update={"dry_runs": dry_plan().dry_runs}))
    session, text = load_session(folder), (folder / "session.toml").read_text()

    assert [(trial.name, trial.kind) for trial in session.trials] == [
        ("slow", "swim"),
        ("fast", "swim"),
        ("dry", "dry"),
    ]
    for name in ("slow", "dry"):
        assert session.trial(name).motor == folder / "trials" / f"{name}.motor.csv"
        assert session.trial(name).commands == folder / "trials" / f"{name}.commands.csv"
    assert session.trial("fast").motor is None
    assert "motor_offset_s" not in text
    assert read_truth(folder).plan.dry_runs[0].motor == MOTOR


@pytest.mark.long
def test_the_same_plan_gives_the_same_bytes_and_another_log_leaves_the_tracks_of_the_others(tmp_path: Path) -> None:
    plan = dry_plan()
    more = (*plan.dry_runs, SyntheticTrial(**DRY | {"name": "more", "phase_rad": 0.1}))
    one, two = (files_of(make_session(tmp_path / name, plan)) for name in ("one", "two"))
    three = files_of(make_session(tmp_path / "three", plan.model_copy(update={"dry_runs": more})))

    assert one == two
    assert {name: three[name] for name in one if name.startswith("trials/")} == {
        name: content for name, content in one.items() if name.startswith("trials/")
    }
    assert three["trials/more.motor.csv"] != three["trials/dry.motor.csv"]
