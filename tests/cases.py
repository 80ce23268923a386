"""Cases that several tests share: which of them every run takes, and tracks with other numbers."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import settings

from swimcal.tracks import as_tracks, markers_of, pixels_of


def later(*cases: Any) -> list[pytest.ParameterSet]:
    """Cases, a tuple for one of several parameters, that only `make test-all` takes."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.long) for case in cases]


def few(examples: int) -> settings:
    """Settings of a property whose examples take seconds: as many fewer in every run as `make test-all` has more."""
    return settings(max_examples=examples * max(settings.default.max_examples // 25, 1), deadline=None)


def changed(
    tracks: xr.Dataset,
    *,
    time_s: np.ndarray | None = None,
    position_px: np.ndarray | None = None,
    confidence: np.ndarray | None = None,
) -> xr.Dataset:
    """Tracks with other times (n,), positions (n, m, 2) or confidences (n, m)."""
    return as_tracks(
        markers_of(tracks),
        tracks.time.values if time_s is None else time_s,
        pixels_of(tracks) if position_px is None else position_px,
        tracks.confidence.values if confidence is None else confidence,
    )
