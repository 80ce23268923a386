"""Elongated body theory of a swim, and the wave of the body that it rests on.

`body_wave`, `swim_numbers` and `sways` describe how the body moves, measured and simulated: the first harmonic of every
tail marker, dimensionless numbers, and the sway of the neck.

Elongated body theory comes in three forms (`FORMS`), each fitted to the fit trials by the same search over its one free
number (`fit_ebt`). The forms differ in what they take from the motion of the tail tip, measured or simulated. The
published one takes it in the frame of the head, by the finite difference between neighbouring frames of 60 a second,
which half-pixel tracks inflate (<h_t^2> by up to 80 % at low speed); the others in the frame that swims along, by a
Savitzky-Golay filter (quadratic over a sixth of a second).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import savgol_filter

from fitting.features import FeatureReader, harmonics_of, marker_part
from fitting.forecast import set_off
from fitting.mode import Mode
from fitting.pool import bridged, design, forward_speed, weighted_fit, whole_beats
from fitting.trial import MeasuredTrial
from fitting.trial_model import NO_ROLL
from swimcal.ebt import BETA_BOUNDS, DRAG_BOUNDS, TailMotion, TipMotion, steady_speed, steady_speed_large
from swimcal.flags import Flag
from swimcal.robot import RobotSpec
from tracking.head_frame import HeadFrame, from_head_frame

PUBLISHED_STEP_S = 1 / 60
"""Time between two frames of the published videos."""
WINDOW_S = 10 / 60  # length of the Savitzky-Golay filter: 11 frames of the published videos
ORDER = 2  # degree of the filter
EBT_RATIO_ONLY = "ebt_ratio_only"
"""The flag that names what is not identifiable in elongated body theory; every fit of it has it."""
_MOSTLY_NOISE = 0.6  # share of <h_t^2> as published that is no beat; the public trials have 0.18 to 0.53
FROM_TWIN = ", twin's tail"  # after the name of a form that predicts from the tail of the twin


# The wave of the body.


class BodyWave(NamedTuple):
    """First harmonic of the lateral motion of each tail marker, in the head frame.

    Attributes:
        markers: names of the t tail markers, from head to fin.
        amplitude_m: (t,) m.
    """

    markers: tuple[str, ...]
    amplitude_m: np.ndarray


class SwimNumbers(NamedTuple):
    """Dimensionless numbers (Gazzola, Argentina and Mahadevan, Nature Physics 10 (2014)) of a swim after its warm-up.

    The role of a trial changes none of them: U and A are those of the whole swim, not of the rest that is scored.

    Attributes:
        amplitude_m: A, half the excursion of the hindmost marker in the pool, peak to peak, m.
        swimming_number: Sw = omega A L / nu, L the body length.
        reynolds: Re = U L / nu.
        strouhal: St = f 2 A / U; nan when the robot does not swim forward.
    """

    amplitude_m: float
    swimming_number: float
    reynolds: float
    strouhal: float


def body_wave(trial: MeasuredTrial, head: HeadFrame) -> BodyWave:
    """Return the body wave of a trial over its kept frames.

    Args:
        trial: n frames of m markers.
        head: (n, m, 2) the head frame of the trial itself, or of a simulation of it.
    """
    tail = list(trial.tail)
    frames = trial.kept
    lateral = head.shape_m[frames][:, tail, 1]  # (k, t)
    weight = np.where(np.isfinite(lateral), (trial.weight[frames][:, tail] > 0).astype(float), 0.0)
    columns = design(trial.time_s[frames], trial.frequency.hz, harmonics=3)
    fitted = weighted_fit(columns, lateral, weight)
    first = fitted[2] - 1j * fitted[3]  # (t,) complex amplitude: lateral = Re(first exp(i omega t))
    return BodyWave(tuple(trial.markers[i] for i in tail), np.abs(first))


def excursion(reader: FeatureReader, position_m: np.ndarray, marker: int) -> float:
    """Measure how far a marker swings across the course of the fish in the pool, peak to peak.

    The course is smooth: a path cubic in time, along a heading quadratic in time. The head's own sway and yaw count, as
    in the literature on Strouhal numbers: in the head's frame the tail of this fish swings about twice as far.

    Args:
        reader: reader of the frames that count.
        position_m: (n, m, 2) markers in these frames, on the pool, m.
        marker: index of the marker.

    Returns:
        Twice the amplitude of its first harmonic, m.
    """
    return 2 * float(abs(harmonics_of(reader(position_m))[marker, 1, 0]))


def swim_numbers(trial: MeasuredTrial, robot: RobotSpec) -> SwimNumbers:
    """Compute the dimensionless numbers of a measured swim."""
    whole = trial.with_role("fit")
    wide = excursion(FeatureReader.of(whole), whole.position_m[whole.kept], whole.hindmost)
    return _numbers(wide / 2, trial.frequency.hz, whole.speed, robot)


def simulated_numbers(trial: MeasuredTrial, head: HeadFrame, frequency_hz: float, robot: RobotSpec) -> SwimNumbers:
    """Compute the dimensionless numbers of a simulation of a trial.

    Args:
        trial: the trial, n frames.
        head: (n, m, 2) head frame of the simulation.
        frequency_hz: turns of the simulated crank a second.
        robot: the robot.
    """
    whole = trial.with_role("fit")
    reader = FeatureReader.of(whole)
    turn_rad = trial.crank_rad(reader.time_s, frequency_hz)
    everything = replace(reader, turn_rad=turn_rad, usable=np.ones_like(reader.usable))
    wide = excursion(everything, from_head_frame(head)[whole.kept], whole.hindmost)
    speed = float(forward_speed(trial.time_s, head, whole.kept, frequency_hz))
    return _numbers(wide / 2, frequency_hz, speed, robot)


def _numbers(amplitude: float, frequency_hz: float, speed: float, robot: RobotSpec) -> SwimNumbers:
    viscosity = robot.water.viscosity_pa_s / robot.water.density_kg_m3  # nu, m^2/s
    return SwimNumbers(
        amplitude_m=amplitude,
        swimming_number=2 * np.pi * frequency_hz * amplitude * robot.length_m / viscosity if viscosity > 0 else np.nan,
        reynolds=speed * robot.length_m / viscosity if viscosity > 0 else np.nan,
        strouhal=2 * amplitude * frequency_hz / speed if speed > 0 else np.nan,
    )


class Wave(NamedTuple):
    """First harmonic of a marker's sideways motion; phase ahead of the hindmost marker seen, 0 to 360 degrees."""

    amplitude_m: float
    phase_deg: float


