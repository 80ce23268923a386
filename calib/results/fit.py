"""What a fit found: `results/calibration.json` as attributes, frames, figures and sentences."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import nan
from pathlib import Path

import numpy as np
import pandas as pd

from calib.results.figures import FitFigures
from calib.results.posterior import interval_lines
from calib.results.result import Result, flag_frame, flag_lines
from fitting import CalibrationResult
from fitting.calibration_file import TrialResult
from fitting.speed_line import speed_line
from reports.numbers import in_words, listed, of_its_size, shown
from session import Flag
from swimmer import FluidCoefficients

_LINE, _MM = "straight_line", 1000.0
_THROUGH = 2  # fit trials that a straight line goes through
_HIDDEN = ("flags", "from_command", "speed_ebt_of_twin")  # of a trial, no columns of their own
_SAID_ELSEWHERE = ("ebt_ratio_only",)  # kinds of flags that are true of every fit


@dataclass(frozen=True, eq=False, kw_only=True)
class FitResult(Result):
    """A calibrated twin beside every swim trial; what `calibration.json` holds, read from there.

    Speeds in m/s, forward positive. Tables of `to_frame`: "trials" (a row a swim trial), "coefficients" (value, and
    posterior interval where there is one), "speed_errors" (mean absolute error by model and role, m/s, beside a
    straight line in frequency) and "flags". Frames have the keys of the file as columns.

    Attributes:
        mjcf_file: `results/calibrated.xml`.
        data: all that the file holds.
        plot: its figures.
    """

    key = "calibration"

    mjcf_file: Path
    data: CalibrationResult = field(repr=False)
    plot: FitFigures = field(repr=False)

    @property
    def coefficients(self) -> FluidCoefficients:
        """The five fluid coefficients, without unit."""
        return self.data.coefficients

    @property
    def trials(self) -> Mapping[str, TrialResult]:
        """Every swim trial by its name."""
        return self.data.trials

    @property
    def flags(self) -> tuple[Flag, ...]:
        """What is doubtful about the fit as a whole; flags of a trial stand in `trials`."""
        return self.data.flags

    @cached_property
    def line_speeds(self) -> dict[str, float]:
        """Speed of each trial by a straight line in frequency through the fit trials, m/s: the baseline to beat."""
        fitted = [trial for trial in self.trials.values() if trial.role == "fit"]
        hz, speed = [trial.frequency_hz for trial in fitted], [trial.speed_measured for trial in fitted]
        told = speed_line(hz, speed, [trial.simulated_hz for trial in self.trials.values()])
        return dict(zip(self.trials, told, strict=True))

    @property
    def verdict(self) -> str:
        """One word: good, doubtful (flags), unchecked (no held-out trial) or worse_than_line (of the forecasts)."""
        errors = self._speed_errors()
        if "holdout" not in errors:
            return "unchecked"
        if errors.holdout["twin"] > errors.holdout[_LINE]:
            return "worse_than_line"
        return "doubtful" if self._doubts() else "good"

    def summary(self) -> str:
        """What was found, how far to trust it, and what to do next, in six lines."""
        fitted = [name for name, trial in self.trials.items() if trial.role == "fit"]
        held = [name for name, trial in self.trials.items() if trial.role == "holdout"]
        coefficients = self.coefficients._asdict()
        values = ", ".join(f"{in_words(name)} {of_its_size(value)}" for name, value in coefficients.items())
        doubts = self._doubts()
        more = f" (and {len(doubts) - 1} more kinds of doubt)" if len(doubts) > 1 else ""
        return "\n".join(
            [
                f"{self.session.name}: {self.name}, fitted to {listed(fitted)}; held out: {listed(held) or 'none'}.",
                f"Coefficients: {values}.",
                f"Marker error: {self._marker_errors()}.",
                f"Speed error: {self._speeds_in_words()}.",
                f"Biggest doubt: {doubts[0]}{more}." if doubts else "No doubt was raised.",
                f"Verdict: {in_words(self.verdict)}. Next: calib posterior {self.session.folder}",
            ]
        )

    def details(self) -> list[str]:
        """A line a trial, then structure, coefficients, means, and every flag, each once."""
        found = self.data
        lines = [f"{'trial':12} {'role':8} {'Hz':>6} {'marker mm':>10} {'speed m/s':>10} {'twin':>8} {'EBT':>8}"]
        for name, trial in found.trials.items():
            errors = f"{shown(trial.frequency_hz, 3):>6} {shown(trial.marker_error_mm, 1):>10}"
            speeds = (
                f"{shown(trial.speed_measured, 4):>10} {shown(trial.speed_twin, 4):>8} {shown(trial.speed_ebt, 4):>8}"
            )
            lines.append(f"{name:12} {trial.role:8} {errors} {speeds}")
        lines += [source.sentence for source in found.structure.values()]
        coefficients = found.coefficients._asdict().items()
        lines.append("coefficients " + ", ".join(f"{name} {value:.3g}" for name, value in coefficients))
        lines += interval_lines(found.posterior)
        for role, label in (("fit", "fit trials"), ("holdout", "held out")):
            if (summary := found.summary[role]) is not None:
                lines.append(
                    f"{label}: markers {shown(summary.marker_error_mm, 1)} mm, mean speed error "
                    f"{shown(summary.speed_mae_twin, 4)} m/s (EBT {shown(summary.speed_mae_ebt, 4)})"
                )
        return [*lines, *flag_lines(self._all_flags())]

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {
            "trials": self._trials,
            "coefficients": self._coefficients,
            "speed_errors": self._speed_errors,
            "flags": lambda: flag_frame(self._all_flags()),
        }

    def _shown(self) -> pd.DataFrame:
        columns = ["role", "frequency_hz", "marker_error_mm", "speed_measured", "speed_twin", "speed_ebt", "flags"]
        return self.to_frame()[columns]

    def _trials(self) -> pd.DataFrame:
        rows = {}
        for name, trial in self.trials.items():
            row = {key: value for key, value in asdict(trial).items() if key not in _HIDDEN}
            rows[name] = row | {"speed_line": self.line_speeds.get(name, nan), "flags": len(trial.flags)}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("trial")

    def _coefficients(self) -> pd.DataFrame:
        frame = pd.DataFrame({"value": self.coefficients._asdict()}).rename_axis("coefficient")
        if not self.data.posterior:
            return frame
        posterior = {name: marginal._asdict() for name, marginal in self.data.posterior.items()}
        return frame.join(pd.DataFrame.from_dict(posterior, orient="index"))

    def _speed_errors(self) -> pd.DataFrame:
        found = {}
        for role, summary in self.data.summary.items():
            if summary is not None:
                of_role = [name for name, trial in self.trials.items() if trial.role == role]
                missed = [self.trials[name].speed_measured - self.line_speeds.get(name, nan) for name in of_role]
                through = role == "fit" and len(of_role) <= _THROUGH  # where it errs by nothing, and that tells nothing
                found[role] = dict(summary.speed_mae) | {_LINE: nan if through else float(np.mean(np.abs(missed)))}
        return pd.DataFrame(found).rename_axis("model")

    def _all_flags(self) -> Iterator[tuple[str, Flag]]:
        yield from (("", flag) for flag in self.flags)
        for name, experiment in self.data.experiments.items():
            yield from ((name, flag) for flag in experiment.flags)
        for name, trial in self.trials.items():
            yield from ((name, flag) for flag in trial.flags)

    def _marker_errors(self) -> str:
        words = (("fit", "on fit trials"), ("holdout", "held out"))
        found = ((self.data.summary[role], word) for role, word in words)
        return ", ".join(f"{shown(each.marker_error_mm, 1)} mm {word}" for each, word in found if each is not None)

    def _speeds_in_words(self) -> str:
        errors = _MM * self._speed_errors()
        role = "holdout" if "holdout" in errors else "fit"
        told = errors[role]
        fit = f"{shown(errors.fit['twin'], 1)} mm/s on fit trials" if "fit" in errors else ""
        held = f", {shown(told['twin'], 1)} mm/s held out" if role == "holdout" else ""
        beside = f"straight line {shown(told[_LINE], 1)}, elongated body theory {shown(told['published'], 1)}"
        return f"{fit}{held} ({beside} mm/s)"

    def _doubts(self) -> list[str]:
        """A sentence a kind of flag: of the fit first, then of trials, those that concern most frames first."""
        whole: dict[str, str] = {}
        for flag in self.flags:
            if flag.kind not in _SAID_ELSEWHERE:
                whole.setdefault(flag.kind, flag.message)
        frames: Counter[tuple[str, str]] = Counter()
        for name, trial in self.trials.items():
            for flag in trial.flags:
                if flag.frames:
                    frames[name, flag.kind] += flag.frames[1] - flag.frames[0] + 1
        of_trials = [f"{name}: {in_words(kind)} in {count} frames" for (name, kind), count in frames.most_common()]
        return [*whole.values(), *of_trials]
