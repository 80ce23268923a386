"""Sessions of the exported twin in plain MuJoCo, with one change that is made outside the project's own effects.

The water is the twin's own, so that only the change is missing from it: whoever cannot name a change here names none
anywhere. Changes are model fields, forces at each step, the motor's command, or what a camera does to the picture.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.cases import write_record
from benchmarks.effects.pictures import PictureFault, PixelTracks, clock, drift, lens, offset, shaken, shutter
from benchmarks.effects.suite import WARMUP_S, apart, in_turn
from swimcal.create_session import FISHSIM_MARKERS, new_folder, write_session_toml
from swimcal.mjcf import FluidCoefficients, build_mjcf
from swimcal.robot import load_robot
from swimcal.tracks import as_tracks, save_tracks
from swimsynth.plan import trial_name

_SWIMS, _HELD_OUT = 6, (2, 4)  # swims of a session, by frequency, and those that are held out
_SLOWEST_HZ, _FASTEST_HZ = 0.5, 1.4
_FPS = 60.0
_PICTURE_PX = np.array([1920.0, 1080.0])
_PX_PER_M = 620.0
_NECK_TO_NOSE_M = 0.142
_SETTLING_S = 5.0  # A swim is filmed from this long after its start.
_BEATS, _LEAST_S = 5.0, 6.0  # beats after the warm-up, and the least length of a film
_NOISE_PX = 0.3
_ASIDE_M_S, _TURN_RAD_S = 0.003, 0.01  # launches differ by a slip aside and a turn
_COEFFICIENT_SD = 0.2  # standard deviation of ln coefficient about a calibrated twin
_CALIBRATED = FluidCoefficients(0.45, 2.5, 6.0, 4.2, 0.8)

Force = Callable[[mujoco.MjModel, mujoco.MjData], None]


@dataclass(frozen=True, kw_only=True)
class Change:
    """A change of the robot, its water, its drive or the camera.

    Attributes:
        right: names that the catalogue has for it; none where the catalogue lacks it.
        stage: stage in which it acts.
        model: changes the model before it is compiled.
        compiled: changes the compiled model.
        force: adds forces to `qfrc_applied` or `xfrc_applied`, which are zero before, at each step.
        speed: crank speed over its commanded value, from the command, Hz, the time, s, and the crank's angle, rad.
        fault: changes the tracks in pixels.
        height_m: height of the camera above the plane of the scale, m.
        scale: stated over true distance between nose and neck.
    """

    right: tuple[str, ...] = ()
    stage: str = ""
    model: Callable[[mujoco.MjSpec], None] = lambda _spec: None
    compiled: Callable[[mujoco.MjModel], None] = lambda _model: None
    force: Force | None = None
    speed: Callable[[float, float, float], float] = lambda _hz, _time_s, _angle_rad: 1.0
    fault: PictureFault = lambda tracks: tracks
    height_m: float = np.inf
    scale: float = 1.0


def _joints(model: mujoco.MjModel) -> np.ndarray:
    """Return the addresses of the tail's hinges in qpos and qvel, which are the same here."""
    return np.array([model.joint(f"tail_{n}").qposadr[0] for n in range(1, 6)])


def _each_hinge(share: Callable[[int], float], what: str) -> Callable[[mujoco.MjModel], None]:
    def change(model: mujoco.MjModel) -> None:
        hinges = _joints(model)
        for n, hinge in enumerate(hinges):
            getattr(model, what)[hinge] *= share(n)

    return change


def _current(right_m_s: float, down_m_s: float) -> Change:
    def flow(model: mujoco.MjModel) -> None:
        model.opt.wind[:2] = right_m_s, -down_m_s

    return Change(right=("background_current",), stage="body", compiled=flow)


