"""One trial as a recording shows it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from reports.recording.missing import MissingOverTime
from session.tracks import markers_of, pixels_of


@dataclass(frozen=True, eq=False)
class RecordedTrial:
    """One trial of a recording: n frames of m markers.

    Attributes:
        name: name of the trial; unique in a recording.
        tracked: tracks, states, sizes and flags; `tracking.records.as_tracked` makes them of bare tracks.
        video_proxy: a small video with the time stamps of the trial's own (`make_proxy`), or None.
        picture_px: width and height of the pictures that `tracked` is in, px; needed with a proxy, which is stretched
            to it.
        twin_px: (n, m, 2) where the fitted twin's markers are in the picture, in the frame of the tracks, px; nan where
            unknown. None before there is a fit.
        residual_mm: (n, m) distance between measured and simulated marker, mm; nan where it does not count.
        metrics: numbers about the trial, shown as they are, such as {"marker_error_mm": 3.1}.
        missing: forces that a diagnosis finds missing, over the n frames; None before there is a diagnosis.
    """

    name: str
    tracked: xr.Dataset
    video_proxy: Path | None = None
    picture_px: tuple[int, int] | None = None
    twin_px: np.ndarray | None = None
    residual_mm: np.ndarray | None = None
    metrics: Mapping[str, float | str] = field(default_factory=dict)
    missing: MissingOverTime | None = None

    @property
    def markers(self) -> tuple[str, ...]:
        """Names of the m markers."""
        return markers_of(self.tracked)

    @property
    def time_s(self) -> np.ndarray:
        """Times (n,) of the frames, s."""
        return self.tracked.time.values

    @property
    def present(self) -> np.ndarray:
        """Mask (n, m) of the samples that have a position."""
        return np.isfinite(pixels_of(self.tracked)).all(axis=2)
