"""The section on how far the tracks can be trusted: which samples are flagged, and as what."""

from collections import Counter
from collections.abc import Iterator

from fitting import CalibratedTrial, MeasuredTrial
from reports.blocks import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.caveats import track_flags
from reports.context import ReportContext
from reports.figures.flagged_samples import flagged_samples_figure
from reports.numbers import counted, listed, percent, sentence, shown, spanned
from session.flags import FLAG_KINDS

COLUMNS = table_head("trial | what was seen | stretches [] | longest [frames] | markers")
STRETCHES = table_head("trial | flag | frames [] | time [s] | what was seen")


def build(context: ReportContext) -> Section:
    """Build the section: a picture of each trial with flags, the flags counted by kind, and every stretch."""
    trials = [trial for trial in context.calibration.trials if (trial.measured.weight <= 0).any()]
    unflagged = [trial.measured.name for trial in context.calibration.trials if trial not in trials]
    rows = tuple(row for trial in context.calibration.trials for row in _rows(trial))
    blocks: list[Block] = []
    if unflagged:
        blocks.append(Prose(f"Every sample counts in {listed(unflagged)}."))
    if rows:
        blocks.append(Table("Flags by trial and kind. Flagged samples are not used.", COLUMNS, rows))
        stretches = tuple(row for trial in context.calibration.trials for row in _stretches(trial.measured))
        blocks.append(Table(f"{counted(len(stretches), 'stretch', 'es')}.", STRETCHES, stretches, folded=True))
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
    last_frame = len(trial.time_s) - 1
    for flag in track_flags(trial):
        first, last = (min(frame, last_frame) for frame in flag.frames or (0, last_frame))
        when = spanned(float(trial.time_s[first]), float(trial.time_s[last]), lambda time_s: shown(time_s, 2))
        yield trial.name, flag.kind.replace("_", " "), f"{first} to {last}", when, sentence(flag.message)


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
            "No lens calibration is given: distances near the edge of the picture may be off. The scale is the median "
            f"nose-neck distance ({shown(min(scales), 2)} to {shown(max(scales), 2)} mm per pixel)."
        )
    return tuple(caveats)
