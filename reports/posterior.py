"""Section on the posterior: how sure the coefficients are, what is predicted with them, and the checks of the draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import gaussian_filter
from scipy.stats import rankdata

from reports.coefficients import NAMES
from reports.context import ReportContext
from reports.page import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.style import (
    EBT,
    EBT_LARGE,
    FULL_WIDTH_IN,
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
    legend_on_top,
    name_panels,
    panel,
    panels,
    role_handles,
    role_marker,
    small_multiples,
    styled,
)
from reports.words import (
    MM,
    counted,
    in_mm,
    in_words,
    listed,
    percent,
    shortened,
    shown,
    significant,
    spanned,
    with_error,
)
from swimcal.mjcf import COEFFICIENT_BOUNDS

if TYPE_CHECKING:
    from fitting.posterior.prediction import PredictedTrial
    from fitting.posterior.summary import PosteriorSummary
    from swimcal.mjcf import FluidCoefficients

# The figure of the checks
_GROUPS = 4  # number of groups of walkers
_RANK_BINS = 10  # bins of the ranks
_QUARTER_COLOURS = (TWIN, EBT, EBT_LARGE, INK)

# Figures of the draws
_DENSITY_BINS = 36  # bins of the densities
_SMOOTH = 1.3  # standard deviation of the filter that smooths them, bins
_HELD = (0.9, 0.5)  # shares of the draws within the contours
_COEFFICIENT_COLOURS = (TWIN, EBT, EBT_LARGE, INK, WARN)

# Tables
COLUMNS = table_head("coefficient | fit [] | mean ± sd [] | 90 % interval [] | sd / prior’s [%] | determined")
DIRECTIONS = table_head("combination | sd / prior’s [%]")
TRIALS = table_head(
    "trial | role | measured [mm/s] | coefficients, 90 % [mm/s] | all, 90 % [mm/s] | speed inside | "
    "marker coordinates inside [%]"
)
ROBOT = table_head("quantity | prior sd [%] | from | posterior offset [%]")
NOISE = table_head(
    "trial | frames [] | effective [] | lasts [s] | white share [%] | size [mm] | neighbours [] | "
    "after the model [] | white after the model"
)


@styled
def posterior_ranks_figure(found: PosteriorSummary) -> Figure:
    """Draw how the ranks of four groups of walkers spread, a panel a coefficient.

    Flat within the band means well mixed.
    """
    margins = Margins(left=0.6, top=0.5)
    figure, drawn = panels(len(NAMES), Grid(1, 0.52, gap_in=(0.0, 0.22)), HALF_WIDTH_IN, margins)
    name_panels(drawn, NAMES, 1, "rank among all draws")
    edges = np.linspace(0.0, 1.0, _RANK_BINS + 1)
    for i, axes in enumerate(drawn):
        ranks = rankdata(found.chains[..., i]).reshape(found.chains.shape[:2]) / found.chains[..., i].size
        each = found.ess_bulk[i] / _GROUPS
        spread = 1.96 * np.sqrt(
            (1 - 1 / _RANK_BINS) * _RANK_BINS / each
        )  # half width of the band of a bin's share times bins
        axes.axhspan(1 - spread, 1 + spread, facecolor=SHADE, linewidth=0)
        for quarter, colour in enumerate(_QUARTER_COLOURS):
            group = np.array_split(ranks, _GROUPS)[quarter]
            share = np.histogram(group, edges)[0] * _RANK_BINS / group.size
            axes.stairs(share, edges, color=colour, linewidth=0.9, baseline=None, label=f"quarter {quarter + 1}")
        axes.axhline(1.0, color=MUTED, linewidth=0.6)
        reach = max(0.3, 1.6 * spread)
        axes.set(xlim=(0, 1), ylim=(1 - reach, 1 + reach))
        axes.locator_params(axis="y", nbins=3)
    drawn[2].set_ylabel("density of the ranks")
    legend_on_top(figure, 4)
    return figure


@styled
def posterior_corner_figure(found: PosteriorSummary, fit: FluidCoefficients) -> Figure:
    """Draw densities on the diagonal, contours that hold 50 and 90 % of the draws below it, correlations above it."""
    draws, count = found.chains[..., :5].reshape(-1, 5), len(NAMES)
    margins = Margins(left=0.72, right=0.1, bottom=0.55, top=0.25)
    figure, drawn = panels(count**2, Grid(count, 1.02, gap_in=(0.1, 0.1)), FULL_WIDTH_IN, margins)
    limits = [_limits(draws[:, i]) for i in range(count)]
    for place, axes in enumerate(drawn):
        row, column = divmod(place, count)
        if row < column:
            value = float(found.identifiability.correlation[row, column])
            look: Look = {"ha": "center", "va": "center", "fontsize": 7.5 + 6 * abs(value), "color": MUTED}
            axes.text(0.5, 0.5, f"{value:+.2f}".replace("-", "−"), **look)
            axes.set_axis_off()
            continue
        if row == column:
            _density(axes, draws[:, row], limits[row], fit[row])
            marginal = list(found.marginals.values())[row]
            ends = f"{significant(marginal.q05)} to {significant(marginal.q95)}"
            axes.set_title(ends, loc="left", pad=3, fontsize=7.5)
        else:
            _contours(axes, draws[:, [column, row]], (limits[column], limits[row]))
            axes.plot(fit[column], fit[row], "D", color=EBT, markersize=4)
        _dress(axes, row, column, (limits[column], limits[row]))
    handles = [
        Line2D([], [], color=EBT, marker="D", markersize=4, linestyle="none", label="fit"),
        Patch(facecolor=TWIN, alpha=0.45, label="50 % of the draws"),
        Patch(facecolor=TWIN, alpha=0.18, label="90 %"),
        Line2D([], [], color=MUTED, linestyle="none", label="+0.00  correlation"),
    ]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=7.5)
    return figure


def _limits(values: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(values, [0.001, 0.999])
    margin = 0.06 * (high - low)
    return max(float(low - margin), COEFFICIENT_BOUNDS[0]), min(float(high + margin), COEFFICIENT_BOUNDS[1])


def _density(axes: Axes, values: np.ndarray, limits: tuple[float, float], best: float) -> None:
    heights, edges = np.histogram(values, _DENSITY_BINS, limits, density=True)
    smooth = gaussian_filter(heights, _SMOOTH, mode="nearest")
    middles = (edges[1:] + edges[:-1]) / 2
    for share, alpha in zip(_HELD, (0.18, 0.3), strict=True):
        low, high = np.quantile(values, [0.5 - share / 2, 0.5 + share / 2])
        inside = (middles >= low) & (middles <= high)
        axes.fill_between(middles, smooth, where=inside, color=TWIN, alpha=alpha, linewidth=0)
    axes.plot(middles, smooth, color=TWIN)
    axes.axvline(best, color=EBT, linewidth=1.0)
    axes.set_ylim(bottom=0)


def _contours(axes: Axes, pair: np.ndarray, limits: tuple[tuple[float, float], tuple[float, float]]) -> None:
    counts, x, y = np.histogram2d(pair[:, 0], pair[:, 1], _DENSITY_BINS, limits)
    smooth = gaussian_filter(counts, _SMOOTH, mode="nearest").T
    ordered = np.sort(smooth, axis=None)[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    levels = sorted({float(ordered[np.searchsorted(held, share)]) for share in _HELD})
    middles = ((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2)
    axes.contourf(*middles, smooth, [*levels, smooth.max() * 1.01], colors=[TWIN, TWIN], alpha=0.18)
    if len(levels) > 1:
        axes.contourf(*middles, smooth, [levels[-1], smooth.max() * 1.01], colors=[TWIN], alpha=0.3)
    axes.contour(*middles, smooth, levels, colors=[TWIN], linewidths=0.9)


def _dress(axes: Axes, row: int, column: int, limits: tuple[tuple[float, float], tuple[float, float]]) -> None:
    axes.set_xlim(*limits[0])
    axes.grid(visible=False)
    axes.locator_params(nbins=4)
    axes.tick_params(labelbottom=row == len(NAMES) - 1, labelleft=row != column and column == 0, labelsize=7, length=2)
    if row == column:
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
    else:
        axes.set_ylim(*limits[1])
    if row == len(NAMES) - 1:
        axes.set_xlabel(NAMES[column])
    if column == 0:
        axes.set_ylabel(NAMES[row])


@styled
def posterior_further_figure(found: PosteriorSummary) -> Figure:
    """Draw the standard deviation of each coefficient with one more swim over that without, by the swim's frequency."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    sweep, chosen = found.sweep, found.wanted
    ratio = 100 * sweep.sd / sweep.sd_now
    wanted, loose = {"linewidth": 1.6, "markersize": 3}, {"linewidth": 0.8, "linestyle": (0, (2, 2)), "markersize": 1.8}
    for i, name in enumerate(NAMES):
        style = wanted if chosen[i] else loose
        axes.plot(sweep.frequency_hz, ratio[:, i], marker="o", color=_COEFFICIENT_COLOURS[i], label=name, **style)
    axes.axvline(
        sweep.frequency_hz[np.argmin(sweep.shrinkage(chosen))], color=MUTED, linewidth=0.7, linestyle=(0, (2, 2))
    )
    axes.set(ylim=(0, 104), xlabel="frequency of one more trial (Hz)", ylabel="standard deviation, % of now")
    legend_above(axes, 3, columnspacing=1.0)
    return figure


