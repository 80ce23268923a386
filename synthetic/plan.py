"""The plan of a synthetic session: everything that decides its numbers, validated when it is made."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field, field_serializer, model_validator

from session.create import FISHSIM_MARKERS
from session.toml_source import Table
from swimmer import FluidCoefficients, RobotSpec, load_robot
from swimmer.robot import NonNegative, Positive
from synthetic.motor import RISE_S
from synthetic.noise import TrackingNoise
from synthetic.trials import PlannedTrial, SyntheticCamera, SyntheticDecay, SyntheticTrial

PLAUSIBLE_COEFFICIENTS = FluidCoefficients(0.4, 2.0, 6.0, 4.0, 1.0)
"""None at a bound or near the published ones; the fish swims forward, 0.06 to 0.20 m/s from 0.4 to 1.3 Hz."""


class SyntheticPlan(Table):
    """A session to be made.

    Attributes:
        name: of the session.
        trials: the swims.
        dry_runs: trials with the head clamped, in air.
        free_decays: trials in air without tendons.
        seed: of every random draw.
        robot: None for the built-in fish.
        markers: the tracked ones, in the order of the columns.
        coefficients: the truth to be found.
        noise: of the tracker.
        camera: clock and scale.
        warmup_s: left out of every comparison, as the session says.
        run_in_s: simulated before the first frame, so that a trial begins in the middle of a developed swim. A trial
            with a motor has none: the motor drives it from rest to rest.
        start_speed_m_s: forward, at the start of the run-in, or a push in the first frame. The twin swims backward as
            well, and from rest the crank's phase decides between the two.
        timestep_s: of the simulated swims; a third of the twin's own, so that no fit can reproduce a session to
            the bit.
        air_timestep_s: the same for dry runs and free decays.

    Raises:
        pydantic.ValidationError: a `ValueError` that names every fault of the plan.
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
        faults = [*_coefficient_faults(self), *_marker_faults(self), *_trial_faults(self)]
        if faults:
            raise ValueError("; ".join(faults))
        return self


def _coefficient_faults(plan: SyntheticPlan) -> Iterator[str]:
    for name, value in plan.coefficients._asdict().items():
        if not 0 <= value < np.inf:
            yield f"coefficients.{name}: found {value}, expected a number from 0"


def _marker_faults(plan: SyntheticPlan) -> Iterator[str]:
    there = tuple(plan.swimmer.markers)
    for name in plan.markers:
        if name not in there:
            yield f"markers: found {name!r}, expected markers of {plan.swimmer.name}: {', '.join(there)}"
    if len(set(plan.markers)) < len(plan.markers):
        yield "markers: one is named twice, expected each once"
    if missing := {"nose", "neck"} - set(plan.markers):
        yield f"markers: {', '.join(sorted(missing))} missing, expected both: they make the head frame"


def _trial_faults(plan: SyntheticPlan) -> Iterator[str]:
    names = [trial.name for trial in plan.all_trials]
    if not names:
        yield "trials: found none, expected at least one of trials, dry_runs or free_decays"
    if len(set(names)) < len(names):
        yield f"trials: found {', '.join(names)}, expected a name of its own for each"
    for trial in plan.all_trials:
        yield from _track_faults(plan, trial)
    for driven in (*plan.trials, *plan.dry_runs):
        yield from _length_faults(plan, driven)
    for decay in plan.free_decays:
        yield from _decay_faults(plan, decay)


def _track_faults(plan: SyntheticPlan, trial: PlannedTrial) -> Iterator[str]:
    last = len(trial.time_s(plan.camera)) - 1
    for fault in trial.faults:
        place = f"trial {trial.name}, {fault.kind}"
        if fault.last > last:
            yield f"{place}: found frame {fault.last}, expected frames 0 to {last}"
        for name in (fault.marker, fault.onto):
            if name not in plan.markers:
                yield f"{place}: found marker {name!r}, expected one of {', '.join(plan.markers)}"


def _length_faults(plan: SyntheticPlan, trial: SyntheticTrial) -> Iterator[str]:
    found, motor = f"trial {trial.name}: found {trial.seconds:g} s", trial.motor
    if trial.seconds <= plan.warmup_s:
        yield f"{found}, expected more than {plan.warmup_s:g} s of warm-up"
    if motor is not None and trial.seconds < motor.ends_s:
        yield f"{found}, expected at least {motor.ends_s:.1f} s: the video shows the motor's codes and drive"
    if motor is not None and motor.drive_s <= RISE_S + 1 / trial.frequency_hz:
        least = f"expected more than {RISE_S:g} s to come up to speed and one turn"
        yield f"trial {trial.name}: found a drive of {motor.drive_s:g} s, {least}"


def _decay_faults(plan: SyntheticPlan, trial: SyntheticDecay) -> Iterator[str]:
    hinges = len(plan.swimmer.hinges)
    if len(trial.bent_rad) != hinges:
        expected = f"expected one for each of {hinges} hinges"
        yield f"trial {trial.name}, bent_rad: found {len(trial.bent_rad)} angles, {expected}"
    if trial.release_s >= trial.seconds:
        yield f"trial {trial.name}: found a release at {trial.release_s:g} s, expected it within {trial.seconds:g} s"
