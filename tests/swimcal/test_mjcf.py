import mujoco
import numpy as np
import pytest

from swimcal.mjcf import DRY, FREE_DECAY, SWIM, FluidCoefficients, Scene, build_mjcf
from swimcal.robot import RobotSpec, load_robot
from swimcal.runs import model_sha256
from swimcal.twin import Twin
from tests.swimcal.engine_state import at_pose, random_state
from tests.swimcal.robots import every_robot

OTHER = FluidCoefficients(1.0, 2.0, 3.0, 4.0, 5.0)
TENDONS = ("tendon_left", "tendon_right")


def joints(model: mujoco.MjModel) -> list[str]:
    return [model.joint(i).name for i in range(model.njnt)]


def from_text(robot: RobotSpec, scene: Scene = SWIM) -> mujoco.MjModel:
    """The model as a stranger with the exported text alone gets it."""
    spec = build_mjcf(robot, OTHER, scene)
    spec.compile()
    return mujoco.MjModel.from_xml_string(spec.to_xml())


def routed(model: mujoco.MjModel, tendon: str) -> list[str]:
    """Names of the sites that a tendon runs through."""
    number = model.tendon(tendon).id
    first, count = model.tendon_adr[number], model.tendon_num[number]
    assert (model.wrap_type[first : first + count] == mujoco.mjtWrap.mjWRAP_SITE).all()
    return [model.site(i).name for i in model.wrap_objid[first : first + count]]


@every_robot
def test_names_are_those_of_the_contract(robot: RobotSpec) -> None:
    model = build_mjcf(robot).compile()
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    assert bodies == ["head", "crank", *robot.hinges]
    assert joints(model) == ["surge", "sway", "yaw", "crank", *robot.hinges]
    assert tuple(model.tendon(i).name for i in range(model.ntendon)) == TENDONS
    assert [model.actuator(i).name for i in range(model.nu)] == ["motor"]
    sites = {model.site(i).name for i in range(model.nsite)}
    assert {s for s in sites if s.startswith("marker_")} == {f"marker_{name}" for name in robot.markers}


def test_the_time_step_is_that_of_the_robots_file() -> None:
    fish = load_robot()
    finer = fish.model_copy(update={"time_step_s": 0.0015})
    assert build_mjcf(fish).compile().opt.timestep == 0.0045
    assert build_mjcf(finer).compile().opt.timestep == Twin(finer).scene.timestep_s == 0.0015
    assert model_sha256(finer) != model_sha256(fish)


@every_robot
def test_tendons_start_at_opposite_anchors_of_the_crank_and_pass_every_segment(robot: RobotSpec) -> None:
    model = build_mjcf(robot).compile()
    crank = model.body("crank").id
    for tendon, side in zip(TENDONS, ("left", "right"), strict=True):
        anchor, *guides = routed(model, tendon)
        assert anchor == f"anchor_{side}"
        assert model.site(anchor).bodyid[0] == crank
        other = "right" if side == "left" else "left"
        expected = [
            f"guide_{i}_{other if segment.tendon_crosses else side}"
            for i, segment in enumerate(robot.tail.segment, start=1)
        ]
        assert guides == expected
    left, right = model.site("anchor_left").pos, model.site("anchor_right").pos
    np.testing.assert_array_equal(left, -right)  # arms 180 degrees apart; left is -y
    np.testing.assert_allclose(right[1:], [robot.crank.anchor_offset_m, robot.crank.anchor_radius_m])


@every_robot
def test_stiffness_and_damping_are_in_joints_and_tendons(robot: RobotSpec) -> None:
    model = build_mjcf(robot).compile()
    for hinge in robot.hinges:
        assert model.joint(hinge).stiffness[0] == robot.tail.hinge_stiffness_n_m
        assert model.joint(hinge).damping[0] == robot.tail.hinge_damping_n_m_s
    assert (model.tendon_stiffness == robot.tendons.stiffness_n_m).all()
    assert (model.tendon_damping == robot.tendons.damping_n_s_m).all()
    at_rest = at_pose(model, {}).ten_length  # straight
    np.testing.assert_allclose(model.tendon_lengthspring, np.stack([at_rest, at_rest], axis=1), rtol=1e-12)


