"""Numbers and sentences of the report: one quantity in one unit everywhere.

First numbers and names as printed, then the names of models and sentences on their forecasts, then sentences on a
diagnosis.
"""

import math
from collections.abc import Callable, Sequence
from math import floor, isfinite, isnan, log10, nan
from typing import NamedTuple

from diagnosis.result import DiagnosisResult, EffectParameters, FittedParameter, GapSize, parameters_of
from diagnosis.sentences import plain, where, which
from fitting.baselines import BASELINES
from fitting.ebt import FORMS
from fitting.session_forecast import BEATS, CONTINUED, DRAWN, GIVEN, TWIN, SessionForecast

# Numbers
MISSING = "–"  # printed where a number is not known
MM = 1000.0  # millimetres in a metre

# Models and their forecasts
_LABELS = {
    "twin": "twin",
    "published": "EBT, published",
    "smoothed": "EBT, smoothed",
    "large": "EBT, large amplitude",
}

_FAR = 2.0
"""Share by which a twin's speed exceeds the measured one, from which a percentage says nothing."""
_ALIKE_M_S = 5e-5
"""Difference of two errors of speed that is shown as 0.0 mm/s."""
_MISSED = 0.1
"""Largest relative error of a fit trial's speed with which the twin still describes the robot."""

# A diagnosis
MORE_THAN_NOISE = 0.01
"""Smallest probability that noise alone leaves as much.

Below it, something is missing in addition to the named effects.
"""

SEPARATES = 0.2
"""Expected error below which an experiment separates two effects."""


# Numbers and names.


def shown(value: float | None, decimals: int = 1, *, signed: bool = False) -> str:
    """Format a number with this many decimals; a dash for None, nan and infinity."""
    if value is None or not math.isfinite(value):
        return MISSING
    text = f"{value:{'+' if signed else ''}.{decimals}f}"
    return text.lstrip("+-") if not float(text) else text.replace("-", "−")


def significant(value: float | None, digits: int = 3) -> str:
    """Format a number with this many significant digits; a dash for None, nan and infinity."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{value:.{digits}g}".replace("-", "−")


def in_mm(value_m: float | None, decimals: int = 1, *, signed: bool = False) -> str:
    """Format metres, or metres a second, as millimetres."""
    return shown(None if value_m is None else value_m * MM, decimals, signed=signed)


def with_error(value: float, se: float, decimals: int = 1) -> str:
    """Format a value with its error, `0.650 ± 0.004`, both with as many decimals as the error needs.

    The value stands alone where the error is not known.
    """
    if not (math.isfinite(se) and se > 0):
        return shown(value, decimals)
    decimals = next((d for d in range(6) if se * 10**d >= 0.95), 6)
    return f"{shown(value, decimals)} ± {shown(se, decimals)}"


def percent(share: float | None) -> str:
    """Format a share as a percentage; 100 % only when nothing is left out."""
    if share is None or not math.isfinite(share):
        return MISSING
    return f"{share:.0%}".replace("%", " %") if share in (0.0, 1.0) else f"{min(100 * share, 99.9):.1f} %"


def whole_percent(share: float) -> str:
    """Format a share as a whole percentage, `89 %`; with one decimal where it would else be 0 or 1 %."""
    value = 100 * share
    return f"{shown(value, 1 if 0.05 <= abs(value) < 0.95 else 0)} %"


def of_its_size(value: float) -> str:
    """Format a number with two decimals, one from 10 on, none from 100 on."""
    return shown(value, 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2)


def spanned(low: float, high: float, how: Callable[[float], str] = significant) -> str:
    """Format a range, `0.4 to 7.8`, or `0.4` where both ends print alike; a dash where one is not known."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return MISSING
    return how(low) if how(low) == how(high) else f"{how(low)} to {how(high)}"


def counted(count: int, noun: str, plural: str = "s") -> str:
    """Format a count with its noun: `1 trial`, `2 trials`."""
    return f"{count} {noun}{'' if count == 1 else plural}"


def share_of(count: int, of: int, noun: str) -> str:
    """Format how many of several lie somewhere: `1 of 1 speed lies`, `2 of 3 speeds lie`."""
    return f"{count} of {counted(of, noun)} {'lies' if of == 1 else 'lie'}"


def listed(names: Sequence[str], most: int = 6) -> str:
    """Join names as `a, b and c`; of many the first few and how many more."""
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def shortened(name: str, most: int = 14) -> str:
    """Shorten a name so that it fits into a figure."""
    return name if len(name) <= most else f"{name[: most - 1]}…"


def in_words(name: str) -> str:
    """Convert a name to words: `tendon slack` for `tendon_slack`, `Kutta lift` for `kutta_lift`."""
    words = name.replace("_", " ")
    return f"{words[:1].upper()}{words[1:]}" if name in ("kutta_lift", "magnus_lift") else words


