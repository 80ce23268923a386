"""A diagnosis in three sentences: where the gap is, which effect causes it, how far it shrinks with that."""

from math import isnan

from diagnosis.result import DiagnosisResult
from reports.numbers import counted, in_mm, shown, spanned, whole_percent


def gap_sentences(found: DiagnosisResult) -> tuple[str, str, str]:
    """Each after its question."""
    from diagnosis.sentences import sentences  # its package loads the twin

    _, where, which = sentences(found)
    return where, which, f"How far: {how_far(found)}"


def how_far(found: DiagnosisResult) -> str:
    """The skill score with its interval, then markers and speeds without and with the effects."""
    gap = found.gap
    if not gap.evaluated_on or isnan(gap.baseline_mm):
        return "No trial is held out, so how far the gap shrinks is not known."
    trials = counted(len(gap.evaluated_on), "held-out trial")
    if found.verdict in ("no_gap", "unexplained"):
        sizes = f"markers {shown(gap.baseline_mm)} mm, speeds {in_mm(gap.speed_mae_before)} mm/s off"
        return f"Nothing was added to the twin; on {trials}: {sizes}."
    sizes = (
        f"markers {shown(gap.baseline_mm)} to {shown(gap.with_effects_mm)} mm, "
        f"speeds {in_mm(gap.speed_mae_before)} to {in_mm(gap.speed_mae_after)} mm/s"
    )
    if isnan(gap.shrinkage):
        return f"On {trials} the plain twin leaves no more than noise: {sizes}."
    ends = "" if gap.shrinkage_ci95 is None else f" (95 % interval {spanned(*gap.shrinkage_ci95, whole_percent)})"
    warning = "" if gap.improves else " Do not use it for forecasts."
    return f"On {trials} the gap shrinks by {whole_percent(gap.shrinkage)}{ends}: {sizes}.{warning}"
