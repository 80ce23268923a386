"""The place of a trial in the image: placed, turned and scaled as planned, and all of it in sight."""

from collections.abc import Iterable

import numpy as np

from session import FaultCollector
from synthetic.plan import SyntheticPlan
from synthetic.trials import PlannedTrial, SyntheticCamera


def in_image(marker_m: np.ndarray, trial: PlannedTrial, plan: SyntheticPlan) -> np.ndarray:
    """Project markers (n, m, 2) seen from above, m, y up, to (n, m, 2) pixels, y down.

    Args:
        marker_m: (n, m, 2) markers seen from above, m, y up.
        trial: the planned trial, whose start and heading are used.
        plan: the plan of the session.
    """
    camera, nose, neck = plan.camera, plan.markers.index("nose"), plan.markers.index("neck")
    axis = marker_m[0, nose] - marker_m[0, neck]
    turn = trial.heading_rad - np.arctan2(axis[1], axis[0])
    cos, sin = np.cos(turn), np.sin(turn)
    turned = (marker_m - marker_m[0, nose]) @ np.array([[cos, sin], [-sin, cos]])  # rows times the transpose
    position_px = camera.px_per_m * turned * np.array([1.0, -1.0])
    if trial.start_px is not None:
        return position_px + np.array(trial.start_px)
    centre = (np.array([camera.width_px, camera.height_px]) - 1) / 2
    return position_px + centre - (position_px.max(axis=(0, 1)) + position_px.min(axis=(0, 1))) / 2


def check_in_image(trials: Iterable[tuple[str, np.ndarray]], camera: SyntheticCamera) -> None:
    """Check that every marker stays in the image, for trials given as names with (n, m, 2) pixels.

    Raises:
        session.InputError: names each trial that leaves the image.
    """
    faults = FaultCollector("plan of the synthetic session")
    for name, position_px in trials:
        low, high = position_px.min(axis=(0, 1)), position_px.max(axis=(0, 1))
        if (low < 0).any() or (high > [camera.width_px - 1, camera.height_px - 1]).any():
            found = f"x {low[0]:.0f} to {high[0]:.0f}, y {low[1]:.0f} to {high[1]:.0f} px"
            expected = f"x 0 to {camera.width_px - 1}, y 0 to {camera.height_px - 1} px"
            step = "Shorten it, turn its heading_rad, or leave start_px out to centre it."
            where, what = f"trial {name}", "the fish leaves the image"
            faults.add(where, what, found=found, expected=expected, next_step=step)
    faults.raise_if_any()