class Sway(NamedTuple):
    """Sway of the neck in one trial.

    Attributes:
        frequency_hz: beats a second.
        measured: sway by the tracks.
        rigid: sway of the calibrated twin, whose hull does not roll.
        rolling: sway of the same twin with the likeliest roll of the fit.
        roll_deg: amplitude of that roll.
    """

    frequency_hz: float
    measured: Wave
    rigid: Wave
    rolling: Wave
    roll_deg: float


def sways(mode: Mode, trials: Sequence[MeasuredTrial]) -> dict[str, Sway]:
    """Return the neck's sway in every trial, fitted or held out, by its name.

    Args:
        mode: the fit.
        trials: the trials.
    """
    first, found = mode.model.trials[0], {}
    for trial in trials:
        neck, hindmost = trial.markers.index("neck"), trial.hindmost
        model = replace(first, trial=trial)
        model = model if trial.role == "fit" else set_off(mode, model)
        swum = model.trajectories(mode.coefficients[None])
        rows = [model.measured, *(each.features_of(swum)[0] for each in (model.rolling(NO_ROLL), model))]
        harmonics = [marker_part(row)[:, 1, 1] + 1j * marker_part(row)[:, 1, 2] for row in rows]  # (m,) each
        roll = abs(harmonics[2][neck] - harmonics[1][neck]) / first.twin.robot.marker_positions_m(("neck",))[0, 2]
        measured, rigid, rolling = (_wave(each[neck], each[hindmost]) for each in harmonics)
        found[trial.name] = Sway(trial.frequency.hz, measured, rigid, rolling, float(np.degrees(roll)))
    return found


def _wave(harmonic: complex, reference: complex) -> Wave:
    phase = np.degrees(np.angle(harmonic / reference)) % 360
    return Wave(float(abs(harmonic)), float(phase))


