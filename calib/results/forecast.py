"""What the hierarchical model forecasts of every trial, beside simple baselines: `results/forecast.json`."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from scipy.stats import t as student

from calib.results.result import Result, flag_frame, flag_lines
from fitting.model.session_forecast import BASELINES, BEATS, COMMAND, CONTINUED, TWIN, ForecastTrial, SessionForecast
from reports.numbers import in_words, listed, shown
from session import Flag
from swimmer import FluidCoefficients

_MM = 1000.0
_WORDS = {
    TWIN: "twin alone",
    COMMAND: "twin and its learned discrepancy",
    BEATS: "the same after two beats of the trial",
    CONTINUED: "goes on as in its first two beats",
    "line": "line",
    "power_law": "power law",
    "constant_stride": "constant stride",
}


@dataclass(frozen=True, eq=False, kw_only=True)
class ForecastResult(Result):
    """Forecasts of every trial by one hierarchical model of the fit trials, and by baselines.

    Tables of `to_frame`: "trials" (a row a trial and model: speed in m/s with its 90 % band, marker and shape error in
    mm, share inside the bands), "errors" (means over held-out trials by model: absolute speed error in mm/s, marker
    errors in mm), "coefficients" (mode with 90 % interval), "components" (standard deviation of each) and "flags".

    Attributes:
        data: all that the file holds.
    """

    key = "forecast"

    data: SessionForecast = field(repr=False)

    @property
    def coefficients(self) -> FluidCoefficients:
        """The mode of the model, without unit."""
        return self.data.coefficients

    @property
    def trials(self) -> Mapping[str, ForecastTrial]:
        """Every swim trial by its name."""
        return self.data.trials

    @property
    def verdict(self) -> str:
        """One word: beats_baselines, worse_than_baselines (speeds from the command), or unchecked."""
        errors = self._errors()
        if errors.empty:
            return "unchecked"
        best = float(errors.speed_error_mm_s[list(BASELINES)].min())
        return "beats_baselines" if errors.speed_error_mm_s[COMMAND] < best else "worse_than_baselines"

    def summary(self) -> str:
        """Whether the model beats the baselines, quantity by quantity, and what to do next."""
        held = [name for name, trial in self.trials.items() if trial.role != "fit"]
        values = ", ".join(f"{in_words(name)} {value:.3g}" for name, value in self.coefficients._asdict().items())
        lines = [f"{self.session.name}: {self.name}; held out: {listed(held) or 'none'}.", f"Mode: {values}."]
        errors = self._errors()
        if errors.empty:
            lines.append("No trial is held out: nothing says how well it forecasts.")
        else:
            speeds = ", ".join(f"{_WORDS[name]} {shown(errors.speed_error_mm_s[name], 1)}" for name in errors.index)
            lines += [self._beside_baselines(), f"Speed error held out, mm/s: {speeds}.", *self._markers(errors)]
        doubts = self.to_frame("flags").message
        lines.append(f"Biggest doubt: {doubts.iloc[0]}." if len(doubts) else "No doubt was raised.")
        return "\n".join([*lines, f"Verdict: {in_words(self.verdict)}. Next: calib posterior {self.session.folder}"])

    def details(self) -> list[str]:
        """A line a trial and model, and every flag."""
        rows = self.to_frame("trials").itertuples()
        numbers = [
            f"{row.Index[0]} {row.Index[1]}: {_MM * row.speed:.1f} mm/s (measured {_MM * row.speed_measured:.1f})"
            for row in rows
        ]
        return [*numbers, *flag_lines(self._flags())]

    def _beside_baselines(self) -> str:
        """The first sentence: does it beat them, by how much, with an interval over trials."""
        errors = self._errors().speed_error_mm_s
        best = str(errors[list(BASELINES)].idxmin())
        gained = [
            _MM * (abs(f[best].speed - trial.speed_measured) - abs(f[COMMAND].speed - trial.speed_measured))
            for trial in self.trials.values()
            if COMMAND in (f := trial.forecasts)
        ]
        mean, reach = float(np.mean(gained)), float("inf")
        if len(gained) > 1:
            reach = float(student.ppf(0.95, len(gained) - 1) * np.std(gained, ddof=1) / np.sqrt(len(gained)))
        interval = f" (90 % interval over trials {shown(mean - reach, 1)} to {shown(mean + reach, 1)})"
        how = "beat" if mean > 0 else "do not beat"
        return (
            f"Forecasts of speed from the command {how} the best baseline ({in_words(best)}): gain "
            f"{shown(mean, 1)} mm/s{interval if len(gained) > 1 else ', one trial'}."
        )

    @staticmethod
    def _markers(errors: pd.DataFrame) -> list[str]:
        told = [
            f"{_WORDS[name]} {shown(row.marker_error_mm, 1)} ({shown(row.shape_error_mm, 1)} relative to the nose)"
            for name, row in errors.iterrows()
            if np.isfinite(row.marker_error_mm)
        ]
        return [f"Marker error held out, mm: {'; '.join(told)}."] if told else []

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {
            "trials": self._trials,
            "errors": self._errors,
            "coefficients": self._coefficients,
            "components": lambda: pd.DataFrame({"sd": dict(self.data.components)}).rename_axis("component"),
            "flags": lambda: flag_frame(self._flags()),
        }

    def _trials(self) -> pd.DataFrame:
        rows = {}
        for name, trial in self.trials.items():
            for model, forecast in trial.forecasts.items():
                low, high = forecast.speed_ci90 or (np.nan, np.nan)
                rows[name, model] = {
                    "role": trial.role,
                    "frequency_hz": trial.frequency_hz,
                    "speed_measured": trial.speed_measured,
                    "speed": forecast.speed,
                    "speed_q05": low,
                    "speed_q95": high,
                    "marker_error_mm": forecast.marker_error_mm,
                    "shape_error_mm": forecast.shape_error_mm,
                    "inside": forecast.inside,
                }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis(["trial", "model"])

    def _errors(self) -> pd.DataFrame:
        """Means over the held-out trials that every model forecasts."""
        frame = self._trials()
        frame = frame[frame.role != "fit"]
        if frame.empty:
            return pd.DataFrame(columns=["speed_error_mm_s", "marker_error_mm", "shape_error_mm"])
        frame = frame.assign(speed_error_mm_s=_MM * (frame.speed - frame.speed_measured).abs())
        columns = ["speed_error_mm_s", "marker_error_mm", "shape_error_mm"]
        return frame[columns].astype(float).groupby("model", sort=False).mean()

    def _coefficients(self) -> pd.DataFrame:
        ends = pd.DataFrame.from_dict(dict(self.data.ci90), orient="index", columns=["q05", "q95"])
        return pd.DataFrame({"value": self.coefficients._asdict()}).join(ends).rename_axis("coefficient")

    def _flags(self) -> Iterator[tuple[str, Flag]]:
        yield from (("", flag) for flag in self.data.flags)