def _gust(strength_m_s: float) -> Change:
    def force(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        model.opt.wind[1] = strength_m_s * np.exp(-(((data.time - _SETTLING_S - 3.0) / 0.5) ** 2))

    return Change(stage="body", force=force)


def _unequal_tendons(length_m: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        for side, sign in (("left", 1), ("right", -1)):
            model.tendon_lengthspring[model.tendon(f"tendon_{side}").id] += sign * length_m / 2

    return Change(right=("tendon_asymmetry",), stage="tail", compiled=change)


def _slack(length_m: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        model.tendon_lengthspring += length_m * np.array([-1.0, 1.0])

    return Change(right=("tendon_slack",), stage="tail", compiled=change)


def _soft_tendons(relative: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        model.tendon_stiffness /= 1 + relative

    return Change(right=("tendon_compliance",), stage="tail", compiled=change)


def _crank_arm(relative: float) -> Change:
    def change(spec: mujoco.MjSpec) -> None:
        for side in ("left", "right"):
            spec.site(f"anchor_{side}").pos[2] *= 1 + relative

    return Change(right=("crank_arm_error",), stage="tail", model=change)


def _warped(angle_rad: float) -> Change:
    def change(model: mujoco.MjModel) -> None:
        model.qpos_spring[_joints(model)] = angle_rad

    return Change(right=("bend_offset",), stage="tail", compiled=change)


def _hinge_torque(torque: Callable[[np.ndarray, np.ndarray], np.ndarray], right: str) -> Change:
    def force(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        hinges = _joints(model)
        data.qfrc_applied[hinges] = torque(data.qpos[hinges], data.qvel[hinges])

    return Change(right=(right,), stage="tail", force=force)


def _tip_mass(mass_kg: float) -> Change:
    def change(spec: mujoco.MjSpec) -> None:
        spec.body("tail_5").add_geom(
            name="glue", pos=(0.02, 0, 0), size=(0.004, 0, 0), mass=mass_kg, type=mujoco.mjtGeom.mjGEOM_SPHERE
        )

    return Change(right=("mass_distribution",), stage="tail", model=change)


def _towed(force_n: Callable[[float], float], right: str) -> Change:
    def force(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        velocity = data.qvel[:2]
        speed = float(np.hypot(*velocity))
        data.xfrc_applied[model.body("head").id, :2] = -force_n(speed) * velocity / max(speed, 1e-9)

    return Change(right=(right,), stage="body", force=force)


def _coefficients(which: str, factor: float) -> Change:
    """Scale drag and lift of one plate."""

    def change(model: mujoco.MjModel) -> None:
        at = model.geom(which).id
        model.geom_fluid[at, 1:6] *= factor

    return Change(right=("segment_coefficients",), stage="body", compiled=change)


def _sag(load_s2: float) -> Change:
    return Change(right=("motor_speed_sag",), stage="drive", speed=lambda hz, _time_s, _angle: 1 - load_s2 * hz**2)


def _ripple(share: float) -> Change:
    return Change(
        right=("motor_speed_ripple",), stage="drive", speed=lambda _hz, _time_s, angle: 1 + share * np.cos(2 * angle)
    )


def _seen(fault: PictureFault, right: str = "", stage: str = "camera") -> Change:
    return Change(right=(right,) if right else (), stage=stage, fault=fault)


CHANGES: Mapping[str, Callable[[float], Change]] = {
    "current": lambda s: _current(0.015 * s, 0.01 * s),
    "unequal tendons": lambda s: _unequal_tendons(0.0015 * s),
    "slack": lambda s: _slack(0.0012 * s),
    "soft tendons": lambda s: _soft_tendons(3.0 * s),
    "crank arm": lambda s: _crank_arm(-0.05 * s),
    "stiffer": lambda s: Change(
        right=("stiffness_error",), stage="tail", compiled=_each_hinge(lambda _n: 1 + 0.2 * s, "jnt_stiffness")
    ),
    "softer to the tip": lambda s: Change(
        right=("stiffness_gradient",),
        stage="tail",
        compiled=_each_hinge(lambda n: 1 + 0.2 * s * (1 - n / 2), "jnt_stiffness"),
    ),
    "hardening": lambda s: _hinge_torque(lambda q, _v: -2.0 * s * q**3, "stiffness_hardening"),
    "damping": lambda s: Change(
        right=("joint_damping",), stage="tail", compiled=_each_hinge(lambda _n: 1 + 0.8 * s, "dof_damping")
    ),
    "friction": lambda s: _hinge_torque(lambda _q, v: -0.02 * s * np.tanh(v / 0.05), "joint_friction"),
    "warped": lambda s: _warped(0.02 * s),
    "mass near the tip": lambda s: _tip_mass(0.02 * s),
    "line in tow": lambda s: _towed(lambda u: 0.3 * s * u, "linear_drag"),
    "skin": lambda s: _towed(lambda u: 0.2 * s * u**1.5, "skin_friction"),
    "fin's own coefficients": lambda s: _coefficients("caudal_fin", 1 + 0.25 * s),
    "motor sags": lambda s: _sag(0.03 * s),
    "motor turns unevenly": lambda s: _ripple(0.06 * s),
    "gear": lambda s: Change(
        right=("drive_ratio_error",), stage="drive", speed=lambda _hz, _time_s, _angle: 1 + 0.03 * s
    ),
    "clock": lambda s: _seen(clock(1 + 0.03 * s), "time_base_error", "drive"),
    "scale": lambda s: Change(right=("scale_error",), stage="camera", scale=1 + 0.04 * s),
    "drift": lambda s: _seen(drift("tail_4", 0.002 * s), "tracker_drift"),
    "marker": lambda s: _seen(offset("tail_3", 0.006 * s), "marker_offset"),
    "neck": lambda s: _seen(offset("neck", 0.005 * s), "head_frame_misalignment"),
    "lens": lambda s: _seen(lens(-0.05 * s), "lens_distortion"),
    "low camera": lambda s: Change(right=("camera_parallax",), stage="camera", height_m=3.0 / s),
    "shutter": lambda s: _seen(shutter(0.012 * s), "rolling_shutter"),
    "gust": lambda s: _gust(0.04 * s),
    "shaken camera": lambda s: _seen(shaken(6.0 * s)),
}
"""Changes by name, from their strength, 1 to 2."""


@dataclass(frozen=True)
class PlainAnswer:
    """Answer of one session: what was changed, how strongly, at which stage, and its names in the catalogue."""

    session: str
    change: str | None
    strength: float
    right: tuple[str, ...]
    stage: str
    seed: int


class PlainPlan(NamedTuple):
    """Plan of one session: its name, seed and change; None for none."""

    name: str
    seed: int
    change: str | None


def plan_plain(seed: int, unchanged: int, changed: int) -> tuple[PlainPlan, ...]:
    """Plan sessions in random order, the changes in turn; names carry no information."""
    random = np.random.default_rng([seed, 71])
    changes: list[str | None] = [None] * unchanged
    changes += in_turn(tuple(CHANGES), changed, random)
    seeds = random.integers(2**31, size=len(changes))
    return tuple(
        PlainPlan(f"m{n:03d}", int(seeds[i]), changes[i]) for n, i in enumerate(random.permutation(len(changes)))
    )


def make_plain(folder: Path, plans: Sequence[PlainPlan]) -> int:
    """Make the sessions that are missing, with their answers in `folder/answers`; return how many."""
    todo = [plan for plan in plans if not (folder / "answers" / f"{plan.name}.json").exists()]
    (folder / "answers").mkdir(parents=True, exist_ok=True)
    for plan in todo:
        answer = _make(folder, plan)
        write_record(folder / "answers" / f"{plan.name}.json", answer)
    return len(todo)


def _make(folder: Path, plan: PlainPlan) -> PlainAnswer:
    random = np.random.default_rng([plan.seed, 73])
    strength = float(random.uniform(1.0, 2.0)) if plan.change else 0.0
    change = CHANGES[plan.change](strength) if plan.change else Change()
    factors = np.exp(_COEFFICIENT_SD * random.standard_normal(len(_CALIBRATED)))
    coefficients = FluidCoefficients(*(float(c * f) for c, f in zip(_CALIBRATED, factors, strict=True)))
    speeds = apart(_SWIMS, _SLOWEST_HZ, _FASTEST_HZ, random)
    with new_folder(folder / plan.name) as part:
        tables, fps = [], _FPS
        for number, hz in enumerate(sorted(map(float, speeds))):
            name = trial_name("f", hz)
            time_s, px = _film(change, coefficients, hz, random)
            fps = round(1 / float(time_s[1] - time_s[0]), 3)
            tracks = as_tracks(FISHSIM_MARKERS, time_s, px, np.ones(px.shape[:2]))
            save_tracks(part / f"trials/{name}.csv", tracks)
            role = "holdout" if number in _HELD_OUT else "fit"
            tables.append(
                {"name": name, "kind": "swim", "tracks": f"trials/{name}.csv", "commanded_hz": hz, "role": role}
            )
        camera = {"fps": fps, "scale_length_m": round(_NECK_TO_NOSE_M * change.scale, 6)}
        write_session_toml(
            part, name=plan.name, camera=camera, markers=FISHSIM_MARKERS, trials=tables, fit={"warmup_s": WARMUP_S}
        )
    return PlainAnswer(plan.name, plan.change, strength, change.right, change.stage, plan.seed)


def _film(
    change: Change, coefficients: FluidCoefficients, hz: float, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate and film one swim: stamps (n,), s, and pixels (n, marker, 2)."""
    seconds = max(_LEAST_S, WARMUP_S + _BEATS / hz)
    heading_rad = random.uniform(0, 2 * np.pi)
    dense_s, points = _simulate(change, coefficients, hz, _SETTLING_S + seconds + 0.1, heading_rad)
    aside_m_s, turn_rad_s = random.standard_normal(2) * (_ASIDE_M_S, _TURN_RAD_S)
    points[..., 1] += aside_m_s * dense_s[:, None]  # along y, which the fish swims across
    points = _turned(points, heading_rad + turn_rad_s * (dense_s - _SETTLING_S))
    filmed = dense_s > _SETTLING_S
    flat = points[..., :2] - points[filmed][:, :, :2].mean(axis=(0, 1))
    flat /= 1 - points[..., 2:] / change.height_m
    frames_s = np.arange(int(seconds * _FPS)) / _FPS
    seen = CubicSpline(dense_s, flat * _PX_PER_M * (1, -1))(_SETTLING_S + frames_s)
    tracks = change.fault(PixelTracks(frames_s, seen + _PICTURE_PX / 2, FISHSIM_MARKERS, _PX_PER_M, _PICTURE_PX))
    return tracks.time_s, tracks.position_px + _NOISE_PX * random.standard_normal(seen.shape)


def _simulate(
    change: Change, coefficients: FluidCoefficients, hz: float, seconds: float, heading_rad: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,), s, and markers (n, marker, 3), m, at every step, before they are turned by the heading.

    A current is the pool's: here, where the fish always swims along -x, it comes from elsewhere in each swim.
    """
    spec = build_mjcf(load_robot(), coefficients)
    change.model(spec)
    model = spec.compile()
    change.compiled(model)
    model.opt.wind[:] = _turned(model.opt.wind[None], np.array([-heading_rad]))[0]
    data = mujoco.MjData(model)
    data.qvel[0] = -0.14 * hz
    sites = [model.site(f"marker_{name}").id for name in FISHSIM_MARKERS]
    crank = model.joint("crank").qposadr[0]
    steps = int(seconds / model.opt.timestep)
    time_s, points = np.zeros(steps), np.zeros((steps, len(sites), 3))
    for step in range(steps):
        data.ctrl[0] = 2 * np.pi * hz * change.speed(hz, data.time, data.qpos[crank])
        if change.force is not None:
            change.force(model, data)
        mujoco.mj_forward(model, data)
        time_s[step], points[step] = data.time, data.site_xpos[sites]
        mujoco.mj_step(model, data)
    if not np.isfinite(points).all():
        raise ValueError(f"the twin diverged at {hz:g} Hz")
    return time_s, points


def _turned(points: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    turned = points.copy()
    x, y = points[..., 0], points[..., 1]
    c, s = (each.reshape(len(each), *[1] * (x.ndim - 1)) for each in (np.cos(angle_rad), np.sin(angle_rad)))
    turned[..., 0], turned[..., 1] = c * x - s * y, s * x + c * y
    return turned
