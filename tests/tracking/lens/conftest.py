"""One lens, one ChArUco board and its pictures, made once: a third of a second a picture."""

import cv2
import numpy as np
import pytest

from tests.tracking.lens.render import Scene, lens_of, poses
from tracking.board import BoardSpec

LENS = lens_of((960, 540), (570.0, 573.0), (491.0, 263.0), -0.22, 0.08, 4e-4, -3e-4, -0.012)
CHARUCO = BoardSpec(columns=8, rows=6, square_m=0.03)


@pytest.fixture(scope="session")
def scene() -> Scene:
    cv2.setNumThreads(1)
    return Scene(LENS, CHARUCO)


@pytest.fixture(scope="session")
def pictures(scene: Scene) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [scene.picture(pose[:3], pose[3:], rng) for pose in poses(scene, 18, rng)]
