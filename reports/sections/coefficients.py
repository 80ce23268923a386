"""The section on the five fluid coefficients: the mode, how far the data determine them, and the published search."""

import numpy as np

from fitting import CoefficientFit
from fitting.calibration_file import PublishedResult
from fitting.model import COMPONENTS
from reports.blocks import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.coefficients import coefficients_figure
from reports.figures.hull_roll import hull_roll_figure
from reports.numbers import MISSING, counted, in_mm, in_words, shown, significant
from swimmer import PUBLISHED_COEFFICIENTS, FluidCoefficients
from swimmer.fluid import COEFFICIENT_BOUNDS

_COLUMNS = table_head("coefficient | value [] | 90 % interval [] | published search [] | authors' values [] | caveats")
_ERRORS = table_head("over | quantity | recommended fit | published search")
_COMPONENTS = table_head("component | level | standard deviation | meaning")
_AS_LIKELY = 2.0  # largest difference of log density between ends that are about as likely


def build(context: ReportContext) -> Section:
    """Build the section: values with intervals, variance components, and the published search for comparison."""
    fit, published = context.calibration.fit, context.published
    best = fit.ends[0]
    equals = sum(end.log_density > best.log_density - _AS_LIKELY for end in fit.ends)
    text = (
        f"The mode of a hierarchical model of the fit trials; {equals} of {counted(len(fit.ends), 'start')} ended "
        f"within two of the highest log density ({fit.simulations} simulations, {shown(fit.seconds)} s)."
    )
    figure = Plot(
        coefficients_figure(fit, None if published is None else published.fit.coefficients),
        "coefficient-values",
        "Each coefficient within its bounds with its 90 % interval. Dots: where other starts ended; distant dots mean "
        "that the data do not determine the coefficient. Crosses: the twin swims backward from rest.",
    )
    sampled = context.posterior is not None  # a posterior says more than these values
    plots = Plots((figure,), text if sampled else "", folded=sampled)
    blocks = (
        _table(fit, published, sampled),
        plots,
        *_roll(context),
        *_search(context),
        *([] if sampled else [Prose(text)]),
    )
    return Section("The fit", "coefficients", (*blocks, _components(fit)))


_LEAST_ROLL_DEG = 2.0


def _table(fit: CoefficientFit, published: PublishedResult | None, folded: bool) -> Table:
    low, high = COEFFICIENT_BOUNDS
    rows = []
    for i, name in enumerate(FluidCoefficients._fields):
        own = [flag for flag in fit.flags if name in flag.message]
        caveats = [in_words(flag.kind) for flag in own if not (folded and flag.kind == "unidentifiable")]
        rows.append(
            (
                in_words(name),
                significant(fit.coefficients[i]),
                " to ".join(significant(end) for end in fit.interval[i]),
                MISSING if published is None else significant(published.fit.coefficients[i]),
                significant(PUBLISHED_COEFFICIENTS[i]),
                ", ".join(caveats),
            )
        )
    caption = (
        f"Coefficients of the fluid forces (no unit), bounds {low:g} to {high:g}; normal approximation at the "
        "mode. The authors’ values belong to their own model."
    )
    return Table(caption, _COLUMNS, tuple(rows), folded=folded)


def _search(context: ReportContext) -> tuple[Block, ...]:
    """Explain how the published search differs, and why."""
    published = context.published
    if published is None and context.posterior is not None:
        return ()
    if published is None:
        text = "The published search was not run for comparison; calib fit SESSION --objective published does."
        return (Prose(text),)
    rows = []
    for role, words in (("fit", "fit trials"), ("holdout", "held-out trials")):
        own, other = context.calibration.summary(role), published.summary[role]
        if own is not None and other is not None:
            rows += [
                (words, "markers, as tracked [mm]", *(shown(each.marker_error_mm) for each in (own, other))),
                (words, "speed, twin alone [mm/s]", *(in_mm(each.speed_mae_twin) for each in (own, other))),
            ]
    caption = (
        "How the published search differs. It makes the mean distance of the markers as tracked small, and attributes "
        "trim (a steady turn and slip, which displace the markers by centimetres in seconds), boxes off their markers "
        "and the twin's own errors to the fluid. The recommended fit models each of them: its marker "
        "errors may be larger where trials turn, without an error of its coefficients. "
        f"{counted(published.fit.simulations, 'simulation')} of the fit trials, {shown(published.fit.seconds)} s; "
        f"{'converged' if published.fit.converged else 'not converged within its budget'}."
    )
    return (Table(caption, _ERRORS, tuple(rows)),)


def _roll(context: ReportContext) -> tuple[Block, ...]:
    """Describe the roll of the hull that the fit allows for; empty where it is too small to mention."""
    calibration = context.calibration
    roll, sways = calibration.fit.roll, calibration.sways
    largest = max((sway.roll_deg for sway in sways.values()), default=0.0)
    if largest < _LEAST_ROLL_DEG:
        return ()
    plot = Plot(
        hull_roll_figure(sways),
        "hull-roll",
        "The neck's sideways motion at the beat frequency. A rigid hull has the same sway at all frequencies; one that "
        "rolls has a resonance, and markers above its axis swing sideways with it. The fit corrects for this roll.",
    )
    text = (
        f"The tracks show a roll of the hull by up to {shown(largest, 0)}°, with a natural frequency of "
        f"{shown(roll.natural_hz, 2)} Hz and {shown(roll.per_sway, 0)} rad per metre of sway at higher "
        "frequencies. The fit corrects the picture for it; the calibrated twin does not roll."
    )
    return Prose(text), Plots((plot,))


def _components(fit: CoefficientFit) -> Table:
    rows = []
    for component in COMPONENTS:
        size, unit = fit.components[component.name], "%" if component.unit == "1" else component.unit
        value = 100 * size if component.unit == "1" else np.degrees(size) if "rad" in unit else 1000 * size
        shown_unit = unit.replace("rad", "°") if "rad" in unit else unit if unit == "%" else f"m{unit}"
        rows.append(
            (in_words(component.name), component.level, f"{significant(value, 2)} {shown_unit}", component.meaning)
        )
    caption = (
        "Variance components: what changes a trial in addition to the coefficients. Level: it differs from trial to "
        "trial, or is common to all trials of the session."
    )
    return Table(caption, _COMPONENTS, tuple(rows), (), True)
