"""Parallax: markers above or below the reference plane, seen by a camera that looks straight down.

The reference plane is the plane of the nose and neck markers, which give the picture its scale; it is taken to be the
surface of the water, for the robot swims at it (the built-in robot's nose and neck are 2.5 mm below the top of its
submerged part). The camera is H above it, its axis vertical, the robot level.

A marker z above the plane is in air. It is (H - z) t from the camera's foot, t being the slope of its ray, where on
the plane one would read H t: it appears too far out by H / (H - z). A marker d below is seen through the surface:
its ray meets the water H t from the foot and goes on at the slope that Snell's law gives, sin a = n sin b,

    distance = t (H + d / sqrt(n^2 + (n^2 - 1) t^2)),

near the foot t (H + d / n), the apparent depth. A flat surface is assumed: ripple is noise here.
"""

import numpy as np

WATER_INDEX = 1.333
"""Refractive index of water for visible light, 20 degrees Celsius (CRC Handbook of Chemistry and Physics)."""


def true_over_apparent(ray: np.ndarray, height_m: np.ndarray, camera_height_m: float) -> np.ndarray:
    """Return the ratio of a place's true distance from the camera's foot to its apparent one on the reference plane.

    Args:
        ray: (..., m, 2) slopes of the rays from the camera, undistorted.
        height_m: (m,) or scalar, above the reference plane; negative below it, in water.
        camera_height_m: height H of the lens above the reference plane.

    Returns:
        (..., m) factors; 1 on the plane.

    Raises:
        ValueError: a place at the height of the camera or above it.
    """
    height_m = np.asarray(height_m, dtype=float)
    if (height_m >= camera_height_m).any():
        raise ValueError(f"{height_m.max():g} m above the plane is not below the camera at {camera_height_m:g} m")
    squared_slope = (ray**2).sum(axis=-1)  # (..., m)
    above = np.maximum(height_m, 0.0) / camera_height_m
    below = np.maximum(-height_m, 0.0) / camera_height_m
    return 1.0 - above + below / np.sqrt(WATER_INDEX**2 + (WATER_INDEX**2 - 1.0) * squared_slope)
