"""A small filmed session, and what may be wrong with its videos."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from swimcal.create_session import FISHSIM_MARKERS
from swimcal.tracks import load_tracks, pixels_of
from swimsynth.plan import SyntheticCamera, SyntheticPlan
from tests.calib.door import PLAN as TRACKED
from tests.calib.door import edit

PLAN = SyntheticPlan(
    trials=TRACKED.trials,
    camera=SyntheticCamera(fps=30.0, px_per_m=480.0, width_px=560, height_px=280),
    run_in_s=3.0,
)
NAMES = ("slow", "fast")
FRAMES = {"slow": 85, "fast": 76}

BOXES_KEY = 'boxes = "trials/{}.boxes.json"\n'


def without_boxes(folder: Path, *names: str) -> Path:
    """The session with the start boxes of these trials gone."""
    for name in names:
        edit(folder / "session.toml", BOXES_KEY.format(name), "")
        (folder / "trials" / f"{name}.boxes.json").unlink()
    return folder


def with_tracks(folder: Path, name: str) -> Path:
    """The session with the true tracks of a trial in the place of its video."""
    old = f'video = "trials/{name}.mp4"\n{BOXES_KEY.format(name)}'
    edit(folder / "session.toml", old, f'tracks = "truth/{name}.csv"\n')
    return folder


def change_boxes(folder: Path, name: str, change: Callable[[dict[str, Any]], None]) -> None:
    """Changes the content of a trial's boxes in place."""
    path = folder / "trials" / f"{name}.boxes.json"
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def read(path: Path) -> xr.Dataset:
    """A file of tracks in the contract's form."""
    return load_tracks(path, FISHSIM_MARKERS, PLAN.camera.fps)


def tracks_of(folder: Path, name: str, stage: str = "") -> xr.Dataset:
    """The tracks of a trial as ``results/tracking`` has them; `stage` ``"raw"``: as the tracker left them."""
    return read(folder / "results" / "tracking" / stage / f"{name}.csv")


def farthest_px(folder: Path, name: str) -> float:
    """The greatest error of any sample against the truth."""
    found, true = tracks_of(folder, name), read(folder / "truth" / f"{name}.csv")
    return float(np.nanmax(np.abs(pixels_of(found) - pixels_of(true)[: len(found.time.values)])))
