"""Parallax against rays traced through the air and the surface of the water."""

import numpy as np
import pytest
from scipy.optimize import brentq

from tracking.camera import WATER_INDEX, true_over_apparent

H = 2.5


def slope_of(distance: float, height: float) -> float:
    """Slope of the ray from a place `distance` from the foot and `height` above the plane, by Snell's law."""
    if height >= 0:
        return distance / (H - height)

    def excess(on_water: float) -> float:
        sin_air = on_water / np.hypot(on_water, H)
        sin_water = (distance - on_water) / np.hypot(distance - on_water, height)
        return sin_air - WATER_INDEX * sin_water

    return brentq(excess, 0, distance, xtol=1e-14) / H


@pytest.mark.parametrize("height", [-0.8, -0.05, 0.0, 0.05, 0.3])
@pytest.mark.parametrize("distance", [0.01, 0.5, 2.0])
def test_a_traced_ray_leads_back_to_where_it_came_from(height: float, distance: float) -> None:
    ray = slope_of(distance, height) * np.array([0.6, -0.8])
    found = H * ray * true_over_apparent(ray, np.array(height), H)
    assert found == pytest.approx(distance * np.array([0.6, -0.8]), rel=1e-9)


def test_a_place_above_the_camera_is_refused() -> None:
    with pytest.raises(ValueError, match=r"1\.2 m above the plane is not below the camera at 1 m"):
        true_over_apparent(np.zeros((1, 2)), np.array([1.2]), 1.0)
