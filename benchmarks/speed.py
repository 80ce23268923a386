"""Speed of the twin, and the error that its time step costs; ratios count, as absolute times vary with machines."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from calib.pipeline import working
from fitting.pool import forward_speed
from swimcal.mjcf import PUBLISHED_COEFFICIENTS, SWIM, FluidCoefficients, build_mjcf
from swimcal.robot import load_robot
from swimcal.runs import Runs
from swimcal.twin import Twin
from tracking.head_frame import HeadFrame, select_head, to_head_frame

FREQUENCIES_HZ = np.round(np.arange(0.3, 2.01, 0.1), 1)
SECONDS = 8.0  # duration of each swim
WARMUP_S = 1.0  # time left out of the comparison
FINER = 8  # ratio of the time step to the finer one
TIME_S = np.arange(0.0, SECONDS, 1 / 60)
START_SPEED_M_S = 0.1
_REPEATS = 7
_CRANK_RAD_S = 2 * np.pi


# An input of the benchmark, not a result: near the optimum `calib fit` finds for the public trials f1_00 and f1_75 with
# MuJoCo 4.0, so a twin that swims like the robot. `--session` measures with a session's own coefficients.
FITTED = FluidCoefficients(0.41, 6.56, 10.0, 4.12, 9.64)


@dataclass(frozen=True)
class StepError:
    """The error that the time step costs for one set of coefficients, against a step eight times finer.

    Attributes:
        name: name of the set.
        coefficients: the coefficients.
        marker_mean_mm: mean distance of markers relative to the nose, in the head frame, at its worst frequency.
        marker_rms_mm: root mean square of the same distance, at its worst frequency.
        marker_max_mm: largest such distance, at its worst frequency.
        speed: largest relative difference in mean forward speed over the frequencies.
        worst_hz: the frequency of that difference.
    """

    name: str
    coefficients: FluidCoefficients
    marker_mean_mm: float
    marker_rms_mm: float
    marker_max_mm: float
    speed: float
    worst_hz: float


@dataclass(frozen=True)
class SpeedOutcome:
    """The outcome of `python -m benchmarks speed`.

    Attributes:
        timestep_s: time step of the exported file.
        real_time_one_core: simulated seconds a second, the exported file stepped by `mj_step` on one core.
        real_time_all_cores: the same in a batch on all cores.
        real_time_without_fluid: a bare `mj_step` of the same file without water, one core.
        cores: number of cores.
        fluid_cost: time of a step over that of a step without fluid.
        scaling: all cores over one.
        step_errors: error of the time step for each set of coefficients.
    """

    timestep_s: float
    real_time_one_core: float
    real_time_all_cores: float
    real_time_without_fluid: float
    cores: int
    fluid_cost: float
    scaling: float
    step_errors: tuple[StepError, ...]

    def to_json(self) -> dict[str, Any]:
        """Convert the outcome to plain numbers."""
        errors = [vars(error) | {"coefficients": error.coefficients._asdict()} for error in self.step_errors]
        return vars(self) | {"step_errors": errors}


def measure_speed(session: Path | None = None) -> SpeedOutcome:
    """Time the exported file of the built-in robot and compare it with a finer step; it takes about a minute.

    Args:
        session: folder of a session whose fitted coefficients are measured as well.

    Raises:
        InputError: the session has no current fit.
    """
    sets = {"fitted to the public trials": FITTED, "published": PUBLISHED_COEFFICIENTS}
    if session is not None:
        with working(session, quiet=True) as pipeline:
            sets["of the session"] = pipeline.the_fit().result().coefficients
    wet = _export(FITTED, water=True)
    everything, cores = measure_real_time_batch(wet)
    one, bare = measure_real_time(wet), measure_real_time(_export(FITTED, water=False))
    return SpeedOutcome(
        timestep_s=float(wet.opt.timestep),
        real_time_one_core=one,
        real_time_all_cores=everything,
        real_time_without_fluid=bare,
        cores=cores,
        fluid_cost=bare / one,
        scaling=everything / one,
        step_errors=tuple(_measure_step_error(name, values) for name, values in sets.items()),
    )


def speed_table(outcome: SpeedOutcome) -> str:
    """Format the outcome for a terminal."""
    rows = [
        ("step of the exported file", f"{1000 * outcome.timestep_s:g} ms"),
        ("one core, times real time", f"{outcome.real_time_one_core:.0f} x   (authors' model: 14.58 x in the paper)"),
        (f"all {outcome.cores} cores, times real time", f"{outcome.real_time_all_cores:.0f} x"),
        ("bare mj_step without fluid, one core", f"{outcome.real_time_without_fluid:.0f} x"),
        ("a step costs, over one without fluid", f"{outcome.fluid_cost:.2f} x"),
        ("all cores over one", f"{outcome.scaling:.2f} x"),
    ]
    lines = [f"{name:42}{value}" for name, value in rows]
    lines.append(f"\nagainst a step {FINER} x finer, worst of {FREQUENCIES_HZ[0]:g} to {FREQUENCIES_HZ[-1]:g} Hz")
    lines.append(f"{'coefficients':30}{'markers, mean':>14}{'rms':>10}{'largest':>10}{'speed':>9}{'at':>9}")
    lines += [
        f"{e.name:30}{e.marker_mean_mm:11.3f} mm{e.marker_rms_mm:7.3f} mm{e.marker_max_mm:7.3f} mm"
        f"{100 * e.speed:7.2f} %{e.worst_hz:6.1f} Hz"
        for e in outcome.step_errors
    ]
    return "\n".join(lines)


def _export(coefficients: FluidCoefficients, water: bool) -> mujoco.MjModel:
    spec = build_mjcf(load_robot(), coefficients, replace(SWIM, in_water=water))
    spec.compile()
    return mujoco.MjModel.from_xml_string(spec.to_xml())


def measure_real_time(model: mujoco.MjModel) -> float:
    """Measure the simulated seconds a second, the best of some runs of 10 s."""
    data, steps, best = mujoco.MjData(model), round(10.0 / model.opt.timestep), np.inf
    for _ in range(_REPEATS):
        mujoco.mj_resetData(model, data)
        data.joint("crank").qvel[0] = data.ctrl[0] = _CRANK_RAD_S
        began = time.perf_counter()
        mujoco.mj_step(model, data, steps)
        best = min(best, time.perf_counter() - began)
    return float(steps * model.opt.timestep / best)


def measure_real_time_batch(model: mujoco.MjModel, simulations: int = 32) -> tuple[float, int]:
    """Measure the simulated seconds a second of a batch on all cores, the best of three runs of 5 s; and these cores.

    Args:
        model: the model.
        simulations: number of simulations in the batch.
    """
    batch = Batch(model, simulations)
    steps, best = round(5.0 / model.opt.timestep), np.inf
    crank = model.joint("crank")
    for _ in range(3):
        batch.reset()
        batch.bind("qvel")[:, crank.dofadr[0]] = _CRANK_RAD_S
        batch.bind("ctrl")[:] = _CRANK_RAD_S
        began = time.perf_counter()
        batch.step(nstep=steps)
        best = min(best, time.perf_counter() - began)
    return float(simulations * steps * model.opt.timestep / best), int(batch.nthread)


def _measure_step_error(name: str, coefficients: FluidCoefficients) -> StepError:
    coarse, fine = _sweep(coefficients, SWIM.timestep_s), _sweep(coefficients, SWIM.timestep_s / FINER)
    kept = TIME_S >= WARMUP_S
    distance = 1000 * np.linalg.norm(coarse.shape_m - fine.shape_m, axis=-1)[:, kept]  # (f, k, m)
    speeds = [
        np.array([forward_speed(TIME_S, select_head(head, i), kept, hz) for i, hz in enumerate(FREQUENCIES_HZ)])
        for head in (coarse, fine)
    ]
    difference = np.abs(speeds[0] / speeds[1] - 1)
    return StepError(
        name=name,
        coefficients=coefficients,
        marker_mean_mm=float(distance.mean(axis=(1, 2)).max()),
        marker_rms_mm=float(np.sqrt((distance**2).mean(axis=(1, 2))).max()),
        marker_max_mm=float(distance.max()),
        speed=float(difference.max()),
        worst_hz=float(FREQUENCIES_HZ[np.argmax(difference)]),
    )


def _sweep(coefficients: FluidCoefficients, timestep_s: float) -> HeadFrame:
    count = len(FREQUENCIES_HZ)
    twin = Twin(load_robot(), scene=replace(SWIM, timestep_s=timestep_s))
    runs = Runs(
        coefficients=np.tile(coefficients, (count, 1)).astype(float),
        frequency_hz=FREQUENCIES_HZ,
        phase_rad=np.zeros(count),
        velocity=np.tile([-START_SPEED_M_S, 0.0, 0.0], (count, 1)),
    )
    markers = twin.simulate(runs, TIME_S).marker_m
    return to_head_frame(markers, twin.markers.index("nose"), twin.markers.index("neck"))
