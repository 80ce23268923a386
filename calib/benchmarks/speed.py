"""How fast the twin is and what its step costs in accuracy. Ratios count: absolute times vary with machines."""

import time
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from fitting import forward_speed
from swimmer import PUBLISHED_COEFFICIENTS, SWIM, FluidCoefficients, Runs, Twin, build_mjcf, load_robot
from tracking import HeadFrame, to_head_frame

FREQUENCIES_HZ = np.round(np.arange(0.3, 2.01, 0.1), 1)
SECONDS, WARMUP_S, FINER = 8.0, 1.0, 8
START_SPEED_M_S = 0.1
_REPEATS = 7


@dataclass(frozen=True)
class SpeedOutcome:
    """What `calib benchmark speed` measured.

    Attributes:
        timestep_s: of the exported file.
        real_time_one_core: simulated seconds a second, the exported file stepped by `mj_step` on one core.
        real_time_all_cores: the same in a batch on all cores.
        real_time_without_fluid: a bare `mj_step` of the same file without water, one core.
        cores: how many.
        fluid_cost: time of a step over that of a step without fluid.
        scaling: all cores over one core.
        marker_mean_mm, marker_rms_mm, marker_max_mm: worst over the frequencies of the mean, root mean square and
            largest distance between markers relative to the nose and those of a step eight times finer.
        speed_difference: largest relative difference in mean forward speed over the frequencies.
        coefficients: used.
    """

    timestep_s: float
    real_time_one_core: float
    real_time_all_cores: float
    real_time_without_fluid: float
    cores: int
    fluid_cost: float
    scaling: float
    marker_mean_mm: float
    marker_rms_mm: float
    marker_max_mm: float
    speed_difference: float
    coefficients: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return dict(vars(self))


def measure_speed(coefficients: FluidCoefficients | None = None) -> SpeedOutcome:
    """Times the exported file of the built-in robot and compares it with a finer step.

    Args:
        coefficients: default the published ones.
    """
    values = coefficients or PUBLISHED_COEFFICIENTS
    wet = _exported(values, water=True)
    dry = _exported(values, water=False)
    one, bare = _real_time(wet), _real_time(dry)
    everything, cores = _real_time_batch(wet)
    mean, rms, largest, speed = _distance_to_finer_step(values)
    return SpeedOutcome(
        timestep_s=wet.opt.timestep,
        real_time_one_core=one,
        real_time_all_cores=everything,
        real_time_without_fluid=bare,
        cores=cores,
        fluid_cost=bare / one,
        scaling=everything / one,
        marker_mean_mm=mean,
        marker_rms_mm=rms,
        marker_max_mm=largest,
        speed_difference=speed,
        coefficients=tuple(values),
    )


def speed_table(outcome: SpeedOutcome) -> str:
    """The outcome for a terminal."""
    rows = [
        ("step of the exported file", f"{1000 * outcome.timestep_s:g} ms"),
        (
            "one core, times real time",
            f"{outcome.real_time_one_core:.0f} x   (authors' model: 14.58 x in the paper)",
        ),
        (f"all {outcome.cores} cores, times real time", f"{outcome.real_time_all_cores:.0f} x"),
        ("bare mj_step without fluid, one core", f"{outcome.real_time_without_fluid:.0f} x"),
        ("a step costs, over one without fluid", f"{outcome.fluid_cost:.2f} x"),
        ("all cores over one", f"{outcome.scaling:.2f} x"),
        (
            "markers against 8 x finer steps, mean",
            f"{outcome.marker_mean_mm:.3f} mm   (worst frequency, 0.3 to 2 Hz)",
        ),
        ("the same, root mean square", f"{outcome.marker_rms_mm:.3f} mm"),
        ("the same, largest single distance", f"{outcome.marker_max_mm:.3f} mm   (tip of the caudal fin)"),
        ("mean speed against 8 x finer steps", f"{100 * outcome.speed_difference:.2f} %   (worst frequency)"),
    ]
    return "\n".join(f"{name:42}{value}" for name, value in rows)


def _exported(coefficients: FluidCoefficients, water: bool) -> mujoco.MjModel:
    spec = build_mjcf(load_robot(), coefficients, replace(SWIM, in_water=water))
    spec.compile()
    return mujoco.MjModel.from_xml_string(spec.to_xml())


def _real_time(model: mujoco.MjModel, hz: float = 1.0) -> float:
    """Simulated seconds a second, best of some runs of 10 s."""
    data, steps, best = mujoco.MjData(model), round(10.0 / model.opt.timestep), np.inf
    for _ in range(_REPEATS):
        mujoco.mj_resetData(model, data)
        data.joint("crank").qvel[0] = data.ctrl[0] = 2 * np.pi * hz
        began = time.perf_counter()
        mujoco.mj_step(model, data, steps)
        best = min(best, time.perf_counter() - began)
    return float(steps * model.opt.timestep / best)


def _real_time_batch(model: mujoco.MjModel, simulations: int = 32, hz: float = 1.0) -> tuple[float, int]:
    batch = Batch(model, simulations)
    steps, best = round(5.0 / model.opt.timestep), np.inf
    crank = model.joint("crank")
    for _ in range(3):
        batch.reset()
        batch.bind("qvel")[:, crank.dofadr[0]] = 2 * np.pi * hz
        batch.bind("ctrl")[:] = 2 * np.pi * hz
        began = time.perf_counter()
        batch.step(nstep=steps)
        best = min(best, time.perf_counter() - began)
    return float(simulations * steps * model.opt.timestep / best), int(batch.nthread)


def _distance_to_finer_step(coefficients: FluidCoefficients) -> tuple[float, float, float, float]:
    """Mean, rms and largest marker distance (mm, relative to the nose, head frame) and relative speed difference."""
    coarse, fine = _sweep(coefficients, SWIM.timestep_s), _sweep(coefficients, SWIM.timestep_s / FINER)
    time_s = _times()
    kept = time_s >= WARMUP_S
    distance = 1000 * np.linalg.norm(coarse.shape_m - fine.shape_m, axis=-1)[:, kept]  # (f, k, m)
    speeds = [
        np.array([forward_speed(time_s, head.forward_m[i], kept, hz) for i, hz in enumerate(FREQUENCIES_HZ)])
        for head in (coarse, fine)
    ]
    return (
        float(distance.mean(axis=(1, 2)).max()),
        float(np.sqrt((distance**2).mean(axis=(1, 2))).max()),
        float(distance.max()),
        float(np.abs(speeds[0] / speeds[1] - 1).max()),
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
    markers = twin.simulate(runs, _times()).marker_m
    return to_head_frame(markers, twin.markers.index("nose"), twin.markers.index("neck"))


def _times() -> np.ndarray:
    return np.arange(0.0, SECONDS, 1 / 60)
