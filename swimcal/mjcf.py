"""The robot as an MJCF model: bodies, hinges, tendons, fluid coefficients and scenery.

`build_mjcf` builds the model with `MjSpec`, in the names of the public contract. It is planar: `surge`, `sway` and
`yaw` of the head, the `crank`, and one hinge a tail segment. Every rigid link carries one fluid ellipsoid (the caudal
fin a second one on the last link), so a step costs a fraction of the published model's. Guide plates and flexible
strips weigh on it; the water does not feel them. Two spatial tendons run from the crank's arms through the guides of
the segments.

`FluidCoefficients` are those of MuJoCo's ellipsoid fluid model, and `added_volumes` gives the water that an ellipsoid
carries: MuJoCo's documentation, chapter Computation, section "Ellipsoid model" (after Andersen, Pesavento and Wang, J.
Fluid Mech. 541 (2005)), as restated in "Simple Models, Real Swimming" (2026).

`add_scenery` makes an exported MJCF pleasant to look at and ready to use: light, floor, cameras, sensors, a limited
control. Nothing of it touches the dynamics: the model swims the same trajectory to the last digit, unless it blows up.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.linalg import eigh
from scipy.special import elliprd

from swimcal.robot import TIME_STEP_S, Point, RobotSpec, Segment

COEFFICIENT_BOUNDS = (0.0, 10.0)
"""Bounds within which each coefficient is fitted, as published."""

# The robot.
SIDES = (("left", -1.0), ("right", +1.0))  # heading is -x and z is up, so left is -y

_PLASTIC = (0.33, 0.55, 0.78, 1.0)
_FRAME = (0.62, 0.65, 0.70, 1.0)
_FIN = (0.90, 0.45, 0.25, 1.0)
_MARKER = (0.95, 0.60, 0.10, 1.0)
_SPECK_M = 1e-4
_SPECK_KG = 1e-3
_ARM_HALF_WIDTH_M = 0.005  # only seen, without mass
_STRIP_HALF_THICKNESS_M = 0.0005

# Scenery, and the control of the crank.
FASTEST_TURNS_PER_S = 15.0
"""Range of the crank's control; as fast as tails are driven (Zhu et al., Sci. Robot. 4, 2019)."""

_FLOOR_M = -0.4
_WATER = (0.80, 0.91, 0.95)
_DEEP = (0.28, 0.52, 0.62)
_TILE = (0.30, 0.52, 0.60)
_JOINT = (0.45, 0.66, 0.72)


class FluidCoefficients(NamedTuple):
    """The five dimensionless coefficients, in the engine's order."""

    blunt_drag: float
    slender_drag: float
    angular_drag: float
    kutta_lift: float
    magnus_lift: float

    def __str__(self) -> str:
        return ", ".join(f"{name.replace('_', ' ')} {value:.3g}" for name, value in self._asdict().items())


PUBLISHED_COEFFICIENTS = FluidCoefficients(0.40, 7.79, 2.81, 3.84, 0.27)


def added_volumes(semi_axes_m: np.ndarray) -> np.ndarray:
    """Return the volumes of water (3,) that an ellipsoid carries along each axis, m^3.

    Times the density they are its added masses. Lamb, Hydrodynamics, article 114; the integrals alpha_i are Carlson's
    R_D.
    """
    r = semi_axes_m
    alpha = np.array([2 / 3 * np.prod(r) * elliprd(r[i - 2] ** 2, r[i - 1] ** 2, r[i] ** 2) for i in range(3)])
    return np.asarray(float(4 / 3 * np.pi * np.prod(r)) * alpha / (2 - alpha))


@dataclass(frozen=True)
class Scene:
    """Surroundings of the robot: water, or air with its head clamped; with or without its tendons."""

    in_water: bool = True
    head_clamped: bool = False
    with_tendons: bool = True
    timestep_s: float = TIME_STEP_S


SWIM = Scene()
DRY = Scene(in_water=False, head_clamped=True)
FREE_DECAY = Scene(in_water=False, head_clamped=True, with_tendons=False)


def swim_scene(robot: RobotSpec) -> Scene:
    """Return the scene of a swim, with the time step that the robot's description asks for."""
    return replace(SWIM, timestep_s=robot.time_step_s)


