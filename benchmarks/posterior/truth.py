"""Sessions drawn from the prior, with their truth: two swims of a robot, tracked with errors that last.

They are made by the twin itself; of a varied session no trial is quite like the twin, nor like the other. In a gapped
session markers are unseen for a while, or throughout.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.measure_trial import measure_trial
from fitting.phase import speed_from_rest
from fitting.picture_scale import with_common_scale
from fitting.structure import assumed, uncertainties_of
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.mjcf import COEFFICIENT_BOUNDS, SWIM, FluidCoefficients
from swimcal.robot import RobotSpec, load_robot
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.twin import Twin
from swimsynth.disturbances import Stream, TrackingNoise
from swimsynth.plan import SyntheticCamera, SyntheticPlan, SyntheticTrial, trial_name
from swimsynth.session import track_as_filmed
from swimsynth.simulate import simulate_swims

SLOWEST_HZ = 0.5
FASTEST_HZ = 1.4
APART_HZ = 0.3  # The two frequencies differ by at least this much.
SECONDS = 5.0
LEAST_M_S = 0.01  # A robot that is slower from rest is not informative.
GLUED_SD_M = 0.001  # A marker is off its place on the body by this, each way.
# It has the scale of the published videos, and room for any course.
CAMERA = SyntheticCamera(width_px=8000, height_px=8000)
NOISE = TrackingNoise()
MOST_SHARED = 0.8  # Neighbours share at most this part of the tracks' errors.
# In time steps of the twin: with a sixteenth, Kutta lift was still 0.3 standard deviations off.
STEP = 1 / 128
# Standard deviations between the trials of a varied session.
TURNING_RAD_S = 0.03
SIDEWAYS_M_S = 0.005
REGISTRATION_RAD = 0.02  # registration of the head frame
FASTER_SHARE = 0.03
# Gaps of one trial of a gapped session.
_NEVER_SEEN = 0.3  # probability that one tail marker is never seen
_GAP_SHARE = (0.1, 0.6)  # share of the trial for which one or two tail markers are unseen
_HEAD_GAP_S = (0.1, 0.6)  # duration for which nose or neck is unseen
_LOST_SHARE = 0.05  # share of all samples that are lost one by one
_COURSE_DEGREE = 3  # degree of the smooth path that turns and drifts
_FITTED = 2  # number of fitted trials
_TRIES = 16  # This many coefficients are tried at once.


@dataclass(frozen=True, eq=False)
class DrawnSession:
    """A session and its truth."""

    seed: int  # seed that it was drawn with
    truth: FluidCoefficients  # true coefficients
    trials: list[MeasuredTrial]  # two swims as measured, by a session that believes every marker to be in its place
    held_out: list[MeasuredTrial]  # further swims
    twin: Twin  # twin of the robot as the session believes it to be
    robot: RobotSpec  # robot that swam
    noise: TrackingNoise  # noise that its tracks were made with
    varied: bool = False  # whether trials differ in trim, registration of the head frame and speed
    gapped: bool = False  # whether markers are unseen for a while, or throughout


def draw_session(
    seed: int,
    workers: int = 0,
    seconds: float = SECONDS,
    held_out_hz: Sequence[float] = (),
    step: float = STEP,
    varied: bool = False,
    gapped: bool = False,
) -> DrawnSession:
    """Draw a session from the prior of the posterior and of its nuisances.

    Coefficients are uniform over the box, of those with which the robot swims forward from rest: by at least 1 cm/s at
    both frequencies, and at all at half the slower, as the posterior takes for granted. Frequencies are uniform from
    0.5 to 1.4 Hz, at least 0.3 Hz apart; phases and headings are uniform. Each marker sits off its place on the body by
    1 mm (standard deviation, each way); hinges and crank arm are off by what the posterior allows for where nobody
    measured them. The share of the tracks' errors that neighbours have in common is uniform from 0 to 0.8. The trials
    are simulated with steps so fine that they no longer matter.

    Args:
        seed: seed of all draws.
        workers: number of threads; 0 for all cores.
        seconds: duration of each trial.
        held_out_hz: frequencies of further swims.
        step: step of the simulation of the truth, in steps of the twin.
        varied: whether trials differ in trim, registration of the head frame and speed.
        gapped: whether markers are unseen for a while, or throughout.
    """
    random = np.random.default_rng([seed, 6])
    nominal = load_robot()
    twin = Twin(nominal, FISHSIM_MARKERS, workers=workers)
    frequency_hz = _draw_frequencies(random)
    truth = forward_swimmer(twin, frequency_hz, random)
    robot = _reglue(_build(nominal, seed), random)
    noise = NOISE.model_copy(update={"shared": float(random.uniform(0.0, MOST_SHARED))})
    plan = SyntheticPlan(
        trials=tuple(_plan_trial(float(hz), seconds, random) for hz in (*frequency_hz, *held_out_hz)),
        seed=seed,
        robot=robot,
        timestep_s=step * SWIM.timestep_s,
        coefficients=truth,
        noise=noise,
        camera=CAMERA,
    )
    camera = CameraSpec(fps=plan.camera.fps, scale_length_m=nominal.scale_length_m)
    swims = _measure(plan, camera, nominal, varied, gapped)
    return DrawnSession(
        seed=seed,
        truth=truth,
        trials=swims[:_FITTED],
        held_out=swims[_FITTED:],
        twin=twin,
        robot=robot,
        noise=noise,
        varied=varied,
        gapped=gapped,
    )


def _draw_frequencies(random: np.random.Generator) -> np.ndarray:
    """Draw (2,) frequencies, one a fitted trial, uniform over all pairs that are far enough apart, Hz."""
    while True:
        pair = random.uniform(SLOWEST_HZ, FASTEST_HZ, 2)
        if abs(pair[1] - pair[0]) >= APART_HZ:
            return pair


def forward_swimmer(twin: Twin, frequency_hz: np.ndarray, random: np.random.Generator) -> FluidCoefficients:
    """Draw coefficients, uniform over the box, with which the robot swims forward from rest at (2,) frequencies.

    Its crank starts at an angle of its own, which the fit does not know.
    """
    while True:
        drawn, phase_rad = random.uniform(*COEFFICIENT_BOUNDS, (_TRIES, 5)), float(random.uniform(0.0, 2 * np.pi))
        with np.errstate(invalid="ignore"):
            speeds = speed_from_rest(twin, drawn, frequency_hz, phase_rad)
        forward = np.flatnonzero((speeds > LEAST_M_S).all(axis=1))
        if len(forward):
            return FluidCoefficients(*map(float, drawn[forward[0]]))


def _build(robot: RobotSpec, seed: int) -> RobotSpec:
    """Draw the robot as it was built: off in what nobody measured."""
    random = np.random.default_rng([seed, 9])
    for doubt in uncertainties_of(assumed(robot).sources):
        robot = doubt.robot(robot, doubt.sd * float(random.standard_normal()))
    return robot


def _reglue(robot: RobotSpec, random: np.random.Generator) -> RobotSpec:
    """Draw the robot with its markers off their places, along and across the body."""
    markers = {}
    for name, marker in robot.markers.items():
        x, y, z = marker.position_m
        along, across = GLUED_SD_M * random.standard_normal(2)
        markers[name] = marker.model_copy(update={"position_m": (x + along, y + across, z)})
    return robot.model_copy(update={"markers": markers})


def _plan_trial(hz: float, seconds: float, random: np.random.Generator) -> SyntheticTrial:
    phase_rad, heading_rad = random.uniform(0.0, 2 * np.pi, 2)
    return SyntheticTrial(
        name=trial_name("f", hz),
        frequency_hz=hz,
        commanded_hz=hz,
        seconds=seconds,
        phase_rad=float(phase_rad),
        heading_rad=float(heading_rad),
    )


def _measure(
    plan: SyntheticPlan, camera: CameraSpec, nominal: RobotSpec, varied: bool, gapped: bool
) -> list[MeasuredTrial]:
    """Measure the trials of a plan as a session that knows the nominal robot alone does."""
    trials = []
    for number, swim in enumerate(simulate_swims(plan)):
        position_px = swim.position_px
        if varied:
            random = np.random.default_rng([plan.seed, 11, number])
            position_px = _vary(position_px, swim.time_s, plan.camera.px_per_m, random)
        if gapped:
            hidden = _draw_gaps(swim.time_s, np.random.default_rng([plan.seed, 12, number]))
            position_px = np.where(hidden[..., None], np.nan, position_px)
        tracks, _ = track_as_filmed(swim.trial, position_px, plan, Stream.SWIM_TRACKER.of(plan.seed, number))
        trial = TrialSpec(name=swim.trial.name, kind="swim", commanded_hz=swim.trial.commanded_hz)
        trials.append(measure_trial(trial, tracks, camera, nominal, plan.warmup_s))
    return with_common_scale(trials, camera.scale_length_m)


def _vary(position_px: np.ndarray, time_s: np.ndarray, px_per_m: float, random: np.random.Generator) -> np.ndarray:
    """Return (n, m, 2) markers of a trial that also turns, slips and swims faster, its nose off the body's line.

    The smooth path of the fish is laid anew; what it does about that path stays, but turns along.
    """
    sd = (TURNING_RAD_S, SIDEWAYS_M_S, REGISTRATION_RAD, FASTER_SHARE)
    turning, sideways, registration, faster = sd * random.standard_normal(4)
    place = position_px[..., 0] + 1j * position_px[..., 1]  # (n, m)
    nose, neck = (FISHSIM_MARKERS.index(name) for name in ("nose", "neck"))
    place[:, nose] = place[:, neck] + np.exp(1j * registration) * (place[:, nose] - place[:, neck])
    middle = place.mean(axis=1)
    path = np.polynomial.Polynomial.fit(time_s, middle, _COURSE_DEGREE)(time_s)
    turned, velocity = np.exp(1j * turning * time_s), (1 + faster) * np.gradient(path, time_s)
    ahead = (place[:, nose] - place[:, neck]).mean()
    velocity = turned * (velocity + 1j * sideways * px_per_m * ahead / abs(ahead))
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s)
    moved = path[0] + np.concatenate([[0.0], np.cumsum(steps)])
    place = moved[:, None] + turned[:, None] * (place - path[:, None])
    return np.stack([place.real, place.imag], axis=-1)


def _draw_gaps(time_s: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Draw which samples (n, m) of a trial are unseen: stretches of one or two tail markers, of a head marker, singles.

    One tail marker may never be seen. A trial that is not usable so stops its session, which then counts as failed.
    """
    n, m = len(time_s), len(FISHSIM_MARKERS)
    hidden = random.random((n, m)) < _LOST_SHARE
    tail = random.permutation([i for i, name in enumerate(FISHSIM_MARKERS) if name not in ("nose", "neck")])
    for marker in tail[: random.integers(1, 3)]:
        hidden[_draw_stretch(n, float(random.uniform(*_GAP_SHARE)), random), marker] = True
    head = FISHSIM_MARKERS.index(str(random.choice(["nose", "neck"])))
    hidden[_draw_stretch(n, float(random.uniform(*_HEAD_GAP_S)) / float(time_s[-1]), random), head] = True
    if random.random() < _NEVER_SEEN:
        hidden[:, tail[-1]] = True
    return hidden


def _draw_stretch(frames: int, share: float, random: np.random.Generator) -> slice:
    """Draw a stretch of this share of all frames."""
    length = round(share * frames)
    first = int(random.integers(0, frames - length + 1))
    return slice(first, first + length)
