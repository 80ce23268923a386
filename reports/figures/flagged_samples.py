"""The figure of the flagged samples of a trial: markers by time."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from fitting import MeasuredTrial
from reports.colours import INKS, SHADE
from reports.numbers import in_words, shortened
from reports.style import HALF_WIDTH_IN, Margins, panel, styled
from tracking.stretches import stretches

_HEAD = "head not trusted"
_OTHER = "other"
_INK_OF_KIND = {
    "merged_markers": "flag-merged",
    "frozen_marker": "flag-frozen",
    "jump": "flag-jump",
    "segment_length": "flag-segment",
    "gap": "flag-gap",
    _HEAD: "muted",
}


@styled
def flagged_samples_figure(trial: MeasuredTrial) -> Figure:
    """Draw a row for each marker, pale where its samples count, coloured by the kind of flag where they do not."""
    rows, kinds = len(trial.markers), flagged_kinds(trial)
    figure, axes = panel(HALF_WIDTH_IN, 1.02 + 0.17 * rows, Margins(left=0.85, top=0.52))
    frame_s = float(np.median(np.diff(trial.time_s)))
    duration = float(trial.time_s[-1]) + frame_s
    axes.barh(-np.arange(rows), duration, height=0.72, color=SHADE)
    for kind in sorted(set(kinds[kinds != ""])):
        for marker in range(rows):
            spans = [
                (trial.time_s[first], trial.time_s[last] - trial.time_s[first] + frame_s)
                for first, last in stretches(kinds[:, marker] == kind)
            ]
            axes.broken_barh(spans, (-marker - 0.36, 0.72), facecolor=_colour(str(kind)), linewidth=0)
    axes.set_yticks(-np.arange(rows), [shortened(name, 12) for name in trial.markers])
    axes.set(xlim=(0.0, duration), ylim=(-rows + 0.4, 0.6))
    axes.grid(visible=False)
    axes.set_xlabel("time (s)")
    axes.set_title(shortened(trial.name, 40), loc="left", fontweight="bold", pad=17)
    handles = [Patch(color=_colour(kind), label=in_words(kind)) for kind in sorted(set(kinds[kinds != ""]))]
    handles = handles or [Patch(color=SHADE, label="every sample counts")]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, handlelength=1.0)
    return figure


def flagged_kinds(trial: MeasuredTrial) -> np.ndarray:
    """Say (n, m) why each sample is left out: the kind of its flag, the head, another; empty where it counts."""
    kinds = np.full(trial.weight.shape, "", dtype=object)
    for flag in trial.flags:
        first, last = flag.frames or (0, len(kinds) - 1)
        for name in flag.markers:
            if name in trial.markers:
                kinds[first : last + 1, trial.markers.index(name)] = flag.kind
    left_out = trial.weight <= 0
    reason = np.where(left_out.all(axis=1, keepdims=True), _HEAD, _OTHER)
    return np.where(left_out, np.where(kinds == "", reason, kinds), "")


def _colour(kind: str) -> str:
    return INKS[_INK_OF_KIND.get(kind, "flag-other")].light
