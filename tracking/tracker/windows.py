"""Square windows of a picture; beyond its border the last pixels are repeated."""

import numpy as np


def window(luma: np.ndarray, column: int, row: int, reach: int) -> np.ndarray:
    """(2 reach + 1, 2 reach + 1) uint8 of the (h, w) picture, centred on one of its pixels."""
    height, width = luma.shape
    left, top, right, bottom = column - reach, row - reach, column + reach + 1, row + reach + 1
    if left >= 0 and top >= 0 and right <= width and bottom <= height:
        return luma[top:bottom, left:right]
    columns = np.clip(np.arange(left, right), 0, width - 1)
    rows = np.clip(np.arange(top, bottom), 0, height - 1)
    return luma[np.ix_(rows, columns)]


def windows(luma: np.ndarray, centre_px: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """(k, 2 reach + 1, 2 reach + 1) float32 windows around places (k, 2), and (k, 2) the pixels they are centred on."""
    middle = np.rint(centre_px).astype(int)
    cut = [window(luma, column, row, reach) for column, row in middle.tolist()]
    side = 2 * reach + 1
    return np.array(cut, dtype=np.float32).reshape(-1, side, side), middle
