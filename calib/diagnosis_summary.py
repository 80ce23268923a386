"""A diagnosis in three sentences and a table for the terminal."""

from math import isnan

from diagnosis.result import DiagnosisResult, EffectTestResult
from diagnosis.sentences import plain
from reports.caveats import gap_caveats
from reports.gap_words import SEPARATES, by_how_much, effect_size, gap_sentences

_ROWS = 6  # smallest number of effects that are shown
_NEXT = 3  # number of experiments that are shown


def diagnosis_lines(data: DiagnosisResult) -> list[str]:
    """Format where, which and how far; then the most probable effects, what to check, and what to measure next."""
    lines = [*gap_sentences(data), ""]
    lines.append(f"{'effect':28} {'probability':>11}  fitted")
    for number, (name, chance) in enumerate(data.chances.items()):
        if number < _ROWS or name in data.effects:
            lines.append(f"{name:28} {chance:11.3f}  {effect_size(data.effect_parameters, name)}".rstrip())
    lines.append(f"{'none of these':28} {data.none_of_these:11.3f}")
    lines.append(f"{'nothing at all':28} {data.no_gap_probability:11.3f}")
    return [*lines, *(f"! {each}" for each in gap_caveats(data)), *_next(data), *_models(data)]


def main_caveat(data: DiagnosisResult) -> str:
    """Return the first caveat to check before a diagnosis is believed."""
    if found := gap_caveats(data):
        return f"{found[0]}{f' ({len(found) - 1} more: -v)' if len(found) > 1 else ''}"
    if not data.gap.evaluated_on:
        return "no trial is held out, so how far the gap shrinks is not known."
    return "none was raised."


def _next(data: DiagnosisResult) -> list[str]:
    pairs_of: dict[str, list[str]] = {}
    for each in data.next_experiments:
        if each.expected_error < SEPARATES:
            pair = " from ".join(map(plain, each.separates))
            pairs_of.setdefault(each.describe, []).append(f"{pair}, expected error {each.expected_error:.0%}")
    return [f"next: {what} (separates {'; '.join(pairs)})" for what, pairs in list(pairs_of.items())[:_NEXT]]


def _models(data: DiagnosisResult) -> list[str]:
    """List files of twins with effects, and which of several alternatives they contain."""
    either = [plain(group[0]) for group in data.groups if len(group) > 1]
    chosen = f"; with {' and '.join(either)}, the most probable of each group" if either else ""
    names = data.models
    return [f"model: {name}{'' if name.startswith('calibrated+everything.') else chosen}" for name in names]


def test_lines(data: EffectTestResult) -> list[str]:
    """Format the evidence for each tested effect and for all together; then the gap without and with them."""
    lines = [
        f"Tested: {', '.join(plain(name) for name in data.effects)}.",
        f"Log Bayes factor over the plain twin: {data.log_bayes_factor:.1f} (above 0: the fit trials support "
        f"{'it' if len(data.effects) == 1 else 'them'}).",
        "",
        f"{'effect':28} {'ln factor':>11}  fitted",
    ]
    for name, own in data.log_bayes_factor_of_each.items():
        lines.append(f"{name:28} {own:11.1f}  {effect_size(data.effect_parameters, name)}".rstrip())
    lines += ["", f"{'':28} {'plain':>11} {'tested':>11}"]
    for swims, gap in (("fitted", data.fitted), ("held out", data.gap)):
        if gap.evaluated_on:
            lines.append(_format_comparison(f"{swims}: markers, mm", gap.baseline_mm, gap.with_effects_mm))
            speeds = 1000 * gap.speed_mae_before, 1000 * gap.speed_mae_after
            lines.append(_format_comparison(f"{swims}: speed, mm/s", *speeds))
    if not isnan(data.gap.shrinkage):
        lines.append(f"The held-out gap {by_how_much(data.gap)}.")
    return lines


def _format_comparison(what: str, before: float, after: float) -> str:
    return f"{what:28} " + " ".join(f"{'-' if isnan(each) else f'{each:.1f}':>11}" for each in (before, after))