# The motion of the tail, as the theory reads it.


@dataclass(frozen=True, eq=False)
class TailSwim:
    """Motion of one swim's tail, as elongated body theory needs it.

    Attributes:
        time_s: (n,) s.
        tip_m: (n, 2, 2) the last two markers in the head frame, relative to the nose, m.
        pool_m: (n, 2, 2) the same two in the pool, m.
        heading_rad: (n,) direction of nose -> neck in the pool, unwrapped.
        weight: (n, 2) 0 leaves a sample out.
        used: (n,) the whole beats looked at.
        frequency_hz: beats a second.
    """

    time_s: np.ndarray
    tip_m: np.ndarray
    pool_m: np.ndarray
    heading_rad: np.ndarray
    weight: np.ndarray
    used: np.ndarray
    frequency_hz: float


def measured_tail(trial: MeasuredTrial, frames: np.ndarray) -> TailSwim:
    """Return the tail of a measured trial over whole beats.

    A single marker on the tail has no weight: the slope at the tip takes two.

    Args:
        trial: the trial.
        frames: (n,) frames to look at.
    """
    tail = _last_two(trial.tail)
    return TailSwim(
        time_s=trial.time_s,
        tip_m=trial.head.shape_m[:, tail],
        pool_m=trial.position_m[:, tail],
        heading_rad=trial.head.heading_rad,
        weight=trial.weight[:, tail] * (len(trial.tail) > 1),
        used=whole_beats(trial.time_s, frames, trial.frequency.hz),
        frequency_hz=trial.frequency.hz,
    )


def simulated_tail(
    time_s: np.ndarray, head: HeadFrame, tail: Sequence[int], frames: np.ndarray, frequency_hz: float
) -> TailSwim:
    """Return the tail of one simulated swim.

    Args:
        time_s: (n,) s.
        head: (n, m, 2) head frame of the swim.
        tail: indices of the markers behind the head.
        frames: (n,) frames to look at.
        frequency_hz: beats a second.
    """
    last = _last_two(tail)
    return TailSwim(
        time_s=time_s,
        tip_m=head.shape_m[:, last],
        pool_m=from_head_frame(head)[:, last],
        heading_rad=head.heading_rad,
        weight=np.full((len(time_s), 2), float(len(tail) > 1)),
        used=whole_beats(time_s, frames, frequency_hz),
        frequency_hz=frequency_hz,
    )


def _last_two(tail: Sequence[int]) -> list[int]:
    return [*tail[:1], *tail][-2:]


def published_motion(swim: TailSwim) -> TailMotion:
    """Return <h_t^2> and <h_x^2> in the head frame, h_t by finite differences over a published frame.

    Over the frames of a faster camera the same noise of the tracks would make a larger h_t.
    """
    good = (swim.weight > 0) & np.isfinite(swim.tip_m).all(axis=-1) & swim.used[:, None]
    step = max(1, round(PUBLISHED_STEP_S / float(np.median(np.diff(swim.time_s)))))  # frames
    rate = (swim.tip_m[step:, 1, 1] - swim.tip_m[:-step, 1, 1]) / (swim.time_s[step:] - swim.time_s[:-step])
    along, aside = np.moveaxis(swim.tip_m[:, 1] - swim.tip_m[:, 0], -1, 0)
    sloped = good.all(axis=1) & (np.abs(along) > 1e-6)
    seen = rate[good[step:, 1] & good[:-step, 1]], aside[sloped] / along[sloped]
    return TailMotion(*(np.array((each**2).mean() if len(each) else np.nan) for each in seen))


