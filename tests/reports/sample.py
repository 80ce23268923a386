"""A small calibration made by hand: a travelling wave for each trial, and a twin that is a little off."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fitting.baselines import SpeedSweep
from fitting.calibration import CalibratedTrial, Calibration
from fitting.calibration_file import PublishedResult, published_result
from fitting.coefficient_fit import CoefficientFit
from fitting.covariance import MEDIANS
from fitting.ebt import FORMS, EbtFit
from fitting.forecast import Scatter
from fitting.frequency import SwimFrequency
from fitting.mode import SearchEnd
from fitting.phase import score
from fitting.pool import tail_markers
from fitting.published import PublishedFit
from fitting.session_forecast import Forecast, ForecastTrial, SessionForecast
from fitting.structure import assumed
from fitting.trial import MeasuredTrial
from fitting.trial_model import NO_ROLL
from reports.context import ReportContext
from swimcal.flags import Flag
from swimcal.mjcf import FluidCoefficients
from swimcal.results import Provenance
from swimcal.robot import RobotSpec, load_robot
from swimcal.session import Session, TrialSpec
from swimcal.session_file import CameraSpec
from tests.fitting.swims import filmed
from tracking.head_frame import HeadFrame

MARKERS = ("nose", "neck", "dorsal_fin", "tail_1", "tail_3", "tail_5", "caudal_fin")
FPS = 30.0
ROLES = {"slow": ("holdout", 0.5), "medium": ("fit", 0.8), "fast": ("fit", 1.3)}
BEST = FluidCoefficients(0.4, 7.8, 2.8, 3.8, 0.0)
SPEEDS_OVER_HZ = {
    "twin": 0.11,
    "published": 0.13,
    "smoothed": 0.125,
    "large": 0.12,
    "published, twin's tail": 0.128,
    "smoothed, twin's tail": 0.123,
    "large, twin's tail": 0.121,
}


def made_session(name: str = "pool", **changes: Any) -> Session:
    """The session of `made_calibration`; its files are not there."""
    folder = Path("/sessions") / "pool"
    trials = tuple(
        TrialSpec(trial, "swim", tracks=folder / f"{trial}.csv", commanded_hz=hz, role=role)
        for trial, (role, hz) in ROLES.items()
    )
    session = Session(folder, name, None, CameraSpec(FPS, 0.142), MARKERS, warmup_s=1.0, seed=0, trials=trials)
    return replace(session, **changes)


def made_provenance() -> Provenance:
    inputs = {"session.toml": "a" * 64, "slow.csv": "b" * 64}
    return Provenance("4.0.0", "c" * 64, inputs, seed=7, effort="quick", program="swimcal 0.1.0")


def made_calibration(names: tuple[str, ...] = tuple(ROLES), *, flagged: bool = True) -> Calibration:
    """Trials of these names; `flagged` gives the slow one a merge, a lost head, a frequency off command."""
    robot = load_robot()
    trials = tuple(made_trial(robot, name, flagged=flagged and name == "slow") for name in names)
    hz = np.linspace(0.4, 1.5, 12)
    flags = (Flag("ebt_ratio_only", message="EBT: only c_D / beta is identifiable from the speed"),)
    speeds = {"published": 0.12 * hz, "smoothed": 0.118 * hz, "large": 0.115 * hz}
    sweep = SpeedSweep(hz, 0.1 * hz, speeds, fitted_hz=(0.8, 1.3))
    ebts = {form.name: EbtFit(form, 1.0, ratio, flags) for form, ratio in zip(FORMS, (1.63, 1.15, 0.33), strict=True)}
    return Calibration(assumed(robot), made_fit(), ebts, trials, sweep, made_forecasts(trials))


def made_context(calibration: Calibration | None = None) -> ReportContext:
    """What the sections of a report of this calibration read."""
    return ReportContext(made_session(), calibration or made_calibration(), made_provenance())


def made_fit() -> CoefficientFit:
    """Three starts: the best at a bound, another as likely elsewhere, one that swims backward."""
    found = (BEST, BEST._replace(angular_drag=6.0), BEST._replace(kutta_lift=9.0))
    ends = tuple(
        SearchEnd(np.full(5, 5.0 - rank), np.array(end), density, rank == 0, rank < 2)
        for rank, (end, density) in enumerate(zip(found, (100.0, 99.5, 101.0), strict=True))
    )
    flags = (Flag("at_bound", message="magnus_lift = 0 is at its bound 0: the data favour a value beyond it"),)
    interval = np.column_stack([0.9 * np.array(BEST), 1.1 * np.array(BEST)])
    return CoefficientFit(
        BEST, interval, MEDIANS, NO_ROLL, ends, simulations=321, seconds=4.2, time_step_s=0.0045, flags=flags
    )


def made_published(calibration: Calibration) -> PublishedResult:
    """Closer to the markers, and off in the speed."""
    fit = PublishedFit(BEST._replace(slender_drag=3.0), np.zeros(2), 0.02, True, 321, 4.2)
    return published_result(fit, calibration.trials)


def made_forecasts(trials: tuple[CalibratedTrial, ...]) -> SessionForecast:
    """Bands of 5 mm/s about speeds that are 4 mm/s too fast; a line is off by 2 mm/s."""
    return SessionForecast(Scatter(), {trial.measured.name: made_forecast(trial) for trial in trials})


def made_forecast(trial: CalibratedTrial) -> ForecastTrial:
    measured = trial.measured
    speed, role = measured.speed, measured.role
    banded = Forecast(speed + 0.004, (speed - 0.001, speed + 0.009), 12.0, 6.0, 0.9)
    twin = {"twin": Forecast(trial.speed_twin, None, 40.0, 20.0), "ebt_published": Forecast(trial.speed_ebt)}
    if role == "fit":
        return ForecastTrial(role, measured.frequency.hz, speed, {**twin, "repeat": banded})
    baselines = {
        "continued": Forecast(speed - 0.001, None, 9.0, 5.0),
        "line": Forecast(speed + 0.002),
        "power_law": Forecast(speed - 0.003),
        "constant_stride": Forecast(speed + 0.01),
    }
    own = {"given_frequency": banded, "after_two_beats": replace(banded, speed=speed + 0.003)}
    return ForecastTrial(role, measured.frequency.hz, speed, {**twin, **own, **baselines})


def made_trial(robot: RobotSpec, name: str, *, flagged: bool = False, seconds: float = 6.0) -> CalibratedTrial:
    """One trial next to its twin."""
    role, hz = ROLES.get(name, ("fit", 1.0))
    time_s = np.arange(0.0, seconds, 1 / FPS)
    measured = measured_trial(robot, name, role, hz, time_s)
    if flagged:
        measured = with_faults(measured)
    twin = swimming(robot, time_s, hz, speed=0.11 * hz, size=1.15)
    extrapolated = Flag("extrapolated", message=f"{hz:.3f} Hz is outside the fitted 0.800 to 1.300 Hz")
    return CalibratedTrial(
        measured=measured,
        simulated=twin,
        phase_rad=3.5,
        simulated_hz=hz * 1.001,
        scores=score(measured, twin),
        speeds={name: factor * hz for name, factor in SPEEDS_OVER_HZ.items()},
        flags=(*measured.flags, *((extrapolated,) if role == "holdout" else ())),
    )


def measured_trial(robot: RobotSpec, name: str, role: str, hz: float, time_s: np.ndarray) -> MeasuredTrial:
    head = swimming(robot, time_s, hz, speed=0.1 * hz)
    frequency = SwimFrequency(hz, 0.0005, 0.0, 0.1, 0.99, hz * float(time_s[-1]), hz)
    known = np.ones(len(time_s), bool) if role == "fit" else time_s < time_s[-1] / 2
    kept = (time_s >= 1.0) if role == "fit" else ~known
    return MeasuredTrial(
        name=name,
        role=role,
        commanded_hz=hz,
        tracks=filmed(MARKERS, time_s, head.position_m, head, 0.00105),
        frequency=frequency,
        start_frequency=frequency,
        start_velocity=np.zeros(3),
        known=known,
        kept=kept,
        scored=kept & (time_s < time_s[kept][0] + 4.0),
        speed=0.1 * hz,
        warmup_s=1.0,
        tail=tuple(tail_markers(robot, MARKERS)),
        flags=(),
    )


def with_faults(trial: MeasuredTrial) -> MeasuredTrial:
    """The trial with a merge of two markers, frames without a head, and a frequency that is off."""
    weight = trial.weight.copy()
    weight[100:140, MARKERS.index("tail_3")] = 0.0
    weight[20:25] = 0.0
    flags = (
        Flag(
            "merged_markers",
            ("tail_3", "tail_1"),
            (100, 139),
            "tail_3 sits on tail_1: 2 px apart, expected 60",
        ),
        Flag("jump", ("neck",), (20, 24), "neck jumps, up to 40 px from where the others put it"),
        Flag("frequency_off_command", message="the tail beats at 0.500 Hz, -25 % off the commanded 0.67 Hz"),
    )
    return replace(trial.seen_as(weight=weight), flags=flags)


def swimming(robot: RobotSpec, time_s: np.ndarray, hz: float, speed: float, size: float = 1.0) -> HeadFrame:
    """A straight head and a tail that bends more towards the fin, swimming forward steadily."""
    place = robot.marker_positions_m(MARKERS)
    behind = np.maximum(place[:, 0] - robot.tail.start_m, 0.0)
    angle = 2 * np.pi * hz * time_s[:, None] - 6.0 * behind
    shape = np.stack(
        [
            np.broadcast_to(place[:, 0] - place[0, 0], angle.shape),
            size * 2.0 * behind**1.5 * np.sin(angle),
        ],
        axis=2,
    )
    path = np.stack([-speed * time_s, np.zeros_like(time_s)], axis=1)
    return HeadFrame(shape + path[:, None], shape, path, np.zeros_like(time_s), path)
