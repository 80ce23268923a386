"""A diagnosis in three sentences: where the gap is, which effect causes it, how far it shrinks with that."""

from math import floor, isfinite, isnan, log10, nan
from typing import NamedTuple

from diagnosis.result import DiagnosisResult, EffectParameters, FittedParameter, GapSize, parameters_of
from reports.numbers import MM, counted, in_mm, in_words, listed, shown, whole_percent


def gap_sentences(found: DiagnosisResult) -> tuple[str, str, str]:
    """Write the three sentences, each after its question."""
    from diagnosis.sentences import where, which  # its package loads the twin

    return where(found), which(found), f"How far: {how_far(found)}"


MORE_THAN_NOISE = 0.01
"""Smallest probability that noise alone leaves as much.

Below it, something is missing in addition to the named effects.
"""


def effect_size(parameters: EffectParameters, effect: str) -> str:
    """Say how strong an effect was fitted to be: its three clearest parameters, each with its 95 % interval."""
    found = parameters_of(parameters, effect).items()
    largest = sorted(found, key=lambda item: -abs(item[1].value) / max(item[1].ci95[1] - item[1].ci95[0], 1e-12))[:3]
    return ", ".join(_parameter(name, own) for name, own in largest)


def _parameter(name: str, fitted: FittedParameter) -> str:
    """Format a parameter, metres as millimetres, with enough digits that half its interval has two."""
    scale, unit = (MM, f"m{fitted.unit}") if fitted.unit in ("m", "m/s") else (1.0, fitted.unit)
    value, low, high = (scale * each for each in (fitted.value, *fitted.ci95))
    places = max(1 - floor(log10(max(high - low, 1e-12) / 2)), 0)
    at, start, end = (shown(each, places) for each in (value, low, high))
    ends = f"{in_words(name)} {at} ({start} to {end})"
    return ends if unit == "1" else f"{ends} {unit}"


class Change(NamedTuple):
    """A mean error over the held-out trials without and with the effects; `after` is nan where nothing was added."""

    quantity: str
    unit: str
    before: float
    after: float

    @property
    def text(self) -> str:
        """The change in words: `markers 12.0 to 5.1 mm`; without an after `markers 12.0 mm`.

        It has a digit more where both would look the same.
        """
        before, after = shown(self.before), shown(self.after)
        if not isfinite(self.after):
            return f"{self.quantity} {before} {self.unit}"
        if before == after:
            before, after = shown(self.before, 2), shown(self.after, 2)
        if before == after:
            return f"{self.quantity} {before} {self.unit} as before"
        return f"{self.quantity} {before} to {after} {self.unit}"


def changes(found: DiagnosisResult) -> tuple[Change, ...]:
    """List the known changes of markers (mm), speed (mm/s) and beat frequency given the command (mHz)."""
    gap = found.gap
    rows = (
        Change("markers", "mm", gap.baseline_mm, gap.with_effects_mm),
        Change("speed", "mm/s", MM * gap.speed_mae_before, MM * gap.speed_mae_after),
        Change("frequency", "mHz", MM * gap.frequency_mae_before, MM * gap.frequency_mae_after),
    )
    known = [row for row in rows if isfinite(row.before)]
    return tuple(known) if found.effect_parameters else tuple(row._replace(after=nan) for row in known)


def how_far(found: DiagnosisResult) -> str:
    """Say what markers, speed and frequency of the held-out trials are without and with the effects, and how surely."""
    gap = found.gap
    if not gap.evaluated_on or isnan(gap.baseline_mm):
        return "No trial is held out, so how far the gap shrinks is not known."
    trials = counted(len(gap.evaluated_on), "held-out trial")
    line = gap.speed_mae_baselines.get("line", nan)
    beside = {} if isnan(line) else {"speed": f" (a line in frequency: {in_mm(line)})"}
    sizes = listed([f"{change.text}{beside.get(change.quantity, '')}" for change in changes(found)])
    if not found.effect_parameters:
        return f"Nothing was added to the twin; on {trials} its errors are: {sizes}."
    if isnan(gap.shrinkage):
        return f"On {trials} the uncorrected twin is already within noise, so there is nothing to improve: {sizes}."
    warning = "" if gap.improves else " Do not use it for forecasts."
    return f"On {trials}: {sizes}; {_how_surely(gap)}.{warning}"


def _how_surely(gap: GapSize) -> str:
    """Say whether the twin with the effects is closer, by the interval of its skill score, without that number."""
    if gap.shrinkage <= 0:
        return "with the effects the twin is no closer"
    return f"with the effects the twin is closer{'' if gap.improves else ', but not significantly'}"


SEPARATES = 0.2
"""Expected error below which an experiment separates two effects."""


def next_experiment(found: DiagnosisResult) -> str:
    """Describe the most informative experiment and what it separates; empty where none is expected to tell enough."""
    from diagnosis.sentences import plain  # its package loads the twin

    useful = [each for each in found.next_experiments if each.expected_error < SEPARATES]
    if not useful:
        return ""
    pair = " from ".join(map(plain, useful[0].separates))
    what = useful[0].describe
    return f"{what[:1].lower()}{what[1:]} (separates {pair}, expected error {whole_percent(useful[0].expected_error)})"


def by_how_much(gap: GapSize, over: str = "") -> str:
    """Say by how much the gap shrinks or grows: `shrinks by 44 % (95 % interval 29 % to 71 %)`.

    Args:
        gap: the gap on held-out trials.
        over: words before the interval that say what it covers.
    """
    sign = -1 if gap.shrinkage < 0 else 1
    ends = sorted(sign * end for end in gap.shrinkage_ci95 or ())
    interval = f" (95 % interval {over}{' to '.join(map(whole_percent, ends))})" if ends else ""
    return f"{'grows' if sign < 0 else 'shrinks'} by {whole_percent(abs(gap.shrinkage))}{interval}"