def noise_flags(trial: MeasuredTrial) -> tuple[Flag, ...]:
    """Flag a swim whose tail speed, as published, is mostly noise of the tracks: no harmonic of its beat makes it."""
    swim = measured_tail(trial, trial.kept)
    aside = swim.tip_m[..., 1]
    columns = design(swim.time_s, swim.frequency_hz, harmonics=3)
    weight = swim.weight * swim.used[:, None] * np.isfinite(aside)
    beat = np.stack([swim.tip_m[..., 0], columns @ weighted_fit(columns, np.nan_to_num(aside), weight)], axis=-1)
    whole, of_beat = (float(published_motion(each).lateral_speed_sq) for each in (swim, replace(swim, tip_m=beat)))
    share = 1 - of_beat / whole if whole > 0 else 0.0
    if not share > _MOSTLY_NOISE:
        return ()
    message = (
        f"{100 * share:.0f} % of the squared tail speed that elongated body theory as published takes is no beat but "
        "noise of the tracks: its speed for this swim is wrong. Its smoothed form is there for that"
    )
    return (Flag("ebt_noise", message=message),)


def pool_motion(swim: TailSwim) -> TailMotion:
    """Return <h_t^2> and <h_x^2> in the frame that swims along, as Lighthill has h: with the recoil of the head.

    In the head's frame the tail of this fish swings about twice as far.
    """
    tip = tip_motion(swim)
    return TailMotion((tip.lateral_speed**2).mean(), (np.tan(tip.angle_rad) ** 2).mean())


def tip_motion(swim: TailSwim) -> TipMotion:
    """Return the motion of the tip in the frame that swims along.

    Smoothed velocities are turned by the trend of the heading. The result is one sample of nan where the tip is never
    seen.
    """
    used = swim.used & (swim.weight > 0).all(axis=1) & np.isfinite(swim.pool_m).all(axis=(1, 2))
    if not used.any():
        return TipMotion(*np.full((3, 1), np.nan))
    columns = design(swim.time_s, swim.frequency_hz, harmonics=2)
    weight = (swim.used & np.isfinite(swim.heading_rad)).astype(float)[:, None]
    # The heading less its beat (n,) is a straight line through the whole beats.
    trend = columns[:, :2] @ weighted_fit(columns, swim.heading_rad[:, None], weight)[:2, 0]
    forward = -np.stack([np.cos(trend), np.sin(trend)], axis=1)  # (n, 2), against nose -> neck
    aside = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    velocity = _smooth(swim.pool_m, swim.time_s, 1)[:, 1]
    place = _smooth(swim.pool_m, swim.time_s, 0)
    tangent = place[:, 0] - place[:, 1]  # pointing forward
    ahead, lateral = (velocity * forward).sum(axis=1)[used], (velocity * aside).sum(axis=1)[used]
    angle = np.arctan2((tangent * aside).sum(axis=1), (tangent * forward).sum(axis=1))[used]
    return TipMotion(ahead - ahead.mean(), lateral - lateral.mean(), angle - angle.mean())


def _smooth(series_m: np.ndarray, time_s: np.ndarray, derivative: int) -> np.ndarray:
    """Smooth series (n, 2, 2) or take their time derivative; missing samples are interpolated before."""
    flat = bridged(time_s, series_m.reshape(len(series_m), -1))
    step = float(np.median(np.diff(time_s)))
    window = max(2 * round(WINDOW_S / 2 / step) + 1, ORDER + 1 + ORDER % 2)
    window = min(window, len(flat) - 1 + len(flat) % 2)
    smooth = savgol_filter(flat, window, min(ORDER, window - 1), deriv=derivative, delta=step, axis=0)
    return smooth.reshape(series_m.shape)


# The forms of the theory, and their fit.


@dataclass(frozen=True)
class EbtForm:
    """One form of the theory.

    Attributes:
        name: name in results.
        label: name for people.
        motion: extracts what the form needs from a tail.
        speed: computes the steady speed (m/s) for that motion, a robot, beta and c_D.
    """

    name: str
    label: str
    motion: Callable[[TailSwim], Any]
    speed: Callable[[Any, RobotSpec, float, float], Any]


PUBLISHED = EbtForm("published", "steady, in the head's frame (as published)", published_motion, steady_speed)
SMOOTHED = EbtForm("smoothed", "steady, in the pool, smoothed", pool_motion, steady_speed)
LARGE = EbtForm("large", "large amplitude, smoothed derivative", tip_motion, steady_speed_large)
FORMS = (PUBLISHED, SMOOTHED, LARGE)


