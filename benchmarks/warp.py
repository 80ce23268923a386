"""An exported twin in MuJoCo Warp: how fast thousands of it swim on a GPU, and how far from the twin in MuJoCo."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.speed import measure_real_time, measure_real_time_batch

_FAST = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
# Name, integrator and time step. In the 32 bits of Warp the derivative of the Kutta lift, which `implicit` takes whole,
# fails where a link's velocity through the water is almost 0; without that lift nothing blew up.
SETTINGS = (("as in the file", None, None), ("implicitfast", _FAST, None), ("implicitfast", _FAST, 0.002))
SWIMMERS = (1_024, 8_192, 65_536, 262_144)
SECONDS = 4.0  # duration of the swims that are compared
_RANGE_HZ = (0.5, 1.5)
_BLOWN_UP = 1e3  # rad/s or m/s, which no swimmer reaches; in Warp nothing resets one that does
_BATCH = 256  # simulations of a batch on all cores
_A_LAUNCH = 50  # steps of one launch of a CUDA graph
_TIMED_S = 1.0  # simulated at each timing
_ROUNDS = 3


@dataclass(frozen=True)
class SwimInWarp:
    """Swims in Warp with one integrator and time step, beside MuJoCo with those of the file.

    Attributes:
        integrator: its name.
        step_s: the time step.
        blown_up: share of the swimmers that blow up.
        speed_median: relative difference of the speed over the pool, median over the others.
        speed_largest: its largest absolute value.
        real_time: simulated seconds a second for each number of swimmers.
    """

    integrator: str
    step_s: float
    blown_up: float
    speed_median: float
    speed_largest: float
    real_time: dict[int, float]


@dataclass(frozen=True)
class WarpOutcome:
    """The outcome of `python -m benchmarks warp`.

    Attributes:
        device: name of the device that Warp used.
        cores: number of cores.
        one_core: simulated seconds a second of MuJoCo on one core.
        all_cores: the same of a batch on all cores.
        swims: what each integrator and time step give.
    """

    device: str
    cores: int
    one_core: float
    all_cores: float
    swims: tuple[SwimInWarp, ...]

    def __str__(self) -> str:
        lines = [f"MuJoCo, one core: {self.one_core:,.0f} x real time; {self.cores} cores: {self.all_cores:,.0f} x"]
        lines.append(f"MuJoCo Warp on {self.device}, beside MuJoCo with integrator and step of the file")
        counts = list(self.swims[0].real_time)
        lines.append(f"{'':27}{'blown up':>9}{'speed':>9}{'largest':>9}" + "".join(f"{n:>12,}" for n in counts))
        lines += [
            f"{s.integrator:16}{1000 * s.step_s:8.2f} ms{100 * s.blown_up:7.1f} %{100 * s.speed_median:+7.2f} %"
            f"{100 * s.speed_largest:7.2f} %" + "".join(f"{s.real_time[n]:>10,.0f} x" for n in counts)
            for s in self.swims
        ]
        return "\n".join(lines)


def measure_warp(path: Path, swimmers: tuple[int, ...] = SWIMMERS, compared: int = 512) -> WarpOutcome:
    """Swim an exported twin from its first keyframe in MuJoCo and in MuJoCo Warp; the first use compiles for a minute.

    Args:
        path: the exported MJCF.
        swimmers: numbers of swimmers to time.
        compared: number of crank speeds at which both are compared.
    """
    import warp

    model = mujoco.MjModel.from_xml_path(str(path))
    one = measure_real_time(model)
    everything, cores = measure_real_time_batch(model, _BATCH)
    rates_hz = np.linspace(*_RANGE_HZ, compared)
    expected_m = swim_in_engine(model, rates_hz)
    swims = []
    for name, integrator, step_s in SETTINGS:
        model.opt.integrator = model.opt.integrator if integrator is None else integrator
        model.opt.timestep = model.opt.timestep if step_s is None else step_s
        found_m = swim_in_warp(model, rates_hz)
        fine = np.isfinite(found_m)
        apart = found_m[fine] / expected_m[fine] - 1
        median, largest = (float(np.median(apart)), float(np.abs(apart).max())) if fine.any() else (np.nan, np.nan)
        timed = {count: _time_warp(model, count) for count in swimmers}
        blown_up = 1 - float(fine.mean())
        swims.append(SwimInWarp(name, float(model.opt.timestep), blown_up, median, largest, timed))
    device = warp.get_device()
    return WarpOutcome(f"{device.name} ({device.alias})", cores, one, everything, tuple(swims))


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
