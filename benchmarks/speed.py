"""Speed of the twin, and the error that its time step costs; ratios count, as absolute times vary with machines."""

import time
from dataclasses import replace

import mujoco
import numpy as np
from mujoco.batch import Batch

from benchmarks.scores import Scores, Table
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
# MuJoCo 4.0, so a twin that swims like the robot.
FITTED = FluidCoefficients(0.41, 6.56, 10.0, 4.12, 9.64)


def measure_speed() -> Scores:
    """Time the exported file of the built-in robot and compare it with a finer step; it takes about a minute."""
    wet = _export(FITTED, water=True)
    everything, cores = measure_real_time_batch(wet)
    rates = {
        "one core": measure_real_time(wet),
        f"all {cores} cores": everything,
        "one core, without water": measure_real_time(_export(FITTED, water=False)),
    }
    caption = f"A step of {1000 * wet.opt.timestep:g} ms, as in the exported file"
    rows = tuple((name, f"{rate:.0f}") for name, rate in rates.items())
    sets = {"fitted to the public trials": FITTED, "published": PUBLISHED_COEFFICIENTS}
    against = f"Against a step {FINER} times finer, worst of {FREQUENCIES_HZ[0]:g} to {FREQUENCIES_HZ[-1]:g} Hz"
    columns = ("coefficients", "markers, mean, mm", "rms, mm", "largest, mm", "mean speed, %", "at, Hz")
    errors = tuple(
        (name, *(f"{mm:.3f}" for mm in off), f"{100 * speed:.2f}", f"{hz:.1f}")
        for name, (*off, speed, hz) in ((name, measure_step_error(values)) for name, values in sets.items())
    )
    tables = (Table(caption, ("", "times real time"), rows), Table(against, columns, errors))
    return Scores("Twin", "synthetic: the twin itself", "python -m benchmarks speed", tables)


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


def measure_step_error(coefficients: FluidCoefficients) -> tuple[float, float, float, float, float]:
    """Measure what the time step costs with some coefficients, against a step eight times finer.

    Returns:
        Mean, rms and largest distance of markers relative to the nose, in the head frame, each at its worst frequency,
        mm; the largest relative difference in mean forward speed, and the frequency at which it is, Hz.
    """
    coarse, fine = _sweep(coefficients, SWIM.timestep_s), _sweep(coefficients, SWIM.timestep_s / FINER)
    kept = TIME_S >= WARMUP_S
    distance = 1000 * np.linalg.norm(coarse.shape_m - fine.shape_m, axis=-1)[:, kept]  # (f, k, m)
    speeds = [
        np.array([forward_speed(TIME_S, select_head(head, i), kept, hz) for i, hz in enumerate(FREQUENCIES_HZ)])
        for head in (coarse, fine)
    ]
    difference = np.abs(speeds[0] / speeds[1] - 1)
    mean, square = (float((distance**power).mean(axis=(1, 2)).max()) for power in (1, 2))
    worst_hz = float(FREQUENCIES_HZ[np.argmax(difference)])
    return mean, float(np.sqrt(square)), float(distance.max()), float(difference.max()), worst_hz


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
