"""A faulty tracker: where it finds the markers of a trial."""

import numpy as np

from session import Tracks
from synthetic.faults import with_faults
from synthetic.noise import lasting_errors, on_grid, placement_offsets
from synthetic.plan import SyntheticPlan
from synthetic.trials import PlannedTrial

_DECIMALS_PX, _DECIMALS_S = 2, 6


def tracked(
    trial: PlannedTrial, position_px: np.ndarray, plan: SyntheticPlan, random: np.random.Generator
) -> tuple[Tracks, np.ndarray]:
    """The tracks of a trial whose markers are at (n, m, 2), and (m, 2) where its boxes sit on their markers, px."""
    noise = plan.noise
    offsets_px = placement_offsets(len(plan.markers), noise, random)
    place_m = plan.swimmer.marker_positions_m(plan.markers)[:, 0]
    errors_px = lasting_errors(position_px.shape, 1 / plan.camera.fps, noise, random, place_m)
    boxes_px = with_faults(position_px + offsets_px + errors_px, plan.markers, trial.faults)
    found_px = np.round(on_grid(boxes_px, noise), _DECIMALS_PX)
    confidence = np.isfinite(found_px).all(axis=2).astype(float)
    return Tracks(plan.markers, np.round(trial.time_s(plan.camera), _DECIMALS_S), found_px, confidence), offsets_px
