"""The plan of a synthetic session: everything that decides its numbers, validated when it is made.

A `SyntheticPlan` holds the robot, the coefficients, the noise, the `SyntheticCamera` and the trials, driven by the
motor (`SyntheticTrial`) or let go (`SyntheticDecay`). `in_image` gives the place of a trial in the image: placed,
turned and scaled as planned, and all of it in sight.

`default_plan` is behind `calib new --synthetic` and `datasets/sample`: swim trials, dry runs, free decays.
"""

from collections.abc import Iterable, Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_serializer, model_validator

from fitting.phase import sets_off_forward
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import FaultCollector
from swimcal.mjcf import FluidCoefficients
from swimcal.robot import NonNegative, Positive, RobotSpec, load_robot
from swimcal.session_file import Name, TrialRole
from swimcal.toml import TomlTable
from swimcal.twin import Twin
from swimsynth.disturbances import RISE_S, SyntheticMotor, TrackingNoise

Pixels = tuple[float, float]  # x to the right, y down

PLAUSIBLE_COEFFICIENTS = FluidCoefficients(0.4, 2.0, 6.0, 4.0, 1.0)
"""Coefficients with which the fish swims forward, 0.06 to 0.20 m/s from 0.4 to 1.3 Hz.

None is at a bound or near the published ones.
"""

KUTTA_LIFTS = (PLAUSIBLE_COEFFICIENTS.kutta_lift, 6.0, 8.0, 10.0)
"""Lifts that are tried in turn for another robot."""

SPEEDS_HZ = (0.4, 0.6, 0.8, 1.0, 1.3)
"""Commanded crank turns a second: the range of the published swim trials."""
FIT_HZ = (0.4, 1.3)
FEWEST_S = 5.0  # shortest swim
FEWEST_BEATS = 3.2  # fewest beats of any swim

DRY_HZ = (0.6, 0.9)
BENT_RAD = ((0.18, 0.21, 0.21, 0.17, 0.08), (-0.2, -0.22, -0.18, -0.12, -0.05), (0.12, 0.17, 0.22, 0.2, 0.12))
"""Angles of five hinges before each free decay. The tail rings for little over one period: one decay is too few."""
BETWEEN_VIDEOS_S = 96.0
"""Time from the start of one dry run's video to that of the next."""


def trial_name(prefix: str, hz: float) -> str:
    """Name a trial after the turns of its crank a second: `f0_80`."""
    return f"{prefix}{hz:.2f}".replace(".", "_")


class SyntheticCamera(TomlTable):
    """A camera that looks straight down: no lens, no parallax, exact clock; by default in the published scale."""

    fps: Positive = 60.0
    px_per_m: Positive = 965.0
    width_px: Annotated[int, Field(gt=0)] = 3840
    height_px: Annotated[int, Field(gt=0)] = 2160

    def frame_times(self, seconds: float) -> np.ndarray:
        """Compute the (n,) times of the frames of a trial from the first, s."""
        return np.arange(int(round(seconds * self.fps, 6)) + 1) / self.fps


class Merge(TomlTable):
    """A track fault: the box sits on another marker, at a constant offset.

    Attributes:
        marker, onto: the marker of the box, and the one that it sits on.
        first, frames: the first wrong frame, counted from 0, and how many in a row.
        kind: kind of the flag that it should raise.
        offset_px: offset of the box from the other's.
    """

    marker: str
    first: Annotated[int, Field(ge=0)]
    frames: Annotated[int, Field(ge=1)]
    kind: Literal["merged_markers"] = "merged_markers"
    onto: str
    offset_px: Pixels = (1.5, -1.0)

    @model_validator(mode="after")
    def _two_markers(self) -> "Merge":
        if self.onto == self.marker:
            raise ValueError(f"{self.marker} cannot merge onto itself; name another marker in `onto`")
        return self

    @property
    def last(self) -> int:
        """The number of the last wrong frame."""
        return self.first + self.frames - 1

    def apply(self, position_px: np.ndarray, markers: tuple[str, ...]) -> None:
        """Write the fault into (n, m, 2) positions, px."""
        wrong = slice(self.first, self.first + self.frames)
        position_px[wrong, markers.index(self.marker)] = position_px[wrong, markers.index(self.onto)] + self.offset_px


