"""The results of posterior and diagnosis, and their sentences for the terminal.

`PosteriorResult` is `results/posterior.nc` and `posterior.json` as attributes, frames and figures; `GapResult` is
`results/diagnosis.json`, and `EffectTest` the test of named effects. `diagnosis_lines` says a diagnosis in three
sentences and a table.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from math import isnan
from typing import TYPE_CHECKING, Any

import pandas as pd
import xarray as xr

from calib.results.result import GapFigures, PosteriorFigures, Result, flag_frame, forecast_frame
from diagnosis.result import (
    NONE,
    DiagnosisResult,
    EffectParameters,
    EffectTestResult,
    GapShares,
    GapSize,
    MissingForces,
    parameters_of,
)
from diagnosis.sentences import plain, visible_changes
from fitting.coefficient_fit import Marginal
from reports.caveats import gap_caveats, posterior_caveats
from reports.words import (
    SEPARATES,
    by_how_much,
    counted,
    drawn_sentence,
    effect_size,
    gap_sentences,
    in_mm,
    in_words,
    listed,
    next_experiment,
    of_its_size,
    shown,
    sizes_sentence,
    spanned,
)
from swimcal.flags import Flag

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary
    from fitting.session_forecast import SessionForecast

_ROWS = 6  # smallest number of effects that are shown
_NEXT = 3  # number of experiments that are shown


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PosteriorResult(Result):
    """Draws from the posterior of the five coefficients given the fit trials, and their summary.

    Tables of `to_frame`: "coefficients" (a row each: mean, sd, ends of the 90 % interval, effective draws, R-hat),
    "trials" (speed along the smooth path of each swim trial with its predictive interval, m/s), "forecasts" (of the
    draws, and of simple baselines, as those of a fit) and "flags".

    Example:
        >>> found = calib.posterior("pool", "quick", progress=False)
        >>> print(found.summary().splitlines()[1])
        90 % intervals: blunt drag ... to ..., slender drag ... to ..., angular drag ...
        >>> found.coefficients["blunt_drag"].determined
        True
        >>> found.idata.posterior.blunt_drag.dims               # the draws, for ArviZ
        ('chain', 'draw')
    """

    key = "posterior"

    data: PosteriorSummary
    plot: PosteriorFigures
    next_step: str
    explained: Collection[str] = ()
    """Kinds of flags that the named effects of the current diagnosis explain."""

    @cached_property
    def idata(self) -> Any:
        """The draws as ArviZ reads them: groups `posterior`, `sample_stats` and `observed_data`."""
        from fitting.posterior.sampling import arviz

        return arviz.from_netcdf(str(self.file), engine="h5netcdf")

    @cached_property
    def sweep(self) -> xr.Dataset:
        """The forward speed over frequency that the draws predict.

        Dimensions `quantile` (0.05 to 0.95) and `frequency` (Hz); variables `speed`, the expected one, and
        `another_trial`, that of a trial that could still be swum, m/s.
        """
        from fitting.posterior.prediction import QUANTILES  # it loads ArviZ

        found, places = self.data.sweep, ("quantile", "frequency")
        speed = {"units": "m/s", "long_name": "forward speed"}
        return xr.Dataset(
            {"speed": (places, found.inner, speed), "another_trial": (places, found.outer, speed)},
            {"quantile": list(QUANTILES), "frequency": ("frequency", found.frequency_hz, {"units": "Hz"})},
        )

    @property
    def coefficients(self) -> Mapping[str, Marginal]:
        """The mean, sd and 90 % interval of each coefficient, and whether the trials determine it."""
        return self.data.marginals

    @property
    def forecasts(self) -> SessionForecast:
        """Forecasts of every trial averaged over the draws, and by simple baselines."""
        return self.data.forecasts

    @property
    def flags(self) -> tuple[Flag, ...]:
        """The reasons to doubt the posterior."""
        return self.data.flags

    @property
    def verdict(self) -> str:
        """The verdict in one word: determined (all five), partly_determined or undetermined.

        It is doubtful where there are other flags than those that the named effects explain.
        """
        if self._caveats:
            return "doubtful"
        determined = sum(one.determined for one in self.coefficients.values())
        return {0: "undetermined", len(self.coefficients): "determined"}.get(determined, "partly_determined")

    def summary(self) -> str:
        """Summarise what was found, how well it forecasts, how far to trust it, and what to do next, in six lines."""
        data, of = self.data, self.coefficients
        intervals = ", ".join(f"{in_words(name)} {spanned(one.q05, one.q95, of_its_size)}" for name, one in of.items())
        loose = [in_words(name) for name, one in of.items() if not one.determined]
        found = f"Not determined by these trials: {listed(loose)}." if loose else "The trials determine all five."
        inside, count, _ = data.inside("holdout")
        held = f"; the speed of {inside} of {count} held-out trials is in its 90 % band" if count else ""
        caveats, every = self._caveats, posterior_caveats(data)
        more = " (more: -v)" if len(caveats) > 1 else ""
        none = f"{counted(len(every), 'caveat')}, which the named effects explain (-v)." if every else "No caveat."
        why = {
            "doubtful": f": read {counted(len(caveats), 'caveat')} first (-v)",
            "determined": ": all five, and without a caveat",
        }.get(self.verdict, ": the report says which further trial helps most")
        lines = [
            f"{self.session.name}: {self.name}.",
            f"90 % intervals: {intervals}.",
            f"{found[:-1]}{held}.",
            drawn_sentence(self.forecasts),
            f"Main caveat: {caveats[0]}{more}" if caveats else none,
            f"Verdict of the posterior: {in_words(self.verdict)}{why}. Next: {self.next_step}",
        ]
        return "\n".join(filter(None, lines))

    @property
    def _caveats(self) -> tuple[str, ...]:
        return posterior_caveats(self.data, self.explained)

    def details(self) -> list[str]:
        """List the coefficients, a line each, and every caveat."""
        return [*interval_lines(self.coefficients), *(f"! {caveat}" for caveat in posterior_caveats(self.data))]

    @property
    def in_brief(self) -> str:
        """Return how many coefficients are determined, the draws and their convergence."""
        of = self.coefficients.values()
        determined = f"{sum(one.determined for one in of)} of {len(of)} coefficients determined"
        draws = f"{min(one.ess_bulk for one in of):,.0f} effective draws, R-hat {max(one.r_hat for one in of):.3f}"
        return f"{determined}; at least {draws} at most; {in_words(self.verdict)}"

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {
            "coefficients": self._coefficients,
            "trials": self._trials,
            "forecasts": lambda: forecast_frame(self.forecasts),
            "flags": lambda: flag_frame(("", flag) for flag in self.flags),
        }

    def _coefficients(self) -> pd.DataFrame:
        rows = {name: one._asdict() for name, one in self.coefficients.items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("coefficient")

    def _trials(self) -> pd.DataFrame:
        rows = {
            trial.name: {
                "role": trial.role,
                "speed_measured": trial.speed,
                "speed_q05": trial.outer[0],
                "speed_q50": trial.outer[2],
                "speed_q95": trial.outer[-1],
                "inside": trial.speed_inside,
            }
            for trial in self.data.trials
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("trial")


def interval_lines(marginals: Mapping[str, Marginal]) -> list[str]:
    """Format the 90 % interval of each coefficient, and whether the trials determine it, a line each."""
    return [
        f"  {name:13} {shown(one.mean, 3):>6} ± {one.sd:.2g}, 90 % interval {one.q05:.3g} to {one.q95:.3g}"
        f"{'' if one.determined else ': not determined by these trials'}"
        for name, one in marginals.items()
    ]


class Effects(tuple[str, ...]):
    """Names of the effects that a diagnosis names, with all others in `to_frame`."""

    _data: DiagnosisResult

    def __new__(cls, data: DiagnosisResult) -> Effects:  # noqa: D102
        made = super().__new__(cls, data.effects)
        made._data = data
        return made

    @property
    def names(self) -> tuple[str, ...]:
        """The names as a plain tuple."""
        return tuple(self)

    def to_frame(self) -> pd.DataFrame:
        """Make a table with a row for each effect of the catalogue and each of its parameters.

        Columns are the probability, whether the effect is named, value and 95 % interval. The most probable come first;
        effects that were not added to the twin have no value. The last row is the probability of an effect outside the
        catalogue.
        """
        rows = []
        for name, probability in self._data.chances.items():
            of_effect = {"effect": name, "probability": probability, "named": name in self}
            rows += [of_effect | parameter for parameter in _parameters(self._data.effect_parameters, name)]
        rows.append({"effect": NONE, "probability": self._data.none_of_these, "named": False})
        return pd.DataFrame(rows).set_index("effect")

    def __repr__(self) -> str:
        return f"<Effects: {', '.join(self) or 'none is named'}; all of them: to_frame()>"

    def _repr_html_(self) -> str:
        return str(self.to_frame().to_html(float_format=lambda value: f"{value:.4g}", na_rep=""))


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class GapResult(Result):
    """The sim-to-real gap: where it is, which effect causes it, and how far it shrinks with that effect.

    Tables of `to_frame`: "effects" (see `Effects.to_frame`), "where" (share of the gap by split and part), "trials"
    (held-out trials without and with the effects: mm and m/s) and "next_experiments".

    Example:
        >>> gap = calib.diagnose("pool", "quick", progress=False)
        >>> gap.verdict, gap.effects.names, gap.groups          # here the data need no effect
        ('no_gap', (), ())
        >>> list(gap.effects.to_frame().columns)                # named ones also have parameters with intervals
        ['probability', 'named']
        >>> list(gap.to_frame("where").loc["stage"].index)
        ['camera', 'drive', 'body', 'tail', 'floor']
    """

    key = "diagnosis"

    data: DiagnosisResult
    plot: GapFigures
    next_step: str

    @property
    def verdict(self) -> str:
        """The verdict: named, inseparable, unexplained or no_gap."""
        return self.data.verdict

    @property
    def effects(self) -> Effects:
        """The effects that are named; `effects.to_frame()` has those that are not, too."""
        return Effects(self.data)

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """The alternatives that the data cannot separate (inner), which act together (outer)."""
        return self.data.groups

    @property
    def probabilities(self) -> Mapping[str, float]:
        """The probability that each effect is present, the most probable first, and `none_of_these`."""
        return self.data.probabilities

    @property
    def where(self) -> GapShares:
        """Shares of the gap by stage, trial, marker, axis and band; those of each split add up to 1."""
        return self.data.where

    @property
    def size(self) -> GapSize:
        """The gap on held-out trials, without and with the effects: markers in mm, speeds in m/s."""
        return self.data.gap

    @property
    def missing_forces(self) -> MissingForces:
        """Forces (N) and torques (N m) that the plain twin lacks, by joint, trial and harmonic of the crank."""
        return self.data.missing_forces

    def summary(self) -> str:
        """Summarise where, which, how far, the main caveat, the next experiment and the verdict, in six lines."""
        experiment = next_experiment(self.data) or "none known would tell the likeliest effects better apart"
        where, which, how_far = gap_sentences(self.data)
        return "\n".join(
            [
                where,
                f"{which} {sizes_sentence(self.data)}".rstrip(),
                how_far,
                f"Main caveat: {main_caveat(self.data)}",
                f"Next experiment: {experiment}.",
                f"Verdict of the diagnosis: {in_words(self.verdict)}. Next: {self.next_step}",
            ]
        )

    def details(self) -> list[str]:
        """List where, which and how far; then the most probable effects, what to check, and what to measure next."""
        return diagnosis_lines(self.data)

    @property
    def in_brief(self) -> str:
        """Return the verdict with the most probable effect, and the gap on held-out trials without and with it."""
        name, chance = next(iter(self.probabilities.items()))
        lines = f"{in_words(self.verdict)}, most probable {in_words(name)} ({chance:.2f})"
        if not (gap := self.size).evaluated_on:
            return f"{lines}; no held-out trial"
        markers = f"markers {shown(gap.baseline_mm)} mm without and {shown(gap.with_effects_mm)} with effects"
        return (
            f"{lines}; held out: {markers}, speed {in_mm(gap.speed_mae_before)} and {in_mm(gap.speed_mae_after)} mm/s"
        )

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {
            "effects": self.effects.to_frame,
            "where": self._where,
            "trials": self._trials,
            "next_experiments": self._next,
        }

    def _make_notebook_table(self) -> pd.DataFrame:
        return self.to_frame().head(8)

    def _where(self) -> pd.DataFrame:
        splits = asdict(self.where).items()
        rows = [(split.removeprefix("by_"), part, share) for split, parts in splits for part, share in parts.items()]
        return pd.DataFrame(rows, columns=["split", "part", "share"]).set_index(["split", "part"])

    def _trials(self) -> pd.DataFrame:
        rows = {name: asdict(trial) for name, trial in (self.size.trials or {}).items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("trial")

    def _next(self) -> pd.DataFrame:
        rows = [(each.describe, *each.separates, each.expected_error) for each in self.data.next_experiments]
        return pd.DataFrame(rows, columns=["experiment", "effect", "other_effect", "expected_error"])


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class EffectTest(Result):
    """The outcome of a test of effects that a user names; what `supposed.json` holds.

    Its table has a row an effect and parameter: its own log Bayes factor, value and 95 % interval.

    Example:
        >>> found = calib.effect_test("pool", ["camera_parallax"], "quick", progress=False)
        >>> print(found.summary())
        Tested: camera parallax.
        Log Bayes factor over the plain twin: -1.2 (below 0: the fit trials speak against it)...
    """

    key = "test"

    data: EffectTestResult

    @property
    def log_bayes_factor(self) -> float:
        """The log Bayes factor of all named effects together over the plain twin, natural logarithm."""
        return self.data.log_bayes_factor

    def summary(self) -> str:
        """Summarise what the trials say of the effects, and the gap without and with them."""
        return "\n".join(line for line in self.details() if line)

    def details(self) -> list[str]:
        """List the lines of the summary, with blank lines between its parts."""
        return test_lines(self.data)

    @property
    def in_brief(self) -> str:
        """Return the effects and their log Bayes factor."""
        names = listed([in_words(name) for name in self.data.effects])
        return f"{names}; log Bayes factor over the plain twin {shown(self.log_bayes_factor)}"

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {"effects": self._effects}

    def _effects(self) -> pd.DataFrame:
        rows = []
        for name, own in self.data.log_bayes_factor_of_each.items():
            for parameter in _parameters(self.data.effect_parameters, name):
                rows.append({"effect": name, "log_bayes_factor": own} | parameter)
        return pd.DataFrame(rows).set_index("effect")


def _parameters(found: EffectParameters, effect: str) -> Iterator[dict[str, object]]:
    """Yield the fitted parameters of an effect as parts of rows; one empty part where it was not fitted."""
    parameters = parameters_of(found, effect)
    if not parameters:
        yield {}
    for name, each in parameters.items():
        low, high = each.ci95
        yield {"parameter": name, "value": each.value, "low": low, "high": high, "unit": each.unit}


# Its sentences for the terminal.


def diagnosis_lines(data: DiagnosisResult) -> list[str]:
    """Format where, which and how far; then the most probable effects, what to check, and what to measure next."""
    lines = [*gap_sentences(data), ""]
    if (reference := data.reference) is not None:
        lines.append(
            f"reference: {reference.session}, {counted(len(reference.swims), 'swim')} ({listed(reference.swims)})"
        )
    lines.append(f"{'effect':28} {'probability':>11}  fitted")
    for number, (name, chance) in enumerate(data.chances.items()):
        if number < _ROWS or name in data.effects:
            lines.append(f"{name:28} {chance:11.3f}  {effect_size(data.effect_parameters, name)}".rstrip())
    lines.append(f"{'none of these':28} {data.none_of_these:11.3f}")
    lines.append(f"{'nothing at all':28} {data.no_gap_probability:11.3f}")
    if seen := visible_changes(data):
        lines += ["", "would show from:", *(f"  {each}" for each in seen)]
    return [*lines, *(f"! {each}" for each in gap_caveats(data)), *_next(data), *_models(data)]


def main_caveat(data: DiagnosisResult) -> str:
    """Return the first caveat to check before a diagnosis is believed."""
    if found := gap_caveats(data):
        return f"{found[0]}{f' ({len(found) - 1} more: -v)' if len(found) > 1 else ''}"
    if not data.gap.evaluated_on:
        return "no trial is held out, so how far the gap shrinks is not known."
    return "none of the diagnosis; `calib fit -v` lists those of the fit."


def test_lines(data: EffectTestResult) -> list[str]:
    """Format the evidence for each tested effect and for all together; then the gap without and with them."""
    says = "above 0: the fit trials support" if data.log_bayes_factor > 0 else "below 0: the fit trials speak against"
    lines = [
        f"Tested: {', '.join(plain(name) for name in data.effects)}.",
        f"Log Bayes factor over the plain twin: {data.log_bayes_factor:.1f} ({says} "
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


def _format_comparison(what: str, before: float, after: float) -> str:
    return f"{what:28} " + " ".join(f"{'-' if isnan(each) else f'{each:.1f}':>11}" for each in (before, after))
