"""Sessions of the exported twin in plain MuJoCo, with one change that is made outside the project's own effects.

The water is the twin's own, so that only the change is missing from it: whoever cannot name a change here names none
anywhere. Changes are model fields, forces at each step, the motor's command, or what a camera does to the picture.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.effects.changes import PLAIN, ChangeAnswer, ChangePlan, missing, plan_changes
from benchmarks.effects.pictures import PictureFault, PixelTracks, clock, drift, lens, offset, shaken, shutter
from benchmarks.effects.suite import WARMUP_S, apart
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
        right: name that the catalogue has for it; empty where the catalogue lacks it.
        model: changes the model before it is compiled.
        compiled: changes the compiled model.
        force: adds forces to `qfrc_applied` or `xfrc_applied`, which are zero before, at each step.
        speed: crank speed over its commanded value, from the command, Hz, and the crank's angle, rad.
        fault: changes the tracks in pixels.
        height_m: height of the camera above the plane of the scale, m.
        scale: stated over true distance between nose and neck.
    """

    right: str = ""
    model: Callable[[mujoco.MjSpec], None] = lambda _spec: None
    compiled: Callable[[mujoco.MjModel], None] = lambda _model: None
    force: Force | None = None
    speed: Callable[[float, float], float] = lambda _hz, _angle_rad: 1.0
    fault: PictureFault = lambda tracks: tracks
    height_m: float = np.inf
    scale: float = 1.0


def _joints(model: mujoco.MjModel) -> np.ndarray:
    """Return the addresses of the tail's hinges in qpos and qvel, and their numbers, which are all the same here."""
    return np.array([model.joint(f"tail_{n}").qposadr[0] for n in range(1, 6)])


