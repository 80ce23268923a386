"""Common parts of every result of `calib`: tables by name, figures, a summary and the files made.

`Result` is the base class of all results, with its view in a notebook. `Figures` are the figures of the report as
methods of a result: ``fit.plot.envelope("f1_00")``.
"""

from __future__ import annotations

import html
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import pandas as pd

from reports.page import Plot
from swimcal.errors import Fault, InputError, did_you_mean
from swimcal.flags import Flag
from swimcal.session import Session
from swimcal.stage import Stage

if TYPE_CHECKING:
    from fitting.session_forecast import SessionForecast

TIME = {"long_name": "time (s)"}
"""Attributes of times in datasets for users: with `units`, a reader of the file would take them for dates."""
LISTED = 6
"""Flags of one kind in one trial that have a line each; the others are counted."""
_MOTIONS = ("envelope", "path", "lateral")
"""Figures of a trial that need no other trial."""


def check_current(stage: Stage) -> None:
    """Raise an `InputError` where the files are no longer those that a result was read from."""
    if not stage.is_current:
        step = "Ask for the result again, then for what you want of it."
        raise InputError([Fault(str(stage.file), "", "the result has been replaced", "", "", next_step=step)])


class Figures:
    """Some figures of the report; each is drawn on first use, and shows itself in a notebook.

    `names` lists them. A figure has a matplotlib `figure` that may be changed and saved, and a `caption`.
    """

    def __init__(self, stage: Stage, draw: Callable[[], Mapping[str, Plot]]) -> None:
        self._stage, self._draw = stage, draw

    @cached_property
    def _plots(self) -> dict[str, Plot]:
        check_current(self._stage)
        return dict(self._draw())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the available figures; one that begins with the name of a trial is called with that trial."""
        return tuple(self._plots)

    def __getitem__(self, name: str) -> Plot:
        """Return the figure of this name; an `InputError` lists the choices where there is none."""
        if name not in self._plots:
            step = "It is drawn where there is something to show, as flags of a trial that has some."
            raise InputError(
                [Fault("figure", "", "no such figure", repr(name), "one of this result", self.names, step)]
            )
        return self._plots[name]


def _figure(name: str, about: str) -> Callable[[Figures], Plot]:
    def fetch(self: Figures) -> Plot:
        return self[name]

    fetch.__doc__ = about
    return fetch


def _trial_figure(name: str, about: str) -> Callable[[Figures, str], Plot]:
    def fetch(self: Figures, trial: str) -> Plot:
        return self[f"{trial}-{name}"]

    fetch.__doc__ = about
    return fetch


def _numbered_figure(name: str, about: str) -> Callable[..., Plot]:
    def fetch(self: Figures, number: int = 1) -> Plot:
        return self[f"{name}-{number}"]

    fetch.__doc__ = about
    return fetch


class StructureFigures(Figures):
    """Figures of the robot and of its dry experiments; a fit has them, too."""

    robot = _figure("robot", "The robot with its markers, hinges and tendons.")
    decay = _numbered_figure("decay", "A free decay, measured and fitted.")
    decay_spectrum = _numbered_figure("decay-spectrum", "The spectrum of a free decay.")
    crank = _figure("crank-surface", "The error surface of the crank grid search.")
    motor_speed = _figure("motor-speed", "How fast the motor turned in logged trials.")
    motor_turn = _figure("motor-turn", "How unevenly the motor turned within a turn.")


class FitFigures(StructureFigures):
    """Figures of a fit; those of a trial are drawn without measuring any other."""

    def __init__(
        self,
        stage: Stage,
        draw: Callable[[], Mapping[str, Plot]],
        draw_trial: Callable[[str], Mapping[str, Plot]],
        trials: tuple[str, ...],
    ) -> None:
        super().__init__(stage, draw)
        self._draw_trial, self._trials, self._of_trials = draw_trial, trials, dict[str, Plot]()

    def __getitem__(self, name: str) -> Plot:
        """Return the figure of this name; an `InputError` lists the choices where there is none."""
        trial, _, what = name.rpartition("-")
        if what in _MOTIONS and trial not in self._trials:
            hint = did_you_mean(trial, self._trials)
            raise InputError([Fault("figure", "", "no such trial", repr(trial), "one of these", self._trials, hint)])
        if what in _MOTIONS and "_plots" not in vars(self):
            if name not in self._of_trials:
                check_current(self._stage)
                self._of_trials.update(self._draw_trial(trial))
            if name in self._of_trials:
                return self._of_trials[name]
        return super().__getitem__(name)

    envelope = _trial_figure("envelope", "The tail's envelope in the frame of the head, measured and simulated.")
    path = _trial_figure("path", "The distance swum in a trial over time, measured and simulated.")
    lateral = _trial_figure(
        "lateral", "The lateral motion of tail markers in a trial over time, measured and simulated."
    )
    flagged = _trial_figure("flags", "The samples of a trial that are flagged, over time.")
    speeds = _figure("sweep", "Speed over frequency: measured, of the twin, by elongated body theory and simple rules.")
    residual_markers = _figure("residual-markers", "Distance between measured and simulated markers, by marker.")
    forecasts = _figure("forecast-speeds", "Speeds of held-out trials, measured and forecast.")
    hull_roll = _figure("hull-roll", "The neck's sideways sway over frequency: measured, and with and without a roll.")
    coefficients = _figure("coefficient-values", "The coefficients with their intervals, and where every start ended.")


class PosteriorFigures(Figures):
    """Figures of a posterior."""

    corner = _figure("posterior-corner", "The joint posterior of every pair of coefficients.")
    speeds = _figure("sweep", "Speed over frequency with its predictive band.")
    trials = _figure("posterior-trials", "The speed of every trial with its predictive interval.")
    further_trial = _figure("posterior-further-plot", "Expected information of one more trial, over its frequency.")
    ranks = _figure("posterior-ranks", "Rank histograms of the chains.")


class GapFigures(Figures):
    """Figures of a diagnosis."""

    fish = _figure("gap-fish", "Where the gap comes from and where it shows, drawn on the robot.")
    where = _figure("gap-shares", "Shares of the gap by stage, trial, marker, axis and band.")
    effects = _figure("gap-effects", "The probability of every effect.")
    held_out = _figure("gap-held-out", "Marker and speed errors of held-out trials without and with the effects.")
    all_effects = _figure("gap-everything", "The same with all effects at once.")
    forces = _figure("gap-forces", "The forces and torques that the plain twin lacks, over a turn of the crank.")


class Tables:
    """An object that has tables and a summary; in a notebook it shows both."""

    def to_frame(self, table: str = "") -> pd.DataFrame:
        """Return one of its tables.

        Args:
            table: name of the table, as the class lists them; default: the first.

        Raises:
            InputError: no such table.
        """
        tables = self._tables()
        if table and table not in tables:
            expected = "a table of this result"
            raise InputError([Fault("to_frame", "", "no such table", repr(table), expected, tuple(tables))])
        return tables[table or next(iter(tables))]()

    def summary(self) -> str:
        """Summarise what was found, how far to trust it, and what to do next, in a few lines."""
        raise NotImplementedError

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        raise NotImplementedError

    def _make_notebook_table(self) -> pd.DataFrame:
        """Return the table that a notebook shows."""
        return self.to_frame()

    def _repr_html_(self) -> str:
        lines = "<br>".join(html.escape(line) for line in self.summary().splitlines())
        return (
            f"<p>{lines}</p>{self._make_notebook_table().to_html(float_format=lambda value: f'{value:.4g}', na_rep='')}"
        )


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Result(Tables):
    """A result that is stored in a file: `data` is all that the file holds, `plot` has its figures.

    Attributes:
        name: what it is, in words.
        notes: sentences from its making, such as what was left out and what was kept aside.
        made: files that were made anew.
    """

    key: ClassVar[str]
    """Key of its content in the JSON that a command prints."""

    session: Session
    name: str
    file: Path
    notes: tuple[str, ...] = ()
    made: tuple[Path, ...] = ()

    def details(self) -> list[str]:
        """List every number and every flag, a line each."""
        raise NotImplementedError

    @property
    def in_brief(self) -> str:
        """Return the two or three numbers that matter, with their units."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.session.name}: {self.in_brief}>"


