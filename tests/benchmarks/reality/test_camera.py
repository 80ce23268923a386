import numpy as np
import pytest

from benchmarks.reality.camera import Camera, PixelNoise


def test_x_is_to_the_right_and_y_down_at_the_scale_of_the_plane():
    camera = Camera(height_m=2.0, focal_px=2000.0, width_px=2001, height_px=1001)
    assert camera.project(np.array([0.0, 0.1, 0.1j]), np.zeros(3)) == pytest.approx(
        np.array([[1000, 500], [1100, 500], [1000, 400]])
    )


def test_what_is_higher_is_seen_further_out():
    camera = Camera(height_m=2.0, focal_px=2000.0)
    low, high = camera.project(np.array([0.5, 0.5]), np.array([0.0, 0.1])) - camera.centre_px
    assert high[0] / low[0] == pytest.approx(2.0 / 1.9)


@pytest.mark.parametrize("correlation_s", [0.0, 0.05])
def test_noise_has_the_spread_and_memory_asked_for(correlation_s):
    time_s = np.arange(4000) / 60
    noise = PixelNoise(sd_px=0.8, correlation_s=correlation_s, placement_sd_px=0.0, grid_px=0.0)
    error = noise.tracked(time_s, np.zeros((4000, 20, 2)), np.random.default_rng(5))
    assert error.std() == pytest.approx(0.8, rel=0.03)
    memory = (error[1:] * error[:-1]).mean() / error.var()
    assert memory == pytest.approx(np.exp(-1 / 60 / correlation_s) if correlation_s else 0.0, abs=0.02)


def test_boxes_sit_elsewhere_in_every_trial_and_stay_there():
    time_s, true = np.arange(30) / 60, np.full((30, 11, 2), 100.0)
    noise, random = PixelNoise(sd_px=0.0), np.random.default_rng(6)
    first, second = (noise.tracked(time_s, true, random) for _ in range(2))
    assert (first == first[0]).all()
    assert (first[0] != second[0]).any()
    assert (2 * first == np.round(2 * first)).all()
    assert (first - true).std() == pytest.approx(2.0, rel=0.4)
