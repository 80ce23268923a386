"""An exported twin in MuJoCo Warp: how fast thousands of it swim on a GPU, and how far from the twin in MuJoCo."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.scores import Scores, Table
from benchmarks.speed import measure_real_time, measure_real_time_batch

_FAST = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
# Name, integrator and time step. In the 32 bits of Warp the derivative of the Kutta lift, which `implicit` takes whole,
# fails where a link's velocity through the water is almost 0; without that lift nothing blew up.
SETTINGS = (("as in the file", None, None), ("implicitfast", _FAST, None), ("implicitfast", _FAST, 0.002))
SWIMMERS = (1_024, 8_192, 65_536, 262_144)
SECONDS = 4.0  # duration of the swims that are compared
_RANGE_HZ = (0.5, 1.5)
_BLOWN_UP = 1e3  # rad/s or m/s, which no swimmer reaches; in Warp nothing resets one that does
_COMPARED = 512  # number of crank speeds at which both are compared
_BATCH = 256  # simulations of a batch on all cores
_A_LAUNCH = 50  # steps of one launch of a CUDA graph
_TIMED_S = 1.0  # simulated at each timing
_ROUNDS = 3


def measure_warp(path: Path) -> Scores:
    """Swim an exported twin from its first keyframe in MuJoCo and in MuJoCo Warp; the first use compiles for a minute.

    Speeds over the pool are those of Warp against MuJoCo with integrator and step of the file, of what does not blow
    up; the others are simulated seconds a second.
    """
    import warp

    model = mujoco.MjModel.from_xml_path(str(path))
    one = measure_real_time(model)
    everything, cores = measure_real_time_batch(model, _BATCH)
    rates_hz = np.linspace(*_RANGE_HZ, _COMPARED)
    expected_m = swim_in_engine(model, rates_hz)
    rows = []
    for name, integrator, step_s in SETTINGS:
        model.opt.integrator = model.opt.integrator if integrator is None else integrator
        model.opt.timestep = model.opt.timestep if step_s is None else step_s
        found_m = swim_in_warp(model, rates_hz)
        fine = np.isfinite(found_m)
        apart = 100 * (found_m[fine] / expected_m[fine] - 1)
        speed = (f"{np.median(apart):+.2f}", f"{np.abs(apart).max():.2f}") if fine.any() else ("", "")
        timed = (f"{_time_warp(model, count):,.0f}" for count in SWIMMERS)
        setting = f"{name}, {1000 * model.opt.timestep:.2f} ms"
        rows.append((setting, f"{100 * (1 - fine.mean()):.1f}", *speed, *timed))
    device = warp.get_device()
    columns = ("", "blown up, %", "speed, median, %", "largest, %", *(f"{count:,}" for count in SWIMMERS))
    engine = (("one core", f"{one:,.0f}"), (f"{cores} cores", f"{everything:,.0f}"))
    tables = (
        Table("MuJoCo", ("", "times real time"), engine),
        Table(f"MuJoCo Warp on {device.name} ({device.alias}): swimmers, times real time", columns, tuple(rows)),
    )
    return Scores("MuJoCo Warp", f"synthetic: {path.name}", f"python -m benchmarks warp {path}", tables)


def swim_in_engine(model: mujoco.MjModel, rates_hz: np.ndarray) -> np.ndarray:
    """Return how far heads have gone over the pool (n,), m, from the first keyframe at beat frequencies (n,)."""
    ways = []
    for rate_hz in rates_hz:
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.ctrl[0] = 2 * np.pi * rate_hz
        mujoco.mj_step(model, data, round(SECONDS / model.opt.timestep))
        ways.append(_way_m(model, data.qpos))
    return np.array(ways)


def swim_in_warp(model: mujoco.MjModel, rates_hz: np.ndarray) -> np.ndarray:
    """Return the same as `swim_in_engine` from MuJoCo Warp, on the device that it prefers; nan where one blows up."""
    import mujoco_warp

    in_warp, data = _put(model, rates_hz)
    fastest = np.zeros(len(rates_hz))
    for _ in range(round(SECONDS / model.opt.timestep)):
        mujoco_warp.step(in_warp, data)
        fastest = np.maximum(fastest, np.abs(data.qvel.numpy()).max(axis=1))
    return np.where(fastest < _BLOWN_UP, _way_m(model, data.qpos.numpy().astype(float)), np.nan)


def _put(model: mujoco.MjModel, rates_hz: np.ndarray) -> tuple[Any, Any]:
    """Put a model and swimmers at its first keyframe onto the device."""
    import mujoco_warp

    start = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, start, 0)
    data = mujoco_warp.put_data(model, start, nworld=len(rates_hz))
    data.ctrl.assign((2 * np.pi * rates_hz[:, None]).astype(np.float32))
    return mujoco_warp.put_model(model), data


def _way_m(model: mujoco.MjModel, positions: np.ndarray) -> np.ndarray:
    """Return how far heads at positions (..., nq) are from the first keyframe (...)."""
    surge, sway = (model.joint(name).qposadr[0] for name in ("surge", "sway"))
    begin = model.key_qpos[0]
    way: np.ndarray = np.hypot(positions[..., surge] - begin[surge], positions[..., sway] - begin[sway])
    return way


def _time_warp(model: mujoco.MjModel, count: int) -> float:
    """Time swimmers in Warp, on a GPU as a CUDA graph of some steps: simulated seconds a second."""
    import mujoco_warp
    import warp

    in_warp, data = _put(model, np.linspace(*_RANGE_HZ, count))
    mujoco_warp.step(in_warp, data)

    def step() -> None:
        for _ in range(_A_LAUNCH):
            mujoco_warp.step(in_warp, data)

    advance: Callable[[], None] = step
    if warp.get_device().is_cuda:
        with warp.ScopedCapture() as capture:
            step()
        advance = partial(warp.capture_launch, capture.graph)
    launches = max(1, round(_TIMED_S / (_A_LAUNCH * model.opt.timestep)))
    best = np.inf
    for _ in range(_ROUNDS):
        warp.synchronize()
        began = time.perf_counter()
        for _ in range(launches):
            advance()
        warp.synchronize()
        best = min(best, time.perf_counter() - began)
    return count * launches * _A_LAUNCH * float(model.opt.timestep) / best
