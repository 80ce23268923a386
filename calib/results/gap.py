"""The sim-to-real gap: `results/diagnosis.json` as attributes, frames, figures and sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import overload

import pandas as pd

from calib.diagnosis_summary import biggest_doubt, next_experiment
from calib.results.figures import GapFigures
from calib.results.tables import chosen, page_of
from diagnosis.result import (
    NONE,
    DiagnosisResult,
    EffectParameters,
    GapShares,
    GapSize,
    MissingForces,
    SuppositionResult,
    parameters_of,
)
from diagnosis.sentences import sentences
from reports.numbers import in_words
from session import Session


@dataclass(frozen=True, eq=False)
class Effects(Sequence[str]):
    """Names of the effects that a diagnosis names, with what it says of all others in `to_frame`.

    Attributes:
        names: of those that are named; also its items.
    """

    names: tuple[str, ...]
    _data: DiagnosisResult = field(repr=False)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[str, ...]: ...
    def __getitem__(self, index: int | slice) -> str | tuple[str, ...]:
        return self.names[index]

    def __len__(self) -> int:
        return len(self.names)

    def to_frame(self) -> pd.DataFrame:
        """A row an effect of the catalogue and parameter: probability, whether it is named, value, 95 % interval.

        The likeliest come first; effects that were not added to the twin have no value. The last row is the probability
        of something that the catalogue does not hold.
        """
        rows = []
        for name, probability in self._data.chances.items():
            of_effect = {"effect": name, "probability": probability, "named": name in self.names}
            rows += [of_effect | parameter for parameter in _parameters(self._data.effect_parameters, name)]
        rows.append({"effect": NONE, "probability": self._data.none_of_these, "named": False})
        return pd.DataFrame(rows).set_index("effect")

    def _repr_html_(self) -> str:
        return str(self.to_frame().to_html(float_format=lambda value: f"{value:.4g}", na_rep=""))


@dataclass(frozen=True, eq=False)
class GapResult:
    """Where the gap between twin and robot lies, which effect makes it, and how far it shrinks with that effect.

    Attributes:
        session: that was diagnosed.
        name: its effort, in words.
        file: `results/diagnosis.json`.
        data: all that the file holds.
        notes: what was said while it was made.
        plot: its figures.
        made: files that were made anew.
    """

    session: Session = field(repr=False)
    name: str
    file: Path
    data: DiagnosisResult = field(repr=False)
    plot: GapFigures = field(repr=False)
    notes: tuple[str, ...] = ()
    made: tuple[Path, ...] = ()

    @property
    def verdict(self) -> str:
        """named, inseparable, unexplained or no_gap."""
        return self.data.verdict

    @property
    def effects(self) -> Effects:
        """The effects that are named; `effects.to_frame()` has those that are not, too."""
        return Effects(self.data.effects, self.data)

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """Alternatives that the data cannot tell apart (inner), which act together (outer)."""
        return self.data.groups

    @property
    def probabilities(self) -> Mapping[str, float]:
        """That an effect is present, the likeliest first, and `none_of_these`."""
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

    def to_frame(self, table: str = "effects") -> pd.DataFrame:
        """One of the tables.

        Args:
            table: "effects" (see `Effects.to_frame`), "where" (share of the gap by split and part), "trials" (held-out
                trials without and with the effects: mm and m/s) or "next_experiments".

        Raises:
            InputError: no such table.
        """
        tables = {
            "effects": self.effects.to_frame,
            "where": self._where,
            "trials": self._trials,
            "next_experiments": self._next,
        }
        frame: pd.DataFrame = chosen(tables, table)()
        return frame

    def summary(self) -> str:
        """Where, which, how far, the biggest doubt, the next experiment and the verdict, in six lines."""
        return "\n".join(
            [
                *sentences(self.data),
                f"Biggest doubt: {biggest_doubt(self.data)}.",
                f"Next experiment: {next_experiment(self.data)}.",
                f"Verdict: {in_words(self.verdict)}. Next: calib report {self.session.folder}",
            ]
        )

    def _repr_html_(self) -> str:
        return page_of(self.summary(), self.to_frame().head(8))

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


@dataclass(frozen=True, eq=False)
class EffectTest:
    """What the swim trials say of effects that a user names; what `supposed.json` holds.

    Attributes:
        session: that was asked.
        file: `results/supposed.json`.
        data: all that the file holds.
        notes: what was said while it was made.
        made: files that were made anew.
    """

    session: Session = field(repr=False)
    file: Path
    data: SuppositionResult = field(repr=False)
    notes: tuple[str, ...] = ()
    made: tuple[Path, ...] = ()

    @property
    def log_bayes_factor(self) -> float:
        """Of all named effects together over the plain twin, natural logarithm."""
        return self.data.log_bayes_factor

    def to_frame(self) -> pd.DataFrame:
        """A row an effect and parameter: its own log Bayes factor, value and 95 % interval."""
        rows = []
        for name, own in self.data.log_bayes_factor_of_each.items():
            for parameter in _parameters(self.data.effect_parameters, name):
                rows.append({"effect": name, "log_bayes_factor": own} | parameter)
        return pd.DataFrame(rows).set_index("effect")

    def summary(self) -> str:
        """What the trials say of the effects, and the gap without and with them."""
        from calib.diagnosis_summary import supposition_lines

        return "\n".join(line for line in supposition_lines(self.data) if line)

    def _repr_html_(self) -> str:
        return page_of(self.summary().splitlines()[1], self.to_frame())


def _parameters(found: EffectParameters, effect: str) -> Iterator[dict[str, object]]:
    """The fitted parameters of an effect as parts of rows; one empty part where it was not fitted."""
    told = parameters_of(found, effect)
    if not told:
        yield {}
    for name, each in told.items():
        low, high = each.ci95
        yield {"parameter": name, "value": each.value, "low": low, "high": high, "unit": each.unit}
