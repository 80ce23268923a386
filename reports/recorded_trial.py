"""A trial in the Rerun viewer: its data, the layers that show them over time, and what is missing on the head.

A `Layer` is one entity of a recording. `series_layers` makes those next to the picture, `missing_layers` those of the
missing forces; the layers in the picture are in `reports.recording`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from colorsys import hsv_to_rgb
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rerun as rr
import xarray as xr

from diagnosis.result import MissingForces
from fitting.calibration import CalibratedTrial
from reports.gap_figures import FORCES
from reports.style import INKS
from swimcal.flags import Flag
from swimcal.tracks import markers_of, pixels_of
from tracking.tracked import SampleState

# Timelines and colours
FRAME = "frame"
"""The timeline of the number of the frame, from 0."""
TIME = "time"
"""The timeline of the time in the trial's own video."""

Rgb = tuple[int, int, int]

GOLDEN_RATIO = 0.618034

# Series
CONFIDENCE = "confidence"
RESIDUAL = "residual_mm"
STATES = "states"
FLAGS = "flags"
SUMMARY = "summary"

# Missing forces
MISSING_FORCE = "missing_force_mN"
MISSING_TORQUE = "missing_torque_mN_m"
ARROW = "missing_force"
LONGEST = 2.0  # length of the longest arrow, in distances from nose to neck
_MILLI = 1000.0


def rgb(hexadecimal: str) -> Rgb:
    """Convert the colour ``#rrggbb`` to three numbers from 0 to 255."""
    red, green, blue = bytes.fromhex(hexadecimal.removeprefix("#"))
    return red, green, blue


TWIN = rgb(INKS["twin"].dark)
WARN = rgb(INKS["warn"].dark)
GAP = rgb(INKS["gap"].dark)

STATE_COLOURS: dict[SampleState, Rgb] = {
    SampleState.MISSING: rgb(INKS["flag-segment"].dark),
    SampleState.MEASURED: rgb(INKS["flag-other"].dark),
    SampleState.PREDICTED: rgb(INKS["ebt"].dark),
    SampleState.INTERPOLATED: rgb(INKS["flag-merged"].dark),
    SampleState.BY_HAND: rgb(INKS["ink"].dark),
}
"""A colour for each state of a sample."""


class Layer(NamedTuple):
    """One entity of a recording.

    Attributes:
        entity: path of the entity.
        static: Rerun archetypes that hold at all times.
        rows: (r,) numbers of the frames at which there is something.
        columns: Rerun columns of r rows each; empty where everything is static.
    """

    entity: str
    static: tuple[Any, ...] = ()
    rows: np.ndarray = np.zeros(0, dtype=np.int64)
    columns: tuple[Any, ...] = ()

    def send(self, stream: rr.RecordingStream, time_s: np.ndarray) -> None:
        """Send the layer to a recording; `time_s` is the (n,) time of each frame."""
        if self.static:
            stream.log(self.entity, *self.static, static=True, strict=True)
        if self.columns:
            index = [rr.TimeColumn(FRAME, sequence=self.rows), rr.TimeColumn(TIME, duration=time_s[self.rows])]
            stream.send_columns(self.entity, index, self.columns, strict=True)


def lines(entity: str, names: Sequence[str], values: np.ndarray) -> Layer:
    """Make a layer with a line for each of k names over n frames, of (n, k) values.

    Args:
        entity: path of the entity.
        names: the k names.
        values: (n, k) values.
    """
    n, k = values.shape
    style = rr.SeriesLines(names=list(names), colors=[marker_colour(i) for i in range(k)])
    columns = rr.Scalars.columns(scalars=values.ravel()).partition([k] * n)
    return Layer(entity, (style,), np.arange(n), tuple(columns))


def entity_of(*parts: str) -> str:
    """Build the path of an entity from names that may hold any character."""
    return rr.new_entity_path(list(parts))


def marker_colour(index: int) -> Rgb:
    """Choose a colour for the marker of this index; neighbours differ by 0.618 of the colour wheel."""
    red, green, blue = (round(255 * part) for part in hsv_to_rgb((0.08 + index * GOLDEN_RATIO) % 1.0, 0.55, 1.0))
    return red, green, blue


# The trial and the layers next to its picture.


