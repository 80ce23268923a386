"""A measured dry run, ready to be compared with the tail's motion: places, weights, beat, scored frames."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from fitting.frequency import SwimFrequency, estimate_frequency
from fitting.in_pool import head_frame, head_is_trusted, in_pool
from fitting.motor_clock import MotorRecord
from fitting.trial import SCORED_S
from session import CameraSpec, Flag, NotEnoughData, TrialSpec
from session.tracks import markers_of
from swimmer import RobotSpec

WARMUP_S = 1.0  # time in which the motor comes up to speed
HEAD_MOVES_M = 0.005  # motion of nose and neck together; a clamped head and a tracker's noise stay below
_FEWEST_FRAMES = 12


@dataclass(frozen=True, eq=False)
class DryTrial:
    """One dry run: head clamped in air, the crank turning steadily.

    It holds only the n frames after the warm-up; with a usable motor log, those of its steady drive.

    Attributes:
        name: name of the trial.
        commanded_hz: commanded turns a second; None if not known.
        markers: names of the m markers.
        time_s: (n,) from the first frame of the recording, or of the drive where a motor log gives it, s.
        even_s: (n,) when the crank would be where it is if it turned evenly at its mean speed; `time_s` without a log.
        place_m: (n, m) x + i y on the pool, right-handed seen from above, m; nan where missing.
        head_m: (n, m) x + i y in the head frame (published normaliser), the nose starting at 0, m.
        weight: (n, m) 0 where a sample is flagged or missing.
        scored: (n,) the first 4 s, over which the published distance is taken.
        frequency: frequency of the tail's beat, without a model.
        tail: indices of the markers behind the head.
        flags: flags of tracks, beat and motor.
        motor: record of the motor; None without a log.
    """

    name: str
    commanded_hz: float | None
    markers: tuple[str, ...]
    time_s: np.ndarray
    even_s: np.ndarray
    place_m: np.ndarray
    head_m: np.ndarray
    weight: np.ndarray
    scored: np.ndarray
    frequency: SwimFrequency
    tail: tuple[int, ...]
    flags: tuple[Flag, ...]
    motor: MotorRecord | None = None

    @property
    def head_weight(self) -> np.ndarray:
        """Weight of each sample (n, m), 0 also where nose or neck is not trusted, so that the head frame is not."""
        trusted = head_is_trusted(self.markers, self.weight) & np.isfinite(self.head_m).any(axis=1)
        return np.where(np.isfinite(self.head_m), self.weight * trusted[:, None], 0.0)


def measure_dry_run(
    spec: TrialSpec,
    tracks: xr.Dataset,
    camera: CameraSpec,
    robot: RobotSpec,
    warmup_s: float = WARMUP_S,
    motor: MotorRecord | None = None,
) -> DryTrial:
    """Check and scale the tracks of a dry run and find its beat.

    Args:
        spec: the run.
        tracks: n frames of it.
        camera: the camera that filmed it.
        robot: the robot.
        warmup_s: time left out of every comparison, unless a usable log shows when the drive is steady.
        motor: record of the motor (`fitting.motor_clock.read_motor`); only the frames of its steady drive are then
            used, and how unevenly it turned. By default the crank turns evenly.

    Raises:
        NotEnoughData: no tail marker, too few frames after the warm-up, less than one beat, or a drive that was not
            filmed.
    """
    first_frame = 0
    if motor is not None and motor.usable:
        first_frame, tracks = motor.driven(tracks, spec.name)
        warmup_s = 0.0
    position_m, _, quality, tail = in_pool(tracks, camera, robot, f"trial {spec.name}")
    since_s = tracks.time.values - tracks.time.values[0]
    kept = since_s >= warmup_s - 1e-9
    if kept.sum() < _FEWEST_FRAMES:
        raise NotEnoughData(
            f"trial {spec.name}: {since_s[-1]:.2f} s leave {int(kept.sum())} frames after {warmup_s:g} s of "
            f"warm-up; at least {_FEWEST_FRAMES} are needed: shorten [fit] warmup_s or record longer"
        )
    time_s, weight = since_s[kept], quality.weight[kept]
    head = head_frame(markers_of(tracks), position_m[kept])
    lateral = head.shape_m[:, tail, 1]
    frequency = estimate_frequency(time_s, lateral, weight[:, tail], spec.commanded_hz)
    motor = None if motor is None else motor.against(frequency, tracks.time.values[kept])
    even_s = time_s
    if motor is not None and motor.usable:
        even_s = _even(since_s, motor.turn.angle(tracks.time.values))[kept]
    of_frames = (*quality.flags, *frequency.flags, *_moving_head(position_m[kept], markers_of(tracks)))
    trial = DryTrial(
        name=spec.name,
        commanded_hz=spec.commanded_hz,
        markers=markers_of(tracks),
        time_s=time_s,
        even_s=even_s,
        place_m=_as_complex(position_m[kept]),
        head_m=_as_complex(head.position_m),
        weight=np.where(np.isfinite(position_m[kept]).all(axis=-1), weight, 0.0),
        scored=time_s < time_s[0] + SCORED_S - 1e-9,
        frequency=frequency,
        tail=tuple(tail),
        flags=(*(flag.later(first_frame) for flag in of_frames), *(motor.flags if motor else ())),
        motor=motor,
    )
    if not trial.head_weight[trial.scored].any():
        raise NotEnoughData(f"trial {spec.name}: nose and neck are never both trusted in the first {SCORED_S:g} s")
    return trial


def _even(time_s: np.ndarray, crank_rad: np.ndarray) -> np.ndarray:
    """Return the times (n,) at which an even turn of the same mean speed would reach each angle."""
    slope, start = np.polyfit(time_s, crank_rad, 1)
    return (crank_rad - start) / slope


def _moving_head(position_m: np.ndarray, markers: tuple[str, ...]) -> tuple[Flag, ...]:
    head = position_m[:, [markers.index("nose"), markers.index("neck")]].mean(axis=1)
    head = head[np.isfinite(head).all(axis=1)]
    moved = float(np.percentile(np.linalg.norm(head - np.median(head, axis=0), axis=1), 90)) if len(head) else 0.0
    if moved <= HEAD_MOVES_M:
        return ()
    message = f"the head moves by {1000 * moved:.0f} mm; a dry run needs it clamped: is this a swim?"
    return (Flag("head_moves", message=message),)


def _as_complex(position_m: np.ndarray) -> np.ndarray:
    return position_m[..., 0] + 1j * position_m[..., 1]
