"""Swims, dry runs and free decays of the twin, with their motor logs.

`simulate_swims` and `simulate_dry_runs` start before the first frame; in `simulate_decays` the tail is held bent by a
hand, then let go. `read_motor` reads a motor as `calib capture` does: encoder steps, speed steps, uneven times. Units
of the motor: ROBOTIS e-Manual, XW540-T140-R.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fitting.hinges import DecayTwin
from fitting.pool import forward_speed
from swimcal.errors import SimulationDiverged
from swimcal.mjcf import DRY, FREE_DECAY, SWIM, Scene
from swimcal.motor_log import (
    COMMAND_COLUMNS,
    CURRENT_A,
    MOTOR_COLUMNS,
    SPEED_RAD_S,
    TICKS,
    TURN,
    MotorCommands,
    MotorLog,
)
from swimcal.results import write_whole
from swimcal.runs import CrankTurn, Runs, Trajectories
from swimcal.twin import Twin
from swimsynth.disturbances import MotorDrive, Stream, SyntheticMotor, drive
from swimsynth.plan import SyntheticDecay, SyntheticPlan, SyntheticTrial, check_in_image, in_image
from tracking.head_frame import to_head_frame

PULSE_RAD = TURN / TICKS
VOLTAGE_V = 0.1
_FRICTION_A = 0.25  # current at any speed
_LOAD_A_S = 1.5  # current for each rad/s that the motor lags
_SUPPLY_V = 12.1
_SUPPLY_OHM = 0.3
_WARM_C = 31.0  # temperature at the start
_WARMS_C_S = 0.08  # rise of the temperature a second


def reading_times(motor: SyntheticMotor, drive: MotorDrive, random: np.random.Generator) -> np.ndarray:
    """Draw the (r,) times on the motor's clock, s, at which it is read, from first command to end of schedule."""
    beat_s = np.arange(float(drive.commands.time_s[0]), drive.end_s, motor.reading_s)
    late_s = random.exponential(motor.jitter_s, len(beat_s))
    return beat_s + np.minimum(late_s, 0.8 * motor.reading_s)


def read_motor(drive: MotorDrive, time_s: np.ndarray, crank_rad: np.ndarray, random: np.random.Generator) -> MotorLog:
    """Compute the motor's readings.

    The zero of its encoder is drawn at random: nobody mounts the crank with care.

    Args:
        drive: the commands, and the turn of the shaft.
        time_s: (r,) times of the readings on the motor's clock, s.
        crank_rad: (r,) simulated angles of the shaft at these times.
        random: draws the zero of the encoder and the noise of the current.
    """
    zero_rad = 2 * np.pi * random.random()
    speed_rad_s = np.gradient(crank_rad, time_s)
    lag_rad_s = np.interp(time_s, drive.time_s, drive.reference_rad_s - drive.speed_rad_s)
    turning = np.clip(speed_rad_s / 0.1, -1.0, 1.0)
    current_a = _FRICTION_A * turning + _LOAD_A_S * lag_rad_s + CURRENT_A * random.standard_normal(len(time_s))
    voltage_v = _SUPPLY_V - _SUPPLY_OHM * np.abs(current_a)
    warm_c = _WARM_C + _WARMS_C_S * (time_s - time_s[0])
    return in_steps(time_s, crank_rad + zero_rad, speed_rad_s, current_a, voltage_v, warm_c)


def in_steps(
    time_s: np.ndarray,
    crank_rad: np.ndarray,
    speed_rad_s: np.ndarray,
    current_a: np.ndarray,
    voltage_v: np.ndarray,
    warm_c: np.ndarray,
) -> MotorLog:
    """Round (r,) values of a motor without faults to the steps in which it answers.

    Args:
        time_s: times of the readings, s.
        crank_rad: angles of the shaft.
        speed_rad_s: its speeds.
        current_a: currents.
        voltage_v: supply voltages.
        warm_c: temperatures, degrees Celsius.
    """
    return MotorLog(
        time_s=time_s,
        position_rad=PULSE_RAD * np.floor(crank_rad / PULSE_RAD),
        velocity_rad_s=SPEED_RAD_S * np.round(speed_rad_s / SPEED_RAD_S),
        current_a=CURRENT_A * np.round(current_a / CURRENT_A),
        voltage_v=VOLTAGE_V * np.round(voltage_v / VOLTAGE_V),
        temperature_c=np.round(warm_c),
        error=np.zeros(len(time_s)),
    )


def save_motor_log(path: Path, log: MotorLog) -> None:
    """Write ``<trial>.motor.csv``."""
    rows = np.column_stack([getattr(log, name) for name in MOTOR_COLUMNS])
    lines = (f"{t:.6f},{x:.6f},{v:.5f},{i:.4f},{u:.1f},{c:.0f},{e:.0f}" for t, x, v, i, u, c, e in rows + 0.0)
    write_whole(path, "\n".join([",".join(MOTOR_COLUMNS), *lines, ""]))