class SyntheticTrial(TomlTable):
    """A trial in which the crank turns: a swim, or a dry run.

    Attributes:
        frequency_hz: turns a second that the crank is driven with.
        commanded_hz: the command as the session states it.
        seconds: from the first frame to the last.
        phase_rad: crank angle in the first frame.
        heading_rad: where the nose points in the first frame, counter-clockwise from the right of the image.
        start_px: the nose in the first frame; None centres the trial in the image.
        faults: faults of the tracker.
        motor: the motor that drives the trial from rest to rest, and its log; None for a crank that turns evenly all
            the time.
    """

    name: Name
    frequency_hz: Positive
    commanded_hz: Positive
    seconds: Positive
    role: TrialRole = "fit"
    phase_rad: float = 0.0
    heading_rad: float = 0.0
    start_px: Pixels | None = None
    faults: tuple[Merge, ...] = ()
    motor: SyntheticMotor | None = None

    def time_s(self, camera: SyntheticCamera) -> np.ndarray:
        """Compute the (n,) times of the frames from the first, s."""
        return camera.frame_times(self.seconds)


class SyntheticDecay(TomlTable):
    """A free decay: head clamped in air, tendons off, the tail held bent and let go while the camera runs.

    Attributes:
        release_s: time from the first frame until the tail is let go, which need not be in a frame.
        bent_rad: hinge angles until then, from head to fin; by default the fin's marker of the built-in fish is 0.10 m
            aside.
        heading_rad, start_px, faults: as for `SyntheticTrial`.
    """

    name: Name
    seconds: Positive = 3.0
    release_s: Positive = 0.507
    bent_rad: tuple[float, ...] = (0.18, 0.21, 0.21, 0.17, 0.08)
    role: TrialRole = "fit"
    heading_rad: float = 0.0
    start_px: Pixels | None = None
    faults: tuple[Merge, ...] = ()

    def time_s(self, camera: SyntheticCamera) -> np.ndarray:
        """Compute the (n,) times of the frames from the first, s."""
        return camera.frame_times(self.seconds)


PlannedTrial = SyntheticTrial | SyntheticDecay
"""Any trial of a plan."""


class SyntheticPlan(TomlTable):
    """The plan of a session that is to be made.

    Attributes:
        robot: None for the built-in fish.
        markers: the tracked markers, in the order of the columns.
        coefficients: the true coefficients, which a fit is to find.
        warmup_s: left out of every comparison, as the session states.
        run_in_s: simulated before the first frame, so that a trial begins in the middle of a developed swim. A trial
            with a motor has none: the motor drives it from rest to rest.
        start_speed_m_s: forward speed at the start of the run-in, or a push in the first frame. The twin swims backward
            as well, and from rest the crank's phase decides between the two.
        timestep_s: time step of the simulated swim trials; a third of the twin's own, so that no fit can reproduce a
            session to the bit.
        air_timestep_s: the same for dry runs and free decays.
    """

    name: str = "synthetic"
    trials: tuple[SyntheticTrial, ...] = ()
    dry_runs: tuple[SyntheticTrial, ...] = ()
    free_decays: tuple[SyntheticDecay, ...] = ()
    seed: Annotated[int, Field(ge=0)] = 0
    robot: RobotSpec | None = None
    markers: tuple[str, ...] = FISHSIM_MARKERS
    coefficients: FluidCoefficients = PLAUSIBLE_COEFFICIENTS
    noise: TrackingNoise = TrackingNoise()
    camera: SyntheticCamera = SyntheticCamera()
    warmup_s: NonNegative = 1.0
    run_in_s: NonNegative = 8.0
    start_speed_m_s: float = 0.15
    timestep_s: Positive = 0.0015
    air_timestep_s: Positive = 0.0005

    @property
    def swimmer(self) -> RobotSpec:
        """The robot that swims."""
        return self.robot or load_robot()

    @property
    def all_trials(self) -> tuple[PlannedTrial, ...]:
        """Swims, dry runs and free decays."""
        return (*self.trials, *self.dry_runs, *self.free_decays)

    @field_serializer("coefficients")
    def _by_name(self, coefficients: FluidCoefficients) -> dict[str, float]:
        return coefficients._asdict()

    @model_validator(mode="after")
    def _fits_together(self) -> "SyntheticPlan":
        if faults := list(_faults(self)):
            raise ValueError("; ".join(faults))
        return self


