"""The result of the posterior: `results/posterior.nc` and `posterior.json` as attributes, frames and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import pandas as pd

from calib.results.figures import PosteriorFigures
from calib.results.result import Result, flag_frame, flag_lines, forecast_frame
from fitting.coefficient_fit import Marginal
from reports.forecast_words import drawn_sentence
from reports.numbers import counted, in_words, listed, of_its_size, shown, spanned
from session import Flag

if TYPE_CHECKING:
    from fitting.model.session_forecast import SessionForecast
    from fitting.posterior.summary import PosteriorSummary


@dataclass(frozen=True, eq=False, kw_only=True)
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

    data: PosteriorSummary = field(repr=False)
    plot: PosteriorFigures = field(repr=False)
    next_step: str = field(repr=False)

    @cached_property
    def idata(self) -> Any:
        """The draws as ArviZ reads them: groups `posterior`, `sample_stats` and `observed_data`."""
        from fitting.posterior.quiet_arviz import arviz

        return arviz.from_netcdf(str(self.file), engine="h5netcdf")

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

        It is doubtful where there are other flags.
        """
        if any(flag.kind != "unidentifiable" for flag in self.flags):
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
        caveats = list(dict.fromkeys(flag.message for flag in self.flags if flag.kind != "unidentifiable"))
        more = " (more: -v)" if len(caveats) > 1 else ""
        why = {
            "doubtful": f": read {counted(len(caveats), 'caveat')} first (-v)",
            "determined": ": all five, and nothing is flagged",
        }.get(self.verdict, ": the report says which further trial helps most")
        lines = [
            f"{self.session.name}: {self.name}.",
            f"90 % intervals: {intervals}.",
            f"{found[:-1]}{held}.",
            drawn_sentence(self.forecasts),
            f"Main caveat: {caveats[0]}{more}." if caveats else "No caveat.",
            f"Verdict: {in_words(self.verdict)}{why}. Next: {self.next_step}",
        ]
        return "\n".join(filter(None, lines))

    def details(self) -> list[str]:
        """List the coefficients, a line each, and every flag."""
        return [*interval_lines(self.coefficients), *flag_lines(("", flag) for flag in self.flags)]

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
