"""The common part of all results: tables by name, the view in a notebook, notes, and the files made."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import pandas as pd

from session import Flag, InputError, Session
from session.errors import Fault

if TYPE_CHECKING:
    from fitting.model.session_forecast import SessionForecast


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


@dataclass(frozen=True, eq=False, kw_only=True)
class Result(Tables):
    """A result that is stored in a file: `data` is all that the file holds, `plot` has its figures.

    Attributes:
        name: what it is, in words.
        notes: sentences from its making, such as what was left out and what was kept aside.
        made: files that were made anew.
    """

    key: ClassVar[str]
    """Key of its content in the JSON that a command prints."""

    session: Session = field(repr=False)
    name: str
    file: Path
    notes: tuple[str, ...] = ()
    made: tuple[Path, ...] = ()

    def details(self) -> list[str]:
        """List every number and every flag, a line each."""
        raise NotImplementedError


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
    """Format a line for each flag with the names of its trials; flags of the whole come last."""
    trials: dict[str, list[str]] = {}
    whole = []
    for name, flag in flags:
        place = "" if flag.frames is None else f"frames {flag.frames[0]} to {flag.frames[1]}, {flag.kind}: "
        if name:
            trials.setdefault(f"{place}{flag.message}", []).append(name)
        else:
            whole.append(f"! {flag.message}")
    return [*(f"! {', '.join(dict.fromkeys(names))}: {flag}" for flag, names in trials.items()), *whole]
