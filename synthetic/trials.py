"""The planned trials of a synthetic session, driven by the motor or let go, and the camera that sees them."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from session.session_file import Name, TrialRole
from session.toml_source import Table
from swimmer.robot import Positive
from synthetic.motor import SyntheticMotor

Pixels = tuple[float, float]  # x to the right, y down


def trial_name(prefix: str, hz: float) -> str:
    """Name a trial after the turns of its crank a second: `f0_80`."""
    return f"{prefix}{hz:.2f}".replace(".", "_")


class SyntheticCamera(Table):
    """A camera that looks straight down: no lens, no parallax, exact clock; by default in the published scale."""

    fps: Positive = 60.0
    px_per_m: Positive = 965.0
    width_px: Annotated[int, Field(gt=0)] = 3840
    height_px: Annotated[int, Field(gt=0)] = 2160

    def frame_times(self, seconds: float) -> np.ndarray:
        """Compute the (n,) times of the frames of a trial from the first, s."""
        return np.arange(int(round(seconds * self.fps, 6)) + 1) / self.fps


class Merge(Table):
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


class SyntheticTrial(Table):
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


class SyntheticDecay(Table):
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