def build_mjcf(
    robot: RobotSpec,
    coefficients: FluidCoefficients = PUBLISHED_COEFFICIENTS,
    scene: Scene | None = None,
) -> mujoco.MjSpec:
    """Build the MJCF of a robot, uncompiled: `.compile()` gives the model, `.to_xml()` the text once compiled.

    Args:
        robot: the robot.
        coefficients: MuJoCo's five fluid coefficients, the same for every link.
        scene: water or air, head free or clamped, tendons or none; default: swimming, with the time step of the robot.
    """
    scene = scene or swim_scene(robot)
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    _set_options(spec, robot, scene)
    head = _add_head(spec, robot, coefficients, scene)
    _add_crank(head, robot)
    last = _add_tail(head, robot, coefficients)
    fin = robot.caudal_fin
    centre = (robot.fin_root_x_m + fin.centre_m - float(robot.hinge_x_m[-1]), 0.0, 0.0)
    half_size = (fin.chord_m / 2, fin.thickness_m / 2, fin.span_m / 2)
    _add_plate(last, "caudal_fin", centre, half_size, fin.mass_kg, coefficients)
    _add_markers(spec, robot)
    if scene.with_tendons:
        for side, sign in SIDES:
            _add_tendon(spec, robot, side, sign)
    motor = spec.add_actuator(name="motor", target="crank", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.set_to_velocity(kv=robot.crank.speed_gain_n_m_s)
    return spec


def natural_hz(robot: RobotSpec) -> float:
    """Return the lowest natural frequency of the straight tail in air, without tendons, its head clamped, Hz.

    It follows from the engine's mass matrix and the stiffness of the hinges, undamped.
    """
    model = build_mjcf(robot, scene=FREE_DECAY).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    hinges = [model.joint(name).dofadr[0] for name in robot.hinges]
    stiffness = np.array([model.joint(name).stiffness[0] for name in robot.hinges])
    squares = eigh(np.diag(stiffness), inertia[np.ix_(hinges, hinges)], eigvals_only=True)
    return float(np.sqrt(squares[0]) / (2 * np.pi))


def _set_options(spec: mujoco.MjSpec, robot: RobotSpec, scene: Scene) -> None:
    option = spec.option
    option.timestep = scene.timestep_s
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICIT
    option.gravity = (0.0, 0.0, 0.0)
    if scene.in_water:
        option.density, option.viscosity = robot.water.density_kg_m3, robot.water.viscosity_pa_s
    flags = mujoco.mjtDisableBit
    # No constraints to solve; and a state that blows up must stay visible, so the engine may not reset it.
    option.disableflags = int(flags.mjDSBL_CONSTRAINT | flags.mjDSBL_CONTACT | flags.mjDSBL_AUTORESET)
    spec.compiler.degree = False
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1080


def _add_head(spec: mujoco.MjSpec, robot: RobotSpec, coefficients: FluidCoefficients, scene: Scene) -> mujoco.MjsBody:
    head = spec.worldbody.add_body(name="head")
    if not scene.head_clamped:
        slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
        head.add_joint(name="surge", type=slide, axis=(1, 0, 0))
        head.add_joint(name="sway", type=slide, axis=(0, 1, 0))
        head.add_joint(name="yaw", type=hinge, axis=(0, 0, 1))
    for part in robot.head.part:
        # The prefix keeps the name apart from those of all other geoms.
        _add_dry_box(head, f"part_{part.name}", part.centre_m, part.half_size_m, part.mass_kg, _FRAME)
    _add_plate(head, "head_fluid", robot.head.fluid_centre_m, robot.head.fluid_half_size_m, 0.0, coefficients)
    return head


def _add_dry_box(
    body: mujoco.MjsBody,
    name: str,
    centre_m: Point,
    half_size_m: Point,
    mass_kg: float,
    rgba: tuple[float, ...] = _PLASTIC,
) -> None:
    """Add a box of uniform density that the water does not feel: the body has a fluid ellipsoid of its own."""
    box = mujoco.mjtGeom.mjGEOM_BOX
    body.add_geom(name=name, type=box, pos=centre_m, size=half_size_m, mass=mass_kg, rgba=rgba)


def _add_plate(
    body: mujoco.MjsBody,
    name: str,
    centre_m: tuple[float, float, float],
    half_size_m: tuple[float, float, float],
    mass_kg: float,
    coefficients: FluidCoefficients,
) -> None:
    """Add a box whose fluid forces are those of the ellipsoid with its half sizes as semi-axes."""
    geom = body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=centre_m,
        size=half_size_m,
        mass=mass_kg,
        rgba=_FRAME if name == "head_fluid" else _FIN if name == "caudal_fin" else _PLASTIC,
        fluid_ellipsoid=1,
        fluid_coefs=coefficients,
    )
    if mass_kg == 0.0:
        geom.rgba = (*_FRAME[:3], 0.25)


def _add_crank(head: mujoco.MjsBody, robot: RobotSpec) -> None:
    crank = head.add_body(name="crank", pos=robot.crank.position_m)
    crank.add_joint(name="crank", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 1, 0), armature=robot.crank.armature_kg_m2)
    # The shaft's own mass is a part of the head and its inertia the armature's: this speck only satisfies the
    # compiler, and is too small for the water to feel.
    crank.add_geom(name="crank_axis", size=(_SPECK_M, 0, 0), mass=_SPECK_KG, rgba=_FRAME)
    for side, sign in SIDES:
        middle = (0.0, sign * robot.crank.anchor_offset_m, sign * robot.crank.arm_m / 2)
        half_size = (_ARM_HALF_WIDTH_M, _ARM_HALF_WIDTH_M / 2, robot.crank.arm_m / 2)
        box = mujoco.mjtGeom.mjGEOM_BOX
        crank.add_geom(name=f"crank_arm_{side}", type=box, pos=middle, size=half_size, mass=0.0, rgba=_FIN)
    for side, sign in SIDES:
        crank.add_site(
            name=f"anchor_{side}",
            pos=(0.0, sign * robot.crank.anchor_offset_m, sign * robot.crank.anchor_radius_m),
            size=(0.004, 0.004, 0.004),
        )


