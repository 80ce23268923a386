"""A small valid session to break, and the real tracks where they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from swimcal.errors import InputError
from swimcal.session import load_session
from swimcal.tracks import as_tracks

FISHSIM = Path(__file__).resolve().parents[3] / "shared" / "data" / "fishsim"

needs_fishsim = pytest.mark.skipif(
    not FISHSIM.is_dir(), reason="the public tracks are not here (../shared/data/fishsim)"
)

MARKERS = ("nose", "neck", "tail_1")

SESSION_TOML = """\
[session]
name = "pool"

[camera]
fps = 60.0
scale_length_m = 0.142

[markers]
names = ["nose", "neck", "tail_1"]

[[trial]]
name = "slow"
kind = "swim"
tracks = "slow.csv"
commanded_hz = 0.5

[[trial]]
name = "fast"
kind = "swim"
tracks = "fast.csv"
commanded_hz = 1.5
role = "holdout"
"""


def tracks_text(frames: int = 90) -> str:
    """Headerless tracks of the three markers, drifting to the right."""
    rows = [f"{k}.5,10.0,{k + 40}.0,10.5,{k + 80}.0,{20 + k % 7}.25" for k in range(frames)]
    return "\n".join(rows) + "\n"


def make_session(folder: Path, toml: str = SESSION_TOML) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "session.toml").write_text(toml)
    for name in ("slow", "fast"):
        (folder / f"{name}.csv").write_text(tracks_text())
    return folder


def faults_of(folder: Path, **options: object) -> str:
    """The message of the one error that loading the session ends with."""
    with pytest.raises(InputError) as caught:
        load_session(folder, **options)  # type: ignore[arg-type]
    assert caught.value.exit_code == 2
    return str(caught.value)


def made_tracks(frames: int = 5) -> xr.Dataset:
    rng = np.random.default_rng(3)
    position = rng.uniform(0, 4000, (frames, len(MARKERS), 2))
    confidence = rng.uniform(0, 1, (frames, len(MARKERS)))
    position[1, 2] = np.nan
    confidence[1, 2] = 0.0
    return as_tracks(MARKERS, np.arange(frames) / 59.94, position, confidence)
