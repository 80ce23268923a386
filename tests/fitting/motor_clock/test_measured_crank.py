"""Swims and dry runs with a motor log: only the drive is measured, and the twin's crank makes the measured turn."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fitting.dry_run import measure_dry_run
from fitting.measure_trial import measure_trial
from fitting.motor_clock import MotorRecord
from fitting.phase import phase_from_harmonic
from fitting.published import Swims
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import NotEnoughData
from swimcal.motor_log import load_motor
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from swimsynth.simulate import save_motor_log
from tests.fitting.motor_clock.drives import FPS, PX_PER_M, ROBOT, SPEC, SWIM_SPEC, Filmed, filmed, recorded

CAMERA = CameraSpec(FPS, ROBOT.scale_length_m)
COEFFICIENTS = np.array([PLAUSIBLE_COEFFICIENTS], float)


def tracks_of(one: Filmed) -> xr.Dataset:
    position_px = PX_PER_M * one.marker_m * [1, -1] + 1500.0
    return as_tracks(FISHSIM_MARKERS, one.time_s, position_px, np.ones(position_px.shape[:2]))


@cache
def swum(role: str = "fit") -> tuple[Filmed, MotorRecord, MeasuredTrial]:
    one = filmed(2, in_water=True, seed=3)[0]
    record = recorded(one)
    spec = replace(SWIM_SPEC, role=role)  # type: ignore[arg-type]
    return one, record, measure_trial(spec, tracks_of(one), CAMERA, ROBOT, 1.0, record)


def misfit_m(twin: Twin, trial: MeasuredTrial) -> float:
    """Mean marker distance of the true coefficients, at the phase that suits them best."""
    start = phase_from_harmonic(twin, trial, COEFFICIENTS, trial.frequency.hz)[0]
    phases = start + np.linspace(-0.3, 0.3, 31)
    columns = np.vstack([np.repeat(COEFFICIENTS.T, len(phases), axis=1), phases])
    return float(Swims(twin, (trial,)).mean_distance(columns).min())


def test_only_the_frames_of_the_drive_are_measured() -> None:
    one, record, trial = swum()
    video_s = one.time_s[trial.first_frame] + trial.time_s
    assert record.drive_s[0] <= video_s[0] < record.drive_s[0] + 1 / FPS
    assert record.drive_s[1] - 1 / FPS < video_s[-1] <= record.drive_s[1]
    weight = trial.weight_of(len(one.time_s))
    assert len(weight) == len(one.time_s)
    assert not weight[: trial.first_frame].any()
    assert weight[trial.first_frame :][: len(trial.weight)] == pytest.approx(trial.weight)


def test_its_frequency_is_that_of_the_crank_and_not_of_the_tail() -> None:
    _, record, trial = swum()
    assert trial.turn is not None
    assert trial.beat is not None
    assert trial.frequency.hz == pytest.approx(record.measured_hz, rel=2e-3)
    assert trial.beat.hz == pytest.approx(trial.frequency.hz, rel=5e-3)
    assert "beat_off_crank" not in {flag.kind for flag in trial.flags}


def test_a_tail_that_beats_otherwise_than_the_crank_turns_is_flagged() -> None:
    one, record, _ = swum()
    faster = replace(record, turn=record.turn.shifted(0.0, 1.03))
    trial = measure_trial(SWIM_SPEC, tracks_of(one), CAMERA, ROBOT, 1.0, replace(faster, drive_s=(7.5, 11.0)))
    assert "beat_off_crank" in {flag.kind for flag in trial.flags}
    assert trial.turn is None
    assert trial.frequency == trial.beat


@pytest.mark.long
def test_with_the_measured_turn_the_true_coefficients_fit_better() -> None:
    """The motor of this swim turns unevenly, by 2 and 3 per cent once and twice a turn."""
    _, _, trial = swum()
    twin = Twin(ROBOT, FISHSIM_MARKERS)
    even = replace(trial, turn=None)
    assert misfit_m(twin, trial) < 0.5 * misfit_m(twin, even)


def test_a_log_whose_clock_is_not_believed_is_not_used() -> None:
    one, record, _ = swum()
    unused = replace(record, usable=False, clock=replace(record.clock, found_by="given"))
    tracks = tracks_of(one)
    with pytest.raises(NotEnoughData, match="no lasting beat"):  # nobody knows where the codes end
        measure_trial(SWIM_SPEC, tracks, CAMERA, ROBOT, 1.0, unused)

    driven = tracks.sel(time=slice(*record.drive_s))
    trial = measure_trial(SWIM_SPEC, driven, CAMERA, ROBOT, 1.0, unused)
    assert trial.turn is None
    assert trial.motor is not None
    assert len(trial.time_s) == len(driven.time)


def test_a_drive_that_was_not_filmed_is_refused() -> None:
    one, record, _ = swum()
    with pytest.raises(NotEnoughData, match="f0_90: 0 frames show the steady drive"):
        measure_trial(SWIM_SPEC, tracks_of(one), CAMERA, ROBOT, 1.0, replace(record, drive_s=(90.0, 95.0)))


def test_a_dry_run_knows_how_unevenly_its_crank_turned() -> None:
    one = filmed(2, seed=4)[0]
    record = recorded(one)
    trial = measure_dry_run(SPEC, tracks_of(one), CAMERA, ROBOT, motor=record)
    assert trial.motor is record
    assert trial.time_s[0] == 0.0  # the drive is steady from its first frame on
    assert trial.time_s[-1] < record.drive_s[1] - record.drive_s[0]
    ahead = 2 * np.pi * record.measured_hz * (trial.even_s - trial.time_s)
    assert 0.01 < ahead.std() < 0.05  # rad: 2 % once and 1.5 % twice a turn
    assert measure_dry_run(SPEC, tracks_of(one), CAMERA, ROBOT).motor is None


@pytest.mark.parametrize(("rows", "turns"), [((300, 301, 302, 500), 2), ((420,), -1)])
def test_misread_positions_change_neither_drive_nor_turn_and_are_flagged_in_the_trial(
    tmp_path: Path, rows: tuple[int, ...], turns: int
) -> None:
    one, undisturbed, trial = swum()
    position = one.log.position_rad.copy()
    position[list(rows)] += 2 * np.pi * turns
    save_motor_log(tmp_path / "f0_90.motor.csv", replace(one.log, position_rad=position))
    record = recorded(one._replace(log=load_motor(tmp_path / "f0_90.motor.csv")))
    assert record.usable
    assert record.measured_hz == pytest.approx(undisturbed.measured_hz, rel=1e-5)
    video_s = np.arange(*undisturbed.drive_s, 1 / FPS)
    assert record.turn.angle(video_s) == pytest.approx(undisturbed.turn.angle(video_s), abs=0.01)
    flags = measure_trial(SWIM_SPEC, tracks_of(one), CAMERA, ROBOT, 1.0, record).flags
    assert f"{len(rows)} single reading" in next(flag.message for flag in flags if flag.kind == "misread_position")
    assert {flag.kind for flag in flags} - {"misread_position"} == {flag.kind for flag in trial.flags}
