"""The pool from above, drawn without a screen."""

from typing import Any

import cv2
import numpy as np

from swimgym.swimmers import Swimmers

WATER = (214, 232, 240)
FISH = (44, 90, 120)
HEAD = (225, 120, 60)
TARGET = (200, 60, 60)
COLOURS = (WATER, FISH, HEAD, TARGET)
PIXELS = 480
_ROUND_M = 0.006  # half the width of a swimmer's line


def outline(swimmers: Swimmers) -> np.ndarray:
    """Compute the outline of each swimmer in the pool: (n, l + 1, 2) nose, hinges and tip, m."""
    head, hinges = swimmers.head, swimmers.tail[0]
    points = swimmers.joints_m
    turned = head[:, 2:] + np.concatenate([np.zeros((len(head), 1)), np.cumsum(hinges, axis=1)], axis=1)
    steps = np.diff(points)  # nose to first hinge, …, last hinge to tip
    along = np.stack([np.cos(turned), np.sin(turned)], axis=2) * steps[:, None]
    nose = head[:, :2] + points[0] * along[:, 0] / steps[0]
    return np.concatenate([nose[:, None], nose[:, None] + np.cumsum(along, axis=1)], axis=1)


def draw(lines: np.ndarray, targets: np.ndarray, corners: np.ndarray, pixels: int) -> np.ndarray:
    """Draw swimmers and their targets between two corners of the pool, (p, q, 3) RGB.

    x points to the right, so a robot that heads along -x swims to the left.

    Args:
        lines: (n, k, 2) outlines of the swimmers, m.
        targets: (n, 2) their targets, m.
        corners: (2, 2) corners of the pool, the lower left one first, m.
        pixels: length of the picture's longer side.
    """
    low, high = corners
    scale = pixels / float(np.max(high - low))
    width, height = (2 * np.round(scale * (high - low) / 2)).astype(int)
    image = np.full((height, width, 3), WATER, np.uint8)

    def at(place: np.ndarray) -> np.ndarray:
        flipped = np.stack([place[..., 0] - low[0], high[1] - place[..., 1]], axis=-1)
        return np.round(16 * scale * flipped).astype(np.int32)  # with 4 binary digits

    for target in np.unique(at(targets), axis=0):
        cv2.circle(image, tuple(map(int, target)), int(16 * 0.03 * scale), TARGET, 1, cv2.LINE_AA, 4)
    thick, finite = max(1, round(2 * _ROUND_M * scale)), np.isfinite(lines).all(axis=(1, 2))
    placed = at(lines[finite])
    cv2.polylines(image, list(placed), False, FISH, thick, cv2.LINE_AA, 4)
    cv2.polylines(image, list(placed[:, :2]), False, HEAD, 2 * thick, cv2.LINE_AA, 4)
    return image


def view_from_above(course: Any) -> np.ndarray:
    """Draw the swimmers of a course and their targets, (p, q, 3) RGB."""
    lines = outline(course.swimmers)
    targets = course.task.ahead(course.swimmers.centre[0])[0]
    low, high = np.array([-4.3, -2.3]), np.array([0.7, 2.3])
    seen = np.concatenate([lines.reshape(-1, 2), targets])
    seen = seen[np.isfinite(seen).all(axis=1)]
    corners = np.array([np.minimum(low, seen.min(axis=0) - 0.1), np.maximum(high, seen.max(axis=0) + 0.1)])
    return draw(lines, targets, corners, PIXELS)
