"""The results of a fit and of dry experiments.

`FitResult` is `results/calibration.json` as attributes, frames, figures and sentences; `StructureResult` is
`results/structure.json`, that of dry experiments, in which the robot does not swim.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import xarray as xr

from calib.results.gap import interval_lines
from calib.results.result import TIME, FitFigures, Result, StructureFigures, flag_frame, flag_lines, forecast_frame
from diagnosis.result import DiagnosisResult
from fitting.calibration import CalibratedTrial, Calibration
from fitting.calibration_file import CalibrationResult, PublishedResult, TrialResult
from fitting.session_forecast import SessionForecast
from fitting.structure import Structure
from reports.answers import Answers, answers_of
from reports.words import counted, holds_against_rules, in_mm, in_words, misses, share_of, shown
from swimcal.errors import Fault, InputError
from swimcal.flags import Flag
from swimcal.mjcf import FluidCoefficients

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary

_HIDDEN = ("flags", "from_command")  # fields of a trial that have no column of their own


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StructureResult(Result):
    """Hinges and crank of a session that has no swim trial.

    Tables of `to_frame`: "structure" (a row a quantity: value, standard error, unit, whether assumed) and "flags".

    Example:
        >>> found = calib.fit("bench", "quick", progress=False)     # a session of one free decay
        >>> found.to_frame()[["unit", "assumed"]]
                            unit  assumed
        quantity
        hinge_stiffness  N m/rad    False
        hinge_damping   N m s/rad   False
        crank_arm             m      True
        >>> found.plot.names
        ('robot', 'decay-spectrum-1', 'decay-1')
    """

    key = "structure"

    data: Structure
    plot: StructureFigures

    def summary(self) -> str:
        """Summarise where each number of the structure comes from, the main caveat, and what to do next."""
        about, flag = next(self._flags(), ("", None))
        caveat = f"Main caveat: {f'{about}: ' if about else ''}{flag.message}." if flag else "No caveat."
        sources = [source.sentence for source in self.data.sources]
        add = f"Next: film a swim trial, add it to {self.session.folder / 'session.toml'}"
        return "\n".join([f"{self.session.name}: {self.name}.", *sources, caveat, add])

    def details(self) -> list[str]:
        """List the numbers of the structure, and every flag: of the experiments, each once, then of the whole."""
        return [*(source.sentence for source in self.data.sources), *flag_lines(self._flags())]

    @property
    def in_brief(self) -> str:
        """Return hinges and crank arm, and which of them are assumed."""
        return ", ".join(
            f"{in_words(each.quantity)} {each.value:.3g} {each.unit}{' (assumed)' if each.assumed else ''}"
            for each in self.data.sources
        )

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {"structure": self._structure, "flags": lambda: flag_frame(self._flags())}

    def _flags(self) -> Iterator[tuple[str, Flag]]:
        yield from (("", flag) for flag in self.data.flags)
        yield from ((decay.name, flag) for decay in self.data.decays for flag in decay.flags)
        crank = self.data.crank
        yield from ((run.name, flag) for run in (crank.trials if crank else ()) for flag in run.flags)

    def _structure(self) -> pd.DataFrame:
        rows = [
            {"quantity": each.quantity, "value": each.value, "se": each.se, "unit": each.unit, "assumed": each.assumed}
            for each in self.data.sources
        ]
        return pd.DataFrame(rows).set_index("quantity")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class FitResult(Result):
    """A calibrated twin and every swim trial; what `calibration.json` holds, read from there.

    Speeds in m/s, forward positive. Tables of `to_frame`: "trials" (a row a swim trial), "coefficients" (value with its
    90 % interval at the mode, of the published search and of the posterior where they exist), "components" (standard
    deviation of each variance component), "forecasts" (a row a trial and model, simple baselines among them),
    "speed_errors" (mean absolute error by model and role, m/s), "exponents" (of the speed
    over the frequency, with 90 % intervals over trials) and "flags". Frames have the keys of the file as
    columns.

    Attributes:
        mjcf_file: `results/calibrated.xml`.
        published: the published search, for comparison; None where it was not run.
        posterior: the current posterior of this fit, without its draws; None where there is none.
        diagnosed: the current diagnosis of this fit; None where there is none.
        damaged: the file of posterior or diagnosis that cannot be read, where there is one.
        standing: which results of it there are, and by which commands the others are made.
        read, read_trial: simulate every trial, or one, again.

    Example:
        >>> found = calib.fit("pool", "quick", progress=False)
        >>> print(found.summary())
        synthetic: fit of quick effort, ...
        >>> found.trials["fast"].role, found.coefficients.blunt_drag > 0
        ('holdout', True)
        >>> list(found.to_frame("coefficients").columns[:3])
        ['value', 'fit_q05', 'fit_q95']
        >>> found.plot.speeds().figure.savefig("speeds.png")
        >>> found.motion("fast").twin.dims
        ('time', 'space', 'keypoint')
    """

    key = "calibration"

    mjcf_file: Path
    data: CalibrationResult
    published: PublishedResult | None
    plot: FitFigures
    posterior: PosteriorSummary | None
    diagnosed: DiagnosisResult | None
    standing: str
    damaged: Mapping[str, str] = field(default_factory=dict)
    read: Callable[[], Calibration]
    read_trial: Callable[[str], CalibratedTrial]

    def motion(self, trial: str) -> xr.Dataset:
        """Compare a swim trial as measured with the twin, which is simulated again.

        Returns:
            Dimensions `time` (s), `space` (x, y) and `keypoint`. Variables `measured` and `twin` (time, space,
            keypoint), m, in the head frame (published normaliser), aligned in the first frame that may be compared;
            `weight` (time, keypoint), 0 where a sample does not count; `compared` and `scored` (time), the frames of
            the fit and of the marker error.

        Raises:
            InputError: no such trial, or the fit was replaced.
        """
        if trial not in self.trials:
            raise InputError([Fault("motion", "", "no such trial", repr(trial), "a swim trial", tuple(self.trials))])
        one = self.read_trial(trial)
        measured, places = one.measured, ("time", "space", "keypoint")
        first = measured.aligned
        twin = one.simulated.position_m + (measured.head.path_m[first] - one.simulated.path_m[first])
        return xr.Dataset(
            {
                "measured": (places, np.swapaxes(measured.head.position_m, 1, 2), {"units": "m"}),
                "twin": (places, np.swapaxes(twin, 1, 2), {"units": "m"}),
                "weight": measured.tracks.weight,
                "compared": (("time",), measured.kept),
                "scored": (("time",), measured.scored),
            },
            {"time": ("time", measured.time_s, TIME), "space": ["x", "y"]},
        )

    @cached_property
    def answers(self) -> Answers:
        """The answers of the summary and of the report's first screen, from all current results of this fit."""
        return answers_of(self.data, self.posterior, self.diagnosed, self.session.in_shell, self.damaged)

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
        """Flags of the fit as a whole; those of a trial are in `trials`."""
        return self.data.standing_flags

    @property
    def forecasts(self) -> SessionForecast:
        """Forecasts of every trial by the model and by simple baselines."""
        return self.data.forecasts

    @property
    def verdict(self) -> str:
        """The verdict on the fit in one word.

        off (the twin misses its own fit trials by more than 10 %), unchecked (no held-out trial), worse_than_baseline
        (in forecasts), doubtful (caveats), good_with_effects (no caveat but what the effects explain that the diagnosis
        names) or good.
        """
        if misses(self.forecasts):
            return "off"
        if not self.forecasts.held_out:
            return "unchecked"
        if not holds_against_rules(self.forecasts):
            return "worse_than_baseline"
        if self.answers.caveats:
            return "doubtful"
        return "good_with_effects" if self.answers.explained else "good"

    def summary(self) -> str:
        """Summarise how far off the exported twin is, how sure, what is missing, and what to do next.

        The summary has at most eight lines, and covers all current results of this fit: its posterior and its
        diagnosis, too.
        """
        answers = self.answers
        more = f" ({len(answers.caveats) - 1} more: -v)" if len(answers.caveats) > 1 else ""
        lines = [f"{self.session.name}: {self.standing}.", f"How far off: {' '.join(answers.how_far_off.sentences)}"]
        lines.append(f"How sure: {' '.join(answers.how_sure.sentences)}")
        if (found := answers.missing) is None:
            lines.append(f"What is missing: {answers.not_searched}")
        else:
            lines += [
                f"Where: {found.where}",
                f"Which: {found.which} {found.size}".rstrip(),
                f"How far it shrinks: {found.how_far}",
            ]
        lines += [
            f"Main caveat: {answers.caveats[0]}{more}" if answers.caveats else answers.no_caveat,
            f"Verdict of the fit: {self._why(len(answers.caveats))}. Next: {answers.next_step}",
        ]
        return "\n".join(lines)

    def details(self) -> list[str]:
        """List the trials, then structure, coefficients, means, and every flag once, a line each."""
        found = self.data
        wide = max(12, *map(len, found.trials))
        lines = [f"{'trial':{wide}} {'role':8} {'Hz':>6} {'marker mm':>10} {'speed mm/s':>10} {'twin':>8} {'EBT':>8}"]
        for name, trial in found.trials.items():
            errors = f"{shown(trial.frequency_hz, 3):>6} {shown(trial.marker_error_mm, 1):>10}"
            speeds = f"{in_mm(trial.speed_measured):>10} {in_mm(trial.speed_twin):>8} {in_mm(trial.speed_ebt):>8}"
            lines.append(f"{name:{wide}} {trial.role:8} {errors} {speeds}")
        lines += [source.sentence for source in found.structure.values()]
        coefficients = found.coefficients._asdict().items()
        lines.append("coefficients " + ", ".join(f"{name} {value:.3g}" for name, value in coefficients))
        lines += interval_lines(found.posterior)
        for role, label in (("fit", "fit trials"), ("holdout", "held out")):
            if (summary := found.summary[role]) is not None:
                over = f", over {summary.compared} of {summary.trials}" if summary.compared < summary.trials else ""
                lines.append(
                    f"{label}: markers {shown(summary.marker_error_mm, 1)} mm, mean speed error{over} "
                    f"{in_mm(summary.speed_mae_twin)} mm/s (EBT {in_mm(summary.speed_mae_ebt)})"
                )
        lines += [f"! {caveat}" for caveat in self.answers.caveats]
        lines += [f"explained by the named effects: {caveat}" for caveat in self.answers.explained]
        return [*lines, *(f"flag: {line.removeprefix('! ')}" for line in flag_lines(self._flags_of_tracks()))]

    @property
    def in_brief(self) -> str:
        """Return the mean errors over the held-out trials, or over the fit trials where none is held out."""
        found, role = self.data.summary["holdout"], "held-out trial"
        if found is None:
            found, role = self.data.summary["fit"], "fit trial"
        assert found is not None
        errors = f"markers {shown(found.marker_error_mm, 1)} mm, speed {in_mm(found.speed_mae_twin)} mm/s"
        return f"{errors} off over {counted(found.trials, role)}; {in_words(self.verdict)}"

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {
            "trials": self._trials,
            "coefficients": self._coefficients,
            "components": lambda: pd.DataFrame({"sd": dict(self.data.fit.components)}).rename_axis("component"),
            "forecasts": lambda: forecast_frame(self.forecasts),
            "speed_errors": self._speed_errors,
            "exponents": self._exponents,
            "flags": lambda: flag_frame(self._all_flags()),
        }

    def _make_notebook_table(self) -> pd.DataFrame:
        columns = ["role", "frequency_hz", "marker_error_mm", "speed_measured", "speed_twin", "speed_ebt", "flags"]
        return self.to_frame()[columns]

    def _trials(self) -> pd.DataFrame:
        rows = {}
        for name, trial in self.trials.items():
            row = {key: value for key, value in asdict(trial).items() if key not in _HIDDEN}
            line = self.forecasts.trials[name].forecasts.get("line")
            rows[name] = row | {"speed_line": nan if line is None else line.speed, "flags": len(trial.flags)}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("trial")

    def _coefficients(self) -> pd.DataFrame:
        fit, published = self.data.fit, self.published
        low, high = (dict(zip(self.coefficients._fields, ends, strict=True)) for ends in np.transpose(fit.interval))
        columns = {"value": self.coefficients._asdict(), "fit_q05": low, "fit_q95": high}
        if published is not None:
            columns["published"] = published.fit.coefficients._asdict()
        frame = pd.DataFrame(columns).rename_axis("coefficient")
        if not self.data.posterior:
            return frame
        posterior = {name: marginal._asdict() for name, marginal in self.data.posterior.items()}
        return frame.join(pd.DataFrame.from_dict(posterior, orient="index"))

    def _speed_errors(self) -> pd.DataFrame:
        frame = forecast_frame(self.forecasts)
        frame = frame.assign(error=(frame.speed - frame.speed_measured).abs())
        return frame.pivot_table("error", "model", "role", sort=False).rename_axis(None, axis=1)

    def _exponents(self) -> pd.DataFrame:
        law = self.data.speed_law
        found = {} if law is None else law.exponents
        rows = {name: (each.value, *(each.interval or (nan, nan))) for name, each in found.items()}
        return pd.DataFrame.from_dict(rows, orient="index", columns=["exponent", "q05", "q95"]).rename_axis("speed")

    def _all_flags(self) -> Iterator[tuple[str, Flag]]:
        yield from (("", flag) for flag in self.flags)
        for name, experiment in self.data.experiments.items():
            yield from ((name, flag) for flag in experiment.flags)
        for name, trial in self.trials.items():
            yield from ((name, flag) for flag in trial.flags)

    def _why(self, caveats: int) -> str:
        compared = self.answers.how_far_off.compared
        close = "significantly" in compared  # it says that it is not
        inside, count = self.answers.how_sure.in_band
        bands = f"; {share_of(inside, count, 'held-out speed')} in the band predicted" if 2 * inside < count else ""
        surely = ", though not significantly" if close else ""
        better = f"better than the best simple rule{surely}"
        if " worse" in compared:
            better = "not better than the best simple rule, within the errors"
        if "as good as" in compared:
            better = "as good as the best simple rule"
        why = {
            "off": "the twin does not describe this robot: check the robot's description, the scale and the trials",
            "good": f"{better}, and without a caveat",
            "good_with_effects": f"{better}, and without a caveat but what the named effects explain{bands}",
            "doubtful": f"{better}, but read {counted(caveats, 'caveat')} first (-v)",
            "unchecked": "no held-out trial is left"
            if self.data.left_out
            else 'no trial is held out: give one role = "holdout"',
            "worse_than_baseline": f"a simple rule forecasts speeds better{surely}: use that for speeds",
        }
        return f"{in_words(self.verdict)}: {why[self.verdict]}"

    def _flags_of_tracks(self) -> Iterator[tuple[str, Flag]]:
        """Yield the flags of experiments and trials, and those of the whole fit that are no caveat by themselves."""
        told = " ".join((*self.answers.caveats, *self.answers.explained)).lower()
        return ((name, flag) for name, flag in self._all_flags() if name or flag.message.lower() not in told)