@styled
def posterior_trials_figure(found: PosteriorSummary) -> Figure:
    """Draw the lateral amplitude along the body with its bands, a panel a trial, all to one scale."""
    width, columns = small_multiples(len(found.trials))
    top = 0.5 if width > HALF_WIDTH_IN else 0.62
    figure, drawn = panels(len(found.trials), Grid(columns, 1.15, (0.14, 0.34)), width, Margins(left=0.5, top=top))
    highest = max(float(max(trial.swing_m.max(), trial.swing_outer.max())) for trial in found.trials) * MM
    for axes, trial in zip(drawn, found.trials, strict=True):
        _draw_swings(axes, trial)
        axes.set_ylim(0.0, 1.05 * highest)
    name_panels(drawn, [shortened(trial.name) for trial in found.trials], columns)
    drawn[0].set_ylabel("lateral amplitude (mm)")
    drawn[-1].set_xlabel("along the body (mm)")
    bands = [
        Patch(facecolor=TWIN, alpha=0.65, label="coefficients, 90 %"),
        Patch(facecolor=TWIN, alpha=0.2, label="all, 90 %"),
    ]
    legend_on_top(figure, 2 if columns < 4 else 4, [*role_handles(INK), *bands])
    return figure


def _draw_swings(axes: Axes, trial: PredictedTrial) -> None:
    order = trial.place_m.argsort()
    place = trial.place_m[order] * MM
    for band, alpha in ((trial.swing_outer, 0.2), (trial.swing_inner, 0.55)):
        axes.fill_between(place, band[0, order] * MM, band[-1, order] * MM, color=TWIN, alpha=alpha, linewidth=0)
    mark = role_marker(INK, trial.role) | {"markersize": 3.2, "markeredgewidth": 0.9}
    axes.plot(place, trial.swing_m[order] * MM, **mark)
    axes.locator_params(axis="x", nbins=4)


