"""The answers that a reader wants first, worked out once for the end of `calib run` and the report's first screen.

Both print these sentences and these numbers, so that no number has two values or two units in two places.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, isfinite, isnan, nan
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from diagnosis.result import DiagnosisResult
from diagnosis.sentences import at_stage
from fitting.baselines import SAME_BEAT
from fitting.calibration_file import CalibrationResult
from fitting.session_forecast import TWIN, SessionForecast
from reports.caveats import (
    beats_off_command,
    explained_kinds,
    fit_caveats,
    gap_caveats,
    posterior_caveats,
)
from reports.words import (
    MODELS,
    MORE_THAN_NOISE,
    compared_with_best,
    counted,
    gap_sentences,
    holds_against_rules,
    in_mm,
    in_words,
    listed,
    misses,
    next_experiment,
    of_its_size,
    sentence,
    share_of,
    shown,
    sizes_sentence,
    spanned,
)

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary

EBT = "ebt_published"
BESIDE = ("line", "constant_stride", EBT)
"""The models that the twin is compared with where there is room for only a few."""

_AS_GOOD = 0.25
"""Largest relative difference of two mean speed errors between models that are about as good as each other."""
_LIKELY = 3  # number of effects whose probability is shown even if they are not named
_WORTH_A_SWIM = 0.9  # a swim that leaves a larger share of the standard deviations is not worth filming for them
_SHOWN = 0.005  # smallest probability of no gap that is shown; a smaller one would be printed as 0.00


class TwinErrors(NamedTuple):
    """Mean absolute errors of the exported twin, without any correction, over the trials of one role.

    Attributes:
        trials: number of trials that the means are over.
        of: number of trials of the role; larger where elongated body theory tells no speed of some.
        speed: mean error of the forward speed, m/s.
        markers_mm: mean marker distance, mm; nan where unknown.
        swum: mean measured speed, m/s.
        frequencies: number of beat frequencies that differ by more than 2 %.
    """

    trials: int
    of: int
    speed: float
    markers_mm: float
    swum: float
    frequencies: int

    @property
    def size(self) -> str:
        """The errors in words: `0.7 mm/s, 4.1 mm`."""
        return f"{in_mm(self.speed)} mm/s, {shown(self.markers_mm)} mm"

    def over(self, role: str) -> str:
        """Say over how many trials of the role the errors are: `4 held-out trials`, or `3 of 4 held-out trials`."""
        some = f"{self.trials} of " if self.trials < self.of else ""
        return f"{some}{counted(self.of, f'{role} trial')}"


@dataclass(frozen=True)
class HowFarOff:
    """The errors of the exported twin, next to those of simple rules and of elongated body theory.

    Attributes:
        fitted, held_out: errors by role; None where no trial tells them.
        beside: mean absolute speed error of simple rules and of elongated body theory over the same held-out trials,
            m/s, by the model's name.
        best: name of the simple rule in frequency with the smallest error; "" where there is none.
        compared: whether the twin forecasts speeds better than that rule; "" where there is none.
        misses: the fit trial that the twin does not describe; "" where it describes all.
    """

    fitted: TwinErrors | None
    held_out: TwinErrors | None
    beside: Mapping[str, float]
    best: str
    compared: str
    misses: str

    @property
    def rules(self) -> str:
        """The errors of the other models in words: `line in frequency 3.4, elongated body theory 4.1 mm/s`."""
        known = [f"{MODELS[name]} {in_mm(error)}" for name, error in self.beside.items()]
        return f"{', '.join(known)} mm/s" if known else ""

    @property
    def beside_theory(self) -> str:
        """A comparison in words: `about as good as elongated body theory (4.4 mm/s)`.

        Empty where the theory tells no speed.
        """
        theory = self.beside.get(EBT)
        if theory is None or self.held_out is None:
            return ""
        own = self.held_out.speed
        how = "better than" if own < theory else "worse than"
        if abs(own - theory) <= _AS_GOOD * max(own, theory):
            how = "about as good as"
        return f"{how} {MODELS[EBT]} ({in_mm(theory)} mm/s)"

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences on the errors by role, on simple rules, and on how the twin compares with those and with theory."""
        held, fitted = self.held_out, self.fitted
        if held is None:
            known = "not known" if fitted is None else f"exported twin {fitted.size} in {fitted.over('fit')}"
            off = f"{known}. No held-out trial tells how well it forecasts."
        else:
            of_fit = "" if fitted is None else f" ({fitted.size} in {fitted.over('fit')})"
            off = f"exported twin {held.size} in {held.over('held-out')}{of_fit}{self.rules and f'; {self.rules}'}."
        theory = self.beside_theory and f"It is {self.beside_theory}."
        return tuple(filter(None, (self.misses, off, self.compared, theory)))


