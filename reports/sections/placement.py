"""How much of the distance is a matter of where boxes were put, and what the swims do beside swimming straight."""

import numpy as np

from fitting import CalibratedTrial, Calibration, CoefficientFit
from fitting.course import course_of
from fitting.placed_fit import PlacedFit
from reports.blocks import Block, Column, Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.coefficients import NAMES
from reports.figures.trial import mean_shapes_figure
from reports.numbers import counted, in_mm, in_words, sentence, shown, significant, with_error

CLEAR, LEAST_DEG = 3.0, 0.2  # standard errors, and degrees a beat, from which a trial turns
BOXES = table_head(
    "trial | nose along [mm] | across [mm] | neck along [mm] | across [mm] | turned by [°] | scaled by []"
)
DISTANCES = table_head("trial | distance, plain [mm] | put right [mm] | shape alone, plain [mm] | put right [mm]")
MARKERS = table_head("marker | along [mm] | across [mm]")
COURSE = table_head(
    "trial | forward [mm/s] | twin [mm/s] | to the left [mm/s] | twin [mm/s] | turns [° a beat] | twin [° a beat]"
)


def build(context: ReportContext) -> Section | None:
    """Nothing without the evidence."""
    if context.evidence is None:
        return None
    placed, trials = context.evidence.placed, context.calibration.trials
    figure = Plot(
        mean_shapes_figure(trials, placed),
        "mean-shapes",
        "Mean places of the markers in each trial, to scale; the twin is that of the plain fit. What boxes of nose and "
        "neck do is a turn, a scale and a shift of a whole trial; what a marker's own place does is the same in all. A "
        "bend that neither makes is the fish's own.",
    )
    blocks: tuple[Block, ...] = (
        Prose(_text(placed)),
        _fits(context.calibration, placed),
        Plots((figure,)),
        _distances(trials, placed),
        _boxes(placed),
        _markers(placed),
        Prose(_straight(trials)),
        _course(trials),
    )
    caveats = tuple(sentence(flag.message) for flag in placed.flags)
    return Section("With boxes put right", "placement", blocks, caveats)


def _text(placed: PlacedFit) -> str:
    ended = "" if placed.converged else "; it was still improving when its iterations ran out"
    return (
        "The head frame hangs on the boxes of nose and neck. Where a hand has put them some millimetres off, all else "
        "of that trial is turned, scaled and shifted; where a marker sits elsewhere on the body than the robot’s "
        "description has it, it is off in all trials alike. Both are found from the shape of the fish (hands trusted "
        "to 5 mm, the description to 10 mm) and the coefficients refitted. Its distance is an upper bound: the descent "
        f"starts from the plain fit{ended}. Held-out trials take the markers’ places from the fit trials and find "
        "their own boxes from their first beats. Every other number of this report belongs to the plain fit."
    )


def _fits(calibration: Calibration, placed: PlacedFit) -> Table:
    columns = (*table_head("fit | mean distance [mm]"), *map(Column, NAMES))
    fits: dict[str, CoefficientFit | PlacedFit] = {"plain": calibration.fit, "boxes put right": placed}
    rows = tuple(
        (title, in_mm(fit.mean_distance_m), *(significant(value) for value in fit.coefficients))
        for title, fit in fits.items()
    )
    return Table("Each fit: mean marker distance on the fit trials, coefficients.", columns, rows)


def _distances(trials: tuple[CalibratedTrial, ...], placed: PlacedFit) -> Table:
    rows = tuple(
        (
            each.name,
            in_mm(trial.scores.marker_error_m),
            in_mm(each.distance_m),
            in_mm(trial.scores.shape_error_m),
            in_mm(each.shape_m),
        )
        for trial, each in zip(trials, placed.trials, strict=True)
    )
    return Table("Mean marker distance of the plain fit and of the one with boxes put right.", DISTANCES, rows)


def _boxes(placed: PlacedFit) -> Table:
    rows = tuple(
        (
            each.name,
            *(with_error(1000 * off, 1000 * error) for off, error in zip(each.boxes, each.boxes_sd, strict=True)),
            shown(np.degrees(each.boxes.turn_rad), signed=True),
            shown(each.boxes.scale, 3),
        )
        for each in placed.trials
    )
    caption = (
        "How far the boxes of nose and neck sit from their markers, with standard deviations, and what that does to "
        "all else (counter-clockwise from above). What all trials share may be boxes or markers; differences between "
        "trials are known much better."
    )
    return Table(caption, BOXES, rows)


def _markers(placed: PlacedFit) -> Table:
    rows = tuple(
        (in_words(name), *(with_error(1000 * value, 1000 * error) for value, error in zip(off, sd, strict=True)))
        for name, off, sd in zip(placed.markers, placed.marker_m, placed.marker_sd_m, strict=True)
        if name not in ("nose", "neck")
    )
    caption = "Where markers sit beside their described places, along their link and across, in all trials."
    return Table(caption, MARKERS, rows)


def _straight(trials: tuple[CalibratedTrial, ...]) -> str:
    courses = [course_of(trial.measured) for trial in trials]
    turns = [np.degrees(c.turning.value) / t.measured.frequency.hz for c, t in zip(courses, trials, strict=True)]
    clear = sum(
        abs(turn) > LEAST_DEG and abs(course.turning.value) > CLEAR * course.turning.se
        for turn, course in zip(turns, courses, strict=True)
    )
    if not clear:
        return (
            "No trial turns by more than its errors: the robot swims straight, as a symmetric twin in still water does."
        )
    return (
        f"The robot turns by {shown(min(turns), signed=True)} to {shown(max(turns), signed=True)}° a beat "
        f"(counter-clockwise from above; beyond its errors in {clear} of {counted(len(trials), 'trial')}); a symmetric "
        "twin in still water swims straight. What turning and slipping add to the marker distance no coefficient can "
        "take away."
    )


def _course(trials: tuple[CalibratedTrial, ...]) -> Table:
    rows = []
    for trial in trials:
        measured, twin = course_of(trial.measured), course_of(trial.measured, trial.simulated)
        beat = np.degrees(1) / trial.measured.frequency.hz
        rows.append(
            (
                trial.measured.name,
                with_error(1000 * measured.forward.value, 1000 * measured.forward.se),
                shown(1000 * twin.forward.value),
                with_error(1000 * measured.sideways.value, 1000 * measured.sideways.se),
                shown(1000 * twin.sideways.value),
                with_error(beat * measured.turning.value, beat * measured.turning.se),
                shown(beat * twin.turning.value),
            )
        )
    caption = (
        "The course of each trial after warm-up, in the head’s own axes: a line beside two harmonics of the beat. A "
        "head frame that is turned by misplaced boxes feigns a slip to one side, but no turning. Of fewer than three "
        "beats the errors are too small."
    )
    return Table(caption, COURSE, tuple(rows))
