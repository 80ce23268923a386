"""How far the tracks can be trusted: which samples are flagged, and as what."""

from collections import Counter

from fitting import CalibratedTrial, MeasuredTrial
from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.caveats import track_flags
from reports.context import ReportContext
from reports.figures.flagged_samples import flagged_samples_figure
from reports.numbers import counted, listed, percent, shown
from session.flags import FLAG_KINDS

COLUMNS = table_head("trial | what was seen | stretches [] | longest [frames] | markers")


def build(context: ReportContext) -> Section:
    """A matrix a trial, and the flags counted by kind."""
    trials = context.calibration.trials
    rows = [row for trial in trials for row in _rows(trial)]
    if rows:
        caption = "Flags by trial and kind; every stretch is listed with its trial. Flagged samples are not used."
        table: Table | Prose = Table(caption, COLUMNS, tuple(rows))
    else:
        table = Prose("No sample of any trial is flagged: every marker counts in every frame.")
    plots = Plots(tuple(picture_of_tracks(trial.measured) for trial in trials))
    text = (
        "Tracks are judged before any fit, each sample by the other markers of its frame and by its own "
        "motion. Flagged samples get no weight."
    )
    return Section("Track quality", "tracks", (Prose(text), plots, table), _caveats(context))


def picture_of_tracks(trial: MeasuredTrial) -> Plot:
    """Which samples of a measured trial are flagged; needs no fit."""
    count = f"{percent(float((trial.weight > 0).mean()))} of {counted(trial.weight.size, 'sample')} count"
    caption = (
        f"{trial.name}: {count}. A long coloured row is a marker to track again, a coloured column a moment at which "
        "no marker can be used."
    )
    return Plot(flagged_samples_figure(trial), f"{trial.name}-flags", caption)


def _rows(trial: CalibratedTrial) -> list[tuple[str, ...]]:
    flags = track_flags(trial.measured)
    rows: list[tuple[str, ...]] = []
    for kind, count in Counter(flag.kind for flag in flags).most_common():
        of_kind = [flag for flag in flags if flag.kind == kind]
        frames = [flag.frames or (0, len(trial.measured.time_s) - 1) for flag in of_kind]
        longest = max(last - first + 1 for first, last in frames)
        markers = tuple(dict.fromkeys(name for flag in of_kind for name in flag.markers))
        what = f"{kind.replace('_', ' ')}: {FLAG_KINDS[kind]}" if kind in FLAG_KINDS else kind.replace("_", " ")
        rows.append((trial.measured.name, what, str(count), str(longest), listed(markers)))
    return rows


def _caveats(context: ReportContext) -> tuple[str, ...]:
    caveats = []
    for trial in context.calibration.trials:
        share = trial.measured.used_fraction
        if share < 0.8:
            caveats.append(f"{trial.measured.name}: only {percent(share)} of the compared samples count.")
    if context.session.camera.calibration is None:
        scales = [trial.measured.metres_per_px * 1000 for trial in context.calibration.trials]
        caveats.append(
            "No lens calibration is given: distances near the edge of the picture may be off. The scale "
            f"({shown(min(scales), 2)} to {shown(max(scales), 2)} mm per pixel) is the median nose-neck "
            "distance."
        )
    return tuple(caveats)
