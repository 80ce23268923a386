"""The section on where the twin is off, marker by marker."""

import numpy as np

from fitting import CalibratedTrial
from reports.blocks import Plot, Plots, Prose, Section
from reports.context import ReportContext
from reports.figures.residuals import TRUSTED, marker_distances, marker_residuals_figure
from reports.numbers import in_mm, listed, percent

# A trial drifts if its marker distance is more than this many times that of the shape alone.
DRIFTING = 2.0


def build(context: ReportContext) -> Section:
    """Build the section: distances by marker, and what they say about shape and path."""
    trials = context.calibration.trials
    plots = (
        Plot(
            marker_residuals_figure(trials),
            "residual-markers",
            "Mean distance of each marker from the twin’s; the tick: relative to the nose. A long bar with a short "
            f"tick is an error of the path, not of the shape.{_explain_percentages(trials)}",
        ),
    )
    return Section("Marker by marker", "residuals", (Plots(plots), Prose(_describe_worst(trials))), _caveats(trials))


def _explain_percentages(trials: tuple[CalibratedTrial, ...]) -> str:
    """Explain the percentages in the figure; empty where it has none."""
    if all((marker_distances(trial)[2] >= TRUSTED).all() for trial in trials):
        return ""
    return f" Percentages: less than {TRUSTED * 100:.0f} % of the marker’s samples count."


def _describe_worst(trials: tuple[CalibratedTrial, ...]) -> str:
    """Say which marker is worst, and which trials drift rather than bend differently."""
    worst: dict[str, list[float]] = {}
    for trial in trials:
        for name, value in zip(trial.measured.markers, marker_distances(trial)[0], strict=True):
            worst.setdefault(name, []).append(float(value))
    means = {name: float(np.mean(values)) for name, values in worst.items() if np.isfinite(values).all()}
    if not means:
        return "In no trial do all markers have samples that count, so no marker is singled out."
    farthest, nearest = max(means, key=lambda name: means[name]), min(means, key=lambda name: means[name])
    drifting = [t.measured.name for t in trials if t.scores.marker_error_m > DRIFTING * t.scores.shape_error_m]
    text = (
        f"Over all trials {farthest} is farthest off ({in_mm(means[farthest])} mm on average), {nearest} nearest "
        f"({in_mm(means[nearest])} mm). "
    )
    if not drifting:
        return text + "In no trial is the error of the path larger than that of the shape."
    return text + (
        f"In {listed(drifting)} the distance is more than twice that of the shape alone: mostly an error of the path "
        "(speed and heading)."
    )


def _caveats(trials: tuple[CalibratedTrial, ...]) -> tuple[str, ...]:
    lost = [
        f"{name} of {trial.measured.name} ({percent(float(share))})"
        for trial in trials
        for name, share in zip(trial.measured.markers, marker_distances(trial)[2], strict=True)
        if share < 0.5
    ]
    return (f"Less than half of the scored samples count for {listed(lost)}.",) if lost else ()
