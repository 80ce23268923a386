"""Positions of a motor as laboratories log them, against the turn that they are made from."""

from pathlib import Path

import numpy as np
import pytest

from swimcal.errors import InputError
from swimcal.motor_log import MOTOR_COLUMNS, MotorLog, load_motor

TURN = 2 * np.pi
TIME_S = 100.0 + 0.01 * np.arange(1500) + 0.0005 * np.random.default_rng(0).uniform(-1, 1, 1500)
SPEED = 0.6 * np.clip((TIME_S - 102.0) / 0.5, 0.0, 1.0)  # turns a second: rests for 2 s, then turns
TURNS = 1.523 + np.concatenate([[0.0], np.cumsum(np.diff(TIME_S) * SPEED[1:])])
TURNS = np.round(4096 * TURNS) / 4096


def read(
    tmp_path: Path,
    position: np.ndarray,
    name: str = "position_rad",
    velocity: np.ndarray | None = None,
    velocity_name: str = "velocity_rad_s",
    time_s: np.ndarray = TIME_S,
) -> MotorLog:
    """The log with this position; by default in rad, with the velocity of `TURNS`."""
    velocity = TURN * SPEED if velocity is None else velocity
    header = ",".join(MOTOR_COLUMNS).replace("position_rad", name).replace("velocity_rad_s", velocity_name)
    rows = [f"{t:.6f},{p:.6f},{v:.5f},0.5,12.0,30,0" for t, p, v in zip(time_s, position, velocity, strict=True)]
    path = tmp_path / "f0_60.motor.csv"
    path.write_text("\n".join([header, *rows, ""]).replace("nan", ""))
    return load_motor(path)


def assert_turns(log: MotorLog, turns: np.ndarray = TURNS) -> None:
    """The position is this, but for whole turns in all of it."""
    off = log.position_rad / TURN - turns
    assert np.isfinite(off).mean() > 0.95
    np.testing.assert_allclose(off[np.isfinite(off)], np.round(np.nanmedian(off)), atol=2e-3)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(
    ("rows", "turns"),
    [
        ([300], 1),
        ([300, 301, 302], -1),
        ([700, 800], 2),
        (list(range(300, 900, 70)), 1),
        ([0], 1),
        ([1499], -1),
        ([5], 0.4),
        ([600, 601], -0.7),
        ([601], -100.0),
    ],
)
def test_single_readings_that_cannot_be_are_left_out_and_flagged(
    tmp_path: Path, rows: list[int], turns: float, direction: float
) -> None:
    off = np.zeros(len(TURNS))
    off[rows] = turns
    log = read(tmp_path, TURN * (direction * TURNS + off), velocity=direction * TURN * SPEED)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(log.position_rad)), rows)
    assert_turns(log, direction * TURNS)
    (flag,) = log.flags
    assert flag.kind == "misread_position"
    assert f"{len(rows)} single reading" in flag.message
    assert f"{rows[0] + 2}" in flag.message
    assert f"{turns:+g}" in flag.message


@pytest.mark.parametrize("turns", [-3, 1, 16])
def test_turns_by_which_the_counter_jumps_are_taken_out_and_flagged(tmp_path: Path, turns: int) -> None:
    log = read(tmp_path, TURN * (TURNS + turns * (np.arange(len(TURNS)) >= 800)))
    assert_turns(log)
    assert np.isfinite(log.position_rad).all()
    assert [flag.kind for flag in log.flags] == ["position_jump"]
    assert f"{turns:+d} turns at line 802" in log.flags[0].message


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(
    ("name", "of_turn"), [("rad", TURN), ("deg", 360.0), ("ticks", 4096.0), ("counts", 4096.0), ("turns", 1.0)]
)
@pytest.mark.parametrize("lowest", [None, 0.0, -0.5, "unsigned"])
def test_every_unit_and_counter_gives_the_same_turn(
    tmp_path: Path, name: str, of_turn: float, lowest: float | str | None, direction: float
) -> None:
    turns = direction * (TURNS - 3.0)
    logged = turns
    if lowest == "unsigned":
        logged = turns % 2**20
    elif lowest is not None:
        logged = (turns - lowest) % 1.0 + lowest
    log = read(tmp_path, of_turn * logged, f"position_{name}", direction * TURN * SPEED)
    assert_turns(log, turns)
    assert log.flags == ()


def test_a_shaft_that_rests_where_its_counter_wraps_is_not_misread(tmp_path: Path) -> None:
    turns = TURNS - TURNS[0] - 0.5 / 4096 * (np.random.default_rng(1).random(len(TURNS)) < 0.1)
    log = read(tmp_path, TURN * (turns % 1.0))
    assert_turns(log, turns)
    assert log.flags == ()


def test_a_position_within_one_turn_is_followed_over_missing_readings(tmp_path: Path) -> None:
    position = TURN * (TURNS % 1.0)
    position[900:1250] = np.nan  # 2.1 turns
    log = read(tmp_path, position)
    np.testing.assert_allclose(log.position_rad[1300] - log.position_rad[800], TURN * (TURNS[1300] - TURNS[800]))


def test_a_counter_that_counts_on_is_believed_over_missing_readings(tmp_path: Path) -> None:
    position = TURN * TURNS
    position[100:800] = np.nan  # the motor starts meanwhile
    log = read(tmp_path, position)
    np.testing.assert_array_equal(log.position_rad, np.round(position, 6))
    assert log.flags == ()


