"""Pictures of a board through a known lens, without a camera."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from swimcal.session_file import CameraCalibration
from tracking.board import BoardSpec, dark_rectangles
from tracking.camera import to_rays

TEXEL_PER_SQUARE = 64
SUPERSAMPLE = 2


def to_pixels(ray: np.ndarray, lens: CameraCalibration) -> np.ndarray:
    """(..., 2) slopes of rays -> (..., 2) pixels of the picture as the lens bends it; inverts `to_rays`."""
    points = np.column_stack([ray.reshape(-1, 2), np.ones(ray.size // 2)])
    matrix = np.array([[lens.fx_px, 0.0, lens.cx_px], [0.0, lens.fy_px, lens.cy_px], [0.0, 0.0, 1.0]])
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(lens.distortion))[0].reshape(ray.shape)


def lens_of(
    size: tuple[int, int], focal: tuple[float, float], centre: tuple[float, float], *bent: float, **more: float
) -> CameraCalibration:
    """Of a picture of that size, px, bent by these coefficients of OpenCV."""
    (width, height), (fx, fy), (cx, cy) = size, focal, centre
    sizes = {"width_px": width, "height_px": height, "fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy}
    return CameraCalibration(**sizes, distortion=bent, **more)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Scene:
    """A lens and a board in front of it."""

    lens: CameraCalibration
    board: BoardSpec

    @cached_property
    def rays(self) -> np.ndarray:
        """(s h, s w, 2) slopes of the rays through s x s places in each pixel."""
        s = SUPERSAMPLE
        x = (np.arange(s * self.lens.width_px) + 0.5) / s - 0.5
        y = (np.arange(s * self.lens.height_px) + 0.5) / s - 0.5
        return to_rays(np.stack(np.meshgrid(x, y), axis=-1), self.lens).astype(np.float32)

    @cached_property
    def texture(self) -> np.ndarray:
        """The board from above with a white edge one square wide."""
        board, n = self.board, TEXEL_PER_SQUARE
        image = np.full(((board.rows + 2) * n, (board.columns + 2) * n), 230, np.uint8)
        per_m = n / board.square_m
        for r in dark_rectangles(board):
            x0, x1 = np.round(np.array([r.x, r.x + r.width]) * per_m).astype(int) + n
            y0, y1 = np.round(np.array([r.y, r.y + r.height]) * per_m).astype(int) + n
            image[y0:y1, x0:x1] = 20
        return cv2.GaussianBlur(image, (0, 0), 1.0)

    def picture(self, rotation: np.ndarray, translation_m: np.ndarray, noise: np.random.Generator) -> np.ndarray:
        """(h, w) uint8 of the board in this pose (board frame to camera frame, z away from the camera)."""
        axes = cv2.Rodrigues(np.asarray(rotation, float))[0]
        to_board = np.linalg.inv(np.column_stack([axes[:, 0], axes[:, 1], translation_m]))
        ray = np.concatenate([self.rays, np.ones_like(self.rays[..., :1])], axis=2)
        place = ray @ to_board.T.astype(np.float32)  # homogeneous
        place = place[..., :2] / place[..., 2:] / np.float32(self.board.square_m)  # squares
        texel = (place + 1) * TEXEL_PER_SQUARE - 0.5
        fine = cv2.remap(self.texture, texel[..., 0], texel[..., 1], cv2.INTER_LINEAR, borderValue=128)
        image = cv2.resize(fine, (self.lens.width_px, self.lens.height_px), interpolation=cv2.INTER_AREA)
        return np.clip(np.round(image + noise.normal(0, 2.0, image.shape)), 0, 255).astype(np.uint8)


def poses(scene: Scene, count: int, rng: np.random.Generator, reach: float = 0.38) -> list[np.ndarray]:
    """Rotations and translations (6,) that put the board in nine places in turn, tilted about another axis each time.

    `reach` is how far from the middle, as a share of the picture.
    """
    lens, found = scene.lens, []
    centre = np.array([*scene.board.size_m, 0.0]) / 2
    for number in range(count):
        angle = np.radians(35.0) * rng.uniform(0.6, 1.0)
        axis = np.exp(2j * np.pi * (number + rng.uniform()) / count)
        rotation = angle * np.array([axis.real, axis.imag, 0.0])
        share = reach * (np.array([number % 3, number // 3 % 3]) - 1 + rng.uniform(-0.2, 0.2, 2)) + 0.5
        pixel = share * [lens.width_px, lens.height_px]
        distance = lens.fx_px * scene.board.size_m[0] / lens.width_px / rng.uniform(0.45, 0.65)
        where = distance * np.append(to_rays(pixel, lens), 1.0)
        found.append(np.concatenate([rotation, where - cv2.Rodrigues(rotation)[0] @ centre]))
    return found
