"""Caveats of the numbers of a report."""

from diagnosis.result import DiagnosisResult
from fitting.ebt import EBT_RATIO_ONLY
from reports.blocks import Block, Points, Section
from reports.caveats import kinds_of_whole_trials
from reports.context import ReportContext
from reports.numbers import in_words, listed, sentence, shown
from session.flags import FLAG_KINDS


def build(context: ReportContext) -> Section | None:
    """All caveats, and notes of the run; None where there are neither."""
    blocks: list[Block] = []
    if found := caveats_of(context):
        blocks.append(Points("Before you rely on these numbers", found, doubtful=True))
    if context.notes:
        blocks.append(Points("About this run", tuple(map(sentence, context.notes))))
    return Section("Caveats", "caveats", tuple(blocks)) if blocks else None


def caveats_of(context: ReportContext) -> tuple[str, ...]:
    """Flags of the fit and of the posterior in full, those of whole trials by kind."""
    calibration, posterior = context.calibration, context.posterior
    known = {EBT_RATIO_ONLY, *(["unidentifiable"] if posterior is not None else [])}  # a posterior knows better
    of_fit = [flag for flag in calibration.flags if flag.kind not in known]
    of_both = [*of_fit, *(posterior.flags if posterior is not None else ())]
    caveats = list(dict.fromkeys(sentence(flag.message or flag.kind) for flag in of_both))
    flags = {trial.measured.name: trial.flags for trial in calibration.trials}
    for kind, where in kinds_of_whole_trials(flags).items():
        size = _off_command(context) if kind == "frequency_off_command" else ""
        caveats.append(sentence(f"{where}: {FLAG_KINDS.get(kind, kind.replace('_', ' '))}{size}"))
    return (*caveats, *_of_the_gap(context.diagnosed))


def _of_the_gap(found: DiagnosisResult | None) -> tuple[str, ...]:
    """Effects that this fit leaves out, by the diagnosis."""
    if found is None or found.verdict == "no_gap":
        return ()
    named = listed([" or ".join(map(in_words, group)) for group in found.groups])
    what = (
        f"names {named}, which this fit leaves out" if named else "finds a gap that no effect of its catalogue explains"
    )
    return (f"The diagnosis {what}: see the sim-to-real gap.",)


def _off_command(context: ReportContext) -> str:
    """By how much the flagged trials beat faster or slower than commanded, as far as the command is known."""
    measured = [trial.measured for trial in context.calibration.trials]
    flagged = [m for m in measured if m.commanded_hz and any(f.kind == "frequency_off_command" for f in m.flags)]
    off = sorted({shown(100 * (m.frequency.hz / (m.commanded_hz or 1.0) - 1), 0, signed=True) for m in flagged})
    return f" by {' % or '.join(off)} %" if 0 < len(off) < 3 else ""