def _faults(plan: SyntheticPlan) -> Iterator[str]:
    names = [trial.name for trial in plan.all_trials]
    if not names or len(set(names)) < len(names):
        yield f"trials: found {', '.join(names) or 'none'}, expected at least one, each with a name of its own"
    if not set(plan.markers) <= set(plan.swimmer.markers) or not {"nose", "neck"} <= set(plan.markers):
        there = ", ".join(plan.swimmer.markers)
        yield f"markers: found {', '.join(plan.markers)}, expected nose, neck and more of {plan.swimmer.name}: {there}"
    for trial in plan.all_trials:
        frames = len(trial.time_s(plan.camera))
        if any(fault.last >= frames or not {fault.marker, fault.onto} <= set(plan.markers) for fault in trial.faults):
            yield f"trial {trial.name}: found a track fault outside its {frames} frames or of no marker of the plan"
    for run in (*plan.trials, *plan.dry_runs):
        least_s = plan.warmup_s if run.motor is None else run.motor.ends_s
        if run.seconds < least_s or run.seconds <= plan.warmup_s:
            yield f"trial {run.name}: found {run.seconds:g} s, expected more than {least_s:.1f} s of warm-up or motor"
        if run.motor is not None and run.motor.drive_s <= RISE_S + 1 / run.frequency_hz:
            yield f"trial {run.name}: found a drive of {run.motor.drive_s:g} s, expected {RISE_S:g} s and one turn more"
    for decay in plan.free_decays:
        if len(decay.bent_rad) != len(plan.swimmer.hinges) or decay.release_s >= decay.seconds:
            yield f"trial {decay.name}: expected an angle for each hinge and a release within its {decay.seconds:g} s"


def in_image(marker_m: np.ndarray, trial: PlannedTrial, plan: SyntheticPlan) -> np.ndarray:
    """Project markers (n, m, 2) seen from above, m, y up, to (n, m, 2) pixels, y down.

    Args:
        marker_m: (n, m, 2) markers seen from above, m, y up.
        trial: the planned trial, whose start and heading are used.
        plan: the plan of the session.
    """
    camera, nose, neck = plan.camera, plan.markers.index("nose"), plan.markers.index("neck")
    axis = marker_m[0, nose] - marker_m[0, neck]
    turn = trial.heading_rad - np.arctan2(axis[1], axis[0])
    cos, sin = np.cos(turn), np.sin(turn)
    turned = (marker_m - marker_m[0, nose]) @ np.array([[cos, sin], [-sin, cos]])  # rows times the transpose
    position_px = camera.px_per_m * turned * np.array([1.0, -1.0])
    if trial.start_px is not None:
        return position_px + np.array(trial.start_px)
    centre = (np.array([camera.width_px, camera.height_px]) - 1) / 2
    return position_px + centre - (position_px.max(axis=(0, 1)) + position_px.min(axis=(0, 1))) / 2


def check_in_image(trials: Iterable[tuple[str, np.ndarray]], camera: SyntheticCamera) -> None:
    """Check that every marker stays in the image, for trials given as names with (n, m, 2) pixels.

    Raises:
        swimcal.errors.InputError: names each trial that leaves the image.
    """
    faults = FaultCollector("plan of the synthetic session")
    for name, position_px in trials:
        low, high = position_px.min(axis=(0, 1)), position_px.max(axis=(0, 1))
        if (low < 0).any() or (high > [camera.width_px - 1, camera.height_px - 1]).any():
            found = f"x {low[0]:.0f} to {high[0]:.0f}, y {low[1]:.0f} to {high[1]:.0f} px"
            expected = f"x 0 to {camera.width_px - 1}, y 0 to {camera.height_px - 1} px"
            step = "Shorten it, turn its heading_rad, or leave start_px out to centre it."
            where, what = f"trial {name}", "the fish leaves the image"
            faults.add(where, what, found=found, expected=expected, next_step=step)
    faults.raise_if_any()


