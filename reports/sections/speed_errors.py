"""How large the speed errors are, model by model, each number with an interval; and what of EBT is identifiable."""

import numpy as np

from fitting.command_forecast import beat_to_command, forecast_from_command
from fitting.ebt import FORMS
from fitting.speed_errors import SpeedErrors, speed_errors
from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.speed import speed_intervals_figure
from reports.models import model_label
from reports.numbers import counted, in_mm, listed, sentence, shown, significant, spanned

COLUMNS = table_head(
    "model | mean absolute error [mm/s, 90 % interval] | bias [mm/s, 90 % interval] | worst [mm/s, 90 % interval]"
)
ROLES = {"fit": "fit", "holdout": "held-out"}
FEW_TRIALS = 5


def build(context: ReportContext) -> Section:
    """A table for the fit and one for the held-out trials; without the latter it says so."""
    seed = context.session.seed
    errors = {role: found for role in ROLES if (found := speed_errors(context.trials(role), seed))}
    plots = tuple(
        Plot(speed_intervals_figure(errors, measure), name, caption)
        for measure, name, caption in (
            (
                "mean_absolute",
                "speed-error-size",
                "Mean absolute speed error of each model, with its 90 % interval. Compare the open marks: a model that "
                "is good on the fit trials only has learned them. Where intervals overlap, these trials do not rank "
                "the models.",
            ),
            (
                "bias",
                "speed-error-bias",
                "Bias of the same predictions. A bar that stays clear of zero is a model that is always too fast or "
                "always too slow, which more trials will not mend.",
            ),
        )
    )
    tables = tuple(_table(role, len(context.trials(role)), found) for role, found in errors.items())
    theory = Prose(_identifiable(context))
    blocks = (Plots(plots), *tables, *_by_command(context), theory)
    return Section("Speed errors", "errors", blocks, _caveats(context))


def _table(role: str, count: int, errors: dict[str, SpeedErrors]) -> Table:
    return Table(
        f"Speed errors over {counted(count, f'{ROLES[role]} trial')}. EBT predicts from the measured tail or, where "
        "it says so, from the twin’s, so that it too predicts without the measured tail.",
        COLUMNS,
        _rows(errors),
    )


def _by_command(context: ReportContext) -> tuple[Table | Prose, ...]:
    """The same for forecasts that nothing measured in the trial enters; without any, why there is none."""
    calibration = context.calibration
    foretold = forecast_from_command(calibration)
    if not foretold:
        return ()
    known = [trial for trial in context.trials("holdout") if np.isfinite(foretold[trial.measured.name].speeds["twin"])]
    missing = [f"{name}: {flag.message}" for name, forecast in foretold.items() for flag in forecast.flags]
    without = "".join(f" No forecast of {sentence(text)}" for text in missing)
    if not known:
        return (Prose(f"Nothing could be forecast from the command alone.{without}"),)
    errors = speed_errors(known, context.session.seed, lambda trial: foretold[trial.measured.name].speeds)
    caption = (
        f"Speed errors over {counted(len(known), 'held-out trial')}, forecast from the command alone: the frequency is "
        f"the command times {shown(beat_to_command(calibration), 3)}, the mean ratio of beat to command over the fit "
        "trials, and the speed the one at which the twin settles there (the lines of the sweep). Nothing measured in "
        f"the trials enters, neither their beat, phase and start, nor their tail.{without}"
    )
    return (Table(caption, COLUMNS, _rows(errors)),)


def _rows(errors: dict[str, SpeedErrors]) -> tuple[tuple[str, ...], ...]:
    """A model a row: value and interval of each error, `12.3 (4.1 to 20.0)`, mm/s."""
    return tuple(
        (model_label(name), *(f"{in_mm(each.value)} ({spanned(each.low, each.high, in_mm)})" for each in found))
        for name, found in errors.items()
    )


def _identifiable(context: ReportContext) -> str:
    """The one number of each form of the theory, and that there is only one."""
    ebts = context.calibration.ebts
    ratios = [
        f"{significant(ebts[form.name].drag_coefficient / (ebts[form.name].beta or 1.0))} ({model_label(form.name)})"
        for form in FORMS
        if form.name in ebts
    ]
    at_bound = [flag.message.removeprefix("EBT: ") for ebt in ebts.values() for flag in ebt.flags]
    doubts = [sentence(text) for text in dict.fromkeys(at_bound) if "identifiable" not in text]
    return " ".join(
        [
            "Elongated body theory has two numbers, the shape factor β of the added mass and the drag coefficient c_D. "
            "Thrust is proportional to β and drag to c_D, so that from speeds only their ratio c_D / β is "
            f"identifiable; β is kept at 1. Fitted to the same fit trials, it is {listed(ratios)}. That the "
            "forms differ so much shows that it takes up what each leaves out; it is no property of the robot.",
            *doubts,
        ]
    )


def _caveats(context: ReportContext) -> tuple[str, ...]:
    held_out = len(context.trials("holdout"))
    if not held_out:
        return ("No trial was held out: the errors below are those of the fit and flatter every model.",)
    if held_out < FEW_TRIALS:
        return (
            f"With {counted(held_out, 'held-out trial')} the intervals (trials drawn with replacement, each with the "
            "scatter of its beats) say little beyond these very trials.",
        )
    return ()
