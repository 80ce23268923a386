"""The preview: written whole, every box drawn, no name over another."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.tracking.boxes.drawn import ELEVEN, Scene, draw, places_px
from tracking.box_preview import marker_colour, write_preview
from tracking.boxes import Box, StartBoxes


def boxes_of(scene: Scene) -> StartBoxes:
    places = places_px(scene)
    return StartBoxes(3, {name: Box.around(at, 21) for name, at in zip(scene.markers, places, strict=True)})


@pytest.mark.long
def test_every_box_is_drawn_in_its_colour(tmp_path: Path) -> None:
    scene = Scene(markers=ELEVEN, diameter=14, noise=0)
    rgb = np.repeat(draw(scene).luma[:, :, None], 3, axis=2)

    write_preview(tmp_path / "f1.png", rgb, boxes_of(scene))

    picture = cv2.imread(str(tmp_path / "f1.png"))[:, :, ::-1]
    assert picture.shape == (866, 1540, 3)
    for number in range(len(ELEVEN)):
        alike = np.abs(picture - 255 * np.array(marker_colour(number))).max(axis=2) < 12
        assert alike.sum() > 100


@pytest.mark.parametrize("place", [(0, 0), (1279, 719)])
def test_a_robot_in_the_corner_of_an_upright_picture_is_shown(tmp_path: Path, place: tuple[float, float]) -> None:
    boxes = StartBoxes(0, {"nose": Box.around((30, 30), 21), "neck": Box.around(np.clip(place, 60, 200), 21)})

    write_preview(tmp_path / "f1.png", np.zeros((1280, 720, 3), dtype=np.uint8), boxes)

    assert (tmp_path / "f1.png").stat().st_size > 1000
