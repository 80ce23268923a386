"""A diagnosis in three sentences: where the gap is, which effect causes it, how far it shrinks with that."""

from math import isnan, nan

from diagnosis.result import DiagnosisResult, GapSize
from reports.numbers import counted, in_mm, shown, whole_percent


def gap_sentences(found: DiagnosisResult) -> tuple[str, str, str]:
    """Each after its question."""
    from diagnosis.sentences import where, which  # its package loads the twin

    return where(found), which(found), f"How far: {how_far(found)}"


def how_far(found: DiagnosisResult) -> str:
    """The skill score with its interval, then markers and speeds without and with the effects."""
    gap = found.gap
    if not gap.evaluated_on or isnan(gap.baseline_mm):
        return "No trial is held out, so how far the gap shrinks is not known."
    trials = counted(len(gap.evaluated_on), "held-out trial")
    line = gap.speed_mae_baselines.get("line", nan)
    beside = "" if isnan(line) else f" (a line in frequency: {in_mm(line)})"
    if found.verdict in ("no_gap", "unexplained"):
        sizes = f"markers {shown(gap.baseline_mm)} mm, speeds {in_mm(gap.speed_mae_before)} mm/s off{beside}"
        return f"Nothing was added to the twin; on {trials}: {sizes}."
    sizes = (
        f"markers {shown(gap.baseline_mm)} to {shown(gap.with_effects_mm)} mm, "
        f"speeds {in_mm(gap.speed_mae_before)} to {in_mm(gap.speed_mae_after)} mm/s{beside}"
    )
    if isnan(gap.shrinkage):
        return f"On {trials} the plain twin leaves no more than noise: {sizes}."
    warning = "" if gap.improves else " Do not use it for forecasts."
    return f"On {trials} the gap {by_how_much(gap)}: {sizes}.{warning}"


def by_how_much(gap: GapSize, over: str = "") -> str:
    """`shrinks by 44 % (95 % interval 29 % to 71 %)`, or by how much it grows; `over` what the interval is."""
    sign = -1 if gap.shrinkage < 0 else 1
    ends = sorted(sign * end for end in gap.shrinkage_ci95 or ())
    interval = f" (95 % interval {over}{' to '.join(map(whole_percent, ends))})" if ends else ""
    return f"{'grows' if sign < 0 else 'shrinks'} by {whole_percent(abs(gap.shrinkage))}{interval}"
