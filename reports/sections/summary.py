"""The session grasped in ten seconds: one sentence, the key numbers, and what to mind about them."""

from markupsafe import Markup

from fitting import EBT_RATIO_ONLY, CalibratedTrial, Comparison, Summary
from reports.blocks import Block, Plot, Plots, Points, Prose, Section, Tile, Tiles
from reports.caveats import beats_compared, whole_trial_flags
from reports.context import ReportContext
from reports.diagnosed import Diagnosed
from reports.figures.planform import planform_figure
from reports.numbers import counted, in_mm, in_words, listed, percent, sentence, shown
from reports.objectives import OBJECTIVES
from session import FLAG_KINDS


def build(context: ReportContext) -> Section:
    """The summary; it says so when nothing was held out."""
    calibration = context.calibration
    robot = calibration.robot
    planform = Plot(
        planform_figure(robot, context.session.markers),
        "robot",
        f"The robot from above, to scale ({in_mm(robot.length_m, 0)} mm long): rings are the tracked "
        "markers, dots the hinges, the orange lines the tendons.",
    )
    blocks: list[Block] = [Prose(_headline(context), lead=True), Tiles(_tiles(context))]
    if doubts := _doubts(context):
        blocks.append(Points("Before you rely on these numbers", doubts, doubtful=True))
    if context.notes:
        blocks.append(Points("About this run", tuple(map(sentence, context.notes))))
    return Section("Summary", "summary", (*blocks, Plots((planform,))))


def _headline(context: ReportContext) -> Markup:
    fit, holdout = (context.calibration.summary(role) for role in ("fit", "holdout"))
    parts = []
    if holdout is not None:
        parts.append(
            Markup(
                "Over {} the twin predicts the swimming speed to within <strong>{}&nbsp;mm/s</strong> on "
                "average (elongated body theory: {}&nbsp;mm/s as published, {}&nbsp;mm/s for large amplitudes)."
            ).format(_trials(context.trials("holdout"), "held-out"), *_speed_errors(holdout))
        )
    if fit is not None:
        parts.append(
            Markup("The twin’s markers stay <strong>{}&nbsp;mm</strong> from the measured ones on {}{}.").format(
                in_mm(fit.marker_error_m, 0),
                _trials(context.trials("fit"), "fit"),
                _held_out_markers(holdout),
            )
        )
    if holdout is None and fit is not None:
        parts.append(
            Markup(
                "It gives their speed to within {}&nbsp;mm/s (elongated body theory: {}&nbsp;mm/s as published, "
                "{}&nbsp;mm/s for large amplitudes), but <strong>no trial was held out</strong>: nothing here says how "
                "well it predicts."
            ).format(*_speed_errors(fit))
        )
    return Markup(" ").join(parts)


def _trials(trials: tuple[CalibratedTrial, ...], role: str) -> str:
    hz = sorted(trial.measured.frequency.hz for trial in trials)
    span = shown(hz[0], 2) if len(hz) == 1 else f"{shown(hz[0], 2)} to {shown(hz[-1], 2)}"
    return f"{counted(len(trials), f'{role} trial')} ({span} Hz)"


def _speed_errors(summary: Summary) -> tuple[str, str, str]:
    """Of the twin, of elongated body theory as published and for large amplitudes, mm/s."""
    twin, published, large = (in_mm(summary.speed_mae[name], 0) for name in ("twin", "published", "large"))
    return twin, published, large


def _held_out_markers(holdout: Summary | None) -> Markup | str:
    if holdout is None:
        return ""
    return Markup(" and <strong>{}&nbsp;mm</strong> on the held-out ones").format(in_mm(holdout.marker_error_m, 0))