def sentence(text: str) -> str:
    """Make a sentence of a text: a full stop and, unless it starts with a name such as `tail_1`, a capital letter."""
    text = text.strip()
    start = text[:1].upper() if text.split(" ")[0].isalpha() else text[:1]
    return start + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


# Models and their forecasts.


def model_label(name: str) -> str:
    """Return the label of a key of `CalibratedTrial.speeds`: `EBT, large amplitude (twin's tail)`."""
    form, _, tail = name.partition(", ")
    label = _LABELS.get(form, form.replace("_", " "))
    return f"{label} ({tail.replace(chr(39), '’')})" if tail else label


MODELS = {
    TWIN: "exported twin",
    GIVEN: "corrected twin",
    DRAWN: "corrected twin, averaged over the posterior",
    BEATS: "corrected twin, after two beats",
    CONTINUED: "continuation of two beats",
    **{name: baseline.label for name, baseline in BASELINES.items()},
    **{f"ebt_{form.name}": model_label(form.name) for form in FORMS},
    "ebt_published": "elongated body theory",
}
"""The models of `ForecastTrial.forecasts` as the reader meets them, in their order."""


def misses(forecasts: SessionForecast) -> str:
    """Say by how much the twin misses the fit trial it misses most, where that is more than 10 %; else nothing."""
    off = {
        name: trial.forecasts[TWIN].speed / trial.speed_measured - 1
        for name, trial in forecasts.trials.items()
        if trial.role == "fit" and TWIN in trial.forecasts and trial.speed_measured
        if isfinite(trial.forecasts[TWIN].speed)
    }
    worst = max(off, key=lambda name: abs(off[name]), default="")
    if not worst or abs(off[worst]) <= _MISSED:
        return ""
    measured, twin = forecasts.trials[worst].speed_measured, forecasts.trials[worst].forecasts[TWIN].speed
    way = f"{100 * abs(off[worst]):.0f} % too {'fast' if off[worst] > 0 else 'slow'}"
    way = "far too fast" if off[worst] > _FAR else way
    way = "going the other way" if measured * twin < 0 else way
    return (
        f"The twin does not describe this robot: in {worst}, which it was fitted to, it is {way} ({in_mm(twin)} "
        f"instead of {in_mm(measured)} mm/s)."
    )


def holds_against_rules(forecasts: SessionForecast) -> bool:
    """Return whether the exported twin forecasts speeds better than every simple rule, as far as speeds are known.

    An error of the scale of all measured speeds, within its 90 % interval, does not count against the twin; nor does a
    mean error below the scale's standard deviation, whatever a rule's is.
    """
    if not (best := forecasts.best_baseline):
        return False
    measured = sum(trial.speed_measured for trial in forecasts.held_out) / len(forecasts.held_out)
    as_well_as_known = forecasts.mean(TWIN, "speed_error") < forecasts.scale_sd * measured
    return as_well_as_known or forecasts.gain_of_twin(best).at_best > 0


def compared_with_best(forecasts: SessionForecast) -> str:
    """Say whether the exported twin is better than the best simple rule; empty without a rule.

    The cases: as good; better; better, but not significantly; worse, but not significantly; worse.
    """
    if not (best := forecasts.best_baseline):
        return ""
    gain, name = forecasts.gain_of_twin(best), MODELS[best]
    if not isfinite(gain.mean):
        return ""
    if abs(gain.mean) < _ALIKE_M_S:
        return f"The twin is as good as the best simple rule, {name}: their errors differ by less than 0.1 mm/s."
    how = "better" if gain.mean > 0 else "worse"
    sure = gain.interval is not None and gain.interval[0] * gain.interval[1] > 0
    ends = "" if gain.interval is None else f" (90 % interval {spanned(*gain.interval, in_mm)})"
    if gain.mean <= 0 < gain.at_best:
        ends += f"; the scale of all measured speeds, known to {shown(100 * forecasts.scale_sd)} %, would explain it"
    return (
        f"The twin is {how}{'' if sure else ', but not significantly,'} than the best simple rule, {name}: gain "
        f"{in_mm(gain.mean)} mm/s{ends}."
    )


def correction_sentence(forecasts: SessionForecast) -> str:
    """Say what held-out speeds gain by the correction that the fit trials suggest.

    The correction is no part of the exported twin.
    """
    own, alone = (in_mm(forecasts.mean(name, "speed_error")) for name in (GIVEN, TWIN))
    if not isfinite(forecasts.mean(GIVEN, "speed_error")):
        return ""
    return (
        f"With a correction interpolated from the fit trials, which is no part of the exported twin, the speed error "
        f"is {own} instead of {alone} mm/s."
    )


