"""Section on the quality of the tracks: which samples do not count, and why."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from fitting.trial import MeasuredTrial
from reports.context import ReportContext
from reports.page import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.style import HALF_WIDTH_IN, INKS, SHADE, Margins, panel, styled
from reports.words import counted, in_words, listed, percent, sentence, shortened, shown, spanned
from tracking.harmed_frames import stretches

# Kinds of flags
_HEAD = "head not trusted"
_UNREAD = "unread_marker"
_OTHER = "other"
_INK_OF_KIND = {
    "merged_markers": "flag-merged",
    "frozen_marker": "flag-frozen",
    "jump": "flag-jump",
    "segment_length": "flag-segment",
    "gap": "flag-gap",
    _HEAD: "muted",
}

STRETCHES = table_head("trial | flag | frames [] | time [s] | what was seen")


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
    """Say (n, m) why a sample is left out: kind of its flag, head, too little of its marker, other; "" if it counts."""
    kinds = np.full(trial.weight.shape, "", dtype=object)
    for flag in trial.flags:
        for name in flag.markers:
            if name in trial.markers:
                kinds[trial.rows_of(flag), trial.markers.index(name)] = flag.kind
    left_out = trial.weight <= 0
    reason = np.where(
        left_out.all(axis=1, keepdims=True), _HEAD, np.where(left_out[trial.kept].all(axis=0), _UNREAD, _OTHER)
    )
    return np.where(left_out, np.where(kinds == "", reason, kinds), "")


def _colour(kind: str) -> str:
    return INKS[_INK_OF_KIND.get(kind, "flag-other")].light


def build_track_quality(context: ReportContext) -> Section:
    """Build the section: every flagged stretch, and a picture of each trial with flags."""
    trials = [trial for trial in context.calibration.trials if (trial.measured.weight <= 0).any()]
    unflagged = [trial.measured.name for trial in context.calibration.trials if trial not in trials]
    rows = tuple(row for trial in context.calibration.trials for row in _stretches(trial.measured))
    blocks: list[Block] = []
    if unflagged:
        blocks.append(Prose(f"Every sample counts in {listed(unflagged)}."))
    if rows:
        caption = f"{counted(len(rows), 'flagged stretch', 'es')}; their samples are not used."
        blocks.append(Table(caption, STRETCHES, rows, folded=True))
    pictures = tuple(picture_of_tracks(trial.measured) for trial in trials)
    if pictures:
        what = "A long coloured row is a marker to track again, a column a moment at which no marker can be used."
        blocks.append(Plots(pictures, what))
    return Section("Track quality", "tracks", tuple(blocks), _caveats(context))


def picture_of_tracks(trial: MeasuredTrial) -> Plot:
    """Draw which samples of a measured trial are flagged; needs no fit."""
    count = f"{percent(float((trial.weight > 0).mean()))} of {counted(trial.weight.size, 'sample')} count"
    caption = (
        f"{trial.name}: {count}. A long coloured row is a marker to track again, a coloured column a moment at which "
        "no marker can be used."
    )
    return Plot(flagged_samples_figure(trial), f"{trial.name}-flags", caption, label=f"{trial.name}: {count}.")


def _stretches(trial: MeasuredTrial) -> Iterator[tuple[str, ...]]:
    own = trial.first_frame, trial.first_frame + len(trial.time_s) - 1
    for flag in (each for each in trial.flags if each.markers):
        first, last = flag.frames or own
        seen = trial.time_s[trial.rows_of(flag)]
        when = "outside the trial"
        if len(seen):
            when = spanned(float(seen[0]), float(seen[-1]), lambda time_s: shown(time_s, 2))
        yield trial.name, flag.kind.replace("_", " "), f"{first} to {last}", when, sentence(flag.message)


def _caveats(context: ReportContext) -> tuple[str, ...]:
    caveats = []
    for trial in context.calibration.trials:
        share = trial.measured.used_fraction
        if share < 0.8:
            caveats.append(f"{trial.measured.name}: only {percent(share)} of the compared samples count.")
    if context.session.camera.calibration is None:
        scales = [trial.measured.metres_per_px * 1000 for trial in context.calibration.trials]
        caveats.append(
            "No lens calibration is given: distances near the edge of the picture may be off. The scale is the mean "
            f"nose-neck distance of the fitted swims, {spanned(min(scales), max(scales), lambda mm: shown(mm, 2))} mm "
            "per pixel."
        )
    return tuple(caveats)