def _tiles(context: ReportContext) -> tuple[Tile, ...]:
    calibration = context.calibration
    fit, holdout = (calibration.summary(role) for role in ("fit", "holdout"))
    used = [trial.scores.used_fraction for trial in calibration.trials]
    return (
        _speed_tile("Speed error, held-out trials", holdout, _holdout_warning(context)),
        _speed_tile("Speed error, fit trials", fit),
        Tile("Marker distance, fit trials", _distance(fit), "mm", "mean over the scored window"),
        Tile("Marker distance, held-out trials", _distance(holdout), "mm", "coefficients frozen"),
        Tile(
            "Samples that count",
            percent(sum(used) / len(used)).removesuffix(" %"),
            "%",
            "of the scored windows; the rest is flagged",
            warning="" if min(used) > 0.8 else f"as low as {percent(min(used))} in one trial",
        ),
        Tile(
            "Coefficients fitted",
            str(len(calibration.coefficients)),
            detail=f"with {counted(len(calibration.fit.restarts), 'start')}",
            warning=", ".join(dict.fromkeys(f.kind.replace("_", " ") for f in calibration.fit.flags)),
        ),
    )


def _speed_tile(label: str, summary: Summary | None, warning: str = "") -> Tile:
    if summary is None:
        return Tile(label, "–", detail="no such trial")
    twin, published, large = _speed_errors(summary)
    return Tile(label, twin, "mm/s", f"elongated body theory: {published}, large-amplitude form {large}", warning)


def _distance(summary: Summary | None) -> str:
    return in_mm(summary.marker_error_m if summary else None, 0)


def _holdout_warning(context: ReportContext) -> str:
    trials = context.trials("holdout")
    beyond = [t for t in trials if any(flag.kind == "extrapolated" for flag in t.flags)]
    short = [t for t in trials if beats_compared(t.measured) < 2]
    warnings = [f"{len(beyond)} of {len(trials)} outside the fitted frequencies"] if beyond else []
    warnings += [f"{len(short)} of {len(trials)} over a single beat or less"] if short else []
    return "; ".join(warnings)


def _doubts(context: ReportContext) -> tuple[str, ...]:
    """Flags of the fit in full, those of whole trials by kind."""
    calibration = context.calibration
    doubts = [sentence(flag.message or flag.kind) for flag in calibration.flags if flag.kind != EBT_RATIO_ONLY]
    if calibration.objective != "published":
        doubts.insert(0, _other_objective(calibration.objective))
    names: dict[str, list[str]] = {}
    for trial in calibration.trials:
        for kind in dict.fromkeys(flag.kind for flag in whole_trial_flags(trial)):
            names.setdefault(kind, []).append(trial.measured.name)
    everywhere = len(calibration.trials)
    for kind, trials in names.items():
        where = "every trial" if len(trials) == everywhere else listed(trials)
        size = _off_command(context) if kind == "frequency_off_command" else ""
        doubts.append(sentence(f"{where}: {FLAG_KINDS.get(kind, kind.replace('_', ' '))}{size}"))
    return (*doubts, *_of_the_gap(context.diagnosed))


def _of_the_gap(found: Diagnosed | None) -> tuple[str, ...]:
    """What a diagnosis says that this fit leaves out."""
    if found is None or found.verdict == "no_gap":
        return ()
    named = listed([" or ".join(map(in_words, group)) for group in found.data.groups])
    what = (
        f"names {named}, which this fit leaves out" if named else "finds a gap that no effect of its catalogue explains"
    )
    return (f"The diagnosis {what}: see the sim-to-real gap.",)


def _other_objective(objective: Comparison) -> str:
    return (
        f"The coefficients were found by the {OBJECTIVES[objective]}. Marker distances in this report are the "
        "published ones all the same, which these coefficients were not chosen to make small; only the convergence of "
        "the search is told in what it minimised."
    )


def _off_command(context: ReportContext) -> str:
    """By how much the flagged trials beat faster or slower than commanded, as far as the command is known."""
    measured = [trial.measured for trial in context.calibration.trials]
    flagged = [m for m in measured if m.commanded_hz and any(f.kind == "frequency_off_command" for f in m.flags)]
    off = sorted({shown(100 * (m.frequency.hz / (m.commanded_hz or 1.0) - 1), 0, signed=True) for m in flagged})
    return f" by {' % or '.join(off)} %" if 0 < len(off) < 3 else ""