class Interval(NamedTuple):
    """A coefficient: its value in the exported twin, its 90 % interval, and whether the trials determine it."""

    value: float
    low: float
    high: float
    determined: bool

    @property
    def text(self) -> str:
        """Value and interval as printed: `0.41 (0.40 to 0.42)`; `0.40 to 0.42 (exported: 0.39)` where it is outside."""
        value, interval = of_its_size(self.value), spanned(self.low, self.high, of_its_size)
        return f"{value} ({interval})" if self.low <= self.value <= self.high else f"{interval} (exported: {value})"


@dataclass(frozen=True)
class HowSure:
    """The interval of each coefficient.

    Attributes:
        intervals: intervals by the coefficient's name.
        sampled: whether they are those of the posterior; else they are approximate, of the fit.
        in_band: number of held-out trials with a speed within the predicted 90 % band, and number of all.
        damaged: the file of the posterior that cannot be read; "" where there is none.
        misfit: whether the twin at these coefficients leaves more than noise explains.
        no_gap: whether the diagnosis takes what is left for the twin's own error.
        rejected: whether likelier coefficients were rejected, as their twin swims backward from rest.
    """

    intervals: Mapping[str, Interval]
    sampled: bool
    in_band: tuple[int, int] = (0, 0)
    damaged: str = ""
    misfit: bool = False
    no_gap: bool = False
    rejected: bool = False

    @property
    def verdict(self) -> str:
        """A sentence on which coefficients the trials determine."""
        if not self.sampled:
            return f"Roughly known: {_unreadable(self.damaged) or 'the posterior was not sampled.'}"
        loose = [in_words(name) for name, one in self.intervals.items() if not one.determined]
        if not loose and self.rejected:
            return "All five coefficients are determined among twins that swim forward from rest; likelier ones do not."
        provided = ", if the twin lacks nothing" if self.misfit else ""
        if not loose:
            return f"All five coefficients are determined{provided}."
        if len(loose) == len(self.intervals):
            return "None of the five coefficients is determined."
        return f"Not determined: {listed(loose)}; the others are{provided}."

    @property
    def beware(self) -> str:
        """A sentence on what the intervals leave out; empty where they leave out nothing that is known."""
        if self.misfit and self.no_gap:
            return "What the twin leaves is its own error, more than noise: the true coefficients may lie outside."
        return "The twin does lack something: the true coefficients may lie outside." if self.misfit else ""

    @property
    def band(self) -> str:
        """A sentence on how often held-out speeds are as predicted; empty where none was predicted."""
        inside, count = self.in_band
        whose = "it" if count == 1 else "them"
        return f"{share_of(inside, count, 'held-out speed')} in the 90 % band predicted for {whose}." if count else ""

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences on which coefficients are determined, on every interval, and on how often predicted bands hold."""
        each = listed([f"{in_words(name)} {one.text}" for name, one in self.intervals.items()])
        return tuple(filter(None, (self.verdict, f"90 % intervals: {each}.", self.beware, self.band)))


@dataclass(frozen=True)
class WhatIsMissing:
    """The diagnosis in short: where the gap is, which effect makes it, how far it shrinks with that effect.

    Attributes:
        where, which, how_far: a sentence each, after its question.
        chances: probability of each likely effect, the likeliest first, that the catalogue holds none, and, unless it
            would print as 0.00, that there is no gap.
        named: the effects that are named.
        groups: the same in words; effects that the trials cannot separate are in one group.
        size: how strong the named effects are, a sentence each.
        no_gap: whether the data need no effect.
        misfit: whether the fitted twin leaves more than noise, by the posterior's test.
        more_is_missing: whether the named effects leave more than noise.
        at_stage: where an effect outside the catalogue acts, "most probably in the water (0.99)"; "" where not known.
    """

    where: str
    which: str
    how_far: str
    chances: Mapping[str, float]
    named: tuple[str, ...]
    groups: tuple[str, ...]
    size: str
    no_gap: bool
    misfit: bool
    more_is_missing: bool
    at_stage: str

    @property
    def headline(self) -> str:
        """The missing effects in a few words."""
        if self.groups:
            return sentence(listed(self.groups, 3)).removesuffix(".")
        if self.no_gap and self.misfit:
            return "No effect that these trials show, though the fitted twin leaves more than noise"
        if self.no_gap:
            return "Nothing that these trials show"
        return f"Something, {self.at_stage}" if self.at_stage else "Something that these trials do not name"


@dataclass(frozen=True)
class Answers:
    """The answers that a reader asks for first; None for what was not computed.

    Attributes:
        caveats: caveats of fit, posterior and diagnosis, in sentences; the same list wherever they are counted.
        explained: caveats of fit and posterior that the named effects explain; they do not count.
        next_step: what to do, knowing the current results.
        not_searched: why it is not known what is missing; "" where it is.
    """

    how_far_off: HowFarOff
    how_sure: HowSure
    missing: WhatIsMissing | None
    caveats: tuple[str, ...]
    explained: tuple[str, ...]
    next_step: str
    not_searched: str

    @property
    def no_caveat(self) -> str:
        """The sentence where there is no caveat but what the named effects explain."""
        count = len(self.explained)
        if not count:
            return "No caveat."
        return f"{count} caveat{'s' if count > 1 else ''}, which the named effects explain (-v lists them)."


def answers_of(
    found: CalibrationResult,
    posterior: PosteriorSummary | None,
    diagnosed: DiagnosisResult | None,
    folder: str,
    damaged: Mapping[str, str] = MappingProxyType({}),
) -> Answers:
    """Work out the answers from the current results.

    Args:
        found: the fit.
        posterior: the posterior; None where it was not sampled.
        diagnosed: the diagnosis; None where there is none.
        folder: the session's folder, as commands are to name it.
        damaged: the file of "posterior" or "diagnosis" that is there and cannot be read.
    """
    why_not = _unreadable(damaged.get("diagnosis", "")) or "The trials were not searched for missing effects."
    without = explained_kinds(diagnosed)
    every = (*fit_caveats(found, posterior), *posterior_caveats(posterior))
    caveats = (*fit_caveats(found, posterior, without), *posterior_caveats(posterior, without))
    sure = _how_sure(found, posterior, damaged.get("posterior", ""))
    sure = replace(sure, no_gap=diagnosed is not None and diagnosed.verdict == "no_gap")
    return Answers(
        how_far_off=how_far_off(found.forecasts),
        how_sure=sure,
        missing=None if diagnosed is None else _what_is_missing(diagnosed, sure.misfit),
        caveats=(*caveats, *gap_caveats(diagnosed)),
        explained=tuple(caveat for caveat in every if caveat not in caveats),
        next_step=_next_step(found, posterior, diagnosed, folder),
        not_searched="" if diagnosed is not None else why_not,
    )


def how_far_off(forecasts: SessionForecast) -> HowFarOff:
    """Compare the errors of the exported twin with those of simple rules, all over the same trials."""
    compared = forecasts.compared if forecasts.compared.held_out else forecasts
    best = compared.best_baseline
    beside = {name: compared.mean(name, "speed_error") for name in dict.fromkeys((*filter(None, (best,)), *BESIDE))}
    return HowFarOff(
        _errors(forecasts, forecasts, "fit"),
        _errors(compared, forecasts, "holdout"),
        {name: error for name, error in beside.items() if isfinite(error)},
        best,
        compared_with_best(compared),
        misses(forecasts),
    )


def use_of_named(found: DiagnosisResult) -> str:
    """Say in a sentence what to do about the named effects: the model with them where it forecasts better."""
    named = [in_words(name) for name in found.effect_parameters]
    it, there = ("it", "it is") if len(named) == 1 else ("them", "they are")
    gap = found.gap
    better = gap.shrinkage > 0 and gap.with_effects_mm <= gap.baseline_mm and not gap.frequency_grows
    if gap.evaluated_on and isnan(gap.shrinkage):
        return f"Check {listed(named)} by hand; the held-out trials leave too little to tell which twin is better."
    if gap.evaluated_on and not better:
        return f"Check {listed(named)} by hand; the twin without {it} forecasts as well: calib mjcf writes it."
    return f"Check {listed(named)} by hand; if {there} there, simulate with results/{found.models[0]}."


def film_next(posterior: PosteriorSummary | None, diagnosed: DiagnosisResult | None, fastest_hz: float = inf) -> str:
    """Name the trial or experiment that would tell most, in a sentence; empty where the results call for none.

    Args:
        posterior: the posterior; None where it was not sampled.
        diagnosed: the diagnosis; None where there is none.
        fastest_hz: beats a second of the fastest trial: whether the motor turns faster is not known.
    """
    if diagnosed is not None and (experiment := next_experiment(diagnosed)):
        return sentence(experiment)
    loose = [] if posterior is None else [in_words(n) for n, one in posterior.marginals.items() if not one.determined]
    if posterior is None or not loose:
        return ""
    sweep, shrinks = posterior.sweep, posterior.sweep.shrinkage(posterior.wanted)
    if shrinks.min() > _WORTH_A_SWIM:
        return ""
    best = float(sweep.frequency_hz[shrinks.argmin()])
    reached = ", if the motor turns so fast" if best > fastest_hz else ""
    return f"One more swim, with the tail beating at {shown(best, 1)} Hz{reached}: it narrows {listed(loose)} most."


def _unreadable(file: str) -> str:
    return f"results/{file} is damaged or cut short." if file else ""


def _errors(compared: SessionForecast, everything: SessionForecast, role: str) -> TwinErrors | None:
    told = [trial for trial in compared.trials.values() if trial.role == role and TWIN in trial.forecasts]
    trials = [trial for trial in told if isfinite(trial.forecasts[TWIN].speed)]
    if not trials:
        return None
    count, of = len(trials), sum(trial.role == role for trial in everything.trials.values())
    speed = sum(abs(trial.forecasts[TWIN].speed - trial.speed_measured) for trial in trials) / count
    distances = [trial.forecasts[TWIN].marker_error_mm for trial in trials]
    markers = sum(nan if each is None else each for each in distances) / count
    beats_hz = sorted(trial.frequency_hz for trial in trials)
    frequencies = 1 + sum(high > (1 + SAME_BEAT) * low for low, high in pairwise(beats_hz))
    return TwinErrors(count, of, speed, markers, sum(trial.speed_measured for trial in trials) / count, frequencies)


def _how_sure(found: CalibrationResult, posterior: PosteriorSummary | None, damaged: str) -> HowSure:
    values = found.coefficients._asdict()
    if posterior is None:
        ends = dict(zip(values, found.fit.interval, strict=True))
        rough = {name: Interval(values[name], float(low), float(high), False) for name, (low, high) in ends.items()}
        return HowSure(rough, False, damaged=damaged)
    of = posterior.marginals
    intervals = {name: Interval(values[name], of[name].q05, of[name].q95, of[name].determined) for name in values}
    misfit = any(flag.kind == "model_discrepancy" for flag in posterior.flags)
    rejected = any(flag.kind == "rejected_restart" for flag in found.flags)
    return HowSure(intervals, True, posterior.inside("holdout")[:2], misfit=misfit, rejected=rejected)


def _what_is_missing(found: DiagnosisResult, misfit: bool) -> WhatIsMissing:
    where, which, how_far = (text.partition(": ")[2] for text in gap_sentences(found))
    few = {
        name: chance for i, (name, chance) in enumerate(found.chances.items()) if i < _LIKELY or name in found.effects
    }
    chances = {in_words(name): chance for name, chance in few.items()}
    chances["not in the catalogue"] = found.none_of_these
    if found.no_gap_probability >= _SHOWN:
        chances["no gap at all"] = found.no_gap_probability
    named = tuple(map(in_words, found.effects))
    groups = tuple(" or ".join(map(in_words, group)) for group in found.groups)
    return WhatIsMissing(
        where=where,
        which=which,
        how_far=how_far,
        chances=chances,
        named=named,
        groups=groups,
        size=sizes_sentence(found),
        no_gap=found.verdict == "no_gap",
        misfit=misfit,
        more_is_missing=found.remainder is not None and found.remainder.p_value < MORE_THAN_NOISE,
        at_stage=at_stage(found),
    )


def _next_step(
    found: CalibrationResult, posterior: PosteriorSummary | None, diagnosed: DiagnosisResult | None, folder: str
) -> str:
    if misses(found.forecasts):
        return "Check the robot's description, the scale and the trials."
    if not found.forecasts.held_out and found.left_out:
        each = [f"{name}: {why}" for name, why in found.left_out.items()]
        return f"No held-out trial is left: film again what takes no part ({'; '.join(each)}), or hold another one out."
    if not found.forecasts.held_out:
        return 'Hold a trial out (role = "holdout" in session.toml), or film another one, and fit again.'
    if posterior is None and diagnosed is None and beats_off_command(found):
        return f"Check [camera] fps and commanded_hz in session.toml, then calib posterior {folder}"
    if posterior is None:
        return f"calib posterior {folder}"
    if diagnosed is None:
        return f"calib diagnose {folder}"
    if film := film_next(posterior, diagnosed, max(trial.frequency_hz for trial in found.trials.values())):
        return film
    if diagnosed.models and diagnosed.effects:
        return use_of_named(diagnosed)
    if not holds_against_rules(found.forecasts):
        return "For all but speeds use the twin: calib mjcf writes it, calib.load_twin simulates with it."
    return "Use the twin: calib mjcf writes it, calib.load_twin simulates with it."
