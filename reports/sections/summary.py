"""The first screen: a swim from above, the forecast of speeds, and plain answers to what a reader asks first."""

from markupsafe import Markup

from reports.answers import Answers, HowFarOff, HowSure
from reports.blocks import Bar, Card, FirstScreen, Plot, Range, Section
from reports.context import ReportContext
from reports.figures.hero import representative, swim_from_above
from reports.figures.speed import speed_sweep_figure
from reports.forecast_words import MODELS
from reports.numbers import in_mm, in_words, listed, sentence, shown, spanned
from swimmer.fluid import COEFFICIENT_BOUNDS


def build(context: ReportContext) -> Section:
    """Build the first screen; for what was not computed it names the command."""
    answers = context.answers
    hero, about = _hero(context)
    screen = FirstScreen(
        lead=_lead(answers),
        hero=hero,
        hero_caption=about,
        plots=(_speeds(context),),
        cards=(
            _how_far_off(answers.how_far_off),
            _how_sure(answers.how_sure, context),
            _missing(answers, context),
        ),
        next_step=answers.next_step,
        caveats=answers.caveats,
    )
    return Section("Summary", "summary", (screen,))


def _lead(answers: Answers) -> Markup:
    off = answers.how_far_off
    parts = [Markup(_describe_exported(off))]
    if (found := answers.missing) is not None:
        if found.groups:
            names = Markup(listed([str(Markup("<b>{}</b>").format(group)) for group in found.groups], 3))
            what = "Missing from it, at least" if found.more_is_missing else "Missing from it"
            parts.append(Markup("{}: {}.").format(what, names))
        elif found.no_gap:
            parts.append(Markup("No effect of the catalogue is missing from it."))
        else:
            parts.append(Markup("Something is missing from it that these trials do not name."))
    return Markup(" ").join(parts)


def _describe_exported(off: HowFarOff) -> Markup:
    parts = [Markup("{}").format(off.misses)] if off.misses else []
    if (held := off.held_out) is None:
        if off.fitted is not None:
            known = f"The exported twin is off by {off.fitted.size} in the trials that it was fitted to."
            parts.append(Markup("{}").format(known))
        parts.append(Markup("No held-out trial tells how well it forecasts."))
        return Markup(" ").join(parts)
    swims = "an unseen swim" if held.trials == 1 else f"{held.trials} unseen swims"
    rule = off.best_rule
    beside = "" if rule is None else f"; the best simple rule, {MODELS[off.best]}, to {in_mm(rule)}"
    theory = off.beside_theory and f", {off.beside_theory}"
    text = "The exported twin predicts the speed of {} to <b>{}&nbsp;mm/s</b> of {}{}{}."
    parts.append(Markup(text).format(swims, in_mm(held.speed), in_mm(held.swum, 0), theory, beside))
    return Markup(" ").join(parts)


def _hero(context: ReportContext) -> tuple[Markup, str]:
    trial = representative(context.calibration.trials)
    drawn = Markup("") if trial is None else swim_from_above(trial, context.calibration.robot)
    if trial is None or not drawn:
        return Markup(""), ""
    seen = "fitted" if trial.measured.role == "fit" else "never shown to the fit"
    return drawn, (
        f"Trial {trial.measured.name}, {shown(trial.measured.frequency.hz, 2)} Hz, {seen}. Robot and twin start "
        f"together; their markers are {in_mm(trial.scores.marker_error_m)} mm apart in the mean."
    )


def _speeds(context: ReportContext) -> Plot:
    calibration, sure = context.calibration, context.answers.how_sure
    low, high = calibration.sweep.fitted_hz
    diverged = int((calibration.sweep.speed_twin != calibration.sweep.speed_twin).sum())
    band = ""
    if context.posterior is not None:
        band = " The band is to hold 90 % of other swims, by the twin as corrected by its fit trials."
        band = f"{band} {sure.band}".rstrip()
    return Plot(
        speed_sweep_figure(calibration, None if context.posterior is None else context.posterior.sweep),
        "sweep",
        f"Speed over tail beat frequency. Below: the same minus the twin’s speed.{band} On grey ground nothing was "
        f"fitted ({shown(low, 2)} to {shown(high, 2)} Hz was).",
        f"The twin diverged at {diverged} frequencies, which are left out." if diverged else "",
    )


def _how_far_off(off: HowFarOff) -> Card:
    title = "How far off is the twin I can export?"
    if (held := off.held_out) is None:
        known = f"{off.fitted.size} in {off.fitted.over('fit')}. " if off.fitted is not None else ""
        return Card(title, "Not known", (f"{known}Hold a trial out to find how well it forecasts.",))
    fitted = "" if off.fitted is None else f" In {off.fitted.over('fit')}: {off.fitted.size}."
    highest = max(held.speed, *off.beside.values(), 1e-9)
    rows = [("exported twin", held.speed, True), *((MODELS[name], error, False) for name, error in off.beside.items())]
    bars = tuple(Bar(name, f"{in_mm(error)} mm/s", error / highest, twin) for name, error, twin in rows)
    return Card(
        title, held.size, (f"Mean error of speed and markers in {held.over('held-out')}.{fitted}", off.compared), bars
    )


def _how_sure(sure: HowSure, context: ReportContext) -> Card:
    low, high = COEFFICIENT_BOUNDS
    ranges = tuple(
        Range(in_words(name), one.text, *((each - low) / (high - low) for each in (one.low, one.high, one.value)))
        for name, one in sure.intervals.items()
    )
    how = f"90 % intervals; lines span {spanned(low, high)}."
    command = "" if sure.sampled else f"calib posterior {context.session.folder.name}"
    return Card("How sure are the coefficients?", "", (f"{sure.verdict} {how}",), (), ranges, command)


def _missing(answers: Answers, context: ReportContext) -> Card:
    found, title = answers.missing, "What is missing?"
    if found is None:
        return Card(
            title, "Not known", (answers.not_searched,), command=f"calib diagnose {context.session.folder.name}"
        )
    bars = tuple(Bar(name, shown(chance, 2), chance, name in found.named) for name, chance in found.chances.items())
    place = "" if found.no_gap else sentence(found.where.partition(" (")[0].partition(";")[0])
    return Card(title, found.headline, tuple(filter(None, (found.size, f"{place} {found.how_far}".strip()))), bars)
