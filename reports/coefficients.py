"""Section on the fitted coefficients, and on the roll of the hull that the fit allows for.

`build_coefficients` gives the values with their intervals, the variance components, and the published search for
comparison.
"""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from fitting.calibration_file import PublishedResult
from fitting.coefficient_fit import CoefficientFit
from fitting.covariance import COMPONENTS
from fitting.ebt import Sway
from reports.context import ReportContext
from reports.page import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.style import (
    EBT,
    HALF_WIDTH_IN,
    INK,
    MUTED,
    SHADE,
    TWIN,
    WARN,
    Grid,
    Look,
    Margins,
    legend_above,
    panel,
    panels,
    styled,
)
from reports.words import MISSING, MM, counted, in_mm, in_words, shown, significant
from swimcal.mjcf import COEFFICIENT_BOUNDS, PUBLISHED_COEFFICIENTS, FluidCoefficients

# Figures
NAMES = tuple(map(in_words, FluidCoefficients._fields))
_LOW = float(np.sqrt(COEFFICIENT_BOUNDS[0]))
_HIGH = float(np.sqrt(COEFFICIENT_BOUNDS[1]))
_TICKS = (0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0)  # ticks of the square-root scale

# Tables
_COLUMNS = table_head("coefficient | value [] | 90 % interval [] | published search [] | authors' values [] | caveats")
_ERRORS = table_head("over | quantity | recommended fit | published search")
_COMPONENTS = table_head("component | level | standard deviation | meaning")
_AS_LIKELY = 2.0  # largest difference of log density between ends that are about as likely
_LEAST_ROLL_DEG = 2.0  # least amplitude of a roll that is mentioned


@styled
def coefficients_figure(fit: CoefficientFit, published: FluidCoefficients | None = None) -> Figure:
    """Draw each coefficient within its bounds, on the square-root scale, with its 90 % interval.

    Dots are other ends.
    """
    figure, axes = panel(HALF_WIDTH_IN, 3.3, Margins(left=1.0, top=0.5))
    rows = -np.arange(len(NAMES))
    axes.barh(rows, _HIGH - _LOW, left=_LOW, height=0.5, color=SHADE)
    axes.set_yticks(rows, NAMES)
    axes.set(xlabel="coefficient (no unit; square-root scale)", xlim=(_LOW - 0.08, _HIGH + 0.08))
    axes.grid(visible=False, axis="y")
    within = [tick for tick in _TICKS if _LOW <= np.sqrt(tick) <= _HIGH]
    axes.set_xticks(np.sqrt(within), [f"{tick:g}" for tick in within])
    best, bound = np.sqrt(fit.coefficients), coefficients_at_bound(fit)
    for row, ends in zip(rows, np.sqrt(fit.interval), strict=True):
        axes.plot(ends, [row] * 2, color=TWIN, linewidth=2.0, zorder=2.6)
    for chosen, colour, label in ((~bound, TWIN, "mode"), (bound, WARN, "at its bound")):
        if chosen.any():
            axes.plot(best[chosen], rows[chosen], "D", color=colour, markersize=6, label=label, zorder=3)
    if published is not None:
        look: Look = {"color": EBT, "markersize": 6, "markerfacecolor": "none", "label": "published"}
        axes.plot(np.sqrt(published), rows, "s", **look)
    authors: Look = {"markersize": 11, "markeredgewidth": 1.6, "zorder": 2.5, "label": "authors"}
    axes.plot(np.sqrt(PUBLISHED_COEFFICIENTS), rows, "|", color=INK, **authors)
    for end in fit.ends[1:]:
        mark, label = ("o", "other starts") if end.forward else ("x", "backward")
        axes.plot(np.sqrt(end.coefficients), rows, mark, color=MUTED, markersize=3.5, alpha=0.7, label=label)
    legend_above(axes, 3, columnspacing=1.0, handletextpad=0.3)
    return figure


def coefficients_at_bound(fit: CoefficientFit) -> np.ndarray:
    """Mark (5,) the coefficients that a flag puts at their bound."""
    messages = [flag.message for flag in fit.flags if flag.kind == "at_bound"]
    return np.array([any(name in message for message in messages) for name in FluidCoefficients._fields])


@styled
def hull_roll_figure(sways: Mapping[str, Sway]) -> Figure:
    """Draw the amplitude above and the phase against the tail's end below; each trial is a point."""
    figure, (above, below) = panels(2, Grid(1, 1.45, (0.0, 0.12)), HALF_WIDTH_IN, Margins(top=0.52))
    ordered = sorted(sways.values(), key=lambda sway: sway.frequency_hz)
    for label, colour, mark, waves in (
        ("measured", INK, "o", [sway.measured for sway in ordered]),
        ("twin, rigid hull", EBT, ":", [sway.rigid for sway in ordered]),
        ("twin with the roll", TWIN, "-", [sway.rolling for sway in ordered]),
    ):
        hz = [sway.frequency_hz for sway in ordered]
        look: Look = {"color": colour, "markersize": 5.5, "linewidth": 1.6, "label": label}
        above.plot(hz, [wave.amplitude_m * MM for wave in waves], mark, **look)
        below.plot(hz, [wave.phase_deg for wave in waves], mark, **look)
    above.set_ylim(bottom=0.0)
    above.set_ylabel("amplitude (mm)")
    below.set(ylabel="ahead of tail (°)", xlabel="swim frequency (Hz)")
    above.set_xticklabels([])
    legend_above(above, 2)
    return figure


def build_coefficients(context: ReportContext) -> Section:
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