@dataclass(frozen=True)
class EbtFit:
    """Elongated body theory with its two numbers, of which only the ratio is identifiable.

    Attributes:
        form: the form of the theory.
        beta: shape factor of the added mass, kept at 1 within its published bounds [0.9, 1.1].
        drag_coefficient: c_D, on the reference area of the robot, within its published bounds [0, 10].
        flags: that only the ratio is identifiable, and others.
    """

    form: EbtForm
    beta: float
    drag_coefficient: float
    flags: tuple[Flag, ...] = ()

    def speed(self, swim: TailSwim, robot: RobotSpec) -> float:
        """Return the steady speed for a measured or simulated tail, m/s."""
        return float(self.form.speed(self.form.motion(swim), robot, self.beta, self.drag_coefficient))


def fit_ebt(form: EbtForm, swims: Sequence[TailSwim], speeds: np.ndarray, robot: RobotSpec) -> EbtFit:
    """Fit c_D / beta to speeds by least squares; trials that do not show the tail tip are left out.

    Args:
        form: the form of the theory.
        swims: tails of the t trials.
        speeds: (t,) measured speeds, m/s.
        robot: the robot.
    """
    motions = [form.motion(swim) for swim in swims]
    seen = np.array([np.isfinite(float(form.speed(motion, robot, 1.0, 1.0))) for motion in motions])
    if not seen.any():
        message = (
            "no elongated body theory to compare with: it needs the slope at the tail tip, and the last two markers of "
            "the tail are usable together in no fit trial"
        )
        return EbtFit(form, float("nan"), float("nan"), (Flag("no_ebt", message=message),))

    def misfit(ratio: float) -> float:
        predicted = np.array([float(form.speed(motion, robot, 1.0, ratio)) for motion in motions])
        return float(((predicted - speeds)[seen] ** 2).sum())

    highest = DRAG_BOUNDS[1] / BETA_BOUNDS[0]
    grid = np.concatenate([[0.0], np.geomspace(1e-3, highest, 200)])
    best = int(np.argmin([misfit(ratio) for ratio in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(misfit, bounds=(low, high), method="bounded", options={"xatol": 1e-6})
    ratio = float(found.x)
    beta = min(1.0, DRAG_BOUNDS[1] / ratio) if ratio > 0 else 1.0
    return EbtFit(form, beta, ratio * beta, _flags(ratio, highest))


def fit_every_form(trials: Sequence[MeasuredTrial], robot: RobotSpec) -> dict[str, EbtFit]:
    """Fit each form to the same trials, by its name."""
    tails = [measured_tail(trial, trial.kept) for trial in trials]
    measured = np.array([trial.speed for trial in trials])
    return {form.name: fit_ebt(form, tails, measured, robot) for form in FORMS}


def model_speeds(
    trial: MeasuredTrial, simulated: HeadFrame, ebts: Mapping[str, EbtFit], robot: RobotSpec
) -> dict[str, float]:
    """Return the forward speed over the kept whole beats of a trial by the name of every model, m/s.

    "twin" is the twin whose simulation is given; each form of the theory has its name for the measured tail, and
    "<form>, twin's tail" for that of the twin, as it forecasts without the measured one.

    Args:
        trial: the trial.
        simulated: (n, m, 2) head frame of the twin.
        ebts: the forms of the theory, by name.
        robot: the robot.
    """
    tails = {
        "": measured_tail(trial, trial.kept),
        FROM_TWIN: simulated_tail(trial.time_s, simulated, trial.tail, trial.kept, trial.frequency.hz),
    }
    twin = float(forward_speed(trial.time_s, simulated, trial.kept, trial.frequency.hz))
    theory = {form + whose: ebt.speed(tail, robot) for whose, tail in tails.items() for form, ebt in ebts.items()}
    return {"twin": twin, **theory}


def _flags(ratio: float, highest: float) -> tuple[Flag, ...]:
    only_ratio = "only c_D / beta is identifiable from the speed; beta is kept at 1"
    flags = [Flag(EBT_RATIO_ONLY, message=f"EBT: {only_ratio} (c_D / beta = {ratio:.3g})")]
    if ratio < 1e-3 or ratio > 0.999 * highest:
        flags.append(Flag("at_bound", message=f"EBT: c_D / beta = {ratio:.3g} is at its bound"))
    return tuple(flags)
