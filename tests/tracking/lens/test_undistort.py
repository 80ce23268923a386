"""The lens as a function: inverse of itself, also where it bends most, and it says where it folds."""

import numpy as np
import pytest

from tests.tracking.lens.conftest import LENS
from tests.tracking.lens.render import to_pixels
from tracking.camera import folds, to_rays


def test_pixels_come_back_from_their_rays_everywhere() -> None:
    x, y = np.meshgrid(np.linspace(0, 959, 30), np.linspace(0, 539, 20))
    pixel = np.stack([x, y], axis=-1)
    assert to_pixels(to_rays(pixel, LENS), LENS) == pytest.approx(pixel, abs=1e-6)


@pytest.mark.parametrize(("k1", "folded"), [(-0.1, False), (0.3, False), (-0.5, True), (-2.0, True)])
def test_a_polynomial_that_turns_back_within_the_picture_is_seen(k1: float, folded: bool) -> None:
    lens = LENS.model_copy(update={"distortion": (k1, 0.0, 0.0, 0.0, 0.0)})
    farthest = np.hypot(491 / 570, 276 / 573)
    r = np.linspace(0, 3, 3001)
    highest = np.maximum.accumulate(r + k1 * r**3)[np.argmax(np.diff(r + k1 * r**3) < 0)] if k1 < 0 else np.inf
    assert (highest < farthest) == folded
    assert folds(lens) == folded
