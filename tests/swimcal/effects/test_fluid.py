"""What the effects of the water do, against closed forms, the engine's Jacobians, conservation and symmetry."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from swimcal.ebt import TailMotion
from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect, Observation, Plates, StepState, View
from swimcal.effects.water import DAMPING, NATURAL_ROLL_HZ, PITCH_HZ, ROLL_HZ, SLOW_M_S
from swimcal.mjcf import SWIM, FluidCoefficients, Scene, build_mjcf
from swimcal.robot import RobotSpec
from swimcal.runs import Runs
from swimcal.twin import Twin
from tests.swimcal.effects.swims import PLAIN
from tests.swimcal.engine_state import random_state
from tests.swimcal.robots import FISH, changed, every_robot
from tests.swimcal.thrust import mean_thrust

REACTION = catalogue()["added_mass_reaction"]
CURRENT = catalogue()["background_current"]
FRICTION = catalogue()["skin_friction"]
LINEAR = catalogue()["linear_drag"]
MEMORY = catalogue()["fluid_memory"]
ROLL = catalogue()["hull_roll"]
SEGMENTS = catalogue()["segment_coefficients"]
SURFACE = catalogue()["surface_motion"]
WALL = catalogue()["wall_proximity"]
WAVES = catalogue()["wave_drag"]

RHO = 1000.0
PLATES = Plates(FISH, SWIM)
NO_DRAG = FluidCoefficients(0.0, 0.0, 0.0, 0.0, 0.0)
IDEAL = changed(FISH, water={"viscosity_pa_s": 0.0}, tail={"hinge_damping_n_m_s": 0.0})  # nothing takes energy
SURGE, SWAY, YAW = range(3)


def model_with(effect: Effect, values: np.ndarray, robot: RobotSpec, scene: Scene = SWIM) -> mujoco.MjModel:
    spec = build_mjcf(robot, NO_DRAG, scene)
    effect.mjcf(spec, robot, scene, values)
    return spec.compile()


def state_of(data: mujoco.MjData, plates: Plates = PLATES) -> StepState:
    return StepState(data.time, data.qpos[None], data.qvel[None], data.qacc[None], data.qfrc_fluid[None], plates)


def straight(**velocity: float) -> StepState:
    """The straight robot at the origin, with joints that move at the given rates."""
    data = mujoco.MjData(PLAIN.model)
    for joint, rate in velocity.items():
        data.joint(joint).qvel[0] = rate
    return state_of(data)


def force_of(effect: Effect, value: float, state: StepState, robot: RobotSpec = FISH) -> np.ndarray:
    """(v,) on the first step."""
    force = effect.force(robot, SWIM, np.array([[value]]))
    assert force is not None
    return force(state)[0]


def jacobians(model: mujoco.MjModel, data: mujoco.MjData, plate: str) -> tuple[np.ndarray, np.ndarray]:
    """(3, v) of the velocity of a plate's centre and of its turning, in its own axes."""
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    geom = model.geom(plate).id
    mujoco.mj_jac(model, data, linear, angular, data.geom_xpos[geom], model.geom_bodyid[geom])
    own = data.geom_xmat[geom].reshape(3, 3).T
    return own @ linear, own @ angular


