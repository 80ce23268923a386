"""Boxes that hold no marker: what the tracker was started on does not stand out."""

import numpy as np

from tracking.tracker.tracker import MarkerTracker, Sighting

LEAST_CONTRAST = 6.0
"""Steps of brightness by which a marker must stand out in its start box."""
LEAST_CONTRAST_FAINT = 25.0
"""The same where the detector hardly answers, so that only CSRT can follow it."""


def without_marker(tracker: MarkerTracker, first: Sighting) -> np.ndarray:
    """(m,) bool, the boxes without a marker, of a tracker that was just begun, and what it saw first."""
    faint = tracker.faint.which if tracker.faint is not None else ~first.seen
    empty: np.ndarray = tracker.start.contrast < np.where(faint, LEAST_CONTRAST_FAINT, LEAST_CONTRAST)
    return empty | ~first.seen