def save_commands(path: Path, commands: MotorCommands) -> None:
    """Write ``<trial>.commands.csv``; the motor takes speeds in steps."""
    commanded_rad_s = SPEED_RAD_S * np.round(commands.velocity_rad_s / SPEED_RAD_S) + 0.0
    rows = zip(commands.time_s, commands.part, commanded_rad_s, strict=True)
    write_whole(path, "\n".join([",".join(COMMAND_COLUMNS), *(f"{t:.6f},{part},{v:.5f}" for t, part, v in rows), ""]))


@dataclass(frozen=True, eq=False)
class TrueMotor:
    """The motor of a trial: log and commands on its clock, the steady stretch of the drive on that of the video."""

    log: MotorLog
    commands: MotorCommands
    steady_s: tuple[float, float]


@dataclass(frozen=True, eq=False)
class DrivenMotor:
    """A motor as planned and driven, whose crank is not simulated yet; `readings_s` (r,) are on its clock."""

    motor: SyntheticMotor
    drive: MotorDrive
    readings_s: np.ndarray
    random: np.random.Generator

    @classmethod
    def of(cls, trial: SyntheticTrial, motor: SyntheticMotor, random: np.random.Generator) -> "DrivenMotor":
        """Drive the motor of a trial and draw the times of its readings."""
        driven = drive(motor, trial.commanded_hz, trial.frequency_hz, trial.phase_rad, random)
        return cls(motor, driven, reading_times(motor, driven, random), random)

    @property
    def sampled_s(self) -> np.ndarray:
        """Times (r,) at which the motor is read, on the clock of the video, s."""
        return self.motor.video(self.readings_s)

    @property
    def turn(self) -> CrankTurn:
        """The turn of the crank on the clock of the video."""
        return self.drive.turn.shifted(self.motor.clock_offset_s, self.motor.clock_rate)

    def read(self, crank_rad: np.ndarray) -> TrueMotor:
        """Build the motor's log from the simulated angle of the crank at each reading (r,), rad."""
        start_s, end_s = self.motor.video(np.array(self.drive.steady_s))
        log = read_motor(self.drive, self.readings_s, crank_rad, self.random)
        return TrueMotor(log, self.drive.commands, (float(start_s), float(end_s)))


@dataclass(frozen=True, eq=False)
class TrueDecay:
    """One free decay as planned, without any error of a tracker.

    Attributes:
        trial: the planned trial.
        time_s: (n,) times from the first frame, s.
        position_px: (n, m, 2) markers in the image, x to the right and y down.
    """

    trial: SyntheticDecay
    time_s: np.ndarray
    position_px: np.ndarray


def simulate_decays(plan: SyntheticPlan) -> tuple[TrueDecay, ...]:
    """Simulate all free decays of a plan: head clamped, in air, no tendons, hinges as the robot's file has them.

    Raises:
        swimcal.errors.InputError: the fish does not fit into the image.
        SimulationDiverged: the planned motion is unstable.
    """
    twin = DecayTwin(plan.swimmer, plan.markers, replace(FREE_DECAY, timestep_s=plan.air_timestep_s))
    true = tuple(_true_decay(plan, trial, twin) for trial in plan.free_decays)
    check_in_image([(decay.trial.name, decay.position_px) for decay in true], plan.camera)
    return true


def _true_decay(plan: SyntheticPlan, trial: SyntheticDecay, twin: DecayTwin) -> TrueDecay:
    time_s, tail = trial.time_s(plan.camera), plan.swimmer.tail
    start = np.stack([trial.bent_rad, np.zeros(twin.hinges)])[None]  # (1, 2, h)
    stiffness, damping = np.array([tail.hinge_stiffness_n_m]), np.array([tail.hinge_damping_n_m_s])
    marker_m = twin(stiffness, damping, start, np.maximum(time_s - trial.release_s, 0.0))[0]
    if not np.isfinite(marker_m).all():
        raise SimulationDiverged(
            f"trial {trial.name}: the free decay diverged; expected: a bounded swing. Try a smaller air_timestep_s or "
            "more hinge damping."
        )
    return TrueDecay(trial, time_s, in_image(marker_m, trial, plan))


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
        swimcal.errors.InputError: a swim leaves the image.
        SimulationDiverged: the planned motion is unstable.
    """
    return _simulate(plan, plan.trials, Stream.SWIM_MOTOR, replace(SWIM, timestep_s=plan.timestep_s))


def simulate_dry_runs(plan: SyntheticPlan) -> tuple[TrueRun, ...]:
    """Simulate all dry runs of a plan in one batch: the head clamped, in air.

    Raises:
        swimcal.errors.InputError: the fish does not fit into the image.
        SimulationDiverged: the planned motion is unstable.
    """
    return _simulate(plan, plan.dry_runs, Stream.DRY_MOTOR, replace(DRY, timestep_s=plan.air_timestep_s))


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


def _simulate(
    plan: SyntheticPlan, trials: tuple[SyntheticTrial, ...], stream: Stream, scene: Scene
) -> tuple[TrueRun, ...]:
    if not trials:
        return ()
    planned = [_RunPlan.of(plan, trial, stream.of(plan.seed, number)) for number, trial in enumerate(trials)]
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