def build_posterior(context: ReportContext) -> Section:
    """Build the section; without a posterior it says how to make one."""
    found = context.posterior
    if found is None:
        text = "The posterior of the coefficients was not sampled for this session; calib posterior SESSION does it."
        if file := context.damaged.get("posterior"):
            text = f"results/{file} is damaged or cut short; calib posterior SESSION makes it again."
        return Section("The posterior", "posterior", (Prose(text),))
    parts = (
        Section("What was predicted", "posterior-predicted", _build_predicted(found)),
        Section("One more trial", "posterior-further", _build_further(found)),
        Section("Convergence and noise", "posterior-checks", _build_checks(found)),
    )
    return Section("The posterior", "posterior", _build_determined(found, context), parts=parts)


def _build_determined(found: PosteriorSummary, context: ReportContext) -> tuple[Block, ...]:
    fit = context.calibration.coefficients
    corner = Plot(
        posterior_corner_figure(found, fit),
        "posterior-corner",
        "The posterior of each coefficient and of each pair, with correlations. A slanted ellipse is a combination "
        "that the trials determine better than either coefficient. Orange: the fit.",
    )
    return (
        _table(found, fit),
        Plots((corner,), "How the coefficients trade against each other.", folded=True),
        _robot(found),
        _directions(found),
    )


def _how(found: PosteriorSummary) -> str:
    low, high = COEFFICIENT_BOUNDS
    wave, speed = found.discrepancy
    return (
        f"Prior: each coefficient uniform from {low:g} to {high:g}. The twin’s own error, here "
        f"{significant(100 * wave, 2)} % of the wave and {significant(100 * speed, 2)} % of the speed, noise and what "
        f"is not known of the robot are integrated out ({found.simulations} simulations of each fit trial)."
    )


def _robot(found: PosteriorSummary) -> Table:
    rows = tuple(
        (
            in_words(part.quantity),
            significant(100 * part.sd, 2),
            "dry experiments" if part.measured else "assumed: not measured",
            with_error(100 * part.mean_after, 100 * part.sd_after),
        )
        for part in found.robot
    )
    return Table(_how(found), ROBOT, rows, folded=True)


def _table(found: PosteriorSummary, fit: FluidCoefficients) -> Table:
    rows = []
    for i, (name, marginal) in enumerate(zip(NAMES, found.marginals.values(), strict=True)):
        rows.append(
            (
                name,
                significant(fit[i]),
                f"{significant(marginal.mean)} ± {significant(marginal.sd, 2)}",
                spanned(marginal.q05, marginal.q95),
                significant(100 * found.identifiability.narrowed[i], 2),
                "at a bound" if found.identifiability.at_bound[i] else "yes" if marginal.determined else "no",
            )
        )
    return Table(found.identifiability.sentence, COLUMNS, tuple(rows))


