"""Additions that make an exported MJCF pleasant to look at and ready to use: light, floor, cameras, sensors, a limited
control.

Nothing of it touches the dynamics: the model swims the same trajectory to the last digit.
"""

import mujoco
import numpy as np

from swimmer.robot import RobotSpec

FASTEST_TURNS_PER_S = 15.0
"""Range of the crank's control; as fast as tails are driven (Zhu et al., Sci. Robot. 4, 2019)."""

_FLOOR_M = -0.4
_WATER = (0.80, 0.91, 0.95)
_DEEP = (0.28, 0.52, 0.62)
_TILE = (0.30, 0.52, 0.60)
_JOINT = (0.45, 0.66, 0.72)


def add_scenery(spec: mujoco.MjSpec, robot: RobotSpec) -> mujoco.MjSpec:
    """Put a robot into a pool to look at, with sensors, and return it.

    Cameras: `follow` goes along next to the robot, `above` looks straight down as over a pool. Sensors: `head_position`
    (m), `head_orientation` (quaternion), `head_velocity` (m/s), `crank_angle` (rad), `crank_speed` (rad/s) and
    `<hinge>_angle` (rad).

    Args:
        spec: the model, as `build_mjcf` made it.
        robot: the robot.
    """
    _add_pool(spec)
    head = spec.body("head")
    along = mujoco.mjtCamLight.mjCAMLIGHT_TRACK
    middle = robot.fin_root_x_m / 2
    length = robot.fin_root_x_m
    place = np.array([middle - 0.6 * length, -1.6 * length, 1.1 * length])
    head.add_camera(name="follow", mode=along, pos=place, xyaxes=_look_at(place, np.array([middle, 0.0, 0.0])))
    head.add_camera(name="above", mode=along, pos=(middle, 0.0, 1.2), xyaxes=(1, 0, 0, 0, 1, 0))
    motor = spec.actuator("motor")
    motor.ctrlrange = (-2 * np.pi * FASTEST_TURNS_PER_S, 2 * np.pi * FASTEST_TURNS_PER_S)
    motor.ctrllimited = True
    _add_sensors(spec, robot)
    return spec


def _look_at(place_m: np.ndarray, at_m: np.ndarray) -> np.ndarray:
    """Return the x and y axis (6,) of a camera that looks at a point, upright."""
    ahead = (at_m - place_m) / np.linalg.norm(at_m - place_m)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return np.concatenate([right, np.cross(right, ahead)])


def _add_pool(spec: mujoco.MjSpec) -> None:
    texture = mujoco.mjtTexture
    sky = spec.add_texture(name="sky", type=texture.mjTEXTURE_SKYBOX, width=256, height=256, rgb1=_WATER, rgb2=_DEEP)
    sky.builtin = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    tiles = spec.add_texture(name="tiles", type=texture.mjTEXTURE_2D, width=256, height=256, rgb1=_TILE, rgb2=_TILE)
    tiles.builtin, tiles.mark, tiles.markrgb = mujoco.mjtBuiltin.mjBUILTIN_FLAT, mujoco.mjtMark.mjMARK_EDGE, _JOINT
    material = spec.add_material(name="tiles", texrepeat=(5, 5), texuniform=True, reflectance=0.05)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0.0, 0.0, _FLOOR_M),
        size=(0.0, 0.0, 0.05),
        material="tiles",
        contype=0,
        conaffinity=0,
    )
    sun = spec.worldbody.add_light(name="sun", pos=(0.0, 0.0, 3.0), dir=(0.3, 0.2, -1.0), diffuse=(0.75, 0.75, 0.75))
    sun.type, sun.castshadow = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, False
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (0.35, 0.35, 0.35), (0.25, 0.25, 0.25)


def _add_sensors(spec: mujoco.MjSpec, robot: RobotSpec) -> None:
    kind, body, joint = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_XBODY, mujoco.mjtObj.mjOBJ_JOINT
    sensors = [
        ("head_position", kind.mjSENS_FRAMEPOS, body, "head"),
        ("head_orientation", kind.mjSENS_FRAMEQUAT, body, "head"),
        ("head_velocity", kind.mjSENS_FRAMELINVEL, body, "head"),
        ("crank_angle", kind.mjSENS_JOINTPOS, joint, "crank"),
        ("crank_speed", kind.mjSENS_JOINTVEL, joint, "crank"),
        *((f"{hinge}_angle", kind.mjSENS_JOINTPOS, joint, hinge) for hinge in robot.hinges),
    ]
    for name, type_, object_type, object_name in sensors:
        spec.add_sensor(name=name, type=type_, objtype=object_type, objname=object_name)