def _add_tail(head: mujoco.MjsBody, robot: RobotSpec, coefficients: FluidCoefficients) -> mujoco.MjsBody:
    """Add the segments as a chain, each body's origin at its hinge, and return the last body."""
    body, origin = head, 0.0
    for i, (segment, hinge_x) in enumerate(zip(robot.tail.segment, robot.hinge_x_m, strict=True)):
        body = body.add_body(name=robot.hinges[i], pos=(hinge_x - origin, 0.0, 0.0))
        origin = hinge_x
        body.add_joint(
            name=robot.hinges[i],
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=(0, 0, 1),
            stiffness=robot.tail.hinge_stiffness_n_m,
            damping=robot.tail.hinge_damping_n_m_s,
        )
        rear = robot.segment_x_m[i, 1] - hinge_x
        guide_x = rear - robot.tail.guide_inset_m
        _add_link_plate(body, robot, i, coefficients)
        _add_guide_plates(body, robot, i, guide_x)
        _add_strips(body, robot, i, rear)
        for side, sign in SIDES:
            body.add_site(
                name=f"guide_{i + 1}_{side}",
                pos=(guide_x, sign * segment.guide_offset_m, 0.0),
                size=(0.002, 0.002, 0.002),
            )
    return body


def _add_link_plate(body: mujoco.MjsBody, robot: RobotSpec, i: int, coefficients: FluidCoefficients) -> None:
    """Add the link's plate, from its hinge to the next one: the flexible gaps are part of the surface."""
    segments: tuple[Segment, ...] = robot.tail.segment
    segment, start = segments[i], float(robot.hinge_x_m[i])
    end = float(robot.hinge_x_m[i + 1]) if i + 1 < len(segments) else robot.fin_root_x_m
    half = (end - start) / 2
    _add_plate(
        body,
        f"{robot.hinges[i]}_plate",
        (half, 0.0, 0.0),
        (half, segment.thickness_m / 2, segment.half_height_m),
        robot.segment_mass_kg(i),
        coefficients,
    )


def _add_guide_plates(body: mujoco.MjsBody, robot: RobotSpec, i: int, guide_x: float) -> None:
    """Add the guide plates, which stand across from either side of the segment."""
    segment, tail = robot.tail.segment[i], robot.tail
    if (width := segment.guide_plate_width_m) == 0:
        return
    half_size = (tail.guide_plate_length_m / 2, width / 2, tail.guide_plate_height_m / 2)
    for side, sign in SIDES:
        centre = (guide_x, sign * (segment.thickness_m + width) / 2, 0.0)
        _add_dry_box(body, f"guide_plate_{i + 1}_{side}", centre, half_size, robot.guide_plate_mass_kg(i))


def _add_strips(body: mujoco.MjsBody, robot: RobotSpec, i: int, rear: float) -> None:
    """Add the strips of the link.

    The front one runs from its hinge to its segment, the rear one half over the next gap or to the fin's root.
    """
    segments, fin = robot.tail.segment, robot.caudal_fin
    front, height = segments[i].gap_m / 2, segments[i].half_height_m
    if i + 1 < len(segments):
        end, behind_kg = rear + segments[i + 1].gap_m / 2, segments[i + 1].strip_mass_kg
    else:
        end, behind_kg = rear + fin.gap_m, fin.strip_mass_kg
    for place, start, stop, kg in (("front", 0.0, front, segments[i].strip_mass_kg), ("rear", rear, end, behind_kg)):
        if kg > 0:
            half_size = ((stop - start) / 2, _STRIP_HALF_THICKNESS_M, height)
            _add_dry_box(body, f"strip_{i + 1}_{place}", ((start + stop) / 2, 0.0, 0.0), half_size, kg)


def _add_markers(spec: mujoco.MjSpec, robot: RobotSpec) -> None:
    origins = {"head": 0.0, **dict(zip(robot.hinges, robot.hinge_x_m, strict=True))}
    for name, marker in robot.markers.items():
        x, y, z = marker.position_m
        spec.body(marker.body).add_site(
            name=f"marker_{name}",
            pos=(x - origins[marker.body], y, z),
            size=(0.006, 0.006, 0.006),
            rgba=_MARKER,
        )


def _add_tendon(spec: mujoco.MjSpec, robot: RobotSpec, side: str, sign: float) -> None:
    tendon = spec.add_tendon(
        name=f"tendon_{side}",
        stiffness=np.array([robot.tendons.stiffness_n_m, 0.0, 0.0]),
        damping=np.array([robot.tendons.damping_n_s_m, 0.0, 0.0]),
        width=0.001,
    )
    tendon.wrap_site(f"anchor_{side}")
    other = "right" if sign < 0 else "left"
    for i, segment in enumerate(robot.tail.segment):
        tendon.wrap_site(f"guide_{i + 1}_{other if segment.tendon_crosses else side}")


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
    # The engine's default, the only one that MuJoCo Warp takes: here a simulation that blows up may be reset.
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
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
