import numpy as np
import pytest

from benchmarks.reality.camera import Camera
from benchmarks.wake.world import SharedNoise, TiltedCamera

PLACE_M = np.array([[0.3 + 0.2j, -0.5 + 0.1j]])
HEIGHT_M = np.array([[0.05, 0.0]])


def test_a_camera_without_tilt_looks_straight_down():
    assert np.array_equal(TiltedCamera().project(PLACE_M, HEIGHT_M), Camera().project(PLACE_M, HEIGHT_M))


def test_a_tilted_camera_sees_one_side_larger_and_its_middle_in_place():
    camera = TiltedCamera(about_x_rad=0.05)
    up, middle, down = camera.project(np.array([0.5j, 0j, -0.5j]), np.zeros(3))
    assert middle == pytest.approx(camera.centre_px)
    assert abs(up[1] - middle[1]) < abs(down[1] - middle[1])


def test_neighbours_share_their_errors_and_each_keeps_its_size_and_its_memory():
    noise = SharedNoise(sd_px=0.5, correlation_s=0.1, placement_sd_px=0.0, grid_px=0.0, shared=0.75)
    error = noise.tracked(np.arange(40_000) / 60, np.zeros((40_000, 4, 2)), np.random.default_rng(1))
    correlation = np.corrcoef(error[:, :, 0].T)
    assert error.std() == pytest.approx(0.5, rel=0.05)
    assert correlation[0, 1] == pytest.approx(0.75, abs=0.04)
    assert correlation[0, 2] == pytest.approx(0.75**2, abs=0.05)
    later = np.mean(error[6:] * error[:-6]) / np.mean(error**2)
    assert later == pytest.approx(np.exp(-1.0), abs=0.05)