def water_inertia(robot: RobotSpec, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """(v, v) of the water that plates carry across themselves, by slender body theory."""
    inertia = np.zeros((model.nv, model.nv))
    for plate in Plates(robot, SWIM).names:
        length, thickness, depth = 2 * model.geom(plate).size
        mass = robot.water.density_kg_m3 * np.pi / 4 * depth**2 * length
        linear, angular = jacobians(model, data, plate)
        turning = mass * (length**2 + thickness**2) / 12
        inertia += mass * np.outer(linear[1], linear[1]) + turning * np.outer(angular[2], angular[2])
    return inertia


def body_inertia(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return inertia


# ---- the plates ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("head_clamped", [False, True])
@every_robot
def test_plates_move_and_push_as_in_the_engine(robot: RobotSpec, head_clamped: bool) -> None:
    scene = replace(SWIM, head_clamped=head_clamped)
    model, plates = build_mjcf(robot, scene=scene).compile(), Plates(robot, scene)
    data = random_state(model, 1)
    motion = plates.motion(data.qpos[None], data.qvel[None])
    force = np.random.default_rng(0).normal(size=(len(plates.names), 2)) @ [1, 1j]
    torque = np.random.default_rng(1).normal(size=len(plates.names))
    expected = np.zeros(model.nv)
    for p, plate in enumerate(plates.names):
        place, axes = data.geom(plate).xpos, data.geom(plate).xmat.reshape(3, 3)
        linear, angular = jacobians(model, data, plate)
        assert model.geom(plate).size == pytest.approx(plates.half_m[p])
        assert motion.place[0, p] == pytest.approx(place[0] + 1j * place[1])
        assert motion.velocity[0, p] == pytest.approx((axes @ linear @ data.qvel)[:2] @ [1, 1j])
        assert motion.along[0, p] == pytest.approx(axes[:2, 0] @ [1, 1j])
        assert motion.turning[0, p] == pytest.approx((angular @ data.qvel)[2])
        expected += (axes @ linear).T @ [force[p].real, force[p].imag, 0.0] + angular[2] * torque[p]
    np.testing.assert_allclose(plates.generalised(force[None], motion, torque[None])[0], expected, atol=1e-12)


# ---- added mass ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("joint", ["sway", "yaw", "tail_1", "tail_3"])
@every_robot
def test_a_push_across_a_straight_robot_accelerates_body_and_water(robot: RobotSpec, joint: str) -> None:
    scale = 0.7
    model, plain = model_with(REACTION, np.array([scale]), robot), build_mjcf(robot, NO_DRAG).compile()
    data, bare = mujoco.MjData(model), mujoco.MjData(plain)
    data.joint(joint).qfrc_applied[0] = 1.0
    mujoco.mj_forward(model, data), mujoco.mj_forward(plain, bare)
    both = body_inertia(plain, bare) + scale * water_inertia(robot, plain, bare)
    expected = np.linalg.solve(both, data.qfrc_applied)
    np.testing.assert_allclose(data.qacc, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("speed", [0.0, 0.15])
def test_a_small_wave_of_the_tail_gives_the_thrust_of_elongated_body_theory(speed: float) -> None:
    """Head held on its way: T = 1/2 m (<h_t^2> - U^2 <h_x^2>) at the tail's end, with what the engine does of it."""
    steps, turn = 500, 2 * np.pi * 1.0
    scene = replace(SWIM, with_tendons=False, timestep_s=1 / steps)
    model, plain = model_with(REACTION, np.ones(1), IDEAL, scene), build_mjcf(IDEAL, NO_DRAG, scene).compile()
    force, hinges = REACTION.force(IDEAL, scene, np.ones((1, 1))), np.arange(4, 9)
    assert force is not None
    data, bare, pushed = mujoco.MjData(model), mujoco.MjData(plain), np.zeros(2 * steps)
    for step in range(2 * steps):
        wave = 0.02 * np.exp(1j * (turn * step / steps - 0.8 * np.arange(5)))
        for each in (data, bare):
            each.qpos[hinges], each.qvel[hinges] = wave.real, (1j * turn * wave).real
            each.qvel[SURGE], each.qacc[hinges] = -speed, (-(turn**2) * wave).real
        mujoco.mj_inverse(model, data), mujoco.mj_inverse(plain, bare)
        inertia = (data.qfrc_inverse - bare.qfrc_inverse)[SURGE]
        pushed[step] = force(state_of(data))[0, SURGE] - inertia + bare.qfrc_fluid[SURGE]
    slope = 0.02 * np.cumsum(np.exp(-0.8j * np.arange(5)))  # complex amplitudes
    ends = np.diff(np.append(IDEAL.hinge_x_m, IDEAL.fin_root_x_m))
    fin = IDEAL.caudal_fin
    place = slope @ ends + slope[-1] * (fin.centre_m + fin.chord_m / 2)
    tip = TailMotion(np.array(turn**2 * abs(place) ** 2 / 2), np.array(abs(slope[-1]) ** 2 / 2))
    expected = mean_thrust(tip, np.array(speed), RHO * np.pi / 4 * fin.span_m**2)
    assert -pushed[steps:].mean() == pytest.approx(expected, rel=0.02)


# ---- coefficients, memory, current -----------------------------------------------------------------------------


def test_head_and_fin_alone_have_other_coefficients() -> None:
    own = FluidCoefficients(1.0, 2.0, 3.0, 4.0, 5.0)
    changed_, plain = (
        AffectedTwin(PLAIN, [SEGMENTS]).spec(own, np.array(values)).compile()
        for values in ([np.log(2), -np.log(2)], [0, 0])
    )
    ratio = changed_.geom_fluid[:, 1:6] / np.where(plain.geom_fluid[:, :1] > 0, plain.geom_fluid[:, 1:6], np.nan)
    for geom in np.flatnonzero(plain.geom_fluid[:, 0] > 0):
        factor = {"head_fluid": 2.0, "caudal_fin": 0.5}.get(plain.geom(geom).name, 1.0)
        assert ratio[geom] == pytest.approx(np.full(5, factor))


def test_half_of_a_force_comes_at_once_and_the_rest_on_the_way() -> None:
    """At 0.2 m/s a way of 20 mm lasts 0.1 s; the force is taken to rise evenly over its first step."""
    way, speed, dt = 0.02, 0.2, SWIM.timestep_s
    force, still = MEMORY.force(FISH, SWIM, np.array([[way], [0.0]])), np.zeros((2, 9))
    assert force is not None
    ahead = still.copy()
    ahead[:, SURGE] = -np.sqrt(speed**2 - SLOW_M_S**2)
    held = [force(StepState(k * dt, still, ahead, still, still + 2.0, PLATES))[:, SWAY] for k in range(100)]
    since = dt * (np.arange(100) + 0.5)
    assert 2.0 + np.array(held)[:, 0] == pytest.approx(2.0 * (1 - 0.5 * np.exp(-speed * since / way)), rel=1e-3)
    assert np.abs(np.array(held)[:, 1]).max() == 0


def test_a_swim_in_a_current_is_the_same_swim_carried_along() -> None:
    drift, time_s = np.array([0.1, -0.05]), np.linspace(0, 1.5, 16)
    own = np.tile([0.4, 2.0, 6.0, 4.0, 1.0], (1, 1))
    still = PLAIN.simulate(Runs(own, np.ones(1), np.ones(1), velocity=np.array([[-0.1, 0.0, 0.0]])), time_s)
    carried = AffectedRuns(own, np.ones(1), np.ones(1), velocity=np.array([[0.0, -0.05, 0.0]]), values=drift[None])
    found = AffectedTwin(PLAIN, [CURRENT]).simulate(carried, time_s)
    moved = still.marker_m + (time_s[:, None] * drift)[:, None]
    np.testing.assert_allclose(found.marker_m, moved, atol=1e-9)


# ---- wall and waves --------------------------------------------------------------------------------------------


def wetted() -> tuple[np.ndarray, np.ndarray]:
    """(p,) side areas and half depths of the plates."""
    half = PLATES.half_m
    return 4 * half[:, 0] * half[:, 2], half[:, 2]


def test_a_wall_resists_motion_across_it_by_the_square_of_depth_over_clearance() -> None:
    area, depth = wetted()
    share = depth**2 / (depth**2 + 0.25**2)
    for sign in (-1, 1):
        found = force_of(WALL, sign * 16.0, straight(sway=-0.3))
        assert found[SWAY] == pytest.approx(0.5 * RHO * 1.2 * 0.3**2 * (area * share).sum())
    far, farther = (force_of(WALL, nearness, straight(sway=-0.3))[SWAY] for nearness in (0.04, 0.01))
    assert far / farther == pytest.approx(4.0, rel=1e-3)


def test_a_wall_draws_what_passes_along_it_more_the_nearer_it_is() -> None:
    left, right = (force_of(WALL, nearness, straight(surge=-0.3))[SWAY] for nearness in (16.0, -16.0))
    area, depth = wetted()
    assert left == pytest.approx(-0.5 * RHO * 0.3**2 * (area * depth**2 * 0.25 / (depth**2 + 0.25**2) ** 1.5).sum())
    assert right == -left  # left is -y
    near = straight(surge=-0.3)
    near.position[0, SWAY] = -0.1  # towards the wall on the left
    assert force_of(WALL, 16.0, near)[SWAY] < 2 * left
    assert force_of(WALL, 16.0, near)[SWAY] == pytest.approx(force_of(WALL, 0.15**-2, straight(surge=-0.3))[SWAY])


def test_waves_resist_along_the_head_with_a_hump_at_froude_one_half() -> None:
    hull_speed = np.sqrt(9.81 * 0.355)
    on_hump = 0.5 * RHO * 0.1 * 0.3 * (0.5 * hull_speed) ** 2
    assert force_of(WAVES, 0.3, straight(surge=-0.5 * hull_speed))[SURGE] == pytest.approx(on_hump)
    slow = force_of(WAVES, 0.3, straight(surge=0.05 * hull_speed))[SURGE]
    assert slow == pytest.approx(-2 * 0.1**6 * on_hump, rel=1e-3)
    faster = [force_of(WAVES, 0.3, straight(surge=-f * hull_speed))[SURGE] / f**2 for f in (0.3, 0.49, 0.51, 0.8)]
    assert faster[0] < faster[1] > faster[3]
    assert faster[1] == pytest.approx(4 * on_hump, rel=0.01)
    turned = straight(surge=-0.5 * hull_speed * np.cos(0.6), sway=-0.5 * hull_speed * np.sin(0.6))
    turned.position[0, YAW] = 0.6
    assert force_of(WAVES, 0.3, turned)[:3] == pytest.approx([on_hump * np.cos(0.6), on_hump * np.sin(0.6), 0.0])


def test_drag_of_layers_resists_along_the_head_and_a_cable_in_all_directions() -> None:
    towed = model_with(LINEAR, np.array([0.7]), FISH)
    assert towed.dof_damping[:3] == pytest.approx([0.7, 0.7, 0.0])
    half_m = PLATES.half_m
    wetted_m2, length_m = 8 * (half_m[:, 0] * half_m[:, 2]).sum(), 2 * half_m[:, 0].sum()
    viscosity = FISH.water.viscosity_pa_s / RHO
    for speed in (0.05, 0.2):
        blasius = 1.328 / np.sqrt(speed * length_m / viscosity)
        drag = 0.5 * RHO * wetted_m2 * blasius * speed**2
        assert force_of(FRICTION, 3.0, straight(surge=-speed))[SURGE] == pytest.approx(3 * drag)


def test_the_water_does_nothing_in_air() -> None:
    air = replace(SWIM, in_water=False)
    for effect in (REACTION, MEMORY, WALL, WAVES, FRICTION):
        assert effect.force(FISH, air, np.ones((1, 1))) is None
    twin = Twin(FISH, scene=air, workers=1)
    plain = twin.model
    for effect in (REACTION, CURRENT, LINEAR):
        strong = AffectedTwin(twin, [effect]).spec(NO_DRAG, np.ones(len(effect.parameters))).compile()
        assert np.array_equal(strong.body_mass, plain.body_mass)
        assert np.array_equal(strong.dof_damping, plain.dof_damping)
        assert not strong.opt.wind.any()


# ---- roll and pitch --------------------------------------------------------------------------------------------


def shaken(hz: float) -> tuple[Observation, np.ndarray]:
    """A nose that is shaken 10 mm backward, +y, twice a turn, and 20 mm to the right, -x, once; and the angle."""
    time_s = np.arange(0.0, 6.0, 1 / 120)
    crank = 2 * np.pi * hz * time_s
    names, above = ("nose", "neck", "caudal_fin"), np.array([0.0, 0.0, 0.05])
    axes = np.broadcast_to(np.array([[0.0, 1.0], [-1.0, 0.0]]), (len(time_s), 3, 2, 2))
    path = np.column_stack([-0.02 * np.cos(crank), 0.01 * np.sin(2 * crank)])
    marker_m = path[:, None] + np.array([[0.0, 0.0], [0.0, 0.1], [0.0, 0.5]])
    return Observation(time_s, marker_m, axes, crank, names, above, View(np.zeros(2), np.array([0.0, 1.0]), 1.0)), crank


def test_raised_markers_lean_over_as_a_shaken_float_rolls_and_pitches() -> None:
    hz, (seen, crank) = 0.9, shaken(0.9)
    rolled, pitched = (SURFACE.observe(seen, np.array(v)) - seen.marker_m for v in ([0.02, 0, 0], [0, 0.03, 0]))
    assert np.abs(rolled[:, :2]).max() == np.abs(pitched[:, :2]).max() == 0
    answers = []
    for harmonic, natural in ((1, ROLL_HZ), (2, PITCH_HZ)):
        faster = harmonic * hz / natural
        answers.append(1 / (1 - faster**2 + 2j * DAMPING * faster))
    beat = (2 * np.pi * hz) ** 2
    roll = 0.02 * (-0.02 * beat * np.exp(1j * crank) * answers[0]).real
    pitch = 0.03 * (0.01 * 4 * beat * 1j * np.exp(2j * crank) * answers[1]).real
    assert rolled[:, 2, 0] == pytest.approx(0.05 * roll, abs=0.02 * 0.05 * np.abs(roll).max())  # the right is -x
    assert pitched[:, 2, 1] == pytest.approx(0.05 * pitch, abs=0.02 * 0.05 * np.abs(pitch).max())


@pytest.mark.parametrize("natural", [-0.3, 0.0, 0.4])
def test_markers_swing_by_their_heights_as_a_soft_hull_rolls(natural: float) -> None:
    hz, (seen, crank) = 0.7, shaken(0.7)
    names = seen.names
    effect = ROLL.suited(FISH, names)
    swung = (effect.observe(seen, np.array([30.0, natural])) - seen.marker_m)[:, :, 0]  # the right is -x
    turn = hz / (NATURAL_ROLL_HZ * np.exp(natural))
    roll = 30.0 * (turn**2 / (1 - turn**2 + 2j * DAMPING * turn)) * -0.02 * np.exp(1j * crank)
    for column, height_m in zip(swung.T, FISH.marker_positions_m(names)[:, 2], strict=True):
        expected = height_m * -roll.real
        assert column == pytest.approx(expected, abs=0.02 * np.abs(expected).max())