def _directions(found: PosteriorSummary) -> Table:
    seen = found.identifiability
    rows = tuple((seen.combination(i), significant(100 * seen.direction_narrowed[i], 2)) for i in range(len(NAMES)))
    caption = "Combinations of coefficients from the best to the least determined (principal axes)."
    return Table(caption, DIRECTIONS, rows, folded=True)


def _build_predicted(found: PosteriorSummary) -> tuple[Block, ...]:
    swings = Plot(
        posterior_trials_figure(found),
        "posterior-trials",
        "Amplitude of each marker at the beat frequency, from nose to fin. Dark: uncertainty of the coefficients; "
        "light: all of it.",
    )
    rows = tuple(
        (
            trial.name,
            "fit" if trial.role == "fit" else "held out",
            in_mm(trial.speed),
            spanned(trial.inner[0], trial.inner[-1], in_mm),
            spanned(trial.outer[0], trial.outer[-1], in_mm),
            "yes" if trial.speed_inside else "no",
            shown(100 * trial.inside, 0),
        )
        for trial in found.trials
    )
    caption = (
        "Forward speed, measured and predicted, and marker coordinates inside their 90 % bands. Both bands are of the "
        "twin with its correction; the exported twin has none. Held-out trials: given the frequency and start of their "
        "first two beats."
    )
    return Prose(_inside(found)), Plots((swings,)), Table(caption, TRIALS, rows, folded=True)


def _inside(found: PosteriorSummary) -> str:
    parts = []
    for role, label in (("holdout", "held-out"), ("fit", "fit")):
        speeds, count, share = found.inside(role)
        if count:
            parts.append(
                f"{speeds} of {counted(count, f'{label} trial')} swam at a speed within its 90 % band "
                f"({percent(share)} of their marker coordinates within theirs)"
            )
    none = "" if found.inside("holdout")[1] else "No trial was held out. "
    return f"{none}{'; '.join(parts)}."


def _build_further(found: PosteriorSummary) -> tuple[Block, ...]:
    sweep, wanted = found.sweep, found.wanted
    order = np.argsort(sweep.shrinkage(wanted))
    ratios, best = sweep.sd[order[0]] / sweep.sd_now, sweep.frequency_hz[order[0]]
    loose = "what is not determined" if not wanted.all() else "the coefficients"
    effects = listed([f"{name} to {shown(100 * ratios[i], 0)} %" for i, name in enumerate(NAMES) if wanted[i]])
    text = (
        f"One more swim of 5 s at {shown(best, 1)} Hz would narrow {loose} most: the standard deviation of {effects} "
        f"of what it is. Next best: {listed([f'{shown(sweep.frequency_hz[i], 1)} Hz' for i in order[1:3]])}."
    )
    figure = Plot(
        posterior_further_figure(found),
        "posterior-further-plot",
        "Standard deviation of each coefficient with one more trial, over its frequency, if the twin is right. Thin "
        "dashed: determined already.",
    )
    return Prose(text), Plots((figure,))


def _build_checks(found: PosteriorSummary) -> tuple[Block, ...]:
    least, worst = float(np.min(found.ess_bulk[:5])), float(np.max(found.r_hat[:5]))
    text = (
        f"{counted(found.chains.shape[0], 'walker')}, {found.steps} steps each: at least {shown(least, 0)} effective "
        f"draws of each coefficient, R-hat at most {shown(worst, 3)}. The emulator misses the ln likelihood by "
        f"{shown(found.emulator_error, 2)}. Noise and nuisances alone leave residuals as large in "
        f"{percent(found.misfit_p)} of sessions."
    )
    ranks = Plot(
        posterior_ranks_figure(found),
        "posterior-ranks",
        "Ranks of four groups of walkers among all draws: within the grey band (95 % of bins) they have drawn from the "
        "same distribution.",
    )
    return Prose(text), _noise(found), Plots((ranks,), "The chains, drawn.", folded=True)


def _noise(found: PosteriorSummary) -> Table:
    rows = tuple(
        (
            white.trial,
            str(white.frames),
            shown(white.effective, 0),
            shown(white.lasts_s, 2),
            shown(100 * white.white, 0),
            shown(float(np.median(white.sd_m)) * MM, 2),
            shown(float(white.neighbour_correlation_raw[1]), 2),
            f"{shown(float(white.neighbour_correlation[1]), 2)} (chance {shown(float(white.neighbours_limit[1]), 2)})",
            "yes" if white.is_white else "no",
        )
        for white in found.whiteness
    )
    caption = (
        "The noise of each fit trial’s tracks: independent frames, size (median over markers), and the correlation of "
        "neighbouring markers, before and after the noise model."
    )
    return Table(caption, NOISE, rows, folded=True)
