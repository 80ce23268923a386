"""The plan of a synthetic session: everything that decides its numbers, validated when it is made."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field, field_serializer, model_validator

from session import FISHSIM_MARKERS, Table
from session.session_file import Name, TrialRole
from swimmer import FluidCoefficients, RobotSpec, load_robot
from swimmer.robot import NonNegative, Positive
from synthetic.faults import Merge, Pixels, TrackFault
from synthetic.noise import TrackingNoise

PLAUSIBLE_COEFFICIENTS = FluidCoefficients(0.4, 2.0, 6.0, 4.0, 1.0)
"""None at a bound or near the published ones; the fish swims forward, 0.06 to 0.20 m/s from 0.4 to 1.3 Hz."""


class SyntheticCamera(Table):
    """A camera that looks straight down: no lens, no parallax, exact clock.

    Attributes:
        fps: frames a second.
        px_per_m: scale; the default is that of the published videos.
        width_px, height_px: size of the image.
    """

    fps: Positive = 60.0
    px_per_m: Positive = 965.0
    width_px: Annotated[int, Field(gt=0)] = 3840
    height_px: Annotated[int, Field(gt=0)] = 2160


class SyntheticTrial(Table):
    """One swim.

    Attributes:
        name: of the trial and its file.
        frequency_hz: turns a second that the crank is driven with.
        commanded_hz: what the session says it was told.
        seconds: from the first frame to the last.
        role: "fit" or "holdout".
        phase_rad: crank angle in the first frame.
        heading_rad: where the nose points in the first frame, counter-clockwise from the right of the image.
        start_px: the nose in the first frame; None centres the swim in the image.
        faults: of the tracker.
    """

    name: Name
    frequency_hz: Positive
    commanded_hz: Positive
    seconds: Positive
    role: TrialRole = "fit"
    phase_rad: float = 0.0
    heading_rad: float = 0.0
    start_px: Pixels | None = None
    faults: tuple[TrackFault, ...] = ()

    def time_s(self, camera: SyntheticCamera) -> np.ndarray:
        """(n,) time of each frame from the first, s."""
        return np.arange(int(round(self.seconds * camera.fps, 6)) + 1) / camera.fps


class SyntheticPlan(Table):
    """A session to be made.

    Attributes:
        name: of the session.
        trials: the swims.
        seed: of every random draw.
        robot: None for the built-in fish.
        markers: the tracked ones, in the order of the columns.
        coefficients: the truth to be found.
        noise: of the tracker.
        camera: clock and scale.
        warmup_s: left out of every comparison, as the session says.
        run_in_s: simulated before the first frame, so that a trial begins in the middle of a developed swim.
        start_speed_m_s: forward, at the start of the run-in. Slow swims of the twin have a backward steady
            state as well, and from rest the crank's phase decides between the two.
        timestep_s: of the simulation; a third of the twin's own, so that no fit can reproduce a session to
            the bit.

    Raises:
        pydantic.ValidationError: a `ValueError` that names every fault of the plan.
    """

    name: str = "synthetic"
    trials: Annotated[tuple[SyntheticTrial, ...], Field(min_length=1)]
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

    @property
    def swimmer(self) -> RobotSpec:
        """The robot that swims."""
        return self.robot or load_robot()

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
    names = [trial.name for trial in plan.trials]
    if len(set(names)) < len(names):
        yield f"trials: found {', '.join(names)}, expected a name of its own for each"
    for trial in plan.trials:
        if trial.seconds <= plan.warmup_s:
            expected = f"expected more than {plan.warmup_s:g} s of warm-up"
            yield f"trial {trial.name}: found {trial.seconds:g} s, {expected}"
        last = len(trial.time_s(plan.camera)) - 1
        for fault in trial.faults:
            place = f"trial {trial.name}, {fault.kind}"
            if fault.last > last:
                yield f"{place}: found frame {fault.last}, expected frames 0 to {last}"
            for name in (fault.marker, *([fault.onto] if isinstance(fault, Merge) else [])):
                if name not in plan.markers:
                    yield f"{place}: found marker {name!r}, expected one of {', '.join(plan.markers)}"
