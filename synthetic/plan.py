"""The plan of a synthetic session: everything that decides its numbers, validated when it is made."""

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field, field_serializer, model_validator

from session.create import FISHSIM_MARKERS
from session.toml_source import Table
from swimmer import FluidCoefficients, RobotSpec, load_robot
from swimmer.robot import NonNegative, Positive
from synthetic.motor import RISE_S
from synthetic.noise import TrackingNoise
from synthetic.trials import PlannedTrial, SyntheticCamera, SyntheticDecay, SyntheticTrial

PLAUSIBLE_COEFFICIENTS = FluidCoefficients(0.4, 2.0, 6.0, 4.0, 1.0)
"""Coefficients with which the fish swims forward, 0.06 to 0.20 m/s from 0.4 to 1.3 Hz.

None is at a bound or near the published ones.
"""


class SyntheticPlan(Table):
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