@dataclass(frozen=True)
class Export:
    """Files that a function wrote from existing results, and what they are.

    Attributes:
        files: the files in the order in which they were made; an index comes last.
        notes: what they show, of which effort, and what was left out and how to renew it.
        failures: why some of several sessions failed, by name.

    Example:
        >>> made = calib.report("pool")
        >>> made.file, made.notes
        (PosixPath('pool/results/report.html'), ('synthetic: fit of quick effort, posterior of quick effort, ...',))
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()
    failures: Mapping[str, str] = field(default_factory=dict)

    @property
    def file(self) -> Path:
        """The last of the files."""
        return self.files[-1]


def forecast_frame(forecasts: SessionForecast) -> pd.DataFrame:
    """Make a table of forecasts: speeds and their bands (m/s), distances (mm), and the share inside their bands.

    It has a row for each trial and model.
    """
    rows = {}
    for name, trial in forecasts.trials.items():
        for model, forecast in trial.forecasts.items():
            low, high = forecast.speed_ci90 or (nan, nan)
            row = {key: value for key, value in asdict(forecast).items() if key != "speed_ci90"}
            of_trial = {"role": trial.role, "speed_measured": trial.speed_measured}
            rows[name, model] = of_trial | row | {"speed_q05": low, "speed_q95": high}
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis(["trial", "model"])


def flag_frame(flags: Iterable[tuple[str, Flag]]) -> pd.DataFrame:
    """Make a table of flags: trial (empty for the whole), kind, markers, frames, message."""
    rows = [
        {
            "trial": trial,
            "kind": flag.kind,
            "markers": ", ".join(flag.markers),
            "first_frame": flag.frames[0] if flag.frames else None,
            "last_frame": flag.frames[1] if flag.frames else None,
            "message": flag.message,
        }
        for trial, flag in flags
    ]
    columns = ["trial", "kind", "markers", "first_frame", "last_frame", "message"]
    return pd.DataFrame(rows, columns=columns).astype({"first_frame": "Int64", "last_frame": "Int64"})


def flag_lines(flags: Iterable[tuple[str, Flag]]) -> list[str]:
    """Format a line for each flag with the names of its trials; flags of the whole come last.

    Of many flags of one kind in one trial the first few have a line, the others are counted in one.
    """
    trials: dict[str, list[str]] = {}
    listed: Counter[tuple[str, str]] = Counter()
    whole = []
    for name, flag in flags:
        if not name:
            whole.append(f"! {flag.message}")
            continue
        listed[name, flag.kind] += 1
        if listed[name, flag.kind] <= LISTED:
            trials.setdefault(f"{_place(flag)}{flag.message}", []).append(name)
    lines = [f"! {', '.join(dict.fromkeys(names))}: {flag}" for flag, names in trials.items()]
    more = [
        f"! {name}: {count - LISTED} more flags `{kind}`, in its table of flags"
        for (name, kind), count in listed.items()
        if count > LISTED
    ]
    return [*lines, *more, *whole]


def _place(flag: Flag) -> str:
    """Say which frames a flag is about, and its kind; nothing where it is about the whole trial."""
    if flag.frames is None:
        return ""
    first, last = flag.frames
    return f"frame {first}, {flag.kind}: " if first == last else f"frames {first} to {last}, {flag.kind}: "
