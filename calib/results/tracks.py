"""The tracks of a session: one labelled `xarray.Dataset` a trial, with flags and shares of what was seen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from calib.results.result import TIME, Tables, flag_frame
from fitting.trial import MeasuredTrial
from reports.words import counted, percent
from swimcal.flags import Flag
from swimcal.session import Session
from tracking.boxes import StartBoxes
from tracking.formats import to_movement
from tracking.tracked import SampleState, seen_in

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class FilmedTracks:
    """The files made from the videos of a session: tracks in a folder, start boxes, tracks in another form.

    Flags are those of lens, size and height, of each kind the first: the videos share one camera. `left_out` has the
    reason for each trial whose video cannot be read.
    """

    folder: Path
    boxes: Mapping[str, StartBoxes] = field(default_factory=dict)
    flags: tuple[Flag, ...] = ()
    exported: tuple[Path, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class TrackResult(Tables, Mapping[str, "xr.Dataset"]):
    """The tracks of every trial: a mapping from the trial's name to an `xarray.Dataset`.

    A dataset has the dimensions `time` (s), `space` (x to the right, y down) and `keypoint`, its name as coordinate
    `trial`, and the variables

    - `position` (time, space, keypoint), px, nan where missing, and `confidence` (time, keypoint), as in `movement`;
    - `state` (time, keypoint), how each sample came about, and `size` (time, keypoint), the marker's diameter in px;
    - of a swim trial also `weight` (time, keypoint), 0 where a sample does not count in a fit; `position_pool`, m, on
      the pool's surface, right-handed seen from above; `position_head`, m, in the frame of the head (published
      normaliser: x from nose to neck, y to the right); `heading` (time), rad; `forward` (time), distance swum, m.
      Outside the frames that are measured they are nan, `weight` 0.

    Tables of `to_frame`: "trials" (frames, shares of samples seen, filled and missing, and of a swim trial beat and
    speed) and "flags".

    Attributes:
        tracked: the tracker's record of every sample, by trial.
        measured: the swim trials, measured.
        flags: by trial.
        filmed: what was made from the videos.
        notes: sentences from its making.

    Example:
        >>> tracks = calib.track("pool", progress=False)
        >>> print(tracks.summary())
        synthetic: 2 trials, 320 frames...
        >>> tracks["slow"].position.sel(keypoint="nose").dims
        ('time', 'space')
        >>> tracks.to_frame().speed.idxmax()
        'fast'
    """

    session: Session
    tracked: Mapping[str, xr.Dataset]
    measured: Mapping[str, MeasuredTrial]
    flags: Mapping[str, tuple[Flag, ...]]
    filmed: FilmedTracks
    notes: tuple[str, ...] = ()

    def __getitem__(self, trial: str) -> xr.Dataset:
        tracked = self.tracked[trial]
        data = to_movement(tracked).isel(individual=0, drop=True)
        data = data.assign_coords(trial=trial, time=data.time.assign_attrs(TIME))
        if (swim := self.measured.get(trial)) is None:
            return data
        measured = _collect_measured(swim, data.time[tracked.first_frame + swim.first_frame :])
        found = data.assign(measured.reindex(time=data.time, fill_value={"weight": 0.0}))
        return found.assign_attrs(metres_per_px=swim.metres_per_px)

    def __iter__(self) -> Iterator[str]:
        return iter(self.tracked)

    def __len__(self) -> int:
        return len(self.tracked)

    def __repr__(self) -> str:
        frame = self.to_frame()
        trials = f"{counted(len(frame), 'trial')}, {int(frame.frames.sum())} frames"
        return f"<TrackResult {self.session.name}: {trials}, {percent(frame.seen.mean())} of the samples seen>"

    @property
    def left_out(self) -> tuple[Flag, ...]:
        """Return the flags of the trials that cannot be used, which say why."""
        return tuple(flag for own in self.flags.values() for flag in own if flag.kind == "left_out")

    def summary(self) -> str:
        """Summarise how much was seen, and the flags, in three lines."""
        frame = self.to_frame()
        worst = frame.seen.idxmin()
        kinds = Counter(flag.kind for own in self.flags.values() for flag in own)
        listed = ", ".join(f"{kind.replace('_', ' ')} ({count})" for kind, count in kinds.most_common(4))
        return "\n".join(
            [
                f"{self.session.name}: {counted(len(frame), 'trial')}, {int(frame.frames.sum())} frames.",
                f"Seen: {frame.seen.mean():.1%} of the samples; least in {worst}, {frame.seen[worst]:.1%}.",
                f"Flags: {listed or 'none'}. Next: calib fit {self.session.in_shell}",
            ]
        )

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        flags = ((name, flag) for name, own in self.flags.items() for flag in own)
        return {"trials": self._trials, "flags": lambda: flag_frame(flags)}

    def _trials(self) -> pd.DataFrame:
        rows = {name: self._row(name, found) for name, found in self.tracked.items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("trial")

    def _row(self, name: str, found: xr.Dataset) -> dict[str, object]:
        shares = shares_of(found)
        row: dict[str, object] = {column: shares[column] for column in ("frames", "seen", "filled", "missing")}
        row["flags"] = len(self.flags[name])
        row["commanded_hz"] = self.session.trial(name).commanded_hz
        swim = self.measured.get(name)
        if swim is None:
            return row
        frequency = swim.frequency
        row |= {"frequency_hz": frequency.hz, "frequency_se_hz": frequency.se_hz}
        return row | {"speed": swim.speed, "used": swim.used_fraction}


def shares_of(found: xr.Dataset) -> dict[str, float]:
    """Count the frames of a trial, and the shares of its samples that were seen, count, are filled and missing.

    Samples count from the frame of the boxes on; the mean confidence of those seen is added. Not all samples that are
    seen count in a fit: see `docs/tracking.md`.
    """
    own = found.isel(time=slice(found.first_frame, None))
    seen, missing = seen_in(own), own.state.values == SampleState.MISSING
    shares = {"seen": seen, "filled": ~missing & ~seen, "missing": missing}
    if "weight" in own:
        shares["counts"] = own.weight.values > 0
    confidence = np.average(own.confidence.values, weights=seen) if seen.any() else 0.0
    row = {"frames": found.sizes["time"], "confidence": float(confidence)}
    return row | {name: float(share.mean()) for name, share in shares.items()}


def _collect_measured(swim: MeasuredTrial, time: xr.DataArray) -> xr.Dataset:
    """Return what is measured in a swim, its frames at the first of these times."""
    own = swim.tracks[["weight", "position_pool", "position_head", "heading"]]
    forward = -swim.tracks.path.sel(space="x", drop=True)
    own = own.assign(forward=forward.assign_attrs(units="m", long_name="distance swum"))
    return own.assign_coords(time=time[: own.sizes["time"]])
