"""The result of a diagnosis: `results/diagnosis.json` as attributes, frames, figures and sentences."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field

import pandas as pd

from calib.diagnosis_summary import diagnosis_lines, main_caveat, test_lines
from calib.results.figures import GapFigures
from calib.results.result import Result
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
from reports.gap_words import gap_sentences, next_experiment
from reports.numbers import in_words


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

    def _repr_html_(self) -> str:
        return str(self.to_frame().to_html(float_format=lambda value: f"{value:.4g}", na_rep=""))


@dataclass(frozen=True, eq=False, kw_only=True)
class GapResult(Result):
    """The sim-to-real gap: where it is, which effect causes it, and how far it shrinks with that effect.

    Tables of `to_frame`: "effects" (see `Effects.to_frame`), "where" (share of the gap by split and part), "trials"
    (held-out trials without and with the effects: mm and m/s) and "next_experiments".

    Example:
        >>> gap = calib.diagnose("pool", "quick", progress=False)
        >>> gap.verdict, gap.effects.names, gap.groups          # here the data need no effect
        ('no_gap', (), ())
        >>> list(gap.effects.to_frame().columns)                # of those named also parameters with intervals
        ['probability', 'named']
        >>> list(gap.to_frame("where").loc["stage"].index)
        ['camera', 'drive', 'body', 'tail', 'floor']
    """

    key = "diagnosis"

    data: DiagnosisResult = field(repr=False)
    plot: GapFigures = field(repr=False)
    next_step: str = field(repr=False)

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
        experiment = next_experiment(self.data) or "none of the known ones is expected to add information"
        return "\n".join(
            [
                *gap_sentences(self.data),
                f"Main caveat: {main_caveat(self.data)}",
                f"Next experiment: {experiment}.",
                f"Verdict: {in_words(self.verdict)}. Next: {self.next_step}",
            ]
        )

    def details(self) -> list[str]:
        """List where, which and how far; then the most probable effects, what to check, and what to measure next."""
        return diagnosis_lines(self.data)

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


@dataclass(frozen=True, eq=False, kw_only=True)
class EffectTest(Result):
    """The outcome of a test of effects that a user names; what `supposed.json` holds.

    Its table has a row an effect and parameter: its own log Bayes factor, value and 95 % interval.

    Example:
        >>> found = calib.effect_test("pool", ["camera_parallax"], "quick", progress=False)
        >>> print(found.summary())
        Tested: camera parallax.
        Log Bayes factor over the plain twin: -1.2 (above 0: the fit trials support it)...
    """

    key = "test"

    data: EffectTestResult = field(repr=False)

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
