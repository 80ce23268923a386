from typing import Any

import numpy as np
import pytest

from benchmarks.video.motion import RobotPoints
from benchmarks.video.occlusion import Occlusion
from benchmarks.video.plan import MarkerLook
from benchmarks.video.scene import PoolScene
from benchmarks.video.water import WaterLook
from swimcal.robot import load_robot
from tests.benchmarks.video.clips import HEAD, centroid_px, small_scene


def lone_disc(shift_px: tuple[float, float], **changes: Any) -> PoolScene:
    """A scene of one frame, in which a disc sits so far from the middle."""
    return small_scene(frames=1, markers=("neck",), shift_m=(shift_px[0] / 420, -shift_px[1] / 420), **changes)


def measured_px(scene: PoolScene, number: int, marker: int) -> np.ndarray:
    """Centre of gravity of what tells a bright disc from one of its base's gray."""
    plain, marked = (painted(scene, number, gray) for gray in (30.0, 236.0))
    return centroid_px(marked - plain, scene.truth.shown_px[number, marker])


def painted(scene: PoolScene, number: int, gray: float) -> np.ndarray:
    look = MarkerLook(diameter_px=16.0, glow=0.0, gray=gray)
    return (
        PoolScene(scene.plan.model_copy(update={"marker_look": look}), scene.stage).picture(number).luma.astype(float)
    )


@pytest.mark.long
def test_a_disc_is_painted_where_the_truth_says() -> None:
    errors = []
    for x, y in np.random.default_rng(0).uniform(-2, 2, (40, 2)):
        scene = lone_disc((x, y), optics={"exposure_s": 0.0})
        errors.append(measured_px(scene, 0, 0) - scene.truth.position_px[0, 0])

    assert np.abs(errors).max() < 0.02
    assert np.abs(np.mean(errors, axis=0)).max() < 0.005


def test_a_blurred_disc_lies_about_the_middle_of_the_exposure() -> None:
    scene = small_scene(frequency_hz=6.0, turn_rad=0.7, optics={"exposure_s": 1 / 70})
    truth, tail = scene.truth, HEAD.index("tail_3")
    moved_px = np.linalg.norm(np.diff(truth.shown_px[:, tail], axis=0), axis=1)

    assert moved_px.max() > 3
    for number in range(len(scene)):
        assert measured_px(scene, number, tail) == pytest.approx(truth.shown_px[number, tail], abs=0.03)
        assert truth.shown_px[number, tail] == pytest.approx(truth.position_px[number, tail], abs=0.6)


def test_a_rolling_shutter_shows_each_marker_at_the_time_of_its_row() -> None:
    scene = small_scene(frequency_hz=5.0, turn_rad=1.2, optics={"readout_s": 0.015, "exposure_s": 0.0})
    stage, truth = scene.stage, scene.truth
    robot = load_robot()
    points = RobotPoints(robot, [robot.markers[name] for name in HEAD])

    assert np.abs(truth.shown_px - truth.position_px).max() > 0.5
    for number, time_s in enumerate(truth.time_s):
        for marker, shown in enumerate(truth.shown_px[number]):
            at = time_s + stage.camera.delay_s(shown[1])
            assert stage.camera.project(points(stage.motion.at(at)))[marker] == pytest.approx(shown, abs=1e-4)


def test_the_same_seed_paints_the_same_pixels_in_any_order() -> None:
    lively: dict[str, Any] = {"glints_per_s": 200.0, "water": WaterLook(), "optics": {"noise": 3.0}}
    one, two, other = (small_scene(seed=seed, **lively) for seed in (1, 1, 2))
    forward = [one.picture(number).data for number in range(6)]
    backward = [two.picture(number).data for number in reversed(range(6))]

    np.testing.assert_array_equal(forward, backward[::-1])
    assert (forward[0] != other.picture(0).data).mean() > 0.5
    assert (forward[0] != forward[1]).mean() > 0.5


def test_a_pole_covers_its_marker_for_just_the_planned_frames() -> None:
    pole = Occlusion(marker="neck", first=2, frames=3)
    scene = small_scene(frames=8, occlusions=(pole,))
    truth, neck = scene.truth, HEAD.index("neck")

    np.testing.assert_array_equal(np.flatnonzero(truth.visible_share[:, neck] < 0.001), [2, 3, 4])
    bare = small_scene(frames=8)
    x, y = np.round(truth.shown_px[3, neck]).astype(int)
    disc = (slice(y - 4, y + 5), slice(x - 4, x + 5))
    assert bare.picture(3).luma[disc].min() > 200
    assert scene.picture(3).luma[disc].max() < 200
    np.testing.assert_array_equal(scene.picture(6).luma[disc], bare.picture(6).luma[disc])
