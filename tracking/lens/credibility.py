"""Whether a calibrated lens is to be believed."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from session import CameraCalibration, Flag
from tracking.lens.corners import Corners
from tracking.lens.lens_fit import LensFit
from tracking.lens.uncertainty import LensUncertainty
from tracking.lens.undistort import folds

TILES = (8, 6)
"""Tiles across and down the picture in which corners are looked for."""
GOOD_VIEWS = 8
GOOD_COVERAGE = 0.5
TILTED_DEG = 15.0
"""Zhang 2000, section 4 and figure 4: errors grow steeply where the views differ by less."""
FOCAL_SD = 0.01
"""Of the focal length, relative: the lens's height, and so parallax, is known no better."""
RMS_SHARE = 3e-4
"""Of the picture's width: good corners of a 3840 px wide picture are off by about 1 px, of a 1920 px one by 0.5 px."""
BEND_SHARE = 5e-4
"""Of the picture's width: 1 mm of a pool 2 m wide, and far less over the length of a body."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a judgement rests on: the fit, the same as a camera, and its uncertainty."""

    fit: LensFit
    camera: CameraCalibration
    sd: LensUncertainty


def coverage_of(corners: Iterable[Corners], width_px: int, height_px: int) -> float:
    """Share of the picture's tiles in which a corner was seen."""
    image_px = np.concatenate([seen.image_px for seen in corners])
    tile = np.floor((image_px + 0.5) / [width_px, height_px] * TILES).astype(int)
    tile = np.clip(tile, 0, np.array(TILES) - 1)
    return len(np.unique(tile, axis=0)) / (TILES[0] * TILES[1])


def spread_deg(rotation: np.ndarray) -> float:
    """Largest angle between the planes of two of (v, 3) views, rotation vectors."""
    normal = np.array([cv2.Rodrigues(one)[0][:, 2] for one in rotation])  # (v, 3)
    return float(np.degrees(np.arccos(np.clip(normal @ normal.T, -1.0, 1.0))).max())


def doubts(evidence: Evidence) -> tuple[Flag, ...]:
    """Every reason not to believe the lens, each with its number and what to do."""
    found = (
        *_about_views(evidence),
        *_about_fit(evidence),
    )
    return tuple(Flag(kind, message=message) for kind, message in found)


def _about_views(evidence: Evidence) -> list[tuple[str, str]]:
    fit, camera, sd = evidence.fit, evidence.camera, evidence.sd
    found = []
    if (views := len(fit.bundle.corners)) < GOOD_VIEWS:
        found.append(("lens_few_views", f"the lens rests on {views} pictures; take {GOOD_VIEWS} at least"))
    coverage = coverage_of(fit.bundle.corners, camera.width_px, camera.height_px)
    if coverage < GOOD_COVERAGE:
        found.append(
            (
                "lens_coverage",
                f"the board was seen in {100 * coverage:.0f} % of the picture only; elsewhere the lens is "
                "extrapolated: hold the board in the corners and at the edges too",
            )
        )
    angle, focal = spread_deg(fit.bundle.poses[:, :3]), max(sd.fx_px / camera.fx_px, sd.fy_px / camera.fy_px)
    if angle < TILTED_DEG or focal > FOCAL_SD:
        found.append(
            (
                "lens_parallel_views",
                f"the board's planes differ by {angle:.0f} degrees at most, and the focal length is known to "
                f"{100 * focal:.2g} %; parallel views do not determine it: tilt the board by 20 to 45 degrees",
            )
        )
    return found


def _about_fit(evidence: Evidence) -> list[tuple[str, str]]:
    fit, camera, sd = evidence.fit, evidence.camera, evidence.sd
    found = []
    if fit.rms_px > (limit := RMS_SHARE * camera.width_px):
        found.append(
            (
                "lens_rms",
                f"corners are off by {fit.rms_px:.2f} px, more than {limit:.2f} px: the board is not flat, the "
                "pictures are blurred, or the lens bends more than five coefficients can say",
            )
        )
    if sd.bend_px > (limit := BEND_SHARE * camera.width_px):
        found.append(
            (
                "lens_uncertain",
                f"the shape of the picture is known to {sd.bend_px:.2f} px at its worst place, more than "
                f"{limit:.2f} px: take more pictures, with the board near the edges",
            )
        )
    if folds(camera):
        found.append(("lens_folds", "the distortion turns back within the picture: it has no meaning near the corners"))
    return found
