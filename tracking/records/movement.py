"""netCDF in the layout of the `movement` package, its "poses" dataset.

Dimensions time, space, keypoint, individual; variables ``position`` (time, space, keypoint, individual) and
``confidence`` (time, keypoint, individual); attributes ds_type, source_software, source_file, time_unit, fps.
Before version 0.17 the last two dimensions were called keypoints and individuals: both names are read. States
and sizes of samples are further variables, which `movement` keeps.
https://movement.neuroinformatics.dev/user_guide/movement_dataset.html
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from session import FaultCollector
from session.errors import shown
from session.results import program_version, writing_whole
from tracking.records.foreign import check_names, checked_tracks

if TYPE_CHECKING:
    import xarray as xr

INDIVIDUAL = "fish"
SINGULAR = {"keypoints": "keypoint", "individuals": "individual"}
"""The names of dimensions before version 0.17, and since."""
DIMENSIONS = ("time", "space", "keypoint", "individual")


def to_movement(tracked: xr.Dataset) -> xr.Dataset:
    """Tracks with their states as a poses dataset of `movement`, time in seconds."""
    data = tracked[["position", "confidence", "state", "size"]].expand_dims(individual=[INDIVIDUAL], axis=-1)
    data = data.assign_coords(time=tracked.time.values)  # without units, which readers take for a kind of date
    data.attrs = {
        "ds_type": "poses",
        "source_software": program_version(),
        "source_file": tracked.source,
        "time_unit": "seconds",
        "fps": tracked.fps,
    }
    return data


def save_movement(path: Path, tracked: xr.Dataset) -> None:
    """Writes `to_movement` as netCDF, whole or not at all.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    data = to_movement(tracked)
    with writing_whole(path) as part:
        data.to_netcdf(part, engine="h5netcdf")


def load_movement(path: Path, markers: Sequence[str], fps: float) -> xr.Dataset:
    """Reads a poses dataset of `movement` with one individual; further keypoints than the markers are left out.

    `fps` counts where the file's time is in frames.

    Raises:
        InputError: every fault of the file at once.
    """
    faults = FaultCollector(str(path))
    data = _read(path, faults)
    _check_layout(data, faults)
    faults.raise_if_any()
    check_names(markers, data["keypoint"].values.astype(str).tolist(), "keypoint", faults)
    faults.raise_if_any()
    chosen = data.isel(individual=0).sel(keypoint=list(markers), space=["x", "y"])
    position = chosen["position"].transpose("time", "keypoint", "space").values  # (n, m, 2)
    confidence = np.full(position.shape[:2], np.nan)
    if "confidence" in chosen:
        confidence = chosen["confidence"].transpose("time", "keypoint").values.astype(float)
    time = data["time"].values.astype(float)  # (n,)
    time_s = time / fps if data.attrs.get("time_unit") == "frames" else time
    return checked_tracks(markers, time_s, position, confidence, [f"time[{row}]" for row in range(len(time))], faults)


def _read(path: Path, faults: FaultCollector) -> xr.Dataset:
    """The whole dataset in memory, with the present names of its dimensions."""
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as data:
            data.load()
    except FileNotFoundError:
        faults.add("", "the file is not there", expected="a readable file")
    except (OSError, ValueError, KeyError, TypeError) as error:
        faults.add("", "the file cannot be read", found=str(error), expected="a whole netCDF 4 file")
    faults.raise_if_any()
    return data.rename({old: new for old, new in SINGULAR.items() if old in data.dims})


def _check_layout(data: xr.Dataset, faults: FaultCollector) -> None:
    next_step = "Write it with `movement` as a poses dataset: ds.to_netcdf(path)."
    kind = data.attrs.get("ds_type", "poses")
    if kind != "poses" or "position" not in data or set(data["position"].dims) != set(DIMENSIONS):
        found = f"a dataset of {kind} with " + ", ".join(f"{name} {tuple(data[name].dims)}" for name in data.data_vars)
        expected = f"poses: position {DIMENSIONS}, confidence"
        faults.add(
            "", "not a poses dataset of movement", found=shown(found, 200), expected=expected, next_step=next_step
        )
        return
    if unlabelled := [name for name in DIMENSIONS if name not in data.coords]:
        faults.add("", "dimensions without labels", found=", ".join(unlabelled), expected="a coordinate for each")
    elif not {"x", "y"} <= set(data["space"].values.astype(str).tolist()):
        faults.add("", "no x and y", found=shown(data["space"].values.tolist()), expected="x and y in space")
    if data.sizes["individual"] != 1:
        found = (
            shown(data["individual"].values.tolist()) if "individual" in data.coords else str(data.sizes["individual"])
        )
        step = "Choose one: ds.sel(individual=[name])."
        faults.add("", "not one individual", found=found, expected="one", next_step=step)
    if data.attrs.get("time_unit", "seconds") not in ("seconds", "frames"):
        faults.add("", "unknown time_unit", found=shown(data.attrs["time_unit"]), choices=("seconds", "frames"))
