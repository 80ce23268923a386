"""One lucky pair of fit trials proves nothing: the identification on other pairs of the session's swims."""

import numpy as np

from fitting.ebt import FORMS
from fitting.pairs import PairFit
from reports.blocks import Column, Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.coefficients import NAMES, pair_coefficients_figure
from reports.figures.speed import pair_errors_figure
from reports.models import model_label
from reports.numbers import MISSING, counted, in_mm, listed, shown, significant

SPREAD = table_head(
    "model | mean [mm/s] | standard deviation [mm/s] | best [mm/s] | worst [mm/s] | better than the twin [pairs]"
)
TITLE, ANCHOR = "Other pairs of fit trials", "pairs"


def build(context: ReportContext) -> Section:
    """Mean and spread over pairs; without them, why there are none."""
    pairs = () if context.evidence is None else context.evidence.pairs
    if not pairs:
        return Section(TITLE, ANCHOR, (Prose(_why_none(context)),))
    caveats = [
        "Each pair has a search of its own, which knows nothing of this session’s fit nor of the trials that the pair "
        "leaves out. It is a small one: where it stays above the bottom, the pair’s coefficients are off as well."
    ]
    if open_ended := [_name(pair) for pair in pairs if not pair.converged]:
        caveats.append(f"The search of {listed(open_ended)} was still improving when its iterations ran out.")
    if backward := [_name(pair) for pair in pairs if not pair.swims_forward]:
        caveats.append(f"From rest, the twin of {listed(backward)} swims backward: no start led to one that does not.")
    blocks = (Prose(_verdict(pairs)), Plots(_plots(context, pairs)), _spread(pairs), _each(pairs))
    return Section(TITLE, ANCHOR, blocks, tuple(caveats))


def _name(pair: PairFit) -> str:
    return f"{pair.fitted[0]} with {pair.fitted[1]}"


def _why_none(context: ReportContext) -> str:
    if len(context.calibration.trials) < 3:
        return "With fewer than three swims there is no other pair of fit trials to try."
    return (
        "The fit was not repeated on other pairs of trials, so how much depends on this choice of fit trials is not "
        "known; calib run SESSION --effort full tells."
    )


def _verdict(pairs: tuple[PairFit, ...]) -> str:
    twin = _errors(pairs, "twin")
    theories = [form.name for form in FORMS if form.name in pairs[0].speed_mae]
    versus = [
        f"{in_mm(_mean(_errors(pairs, name)))} mm/s for {model_label(name)} (the twin is better in "
        f"{int((twin < _errors(pairs, name)).sum())} of {len(pairs)})"
        for name in theories
    ]
    theory = f", against {listed(versus)}" if versus else ""
    return (
        f"Fitted on each of {counted(len(pairs), 'pair')} of swims and asked for the others, the twin is off by "
        f"{in_mm(_mean(twin))} ± {in_mm(_deviation(twin))} mm/s on average{theory}."
    )


def _plots(context: ReportContext, pairs: tuple[PairFit, ...]) -> tuple[Plot, ...]:
    own = frozenset(trial.measured.name for trial in context.trials("fit"))
    best = context.calibration.coefficients
    return (
        Plot(
            pair_errors_figure(pairs, own),
            "pair-errors",
            "Speed error over the trials that each pair leaves out; a dot a pair, in the same order in every row. Look "
            "whether the open dot, this session’s own choice, sits amid the others or was lucky.",
        ),
        Plot(
            pair_coefficients_figure(pairs, best),
            "pair-coefficients",
            "Coefficients that each pair gives, within their bounds (grey). What scatters widely is set by the choice "
            "of trials as much as by the robot.",
        ),
    )


def _errors(pairs: tuple[PairFit, ...], name: str) -> np.ndarray:
    """(p,) mean absolute speed errors of one model, m/s."""
    return np.array([pair.speed_mae.get(name, np.nan) for pair in pairs])


def _mean(errors: np.ndarray) -> float:
    return float(np.nanmean(errors)) if np.isfinite(errors).any() else float("nan")


def _deviation(errors: np.ndarray) -> float:
    known = errors[np.isfinite(errors)]
    return float(known.std(ddof=1)) if len(known) > 1 else float("nan")


def _spread(pairs: tuple[PairFit, ...]) -> Table:
    rows = []
    for name in pairs[0].speed_mae:
        errors = _errors(pairs, name)
        known = errors[np.isfinite(errors)]
        ends = (in_mm(float(known.min())), in_mm(float(known.max()))) if len(known) else (MISSING, MISSING)
        better = int((errors < _errors(pairs, "twin")).sum())
        wins = MISSING if name == "twin" else f"{better} of {len(pairs)}"
        rows.append((model_label(name), in_mm(_mean(errors)), in_mm(_deviation(errors)), *ends, wins))
    caption = (
        f"Mean absolute speed error over the trials left out, over {counted(len(pairs), 'pair')} of fit trials. EBT "
        "is fitted to the same pair and predicts from the measured tail of the trial left out or, where it says so, "
        "from the twin’s, so that it too predicts without the measured tail."
    )
    return Table(caption, SPREAD, tuple(rows))


def _each(pairs: tuple[PairFit, ...]) -> Table:
    columns = (*table_head("fit trials | marker distance [mm] | twin [mm/s]"), *map(Column, NAMES))
    rows = tuple(
        (
            ", ".join(pair.fitted),
            in_mm(pair.marker_error_m),
            shown(pair.speed_mae["twin"] * 1000),
            *(significant(value) for value in pair.coefficients),
        )
        for pair in pairs
    )
    return Table(
        "Each pair: distance on its two trials, speed error on the others, coefficients.", columns, rows, (), True
    )