def drawn_sentence(forecasts: SessionForecast) -> str:
    """Say how well the draws of a posterior, and the best simple rule, forecast held-out speeds.

    Empty without a rule.
    """
    if not (best := forecasts.best_baseline):
        return ""
    own, other = (in_mm(forecasts.mean(model, "speed_error")) for model in (DRAWN, best))
    return f"Held-out speed error: corrected twin, averaged over the draws, {own} mm/s; {MODELS[best]} {other} mm/s."


def mean_speed_errors(forecasts: SessionForecast) -> dict[str, float]:
    """Compute the mean absolute error over the held-out trials by model, m/s, as far as it is known."""
    errors = {name: forecasts.mean(name, "speed_error") for name in MODELS}
    return {name: error for name, error in errors.items() if isfinite(error)}


def is_baseline(model: str) -> bool:
    """Return whether a model is a simple baseline, which a first-year student would try."""
    return model in BASELINES or model == CONTINUED


# A diagnosis.


def sizes_sentence(found: DiagnosisResult) -> str:
    """Say how strong each fitted effect is, with 95 % intervals; an empty text where none was fitted."""
    sizes = [f"{in_words(name)}: {effect_size(found.effect_parameters, name)}" for name in found.effect_parameters]
    return sentence(f"{'; '.join(sizes)} (95 % intervals)") if sizes else ""


def gap_sentences(found: DiagnosisResult) -> tuple[str, str, str]:
    """Write the three sentences, each after its question."""
    return where(found), which(found), f"How far: {how_far(found)}"


def effect_size(parameters: EffectParameters, effect: str) -> str:
    """Say how strong an effect was fitted to be: its three clearest parameters, each with its 95 % interval."""
    found = parameters_of(parameters, effect).items()
    largest = sorted(found, key=lambda item: -abs(item[1].value) / max(item[1].ci95[1] - item[1].ci95[0], 1e-12))[:3]
    shown_ones = [parameter_in_words(name, own) for name, own in largest]
    return ", ".join(f"{one.name} {one.value} ({one.interval}) {one.unit}".rstrip() for one in shown_ones)


_OPPOSITE = {"right": "left", "down": "up"}
"""Directions in the picture that parameters are named after, and what they are called where the value is negative."""


class ParameterInWords(NamedTuple):
    """A fitted parameter as one reads it: its name, value and 95 % interval, and the unit; "" for a plain number."""

    name: str
    value: str
    interval: str
    unit: str


def parameter_in_words(name: str, fitted: FittedParameter) -> ParameterInWords:
    """Format a parameter, metres as millimetres, with enough digits that half its interval has two.

    A direction is named so that its value is positive: up, not down of a negative size.
    """
    scale, unit = (MM, f"m{fitted.unit}") if fitted.unit in ("m", "m/s") else (1.0, fitted.unit)
    if name in _OPPOSITE and fitted.value < 0:
        name, scale = _OPPOSITE[name], -scale
    value, low, high = (scale * each for each in (fitted.value, *fitted.ci95))
    low, high = min(low, high), max(low, high)
    places = max(1 - floor(log10(max(high - low, 1e-12) / 2)), 0)
    at, start, end = (shown(each, places) for each in (value, low, high))
    return ParameterInWords(in_words(name), at, f"{start} to {end}", "" if unit == "1" else unit)


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
        return f"No effect is named, so nothing is added to the twin. Its errors on {trials}: {sizes}."
    if isnan(gap.shrinkage):
        within = f"On {trials} the twin is off by no more than noise and its own error; errors change so: {sizes}."
        return f"{within} Do not use the effects for forecasts." if gap.frequency_grows else within
    warning = "" if gap.improves and not gap.frequency_grows else " Do not use it for forecasts."
    return f"On {trials}: {sizes}; {_how_surely(gap)}.{warning}"


def _how_surely(gap: GapSize) -> str:
    """Say whether the twin with the effects is closer, by the interval of its skill score, without that number."""
    if gap.shrinkage <= 0:
        return "with the effects the twin is no closer"
    worse, count = _farther_off(gap)
    but = f", though its speed is farther off in {worse} of {count}" if worse else ""
    return f"with the effects the twin is closer{'' if gap.improves else ', but not significantly'}{but}"


def _farther_off(gap: GapSize) -> tuple[int, int]:
    """Count the held-out trials whose speed is farther off with the effects, and all whose speed is known."""
    errors = [
        (abs(each.speed_before - each.speed_measured), abs(each.speed_after - each.speed_measured))
        for each in (gap.trials or {}).values()
    ]
    known = [(before, after) for before, after in errors if isfinite(before) and isfinite(after)]
    return sum(after > before for before, after in known), len(known)


def next_experiment(found: DiagnosisResult) -> str:
    """Describe the most informative experiment and what it separates; empty where none is expected to tell enough."""
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