@dataclass(frozen=True, eq=False)
class RecordedTrial:
    """One trial of a recording: n frames of m markers.

    Attributes:
        name: name of the trial; unique in a recording.
        tracked: tracks, states, sizes and flags; `tracking.tracked.as_tracked` makes them of bare tracks.
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


def series_layers(trial: RecordedTrial) -> list[Layer]:
    """Make the layers next to the picture; what the trial has no data for is left out."""
    layers = [lines(entity_of(trial.name, CONFIDENCE), trial.markers, trial.tracked.confidence.values)]
    if trial.residual_mm is not None:
        layers.append(lines(entity_of(trial.name, RESIDUAL), trial.markers, trial.residual_mm))
    layers += [_states(trial, k) for k in range(len(trial.markers))]
    if trial.tracked.flags:
        layers.append(_flags(trial))
    return [*layers, _summary(trial)]


def _states(trial: RecordedTrial, k: int) -> Layer:
    """Make the layer of the frames at which the state of marker k changes."""
    state = trial.tracked.state.values[:, k]
    rows = np.flatnonzero(np.concatenate([[True], state[1:] != state[:-1]]))
    columns = rr.StateChange.columns(state=[SampleState(value).word for value in state[rows].tolist()])
    words = [value.word for value in STATE_COLOURS]
    style = rr.StateConfiguration(
        values=words, labels=[word.replace("_", " ") for word in words], colors=list(STATE_COLOURS.values())
    )
    lane = f"{k + 1:02d}_{trial.markers[k]}"  # numbered, since the viewer orders lanes by their paths
    return Layer(entity_of(trial.name, STATES, lane), (style,), rows, tuple(columns))


def _flags(trial: RecordedTrial) -> Layer:
    last = len(trial.time_s) - 1
    first = [0 if flag.frames is None else min(max(flag.frames[0], 0), last) for flag in trial.tracked.flags]
    order = np.argsort(first, kind="stable")
    texts = [_flag_text(trial.tracked.flags[i]) for i in order]
    columns = rr.TextLog.columns(text=texts, level=[rr.TextLogLevel.WARN] * len(texts), color=[WARN] * len(texts))
    return Layer(entity_of(trial.name, FLAGS), (), np.array(first)[order], tuple(columns))


def _flag_text(flag: Flag) -> str:
    frames = "whole trial" if flag.frames is None else f"frames {flag.frames[0]} to {flag.frames[1]}"
    return " · ".join(part for part in (flag.kind, frames, ", ".join(flag.markers), flag.message) if part)


def _summary(trial: RecordedTrial) -> Layer:
    count = np.bincount(trial.tracked.state.values.ravel(), minlength=len(SampleState))
    rows = {
        "frames": len(trial.time_s),
        "duration_s": float(trial.time_s[-1] - trial.time_s[0]),
        **{f"samples_{state.word}": int(count[state]) for state in SampleState},
        **trial.metrics,
    }
    shown = {name: f"{value:.4g}" if isinstance(value, float) else value for name, value in rows.items()}
    table = [f"| {name} | {value} |" for name, value in shown.items()]
    text = "\n".join([f"# {trial.name}", "", "| | |", "|---|---|", *table, ""])
    return Layer(entity_of(trial.name, SUMMARY), (rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN),))


# What is missing on the head.


class MissingOverTime(NamedTuple):
    """The forces that a diagnosis finds missing, frame by frame.

    Attributes:
        joints: (j,) along and across the head (nose to neck; counter-clockwise from there, seen from above), the moment
            on it, then the hinges.
        force: (n, j) N or N m; nan where it is not known.
    """

    joints: tuple[str, ...]
    force: np.ndarray

    @classmethod
    def of(cls, forces: MissingForces, trial: CalibratedTrial, frames: int, first: int) -> MissingOverTime | None:
        """Evaluate the forces in the frames of a fitted swim; None for any other trial.

        Args:
            forces: the missing forces of the diagnosis.
            trial: the swim.
            frames: number n of frames of the recording.
            first: the recording's frame that is the first measured one.
        """
        if trial.measured.name not in forces.trials:
            return None
        measured = trial.measured
        turn = trial.phase_rad + measured.crank_rad(measured.time_s[measured.kept], trial.simulated_hz)
        mean, _ = forces.over(turn)
        kept = np.zeros(frames, bool)
        kept[first : first + len(measured.kept)] = measured.kept
        force = np.full((frames, len(forces.joints)), np.nan)
        force[kept] = mean[forces.trials.index(measured.name)].T
        return cls(forces.joints, force)


def missing_layers(trial: str, missing: MissingOverTime, nose_px: np.ndarray, neck_px: np.ndarray) -> list[Layer]:
    """Make the arrow in the picture and the lines next to it.

    Args:
        trial: name of the trial.
        missing: its missing forces.
        nose_px: (n, 2) nose in the picture, nan where it is not seen.
        neck_px: (n, 2) neck in the picture, nan where it is not seen.
    """
    is_force = np.array([joint in FORCES for joint in missing.joints])
    layers = [_arrow(trial, missing, nose_px, neck_px)]
    for name, part in ((MISSING_FORCE, is_force), (MISSING_TORQUE, ~is_force)):
        joints = np.array(missing.joints)[part].tolist()
        layers.append(lines(entity_of(trial, name), joints, _MILLI * missing.force[:, part]))
    return layers


def arrows_px(missing: MissingOverTime, nose_px: np.ndarray, neck_px: np.ndarray) -> np.ndarray:
    """Compute the (n, 2) arrows of the force on the head in the picture, whose y points down.

    The longest is two heads long.

    Args:
        missing: the missing forces.
        nose_px: (n, 2) nose in the picture.
        neck_px: (n, 2) neck in the picture.
    """
    along = neck_px - nose_px
    length = np.linalg.norm(along, axis=1)
    along = along / length[:, None]
    across = np.stack([along[:, 1], -along[:, 0]], axis=1)  # along, turned counter-clockwise seen from above
    force = missing.force[:, [missing.joints.index(name) for name in FORCES]]  # (n, 2) N
    arrows = force[:, :1] * along + force[:, 1:] * across
    largest = np.nanmax(np.linalg.norm(arrows, axis=1), initial=0.0)
    return np.asarray(arrows * (LONGEST * np.nanmedian(length) / largest if largest > 0 else 0.0))


def _arrow(trial: str, missing: MissingOverTime, nose_px: np.ndarray, neck_px: np.ndarray) -> Layer:
    arrows = arrows_px(missing, nose_px, neck_px)
    good = np.isfinite(arrows).all(axis=1)
    columns = rr.Arrows2D.columns(vectors=arrows[good], origins=neck_px[good]).partition(good.astype(int))
    style = rr.Arrows2D.from_fields(colors=[GAP], radii=-2.0, draw_order=30.0)
    return Layer(entity_of(trial, "picture", ARROW), (style,), np.arange(len(arrows)), tuple(columns))
