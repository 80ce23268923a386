"""The first screen: whether the twin beats simple baselines, and an answer to each question."""

from fitting import CalibratedTrial
from reports.blocks import Prose, Section, Terms
from reports.context import ReportContext
from reports.forecast_words import gain_sentence, marker_sentence, speed_sentence, twin_sentence
from reports.gap_words import gap_sentences
from reports.numbers import counted, in_words, listed, of_its_size, shown, spanned
from reports.sections.caveats import caveats_of


def build(context: ReportContext) -> Section:
    """What it is, how good, how sure, what is missing, the main caveat and the next step; all on one screen."""
    return Section("Summary", "summary", (Prose(_lead(context), lead=True), Terms(_answers(context))))


def _lead(context: ReportContext) -> str:
    forecasts = context.calibration.forecasts
    return f"{twin_sentence(forecasts)} {speed_sentence(forecasts)} {gain_sentence(forecasts)}".strip()


def _answers(context: ReportContext) -> tuple[tuple[str, str], ...]:
    found = caveats_of(context)
    more = " Further caveats are below." if len(found) > 1 else ""
    return (
        ("What", _what(context)),
        ("How good", _how_good(context)),
        ("How sure", _how_sure(context)),
        ("What is missing", _what_is_missing(context)),
        ("Main caveat", f"{found[0]}{more}" if found else "None."),
        ("Next step", _next_step(context)),
    )


def _what(context: ReportContext) -> str:
    names = {role: [trial.measured.name for trial in context.trials(role)] for role in ("fit", "holdout")}
    held = f"; forecasts of {listed(names['holdout'])}" if names["holdout"] else ""
    robot = context.calibration.robot
    return (
        f"A MuJoCo twin of {robot.name}, {shown(robot.length_m, 2)} m long: five fluid coefficients fitted to "
        f"{listed(names['fit'])}{held}."
    )


def _how_good(context: ReportContext) -> str:
    """Markers after two beats, and over which frequencies."""
    over = [
        _trials(context.trials(role), words)
        for role, words in (("fit", "fit"), ("holdout", "held-out"))
        if context.trials(role)
    ]
    return f"{marker_sentence(context.calibration.forecasts)} All over {' and '.join(over)}.".strip()


def _how_sure(context: ReportContext) -> str:
    found = context.posterior
    if found is None:
        return "Not known: this fit has no posterior."
    determined = [
        f"{in_words(name)} {spanned(one.q05, one.q95, of_its_size)}"
        for name, one in found.marginals.items()
        if one.determined
    ]
    loose = [in_words(name) for name, one in found.marginals.items() if not one.determined]
    sure = f"Determined by these trials (90 % interval): {listed(determined)}. " if determined else ""
    return f"{sure}Not determined: {listed(loose) or 'none'}."


def _what_is_missing(context: ReportContext) -> str:
    found = context.diagnosed
    if found is None:
        return "Not known: the gap was not diagnosed."
    which, how_far = (text.partition(": ")[2] for text in gap_sentences(found)[1:])
    return f"{which[:1].upper()}{which[1:]} {how_far}"


def _next_step(context: ReportContext) -> str:
    on_folder = f"on the folder of this session ({context.session.folder.name})"
    if not context.trials("holdout"):
        return "Hold a trial out, or film another one, and fit again."
    if context.posterior is None:
        return f"Run calib posterior {on_folder}."
    if context.diagnosed is None:
        return f"Run calib diagnose {on_folder}."
    experiments = context.diagnosed.next_experiments
    return f"{experiments[0].describe}." if experiments else "Film further trials at other speeds."


def _trials(trials: tuple[CalibratedTrial, ...], role: str) -> str:
    hz = sorted(trial.measured.frequency.hz for trial in trials)
    span = shown(hz[0], 2) if len(hz) == 1 else f"{shown(hz[0], 2)} to {shown(hz[-1], 2)}"
    return f"{counted(len(trials), f'{role} trial')} ({span} Hz)"