def default_plan(seed: int = 0, robot: RobotSpec | None = None) -> SyntheticPlan:
    """Plan five swim trials of a robot, two dry runs with a motor log, and three free decays.

    The slowest and the fastest of the swim trials are to fit, those between them are held out. In the fastest the last
    but two of the markers merges onto the next, in the built-in fish tail_4 onto tail_5.

    Args:
        seed: draws noise, crank phases, headings and the motor's clock.
        robot: None for the built-in fish; another one is bent and tracked at its own hinges and markers, in water in
            which it swims forward from rest (`water_for`).
    """
    markers = FISHSIM_MARKERS if robot is None else tuple(robot.markers)
    random = np.random.default_rng([seed, len(SPEEDS_HZ)])
    phases, headings = 2 * np.pi * random.random((2, len(SPEEDS_HZ)))
    trials = [_swim(*settings, markers) for settings in zip(SPEEDS_HZ, phases, headings, strict=True)]
    of_motor = np.random.default_rng([seed, len(SPEEDS_HZ), len(DRY_HZ)])
    dry_runs, decays = _dry_experiments(of_motor, BENT_RAD if robot is None else _bend(len(robot.hinges)))
    water = PLAUSIBLE_COEFFICIENTS if robot is None else water_for(robot)
    return SyntheticPlan(
        coefficients=water,
        trials=tuple(trials),
        dry_runs=dry_runs,
        free_decays=decays,
        seed=seed,
        robot=robot,
        markers=markers,
    )


def water_for(robot: RobotSpec) -> FluidCoefficients:
    """Return the plausible coefficients, with the least Kutta lift with which a robot swims forward from rest.

    It does so at the slowest beat, as the fit asks of every twin; in other water it would go backward, and the fit
    refuse the truth. Where no lift is enough the plausible one stays.

    Args:
        robot: the robot.

    Raises:
        SimulationDiverged: its tail cannot be brought into its starting poses.
    """
    tried = [PLAUSIBLE_COEFFICIENTS._replace(kutta_lift=lift) for lift in KUTTA_LIFTS]
    forward = sets_off_forward(Twin(robot), np.array(tried), min(SPEEDS_HZ))
    return next((water for water, goes in zip(tried, forward, strict=True) if goes), PLAUSIBLE_COEFFICIENTS)


def _bend(hinges: int) -> tuple[tuple[float, ...], ...]:
    """Spread `BENT_RAD` along a tail of this many hinges, so that the tip is as far off."""
    along, places = np.linspace(0.0, 1.0, len(BENT_RAD[0])), np.linspace(0.0, 1.0, hinges)
    less = len(BENT_RAD[0]) / hinges
    return tuple(tuple(round(float(b) * less, 4) for b in np.interp(places, along, bent)) for bent in BENT_RAD)


def _swim(commanded_hz: float, phase_rad: float, heading_rad: float, markers: tuple[str, ...]) -> SyntheticTrial:
    fastest = commanded_hz == max(SPEEDS_HZ) and not {"nose", "neck"} & set(markers[-3:-1])
    return SyntheticTrial(
        name=trial_name("f", commanded_hz),
        frequency_hz=commanded_hz,
        commanded_hz=commanded_hz,
        seconds=max(FEWEST_S, round(FEWEST_BEATS / commanded_hz, 1)),
        role="fit" if commanded_hz in FIT_HZ else "holdout",
        phase_rad=round(float(phase_rad), 3),
        heading_rad=round(float(heading_rad), 3),
        faults=(Merge(marker=markers[-3], onto=markers[-2], first=120, frames=20),) if fastest else (),
    )


def _dry_experiments(
    random: np.random.Generator, bends_rad: tuple[tuple[float, ...], ...]
) -> tuple[tuple[SyntheticTrial, ...], tuple[SyntheticDecay, ...]]:
    """Plan dry runs and free decays of one robot in one clamp under one camera, its motor logged by one computer."""
    heading_rad = round(float(2 * np.pi * random.random()), 3)
    first_s, rate = round(float(random.uniform(2000, 9000)), 3), 1 + round(float(random.uniform(-8e-5, 8e-5)), 6)
    runs = []
    for number, hz in enumerate(DRY_HZ):
        starts_s = round(float(random.uniform(0.5, 1.2)), 3)
        clock_s = round(first_s + BETWEEN_VIDEOS_S * number, 3)
        motor = SyntheticMotor(starts_s=starts_s, clock_offset_s=clock_s, clock_rate=rate)
        run = SyntheticTrial(
            name=trial_name("dry_", hz),
            frequency_hz=hz,
            commanded_hz=hz,
            seconds=round(motor.ends_s + 0.4, 1),
            phase_rad=round(float(2 * np.pi * random.random()), 3),
            heading_rad=heading_rad,
            motor=motor,
        )
        runs.append(run)
    bends = enumerate(bends_rad, start=1)
    return tuple(runs), tuple(SyntheticDecay(name=f"decay_{n}", heading_rad=heading_rad, bent_rad=b) for n, b in bends)
