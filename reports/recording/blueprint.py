"""The layout of a recording in the viewer: a tab for each trial, the picture left, what goes with it right."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from reports.recording.layer import FRAME, TIME, entity_of
from reports.recording.missing import MISSING_FORCE, MISSING_TORQUE
from reports.recording.picture import picture_entity
from reports.recording.recorded_trial import RecordedTrial
from reports.recording.series import CONFIDENCE, FLAGS, RESIDUAL, STATES, SUMMARY

TRAIL_S = 0.5


def blueprint_of(trials: Sequence[RecordedTrial]) -> rrb.Blueprint:
    """Make the layout for these trials, with the time of the video as the timeline."""
    tabs = [rrb.Horizontal(_picture(trial), _series(trial), column_shares=[3, 2], name=trial.name) for trial in trials]
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIME, play_state="paused"),
    )


def _picture(trial: RecordedTrial) -> rrb.Spatial2DView:
    bounds = None
    if trial.picture_px is not None:
        width, height = trial.picture_px
        bounds = rrb.VisualBounds2D(x_range=[-0.5, width - 0.5], y_range=[-0.5, height - 0.5])
    frame_s = float(np.median(np.diff(trial.time_s))) if len(trial.time_s) > 1 else TRAIL_S
    trails: Any = {picture_entity(trial, "trails"): _last(TRAIL_S, max(round(TRAIL_S / frame_s), 1))}
    return rrb.Spatial2DView(
        origin=picture_entity(trial), name=f"{trial.name}: picture", visual_bounds=bounds, overrides=trails
    )


def _series(trial: RecordedTrial) -> rrb.Vertical:
    shares: dict[rrb.View | rrb.Container, float] = {}
    if trial.residual_mm is not None:
        shares[_lines(trial, RESIDUAL, "residual to the twin, mm")] = 2.0
    if trial.missing is not None:
        torques = _lines(trial, MISSING_TORQUE, "missing torque, mN m", legend=True)
        forces = _lines(trial, MISSING_FORCE, "missing force, mN", legend=True)
        shares[rrb.Tabs(torques, forces, active_tab=0)] = 2.0
    shares[_lines(trial, CONFIDENCE, "confidence", axis_y=rrb.ScalarAxis(range=(-0.02, 1.02)))] = 1.5
    shares[rrb.StateTimelineView(origin=entity_of(trial.name, STATES), name="state of each sample")] = 3.0
    words: list[rrb.View] = [rrb.TextDocumentView(origin=entity_of(trial.name, SUMMARY), name="numbers")]
    if trial.tracked.flags:
        words.insert(0, rrb.TextLogView(origin=entity_of(trial.name, FLAGS), name="flags"))
    shares[rrb.Tabs(*words, active_tab=0)] = 1.5
    return rrb.Vertical(*shares, row_shares=list(shares.values()))


def _lines(
    trial: RecordedTrial, entity: str, name: str, axis_y: rrb.ScalarAxis | None = None, *, legend: bool = False
) -> rrb.TimeSeriesView:
    """Make a plot of lines; markers need no legend, as the picture has their names in the same colours."""
    shown = rrb.PlotLegend(visible=legend)
    return rrb.TimeSeriesView(origin=entity_of(trial.name, entity), name=name, axis_y=axis_y, plot_legend=shown)


def _last(seconds: float, frames: int) -> rrb.VisibleTimeRanges:
    """Select what happened in the last seconds, or frames, up to the time shown."""
    boundary = rrb.TimeRangeBoundary
    now = boundary.cursor_relative()
    return rrb.VisibleTimeRanges(
        [
            rr.encodings.VisibleTimeRange(TIME, start=boundary.cursor_relative(seconds=-seconds), end=now),
            rr.encodings.VisibleTimeRange(FRAME, start=boundary.cursor_relative(seq=-frames), end=now),
        ]
    )
