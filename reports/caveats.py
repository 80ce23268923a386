"""Caveats in sentences for the reader: of a trial's numbers, of a fit, of its posterior and of its diagnosis."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from diagnosis.constants import ALARM
from diagnosis.result import DiagnosisResult, parameters_of
from fitting.calibration import CalibratedTrial
from fitting.calibration_file import CalibrationResult
from fitting.ebt import EBT_RATIO_ONLY
from fitting.trial import SCORED_S, MeasuredTrial
from reports.words import MM, MORE_THAN_NOISE, in_words, listed, percent, sentence, shown
from swimcal.effects.catalogue import catalogue
from swimcal.flags import FLAG_KINDS, Flag

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary


LITTLE_USED = 0.9  # share of the samples that count, below which a trial has a caveat
OF_MISSING_EFFECTS = frozenset({"speed_missed", "model_discrepancy", "outside_bands"})
"""Kinds of flags of fit and posterior that say no more than that the twin lacks an effect."""
_OF_EVERYTHING = frozenset({"frequency_off_command", "scale_off_robot"})
"""Kinds of flags that cast doubt on every number: they come first."""
FEW_BEATS = 2  # whole beats compared, below which a trial has a caveat


# From this relative difference of beat and command, numbers of the session are to be checked.
_OFF = 0.1


def fit_caveats(
    found: CalibrationResult, posterior: PosteriorSummary | None = None, without: Collection[str] = ()
) -> tuple[str, ...]:
    """List the flags of the fit in full, then those of whole trials by kind.

    With a posterior, which says better what is determined, the fit's own flags of that kind are left out.

    Args:
        found: the fit.
        posterior: its posterior.
        without: further kinds of flags to leave out.
    """
    known = {EBT_RATIO_ONLY, *(["unidentifiable"] if posterior is not None else []), *without}
    caveats = [(flag.kind, sentence(flag.message or flag.kind)) for flag in found.flags if flag.kind not in known]
    for kind, where in kinds_of_whole_trials({name: trial.flags for name, trial in found.trials.items()}).items():
        if kind in known:
            continue
        size = _off_command(found) if kind == "frequency_off_command" else ""
        caveats.append((kind, sentence(f"{where}: {FLAG_KINDS.get(kind, in_words(kind))}{size}")))
    caveats.sort(key=lambda caveat: caveat[0] not in _OF_EVERYTHING)
    return tuple(dict.fromkeys(text for _, text in caveats))


def posterior_caveats(posterior: PosteriorSummary | None, without: Collection[str] = ()) -> tuple[str, ...]:
    """List the flags of a posterior, once; none without one.

    That a coefficient is not determined is no caveat: the answer to how sure the coefficients are says so.

    Args:
        posterior: the posterior.
        without: kinds of flags to leave out.
    """
    known = {"unidentifiable", *without}
    flags = () if posterior is None else (flag for flag in posterior.flags if flag.kind not in known)
    return tuple(dict.fromkeys(sentence(flag.message or flag.kind) for flag in flags))


def explains_the_rest(found: DiagnosisResult) -> bool:
    """Tell whether the named effects leave no more than noise, and the twin that has them is closer to all swims."""
    return found.verdict == "named" and bool(found.models and found.gap.evaluated_on) and not _checks(found)


def explained_kinds(found: DiagnosisResult | None) -> frozenset[str]:
    """Return the kinds of flags of fit and posterior that the named effects explain; none without a diagnosis."""
    return OF_MISSING_EFFECTS if found is not None and explains_the_rest(found) else frozenset()


def gap_caveats(found: DiagnosisResult | None) -> tuple[str, ...]:
    """List what should be checked before a diagnosis is believed; none without one."""
    return () if found is None else tuple(map(sentence, _checks(found)))


def _checks(found: DiagnosisResult) -> list[str]:
    gap, caveats = found.gap, _of_verdict(found)
    if found.effects and gap.evaluated_on and gap.shrinkage <= 0:
        caveats.append("the named effects do not reduce the gap on held-out trials")
    if found.effects and gap.with_effects_mm > gap.baseline_mm:
        caveats.append(
            f"the held-out marker error is {shown(gap.with_effects_mm)} mm with the named effects, "
            f"{shown(gap.baseline_mm)} mm without: at best they reduce it relative to the noise"
        )
    if gap.frequency_grows:
        caveats.append(
            f"with the named effects held-out beats are forecast worse: {shown(MM * gap.frequency_mae_after)} mHz off, "
            f"{shown(MM * gap.frequency_mae_before)} mHz without"
        )
    rest = found.remainder
    if rest is not None and rest.p_value < MORE_THAN_NOISE:
        caveats.append(
            "with the named effects the twin still misses the fitted trials by more than noise explains: something "
            "else is missing too"
        )
    if lacking := found.withheld_from_catalogue:
        caveats.append(
            f"the diagnosis was made without {', '.join(map(in_words, lacking))}; run it again with the whole catalogue"
        )
    known = [f.measured_hz / f.commanded_hz - 1 for f in found.frequencies.values() if f.commanded_hz]
    off = sum(known) / len(known) if known else 0.0
    of_drive = any(name in found.effects and effect.stage == "drive" for name, effect in catalogue().items())
    if abs(off) > _OFF and (found.verdict == "unexplained" or of_drive):
        caveats.append(
            f"tails beat {shown(100 * abs(off), 0)} % {'slower' if off < 0 else 'faster'} than commanded: check "
            "[camera] fps and commanded_hz (crank turns per second) before you blame clock, gear or motor"
        )
    fitted = {effect: parameters_of(found.effect_parameters, effect) for effect in found.effect_parameters}
    ends = [
        f"{in_words(effect)} ({in_words(name)})"
        for effect, own in fitted.items()
        for name, parameter in own.items()
        if parameter.at_bound
    ]
    if ends:
        caveats.append(f"at a bound, so it may be stronger, or another effect: {', '.join(ends)}")
    if len(found.missing_forces.trials) == 1:
        caveats.append("one trial was fitted; two or more at different speeds determine far more")
    elif found.effects and not found.evidence.cross_validation.trials:
        caveats.append("two trials were fitted: cross-validation of the named effects needs three")
    return caveats


def _of_verdict(found: DiagnosisResult) -> list[str]:
    """Say what the verdict as such suffers from: trials that no twin follows, a threshold that is near."""
    caveats = []
    if found.doubted_trials:
        caveats.append(
            f"{listed(found.doubted_trials)} of the fitted trials: the twin does not follow at all, so no effect is "
            "named; look into the flags of the fit first"
        )
    if found.verdict == "unexplained" and found.no_gap_probability > 1 - ALARM:
        caveats.append(
            "beat by beat there is no gap, but a fitted swim has a motion beside its beat (flag path_wobbles or "
            "marker_creeps): was the camera shaken, did waves move the robot, did a tracker creep?"
        )
    if found.borderline is not None:
        caveats.append(
            f"the verdict lies near a threshold: with slightly other numbers it would be {in_words(found.borderline)}"
        )
    return caveats


def beats_off_command(found: CalibrationResult) -> bool:
    """Tell whether all fit trials with a command beat at far other frequencies."""
    fitted = (trial for trial in found.trials.values() if trial.role == "fit")
    off = [abs(trial.frequency_hz / trial.commanded_hz - 1) > _OFF for trial in fitted if trial.commanded_hz]
    return bool(off) and all(off)


def _off_command(found: CalibrationResult) -> str:
    """Say by how much the flagged trials beat faster or slower than commanded, as far as the command is known."""
    off = sorted(
        {
            shown(100 * (trial.frequency_hz / trial.commanded_hz - 1), 0, signed=True)
            for trial in found.trials.values()
            if trial.commanded_hz and any(flag.kind == "frequency_off_command" for flag in trial.flags)
        }
    )
    return f" by {' % or '.join(off)} %" if 0 < len(off) < 3 else ""


def trial_caveats(trial: CalibratedTrial) -> tuple[str, ...]:
    """List the flags that concern the whole trial, and what its length and its tracks leave out."""
    measured, scores = trial.measured, trial.scores
    caveats = [sentence(flag.message) for flag in trial.flags if not flag.markers]
    if scores.used_fraction < LITTLE_USED:
        caveats.append(f"Only {percent(scores.used_fraction)} of the scored samples count; the rest is flagged.")
    if (seconds := float(measured.scored.sum() * np.median(np.diff(measured.time_s)))) < 0.98 * SCORED_S:
        caveats.append(f"The marker distance is a mean over {shown(seconds)} s instead of {SCORED_S:g} s.")
    if (beats := beats_compared(measured)) < FEW_BEATS:
        caveats.append(f"The speeds are slopes over {'one beat' if beats == 1 else 'less than one whole beat'}.")
    return tuple(caveats)


def speed_caveats(trial: CalibratedTrial) -> tuple[str, ...]:
    """List the caveats of a trial's speed, in a word each."""
    kinds = {
        flag.kind: flag.kind.replace("_", " ") for flag in trial.flags if flag.kind in ("extrapolated", "few_beats")
    }
    beats = beats_compared(trial.measured)
    short = () if beats >= FEW_BEATS else ("one beat" if beats == 1 else "less than a beat",)
    return (*kinds.values(), *short)


def kinds_of_whole_trials(flags: Mapping[str, Iterable[Flag]]) -> dict[str, str]:
    """Name the trials, in words, that have a flag without markers, by the kind of the flag.

    Args:
        flags: the flags of each trial, by its name.
    """
    names: dict[str, list[str]] = {}
    for name, own in flags.items():
        for kind in dict.fromkeys(flag.kind for flag in own if not flag.markers):
            names.setdefault(kind, []).append(name)
    return {kind: "every trial" if len(own) == len(flags) else listed(own) for kind, own in names.items()}


def beats_compared(trial: MeasuredTrial) -> int:
    """Count the whole beats in the compared frames."""
    frame_s = float(np.median(np.diff(trial.time_s)))
    return int((np.ptp(trial.time_s[trial.kept]) + frame_s) * trial.frequency.hz + 1e-6)