def _of_hinges(right: str, what: str, new: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Change what a field of the model says of each hinge."""

    def change(model: mujoco.MjModel) -> None:
        hinges = _joints(model)
        getattr(model, what)[hinges] = new(getattr(model, what)[hinges])

    return Change(right=right, compiled=change)


def _of_tendons(right: str, what: str, new: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Change what a field of the model says of the left tendon and the right one."""

    def change(model: mujoco.MjModel) -> None:
        getattr(model, what)[:] = new(getattr(model, what))

    return Change(right=right, compiled=change)


def _current(right_m_s: float, down_m_s: float) -> Change:
    def flow(model: mujoco.MjModel) -> None:
        model.opt.wind[:2] = right_m_s, -down_m_s

    return Change(right="background_current", compiled=flow)


def _gust(strength_m_s: float) -> Change:
    def force(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        model.opt.wind[1] = strength_m_s * np.exp(-(((data.time - _SETTLING_S - 3.0) / 0.5) ** 2))

    return Change(force=force)


def _crank_arm(relative: float) -> Change:
    def change(spec: mujoco.MjSpec) -> None:
        for side in ("left", "right"):
            spec.site(f"anchor_{side}").pos[2] *= 1 + relative

    return Change(right="crank_arm_error", model=change)


def _hinge_torque(right: str, torque: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Change:
    def force(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        hinges = _joints(model)
        data.qfrc_applied[hinges] = torque(data.qpos[hinges], data.qvel[hinges])

    return Change(right=right, force=force)


def _tip_mass(mass_kg: float) -> Change:
    def change(spec: mujoco.MjSpec) -> None:
        spec.body("tail_5").add_geom(
            name="glue", pos=(0.02, 0, 0), size=(0.004, 0, 0), mass=mass_kg, type=mujoco.mjtGeom.mjGEOM_SPHERE
        )

    return Change(right="mass_distribution", model=change)


def _towed(right: str, force_n: Callable[[float], float]) -> Change:
    def force(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        velocity = data.qvel[:2]
        speed = float(np.hypot(*velocity))
        data.xfrc_applied[model.body("head").id, :2] = -force_n(speed) * velocity / max(speed, 1e-9)

    return Change(right=right, force=force)


def _fin_coefficients(factor: float) -> Change:
    """Scale drag and lift of the fin."""

    def change(model: mujoco.MjModel) -> None:
        model.geom_fluid[model.geom("caudal_fin").id, 1:6] *= factor

    return Change(right="segment_coefficients", compiled=change)


_SIDES = np.array([[1.0], [-1.0]])  # left and right
CHANGES: Mapping[str, Callable[[float], Change]] = {
    "current": lambda s: _current(0.015 * s, 0.01 * s),
    "unequal tendons": lambda s: _of_tendons(
        "tendon_asymmetry", "tendon_lengthspring", lambda length: length + _SIDES * (0.0015 * s) / 2
    ),
    "slack": lambda s: _of_tendons(
        "tendon_slack", "tendon_lengthspring", lambda length: length + 0.0012 * s * np.array([-1.0, 1.0])
    ),
    "soft tendons": lambda s: _of_tendons("tendon_compliance", "tendon_stiffness", lambda k: k / (1 + 3.0 * s)),
    "crank arm": lambda s: _crank_arm(-0.05 * s),
    "stiffer": lambda s: _of_hinges("stiffness_error", "jnt_stiffness", lambda k: k * (1 + 0.2 * s)),
    "softer to the tip": lambda s: _of_hinges(
        "stiffness_gradient", "jnt_stiffness", lambda k: k * (1 + 0.2 * s * (1 - np.arange(5) / 2))
    ),
    "hardening": lambda s: _hinge_torque("stiffness_hardening", lambda q, _v: -2.0 * s * q**3),
    "damping": lambda s: _of_hinges("joint_damping", "dof_damping", lambda c: c * (1 + 0.8 * s)),
    "friction": lambda s: _hinge_torque("joint_friction", lambda _q, v: -0.02 * s * np.tanh(v / 0.05)),
    "warped": lambda s: _of_hinges("bend_offset", "qpos_spring", lambda q: np.full_like(q, 0.02 * s)),
    "mass near the tip": lambda s: _tip_mass(0.02 * s),
    "line in tow": lambda s: _towed("linear_drag", lambda u: 0.3 * s * u),
    "skin": lambda s: _towed("skin_friction", lambda u: 0.2 * s * u**1.5),
    "fin's own coefficients": lambda s: _fin_coefficients(1 + 0.25 * s),
    "motor sags": lambda s: Change(right="motor_speed_sag", speed=lambda hz, _angle: 1 - 0.03 * s * hz**2),
    "motor turns unevenly": lambda s: Change(
        right="motor_speed_ripple", speed=lambda _hz, angle: 1 + 0.06 * s * np.cos(2 * angle)
    ),
    "gear": lambda s: Change(right="drive_ratio_error", speed=lambda _hz, _angle: 1 + 0.03 * s),
    "clock": lambda s: Change(right="time_base_error", fault=clock(1 + 0.03 * s)),
    "scale": lambda s: Change(right="scale_error", scale=1 + 0.04 * s),
    "drift": lambda s: Change(right="tracker_drift", fault=drift("tail_4", 0.002 * s)),
    "marker": lambda s: Change(right="marker_offset", fault=offset("tail_3", 0.006 * s)),
    "neck": lambda s: Change(right="head_frame_misalignment", fault=offset("neck", 0.005 * s)),
    "lens": lambda s: Change(right="lens_distortion", fault=lens(-0.05 * s)),
    "low camera": lambda s: Change(right="camera_parallax", height_m=3.0 / s),
    "shutter": lambda s: Change(right="rolling_shutter", fault=shutter(0.012 * s)),
    "gust": lambda s: _gust(0.04 * s),
    "shaken camera": lambda s: Change(fault=shaken(6.0 * s)),
}
"""Changes by name, from their strength, 1 to 2."""


def plan_plain(seed: int, unchanged: int, changed: int) -> tuple[ChangePlan, ...]:
    """Plan sessions with these changes."""
    return plan_changes((seed, 71), "m", unchanged, tuple(CHANGES), changed)


def make_plain(folder: Path, plans: Sequence[ChangePlan]) -> int:
    """Make the sessions that are missing, with their answers in `folder/answers`; return how many."""
    todo = missing(folder, plans)
    for plan in todo:
        _make(folder, plan).write(folder)
    return len(todo)


def _make(folder: Path, plan: ChangePlan) -> ChangeAnswer:
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
    right = (change.right,) if change.right else ()
    return ChangeAnswer(plan.name, PLAIN, plan.change, right, strength, plan.seed)


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
        data.ctrl[0] = 2 * np.pi * hz * change.speed(hz, data.qpos[crank])
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
