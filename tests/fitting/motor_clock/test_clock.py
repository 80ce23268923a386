"""The clock of a motor log: found from the codes wherever they are, with an honest error; flagged where it must be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.frequency import SwimFrequency
from fitting.motor_clock import QUARTZ, MotorClock
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimsynth.disturbances import TrackingNoise
from tests.cases import later
from tests.fitting.motor_clock.drives import FPS, HZ, SPEC, Filmed, between, filmed, recorded, tail_of

FRAME_S = 1 / FPS


def kinds(flags: tuple[Flag, ...]) -> set[str]:
    return {flag.kind for flag in flags}


def error_s(clock: MotorClock, one: Filmed, video_s: float) -> float:
    return clock.offset_s + (clock.rate - 1) * video_s - one.offset_at(video_s)


@pytest.mark.parametrize("in_water", [False, *later(True)])
def test_offset_and_rate_are_found_wherever_the_clocks_stand(in_water: bool) -> None:
    for one in filmed(6, in_water):
        clock = recorded(one).clock
        assert clock.found_by == "code"
        assert clock.flags == ()
        assert abs(error_s(clock, one, 3.0)) < 2 * FRAME_S
        assert abs(error_s(clock, one, 15.0)) < 2 * FRAME_S
        assert abs(clock.rate - one.motor.clock_rate) < 4 * clock.rate_se


@pytest.mark.parametrize(("part", "found_by"), [("start_code", "start code"), ("end_code", "end code")])
def test_one_code_gives_the_offset_alone(part: str, found_by: str) -> None:
    one = filmed(6)[1]
    begins_s, ends_s = (float(one.motor.video(time_s)) for time_s in one.commands.span_s(part) or ())
    tail = tail_of(one)
    seen = between(tail, 0, ends_s + 6) if part == "start_code" else between(tail, begins_s - 6, np.inf)
    record = recorded(one, seen)
    assert record.clock.found_by == found_by
    assert record.clock.rate == 1.0
    assert kinds(record.clock.flags) == {"code_not_seen"}
    assert abs(error_s(record.clock, one, begins_s + 2)) < 2 * FRAME_S


def test_a_tail_that_does_something_else_leaves_the_given_offset() -> None:
    one = filmed(6)[0]
    tail = tail_of(one)
    wrong = np.random.default_rng(0).normal(0, 0.02, tail.lateral_m.shape).cumsum(axis=0)
    assert recorded(one, replace(tail, lateral_m=np.zeros_like(tail.lateral_m))).clock.found_by == "given"
    record = recorded(one, replace(tail, lateral_m=wrong))
    assert (record.clock.found_by, record.clock.offset_s, record.clock.rate) == ("given", 0.0, 1.0)
    assert kinds(record.clock.flags) == {"code_not_seen", "clock_given"}
    assert not record.usable


def test_without_commands_the_offset_is_that_of_the_session() -> None:
    one = filmed(6)[0]
    spec = replace(SPEC, motor_offset_s=one.motor.clock_offset_s)
    record = recorded(one._replace(commands=None), spec=spec)  # type: ignore[arg-type]
    assert record.clock.found_by == "given"
    assert kinds(record.flags) == {"clock_given"}
    assert record.usable
    span = one.commands.span_s("drive")
    assert span is not None
    assert one.motor.video(span[0]) < record.drive_s[0] < one.motor.video(span[0] + 1)
    assert record.drive_s[1] == pytest.approx(one.motor.video(span[1]), abs=0.2)


def test_a_log_that_cannot_be_laid_on_the_video_says_what_to_give() -> None:
    record = recorded(filmed(6)[0]._replace(commands=None))  # type: ignore[arg-type]
    (flag,) = record.flags
    assert not record.usable
    assert flag.kind == "clock_given"
    assert "motor_offset_s = 0 makes it cover 0 % of the frames" in flag.message
    assert record.measured_hz == pytest.approx(0.99 * HZ, rel=0.02)


def test_a_log_that_disagrees_with_the_beat_belongs_by_its_commands_or_speed() -> None:
    record = recorded(filmed(6)[0])
    off = SwimFrequency(0.8 * record.measured_hz, 1e-4, 0.0, 0.02, 0.9, 8.0, None)
    reported = record.against(off, np.linspace(*record.drive_s, 100))
    assert "beat_off_crank" in kinds(reported.flags)
    assert reported.logged_hz == record.logged_hz
    alone = replace(reported, commands=None)
    assert replace(alone, commanded_hz=1.01 * reported.measured_hz).logged_hz == record.logged_hz
    assert replace(alone, commanded_hz=1.05 * reported.measured_hz).logged_hz is None
    assert replace(alone, commanded_hz=np.nan).logged_hz is None


def test_frames_stamped_at_another_rate_are_flagged() -> None:
    one = filmed(6)[1]
    tail = tail_of(one, None)
    as_filmed, stamped = recorded(one), recorded(one, replace(tail, time_s=1.004 * tail.time_s))
    assert stamped.clock.rate == pytest.approx(one.motor.clock_rate / 1.004, abs=2e-4)
    assert kinds(stamped.clock.flags) == {"clock_rate"}
    assert stamped.measured_hz == pytest.approx(as_filmed.measured_hz / 1.004, rel=1e-3)
    assert stamped.logged_hz == pytest.approx(as_filmed.logged_hz, rel=1e-3)
    assert as_filmed.logged_hz == pytest.approx(0.99 * HZ, rel=0.005)


def test_the_drive_and_its_speed_are_reported_on_the_clock_of_the_video() -> None:
    one = filmed(6)[0]
    record = recorded(one)
    span = one.commands.span_s("drive")
    assert span is not None
    assert record.drive_s == pytest.approx((one.motor.video(span[0] + 1), one.motor.video(span[1])), abs=2 * FRAME_S)
    assert record.commanded_hz == pytest.approx(HZ)
    assert record.measured_hz == pytest.approx(0.99 * HZ, rel=0.02)
    assert record.ripple == pytest.approx(np.hypot(*one.motor.ripple), rel=0.2)
    assert record.flags == ()


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("motor_error", {"error": 32.0}),
        ("supply_sags", {"voltage_v": 9.0}),
        ("log_gap", {"position_rad": np.nan}),
        ("short_log", None),
    ],
)
def test_what_is_wrong_with_a_log_is_flagged(kind: str, changes: dict[str, float] | None) -> None:
    one = filmed(6)[0]
    log, n = one.log, len(one.log.time_s)
    rows = np.arange(n) // 20 == n // 40
    if changes is None:
        kept = log.time_s < log.time_s[-1] - 6.5
        log = replace(log, **{name: values[kept] for name, values in vars(log).items() if name != "flags"})
    else:
        log = replace(log, **{name: np.where(rows, value, getattr(log, name)) for name, value in changes.items()})
    assert kind in kinds(recorded(one._replace(log=log)).flags)


def test_a_log_without_readings_is_refused() -> None:
    one = filmed(6)[0]
    log = replace(one.log, position_rad=np.full(len(one.log.time_s), np.nan))
    with pytest.raises(NotEnoughData, match=r"f0_90: its motor log holds 0 readings"):
        recorded(one._replace(log=log))


@pytest.mark.long
@pytest.mark.parametrize("in_water", [False, True])
def test_intervals_hold_what_tracking_errors_do_to_offset_and_rate(in_water: bool) -> None:
    """In 240 drives, tracked as well as the published ones and up to twice as badly.

    The prior on quartz is true here: the rate of every drive is drawn from N(1, `QUARTZ`), by stamping
    its frames anew. What the tail lags behind the crank on average is left to the phase of a fit.
    """
    random = np.random.default_rng(7)
    drives = filmed(24, in_water, seed=5)
    lag_s = np.mean([error_s(recorded(one, tail_of(one, None)).clock, one, 8.0) for one in drives])
    inside, found = [], []
    for seed in range(10):
        for number, one in enumerate(drives):
            rate = 1 + QUARTZ * random.normal()
            tail = tail_of(one, TrackingNoise(sd_px=0.5 + 0.05 * seed), 100 * seed + number)
            clock = recorded(one, replace(tail, time_s=one.motor.clock_rate / rate * tail.time_s)).clock
            errors = clock.offset_s - one.offset_at(0.0) - lag_s, clock.rate - rate
            limits = 1.96 * clock.offset_se_s, 1.96 * clock.rate_se
            inside.append([abs(error) < limit for error, limit in zip(errors, limits, strict=True)])
            found.append(clock.found_by == "code")
    assert np.mean(found) > 0.95
    offset, rate = np.mean(np.array(inside)[found], axis=0)
    print(f"\nof {sum(found)}: offset {100 * offset:.0f} %, rate {100 * rate:.0f} %")
    assert 0.92 < offset < 0.98
    assert 0.92 < rate < 0.98