@pytest.mark.parametrize("wraps", [True, False])
@pytest.mark.parametrize("readings", [2, 3, 7])
def test_a_register_renewed_less_often_than_it_is_read_makes_no_jump(
    tmp_path: Path, readings: int, wraps: bool
) -> None:
    rng = np.random.default_rng(readings)
    renewed = np.cumsum(rng.integers(readings - 1, readings + 2, len(TURNS)))
    held = TURNS[np.concatenate([[0], renewed])[np.searchsorted(renewed, np.arange(len(TURNS)), side="right")]]
    seen = np.delete(np.arange(len(TURNS)), slice(700, 730))  # 0.3 s without a reading
    logged = held % 1.0 if wraps else held
    log = read(tmp_path, TURN * logged[seen], velocity=TURN * SPEED[seen], time_s=TIME_S[seen])
    known = np.isfinite(log.position_rad)
    assert 0.5 / readings < known.mean() < 1.5 / readings + 0.2
    off = log.position_rad[known] / TURN - held[seen][known]
    np.testing.assert_allclose(off, np.round(off[0]), atol=2e-3)
    assert log.flags == ()


@pytest.mark.parametrize("seconds", [0.05, 1.0, 1.5])
def test_a_counter_that_counts_on_may_be_read_seldom(tmp_path: Path, seconds: float) -> None:
    time_s = 100.0 + seconds * np.arange(60)
    position = TURN * 0.6 * (time_s - 100.0)
    log = read(tmp_path, position, velocity=np.full(60, 0.6 * TURN), time_s=time_s)
    np.testing.assert_allclose(log.position_rad, position, atol=1e-6)
    assert log.flags == ()


@pytest.mark.parametrize("seconds", [0.8, 1.5])
def test_a_position_within_one_turn_that_is_read_too_seldom_is_refused(tmp_path: Path, seconds: float) -> None:
    time_s = 100.0 + seconds * np.arange(60)
    turns = 0.6 * (time_s - 100.0) % 1.0
    with pytest.raises(InputError, match=r"position_rad stays within one turn and is read too seldom.*a reading every"):
        read(tmp_path, TURN * turns, velocity=np.full(60, 0.6 * TURN), time_s=time_s)


@pytest.mark.parametrize(("name", "per_rad_s"), [("rpm", 60 / TURN), ("deg_s", 360 / TURN), ("ticks_s", 4096 / TURN)])
def test_velocities_are_read_in_their_unit(tmp_path: Path, name: str, per_rad_s: float) -> None:
    log = read(tmp_path, TURN * TURNS, velocity=per_rad_s * TURN * SPEED, velocity_name=f"velocity_{name}")
    np.testing.assert_allclose(log.velocity_rad_s, TURN * SPEED, atol=1e-5)


def test_negative_speeds_and_currents_read_as_unsigned_numbers_are_negative(tmp_path: Path) -> None:
    log = read(tmp_path, -TURN * TURNS, velocity=-TURN * SPEED + 2**32 * 0.229 * TURN / 60 * (SPEED > 0))
    np.testing.assert_allclose(log.velocity_rad_s, -TURN * SPEED, atol=1e-4)


@pytest.mark.parametrize("lowest", [None, 0.0])
@pytest.mark.parametrize(("unit", "of_turn"), [("deg", 360.0), ("ticks", 4096.0), ("turns", 1.0)])
def test_a_position_in_another_unit_than_its_name_says_is_refused(
    tmp_path: Path, unit: str, of_turn: float, lowest: float | None
) -> None:
    turns = TURNS if lowest is None else TURNS % 1.0
    with pytest.raises(InputError, match=f"position_rad and velocity_rad_s do not fit each other.*position_{unit}"):
        read(tmp_path, of_turn * turns)


@pytest.mark.parametrize("per_s", [1e3, 1e6, 1e9])
@pytest.mark.parametrize("with_velocity", [True, False])
def test_times_in_another_unit_than_seconds_are_refused(tmp_path: Path, per_s: float, with_velocity: bool) -> None:
    velocity = TURN * SPEED if with_velocity else np.full(len(TURNS), np.nan)
    with pytest.raises(InputError, match=r"time_s is not in seconds.*Divide times in milliseconds by 1000"):
        read(tmp_path, TURN * TURNS, velocity=velocity, time_s=per_s * TIME_S)


def test_seconds_of_a_log_read_once_a_second_without_velocities_are_taken(tmp_path: Path) -> None:
    time_s = np.arange(300.0)
    log = read(tmp_path, 0.3 * TURN * time_s, velocity=np.full(300, np.nan), time_s=time_s)
    np.testing.assert_allclose(log.position_rad, 0.3 * TURN * time_s, atol=1e-3)


@pytest.mark.parametrize("a_second", [250.0, 1000.0])
def test_milliseconds_of_a_fast_log_without_velocities_are_refused(tmp_path: Path, a_second: float) -> None:
    time_s = np.arange(3000) / a_second
    with pytest.raises(InputError, match="time_s is not in seconds"):
        read(tmp_path, TURN * time_s, velocity=np.full(len(time_s), np.nan), time_s=1e3 * time_s)


@pytest.mark.parametrize(
    ("name", "choice"),
    [("position", "position_deg"), ("position_mm", "position_ticks"), ("position_degrees", "position_deg")],
)
def test_a_position_without_a_known_unit_is_refused_with_the_choices(tmp_path: Path, name: str, choice: str) -> None:
    with pytest.raises(InputError, match=f"wrong header.*'{name}' does not say its unit.*{choice}"):
        read(tmp_path, TURN * TURNS, name)


def test_a_raw_velocity_is_refused_with_the_choices(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'velocity_ticks' does not say its unit.*velocity_ticks_s.*velocity_rpm"):
        read(tmp_path, TURN * TURNS, velocity_name="velocity_ticks")
