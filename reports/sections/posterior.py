"""The section on the posterior: what the trials determine, what that predicts, and whether to believe it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reports.blocks import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.coefficients import NAMES
from reports.figures.posterior_checks import (
    posterior_ranks_figure,
    posterior_trace_figure,
    posterior_whiteness_figure,
)
from reports.figures.posterior_coefficients import (
    posterior_corner_figure,
    posterior_further_figure,
    posterior_intervals_figure,
)
from reports.figures.posterior_predicted import posterior_trials_figure
from reports.numbers import (
    MM,
    counted,
    in_mm,
    listed,
    percent,
    shown,
    significant,
    spanned,
    with_error,
)
from reports.sections.structure import WORDS
from swimmer.fluid import COEFFICIENT_BOUNDS

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary
    from swimmer import FluidCoefficients

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


def build(context: ReportContext) -> Section:
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
    intervals = Plot(
        posterior_intervals_figure(found, fit),
        "posterior-intervals",
        "90 % intervals and means within the prior (grey), and the fit (orange), which is the mode.",
    )
    corner = Plot(
        posterior_corner_figure(found, fit),
        "posterior-corner",
        "The posterior of each coefficient and of each pair, with correlations. A slanted ellipse is a combination "
        "that the trials determine better than either coefficient. Orange: the fit.",
    )
    return (
        _table(found, fit),
        Plots((intervals, corner), "How the coefficients trade against each other.", folded=True),
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
            WORDS.get(part.quantity, part.quantity),
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
        "Speed along a smoothed path, measured and predicted, and marker coordinates inside their 90 % bands. Held-out "
        "trials: given the frequency and start of their first two beats."
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
    white = Plot(
        posterior_whiteness_figure(found),
        "posterior-whiteness",
        "Autocorrelation of the tracking errors (grey) and of the residual of the noise model (blue), which should lie "
        "within the band of white noise.",
    )
    trace = Plot(
        posterior_trace_figure(found),
        "posterior-trace",
        "Walkers after the burn-in: a band of constant mean and width has converged.",
    )
    ranks = Plot(
        posterior_ranks_figure(found),
        "posterior-ranks",
        "Ranks of four groups of walkers among all draws: within the grey band (95 % of bins) they have drawn from the "
        "same distribution.",
    )
    return Prose(text), _noise(found), Plots((white, trace, ranks), "Noise and chains, drawn.", folded=True)


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
