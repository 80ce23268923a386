"""netCDF in the layout of the `movement` package, its "poses" dataset.

Dimensions time, space, keypoint, individual; variables ``position`` (time, space, keypoint, individual) and
``confidence`` (time, keypoint, individual); attributes ds_type, source_software, source_file, time_unit, fps.
Before version 0.17 the last two dimensions were called keypoints and individuals: both names are read. States
and sizes of samples are further variables, which `movement` keeps.
https://movement.neuroinformatics.dev/user_guide/movement_dataset.html
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from session import FaultCollector
from session.errors import shown
from session.results import program_version, writing_whole
from tracking.records.foreign import ForeignTracks

if TYPE_CHECKING:
    import xarray as xr

Engine = Literal["h5netcdf", "scipy"]
"""Engines of xarray: for netCDF 4, which is HDF5, and for netCDF 3."""
INDIVIDUAL = "fish"
SINGULAR = {"keypoints": "keypoint", "individuals": "individual"}
"""The names of dimensions before version 0.17, and since."""
DIMENSIONS = ("time", "space", "keypoint", "individual")


def to_movement(tracked: xr.Dataset) -> xr.Dataset:
    """Turn tracks and their states into a poses dataset of `movement`, time in seconds."""
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
    """Write `to_movement` as netCDF, whole or not at all.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    data = to_movement(tracked)
    with writing_whole(path) as part:
        data.to_netcdf(part, engine="h5netcdf")


def read_movement(path: Path, engine: Engine) -> ForeignTracks:
    """Read all keypoints of a poses dataset of `movement` with one individual.

    Args:
        path: the file.
        engine: xarray's engine for it.

    Raises:
        InputError: every fault of the file at once.
    """
    import xarray as xr

    faults = FaultCollector(str(path))
    try:
        with xr.open_dataset(path, engine=engine, decode_times=False) as data:
            data.load()
    except (OSError, ValueError, KeyError, TypeError, IndexError, EOFError) as error:
        faults.add("", "the file cannot be read", found=str(error), expected="a whole netCDF file")
    faults.raise_if_any()
    return from_movement(data, str(path))


def from_movement(data: xr.Dataset, file: str) -> ForeignTracks:
    """Take in a poses dataset of `movement` from memory, its dimensions in any order and either spelling.

    Args:
        data: the dataset.
        file: its name in messages.

    Raises:
        InputError: every fault of it at once.
    """
    faults = FaultCollector(file)
    data = data.rename({old: new for old, new in SINGULAR.items() if old in data.dims})
    if "position" in data and set(data["position"].dims) == set(DIMENSIONS[:3]):  # an individual is chosen already
        data = data.drop_vars("individual", errors="ignore").expand_dims("individual")
    _check_layout(data, faults)
    faults.raise_if_any()
    chosen = data.isel(individual=0).sel(space=["x", "y"])
    position = chosen["position"].transpose("time", "keypoint", "space").values.astype(float)  # (n, k, 2)
    confidence = np.full(position.shape[:2], np.nan)
    if "confidence" in chosen:
        confidence = chosen["confidence"].transpose("time", "keypoint").values.astype(float)
    time, names = data["time"].values, tuple(data["keypoint"].values.astype(str).tolist())
    if np.issubdtype(time.dtype, np.timedelta64):
        time = time / np.timedelta64(1, "s")
    where, time = [f"time[{row}]" for row in range(len(time))], time.astype(float)
    in_frames = data.attrs.get("time_unit", "seconds") == "frames"
    fps = float(data.attrs.get("fps") or np.nan)
    if in_frames and fps > 0:
        in_frames, time = False, time / fps
    times = {"frame": time} if in_frames else {"time_s": time}
    return ForeignTracks(file, "keypoint", names, position, confidence, where, **times)


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
    if unlabelled := [name for name in DIMENSIONS[:3] if name not in data.coords]:
        faults.add("", "dimensions without labels", found=", ".join(unlabelled), expected="a coordinate for each")
    elif not {"x", "y"} <= set(data["space"].values.astype(str).tolist()):
        faults.add("", "no x and y", found=shown(data["space"].values.tolist()), expected="x and y in space")
    if data.sizes["individual"] != 1:
        named = "individual" in data.coords
        found = shown(data["individual"].values.tolist()) if named else str(data.sizes["individual"])
        step = "Choose one: ds.sel(individual=[name])."
        faults.add("", "not one individual", found=found, expected="one", next_step=step)
    if data.attrs.get("time_unit", "seconds") not in ("seconds", "frames"):
        faults.add("", "unknown time_unit", found=shown(data.attrs["time_unit"]), choices=("seconds", "frames"))
