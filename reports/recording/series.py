"""The layers next to the picture: confidence and residual over time, states, flags, and the trial's numbers."""

import numpy as np
import rerun as rr

from reports.recording.layer import STATE_COLOURS, WARN, Layer, entity_of, lines
from reports.recording.recorded_trial import RecordedTrial
from session import Flag
from tracking.records import SampleState

CONFIDENCE = "confidence"
RESIDUAL = "residual_mm"
STATES = "states"
FLAGS = "flags"
SUMMARY = "summary"


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
