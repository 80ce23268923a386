"""A trial as a camera sees it: what effects of camera and tracker are given."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class View:
    """A camera that looks straight down, in the frame of the pool in which the simulated head starts at the origin.

    Attributes:
        axis_m: (2,) the point under the camera, m.
        down: (2,) unit vector in the pool that points down in the picture.
        half_height_m: from the picture's middle to its lower edge, at the height of the head's markers, m.
    """

    axis_m: np.ndarray
    down: np.ndarray
    half_height_m: float


@dataclass(frozen=True, eq=False)
class Observation:
    """The markers of one simulation before camera and tracker err.

    Attributes:
        time_s: (f,) of the frames.
        marker_m: (f, m, 2) in the pool, m.
        axes: (f, m, 2, 2) unit vectors in the pool along x (backward) and y of the link that carries each marker.
        crank_rad: (f,) angle of the crank.
        names: of the m markers.
        above_m: (m,) height of each over the markers of nose and neck, m.
        view: of the camera.
    """

    time_s: np.ndarray
    marker_m: np.ndarray
    axes: np.ndarray
    crank_rad: np.ndarray
    names: tuple[str, ...]
    above_m: np.ndarray
    view: View
