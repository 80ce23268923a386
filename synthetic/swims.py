"""The true swim trials and dry runs of a plan: simulated from before the first frame, seen by camera and motor."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.speed import forward_speed
from swimmer import Runs, Scene, Trajectories, Twin
from swimmer.mjcf import DRY, SWIM
from synthetic.motor_log import DrivenMotor, TrueMotor
from synthetic.plan import SyntheticPlan
from synthetic.streams import Stream
from synthetic.trials import SyntheticTrial
from synthetic.view import check_in_image, in_image
from tracking import to_head_frame


@dataclass(frozen=True, eq=False)
class TrueRun:
    """One swim or dry run without any error of a tracker.

    Attributes:
        trial: the planned trial.
        time_s: (n,) times from the first frame, s.
        position_px: (n, m, 2) markers in the image, x to the right and y down.
        head: (n, 3) x, y (m) and yaw (rad) of the head's frame in the twin's pool; zeros in a dry run.
        hinges_rad: (n, h) angles of the hinges.
        frequency_hz: mean turns a second of the crank between the first and the last frame; of the steady stretch of
            the drive where a motor is logged.
        phase_rad: crank angle in the first frame, from 0 to 2 pi.
        speed_m_s: forward speed, the slope over the whole beats after the warm-up, or of the steady stretch.
        motor: the motor that is logged; None for a crank that turns evenly.
    """

    trial: SyntheticTrial
    time_s: np.ndarray
    position_px: np.ndarray
    head: np.ndarray
    hinges_rad: np.ndarray
    frequency_hz: float
    phase_rad: float
    speed_m_s: float
    motor: TrueMotor | None = None


def simulate_swims(plan: SyntheticPlan) -> tuple[TrueRun, ...]:
    """Simulate all swim trials of a plan in one batch.

    Raises:
        session.InputError: a swim leaves the image.
        session.SimulationDiverged: the planned motion is unstable.
    """
    planned = _plan(plan, plan.trials, Stream.SWIM_MOTOR)
    return _simulate(plan, planned, replace(SWIM, timestep_s=plan.timestep_s))


def simulate_dry_runs(plan: SyntheticPlan) -> tuple[TrueRun, ...]:
    """Simulate all dry runs of a plan in one batch: the head clamped, in air.

    Raises:
        session.InputError: the fish does not fit into the image.
        session.SimulationDiverged: the planned motion is unstable.
    """
    planned = _plan(plan, plan.dry_runs, Stream.DRY_MOTOR)
    return _simulate(plan, planned, replace(DRY, timestep_s=plan.air_timestep_s))


@dataclass(frozen=True, eq=False)
class _RunPlan:
    """A trial before it is simulated: the times (n,) of its frames, and how long is simulated before the first, s."""

    trial: SyntheticTrial
    frames_s: np.ndarray
    run_in_s: float
    motor: DrivenMotor | None

    @classmethod
    def of(cls, plan: SyntheticPlan, trial: SyntheticTrial, random: np.random.Generator) -> "_RunPlan":
        frames_s = trial.time_s(plan.camera)
        if trial.motor is None:
            return cls(trial, frames_s, plan.run_in_s, None)
        return cls(trial, frames_s, 0.0, DrivenMotor.of(trial, trial.motor, random))

    @property
    def sampled_s(self) -> np.ndarray:
        """Times (n + r,) of the frames, then of the readings of the motor, since the start of the simulation, s."""
        readings_s = np.zeros(0) if self.motor is None else self.motor.sampled_s
        return self.run_in_s + np.concatenate([self.frames_s, readings_s])


def _plan(plan: SyntheticPlan, trials: tuple[SyntheticTrial, ...], stream: Stream) -> list[_RunPlan]:
    return [_RunPlan.of(plan, trial, stream.of(plan.seed, number)) for number, trial in enumerate(trials)]


def _simulate(plan: SyntheticPlan, planned: list[_RunPlan], scene: Scene) -> tuple[TrueRun, ...]:
    if not planned:
        return ()
    run_in_s = np.array([each.run_in_s for each in planned])
    frequency_hz = np.array([each.trial.frequency_hz for each in planned])
    runs = Runs(
        coefficients=np.tile(np.array(plan.coefficients, float), (len(planned), 1)),
        frequency_hz=frequency_hz,
        phase_rad=np.array([each.trial.phase_rad for each in planned]) - 2 * np.pi * frequency_hz * run_in_s,
        velocity=np.tile([-plan.start_speed_m_s, 0.0, 0.0], (len(planned), 1)),  # the robot swims towards -x
        turns=tuple(None if each.motor is None else each.motor.turn for each in planned),
    )
    samples = [each.sampled_s for each in planned]
    longest = max(map(len, samples))
    time_s = np.array([np.pad(sample, (0, longest - len(sample)), mode="edge") for sample in samples])
    seen = Twin(plan.swimmer, plan.markers, scene).simulate(runs, time_s)
    true = tuple(_true_run(plan, each, seen, number) for number, each in enumerate(planned))
    check_in_image([(run.trial.name, run.position_px) for run in true], plan.camera)
    return true


def _true_run(plan: SyntheticPlan, planned: _RunPlan, seen: Trajectories, number: int) -> TrueRun:
    trial, time_s = planned.trial, planned.frames_s
    frames = slice(0, len(time_s))
    marker_m, crank_rad = seen.marker_m[number, frames], seen.crank_rad[number]
    motor = None if planned.motor is None else planned.motor.read(crank_rad[len(time_s) : len(planned.sampled_s)])
    turning, kept = _mark_counted(time_s, plan, motor)
    first, last = np.flatnonzero(turning)[[0, -1]]
    head = to_head_frame(marker_m, plan.markers.index("nose"), plan.markers.index("neck"))
    return TrueRun(
        trial=trial,
        time_s=time_s,
        position_px=in_image(marker_m, trial, plan),
        head=seen.head[number, frames],
        hinges_rad=seen.hinges_rad[number, frames],
        frequency_hz=float((crank_rad[last] - crank_rad[first]) / (2 * np.pi * (time_s[last] - time_s[first]))),
        phase_rad=float(crank_rad[0] % (2 * np.pi)),
        speed_m_s=float(forward_speed(time_s, head, kept, trial.frequency_hz)),
        motor=motor,
    )


def _mark_counted(time_s: np.ndarray, plan: SyntheticPlan, motor: TrueMotor | None) -> tuple[np.ndarray, np.ndarray]:
    """Mark the (n,) frames over which the frequency of the trial is taken, and those over which its speed is."""
    if motor is None:
        return np.full(len(time_s), True), time_s >= plan.warmup_s - 1e-9
    steady = (time_s >= motor.steady_s[0]) & (time_s <= motor.steady_s[1])
    return steady, steady
