"""The true swims of a plan: simulated from before the first frame, placed in the pool, seen by the camera."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fitting import forward_speed
from session import FaultCollector
from swimmer import Runs, Scene, Trajectories, Twin
from synthetic.plan import SyntheticCamera, SyntheticPlan, SyntheticTrial
from tracking import to_head_frame


@dataclass(frozen=True, eq=False)
class TrueSwim:
    """One swim without any error of a tracker.

    Attributes:
        trial: as planned.
        time_s: (n,) from the first frame, s.
        position_px: (n, m, 2) markers in the image, x to the right and y down.
        head: (n, 3) x, y (m) and yaw (rad) of the head's frame in the twin's pool.
        hinges_rad: (n, h).
        frequency_hz: mean turns a second of the crank between the first and the last frame.
        phase_rad: crank angle in the first frame, from 0 to 2 pi.
        speed_m_s: forward speed, the slope over the whole beats after the warm-up.
    """

    trial: SyntheticTrial
    time_s: np.ndarray
    position_px: np.ndarray
    head: np.ndarray
    hinges_rad: np.ndarray
    frequency_hz: float
    phase_rad: float
    speed_m_s: float


def simulate_swims(plan: SyntheticPlan) -> tuple[TrueSwim, ...]:
    """Simulates all swims of a plan in one batch.

    Raises:
        session.InputError: a swim leaves the image.
        session.SimulationDiverged: the planned motion is unstable.
    """
    frequency = np.array([trial.frequency_hz for trial in plan.trials])
    phase = np.array([trial.phase_rad for trial in plan.trials])
    velocity = [-plan.start_speed_m_s, 0.0, 0.0]  # the robot swims towards -x
    runs = Runs(
        coefficients=np.tile(np.array(plan.coefficients, float), (len(frequency), 1)),
        frequency_hz=frequency,
        phase_rad=phase - 2 * np.pi * frequency * plan.run_in_s,
        velocity=np.tile(velocity, (len(frequency), 1)),
    )
    times = [trial.time_s(plan.camera) for trial in plan.trials]
    twin = Twin(plan.swimmer, plan.markers, Scene(timestep_s=plan.timestep_s))
    seen = twin.simulate(runs, plan.run_in_s + max(times, key=len))
    swims = [
        _swim(plan, trial, time_s, _first_of(seen, number, len(time_s)))
        for number, (trial, time_s) in enumerate(zip(plan.trials, times, strict=True))
    ]
    _check_in_image(swims, plan.camera)
    return tuple(swims)


class _Seen(NamedTuple):
    """A simulation at the frames of its trial: markers (n, m, 2), head (n, 3), hinges (n, h), crank (n,)."""

    marker_m: np.ndarray
    head: np.ndarray
    hinges_rad: np.ndarray
    crank_rad: np.ndarray


def _first_of(seen: Trajectories, number: int, frames: int) -> _Seen:
    return _Seen(
        seen.marker_m[number, :frames],
        seen.head[number, :frames],
        seen.hinges_rad[number, :frames],
        seen.crank_rad[number, :frames],
    )


def _swim(plan: SyntheticPlan, trial: SyntheticTrial, time_s: np.ndarray, seen: _Seen) -> TrueSwim:
    marker_m, crank_rad = seen.marker_m, seen.crank_rad
    nose, neck = plan.markers.index("nose"), plan.markers.index("neck")
    forward_m = to_head_frame(marker_m, nose, neck).forward_m
    kept = time_s >= plan.warmup_s - 1e-9
    return TrueSwim(
        trial=trial,
        time_s=time_s,
        position_px=_in_image(marker_m, nose, neck, trial, plan.camera),
        head=seen.head,
        hinges_rad=seen.hinges_rad,
        frequency_hz=float((crank_rad[-1] - crank_rad[0]) / (2 * np.pi * time_s[-1])),
        phase_rad=float(crank_rad[0] % (2 * np.pi)),
        speed_m_s=float(forward_speed(time_s, forward_m, kept, trial.frequency_hz)),
    )


def _in_image(marker_m: np.ndarray, nose: int, neck: int, trial: SyntheticTrial, camera: SyntheticCamera) -> np.ndarray:
    """(n, m, 2) pixels, y down, of markers (n, m, 2) in the pool, y up."""
    axis = marker_m[0, nose] - marker_m[0, neck]
    turn = trial.heading_rad - np.arctan2(axis[1], axis[0])
    cos, sin = np.cos(turn), np.sin(turn)
    turned = (marker_m - marker_m[0, nose]) @ np.array([[cos, sin], [-sin, cos]])  # rows times the transpose
    position_px = camera.px_per_m * turned * np.array([1.0, -1.0])
    if trial.start_px is not None:
        return position_px + np.array(trial.start_px)
    centre = (np.array([camera.width_px, camera.height_px]) - 1) / 2
    return position_px + centre - (position_px.max(axis=(0, 1)) + position_px.min(axis=(0, 1))) / 2


def _check_in_image(swims: list[TrueSwim], camera: SyntheticCamera) -> None:
    faults = FaultCollector("plan of the synthetic session")
    for swim in swims:
        low, high = swim.position_px.min(axis=(0, 1)), swim.position_px.max(axis=(0, 1))
        if (low < 0).any() or (high > [camera.width_px - 1, camera.height_px - 1]).any():
            faults.add(
                f"trial {swim.trial.name}",
                "the swim leaves the image",
                found=f"x {low[0]:.0f} to {high[0]:.0f}, y {low[1]:.0f} to {high[1]:.0f} px",
                expected=f"x 0 to {camera.width_px - 1}, y 0 to {camera.height_px - 1} px",
                next_step="Shorten it, turn its heading_rad, or leave start_px out to centre it.",
            )
    faults.raise_if_any()