@every_robot
def test_motion_is_planar(robot: RobotSpec) -> None:
    model = build_mjcf(robot).compile()
    straight, bent = at_pose(model, {}), random_state(model, 0)
    on_links = [i for i in range(model.nsite) if model.site_bodyid[i] != model.body("crank").id]
    np.testing.assert_allclose(bent.site_xpos[on_links, 2], straight.site_xpos[on_links, 2], atol=1e-12)
    assert not model.opt.gravity.any()


@every_robot
def test_each_rigid_link_carries_one_fluid_ellipsoid_and_the_last_the_fins_too(robot: RobotSpec) -> None:
    model = build_mjcf(robot, OTHER).compile()
    wet = np.flatnonzero(model.geom_fluid[:, 0] > 0)
    carriers = [model.body(model.geom_bodyid[i]).name for i in wet]
    assert carriers == ["head", *robot.hinges, robot.hinges[-1]]
    assert (model.geom_fluid[wet, 1:6] == OTHER).all()
    assert model.geom("caudal_fin").id in wet


@every_robot
def test_head_part_names_cannot_clash_with_those_of_the_model(robot: RobotSpec) -> None:
    taken = ("head_fluid", "caudal_fin", "crank_axis", "crank_arm_left", "tail_1_plate")
    parts = tuple(robot.head.part[0].model_copy(update={"name": name}) for name in taken)
    head = robot.head.model_copy(update={"part": parts})
    build_mjcf(robot.model_copy(update={"head": head})).compile()


@pytest.mark.parametrize("scene", [DRY, FREE_DECAY], ids=["dry", "free_decay"])
@every_robot
def test_clamped_in_air_the_head_has_no_joints_and_nothing_feels_the_fluid(robot: RobotSpec, scene: Scene) -> None:
    model = build_mjcf(robot, OTHER, scene).compile()
    assert joints(model) == ["crank", *robot.hinges]
    assert model.ntendon == (2 if scene.with_tendons else 0)
    assert not random_state(model, 1).qfrc_fluid.any()


@pytest.mark.parametrize("scene", [SWIM, DRY, FREE_DECAY], ids=["swim", "dry", "free_decay"])
@every_robot
def test_the_exported_text_alone_gives_the_same_model(robot: RobotSpec, scene: Scene) -> None:
    built, read = build_mjcf(robot, OTHER, scene).compile(), from_text(robot, scene)
    for field in (
        "body_mass",
        "body_inertia",
        "body_ipos",
        "geom_size",
        "geom_fluid",
        "jnt_stiffness",
        "dof_damping",
        "dof_armature",
        "tendon_stiffness",
        "tendon_damping",
        "actuator_gainprm",
        "actuator_biasprm",
        "site_pos",
    ):
        np.testing.assert_allclose(getattr(read, field), getattr(built, field), rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(read.tendon_lengthspring, built.tendon_lengthspring, rtol=5e-6)  # 6 digits
    option, original = read.opt, built.opt
    assert (option.timestep, option.integrator, option.disableflags) == (
        original.timestep,
        original.integrator,
        original.disableflags,
    )
    assert (option.density, option.viscosity) == (original.density, original.viscosity)
    np.testing.assert_allclose(random_state(read, 2).ten_length, random_state(built, 2).ten_length, rtol=1e-12)


@every_robot
def test_the_exported_text_alone_swims_the_same_way(robot: RobotSpec) -> None:
    ends = []
    for model in (build_mjcf(robot, OTHER).compile(), from_text(robot)):
        data = mujoco.MjData(model)
        data.ctrl[0] = data.joint("crank").qvel[0] = 2 * np.pi
        mujoco.mj_step(model, data, 400)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-5)
