"""The fit with one turn of the head frame a trial, beside the plain fit and never instead of it."""

import numpy as np

from fitting import Calibration, YawFit
from reports.blocks import Column, Prose, Section, Table
from reports.context import ReportContext
from reports.numbers import MISSING, in_mm, shown, significant
from swimmer import FluidCoefficients

TITLE, ANCHOR = "With one yaw per trial", "yaw"
LARGE_DEG = 10.0


def build(context: ReportContext) -> Section:
    """Both fits side by side; without the evidence it says so."""
    if context.evidence is None:
        return Section(TITLE, ANCHOR, (Prose("The fit with a free yaw was not made for this session."),))
    calibration, yaw = context.calibration, context.evidence.yaw
    return Section(
        TITLE,
        ANCHOR,
        (Prose(_text(calibration, yaw)), _fits(calibration, yaw), _turns(context, yaw)),
        _caveats(yaw),
    )


def _text(calibration: Calibration, yaw: YawFit) -> str:
    plain, turned = calibration.fit.mean_distance_m, yaw.mean_distance_m
    return (
        "Nose and neck are marked by hand, so the measured axis of the head may be off by a few degrees, which tilts "
        "the whole measured way. With one turn of the head frame for each fit trial set free, the mean marker "
        f"distance over the fit trials is {in_mm(turned)} mm instead of {in_mm(plain)} mm. Every other number of "
        "this report belongs to the plain fit; this one stands beside it to show how much of its distance may be a "
        f"matter of where the boxes were put. {_bound(yaw)}"
    )


def _bound(yaw: YawFit) -> str:
    ended = "converged" if yaw.converged else "was still improving when its iterations ran out"
    return (
        f"Its distance is an upper bound: the descent starts from the plain fit and {ended}; a search of "
        "its own might end lower."
    )


def _fits(calibration: Calibration, yaw: YawFit) -> Table:
    columns = (
        Column("fit", numeric=False),
        Column("mean distance", "mm"),
        *(Column(name.replace("_", " ")) for name in FluidCoefficients._fields),
    )
    rows = tuple(
        (title, in_mm(distance), *(significant(value) for value in coefficients))
        for title, distance, coefficients in (
            ("plain", calibration.fit.mean_distance_m, calibration.coefficients),
            ("one yaw per trial", yaw.mean_distance_m, yaw.coefficients),
        )
    )
    return Table(
        "The plain fit and the one with a free yaw: mean marker distance on the fit trials, coefficients.",
        columns,
        rows,
    )


def _turns(context: ReportContext, yaw: YawFit) -> Table:
    distances = {trial.measured.name: trial.scores.marker_error_m for trial in context.calibration.trials}
    columns = (Column("fit trial", numeric=False), Column("yaw", "°"), Column("plain distance", "mm"))
    rows = tuple(
        (name, shown(float(np.degrees(turn)), signed=True), in_mm(distances.get(name)) if distances else MISSING)
        for name, turn in yaw.yaw_rad.items()
    )
    caption = "Turn of each fit trial’s measured head frame, counter-clockwise from above."
    return Table(caption, columns, rows)


def _caveats(yaw: YawFit) -> tuple[str, ...]:
    large = [name for name, turn in yaw.yaw_rad.items() if abs(np.degrees(turn)) > LARGE_DEG]
    if not large:
        return ()
    return (
        f"A turn of more than {LARGE_DEG:g}° ({', '.join(large)}) is more than a misplaced box explains: it makes up "
        "for a heading that the twin does not swim.",
    )
