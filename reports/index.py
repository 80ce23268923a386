"""Index of several sessions: a page that sorts and filters (`write_index`), and the same numbers as CSV."""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd
from markupsafe import Markup

from diagnosis.result import DiagnosisResult
from fitting.calibration_file import CalibrationResult
from fitting.ebt import EBT_RATIO_ONLY
from fitting.session_forecast import GIVEN
from reports.page import render_page
from reports.words import MISSING, MODELS, counted, in_mm, in_words, of_its_size, shown, spanned
from swimcal.mjcf import FluidCoefficients
from swimcal.results import write_whole

_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")  # a date in the name of a session

# Sparklines
_WIDE = 64  # width of a sparkline, px
_HIGH = 26  # height of a sparkline, px
Points = Sequence[tuple[float, float]]
_Range = tuple[tuple[float, float], tuple[float, float]]

# Columns of the CSV
_TWIN = "twin_speed_error_m_s"
_BASELINE = "baseline_error_m_s"
_EBT = "ebt_speed_error_m_s"
_ALWAYS = ("session", "folder")


@dataclass(frozen=True, eq=False)
class IndexEntry:
    """One session of an index: its page, its fit with effort, verdict and caveats, its diagnosis.

    What it lacks stays empty, with the reason in `error`. The folder tells sessions of one name apart. `explained`
    counts the caveats that the named effects explain.
    """

    name: str
    report: Path | None = None
    fit: CalibrationResult | None = None
    effort: str = ""
    verdict: str = ""
    gap: DiagnosisResult | None = None
    error: str = ""
    folder: Path | None = None
    caveats: Sequence[str] = ()
    explained: int = 0

    @property
    def date(self) -> str:
        """The date in its name, or in that of its folder; empty if there is none."""
        found = _DATE.search(self.name) or _DATE.search("" if self.folder is None else self.folder.absolute().name)
        return found[0] if found else ""


@dataclass(frozen=True)
class _Cell:
    """A cell of the page: what a reader sees, a smaller line below it, and the value that the column is sorted by."""

    text: str
    below: str = ""
    value: object = ""


@dataclass(frozen=True)
class _Column:
    """A column of the page, with a cell for each session that has a fit, and the columns of the CSV that it shows."""

    title: str
    unit: str
    shows: tuple[str, ...]
    cell: Callable[[Mapping[str, Any]], _Cell]


def write_index(path: Path, entries: Sequence[IndexEntry]) -> tuple[Path, Path]:
    """Write the page, with links relative to it, and a CSV of the same name; whole or not at all.

    Both have the same columns; those in which no session has a value are left out.

    Raises:
        ResultsNotWritable: a file cannot be written.
    """
    rows = [_row(entry, path.parent) for entry in entries]
    table = pd.DataFrame(rows, columns=list(_row(IndexEntry(""), path.parent))).replace("", nan)
    table = table.loc[:, [name in _ALWAYS or bool(table[name].notna().any()) for name in table]]
    write_whole(path.with_suffix(".csv"), table.to_csv(index=False))
    columns = [column for column in _COLUMNS if set(column.shows) & set(table)]
    failed = sum(bool(entry.error) for entry in entries)
    speeds = _range([point for entry in entries for line in _speeds(entry) for point in line])
    page = render_page(
        "index.html.j2",
        title="Calibrated sessions",
        summary=f"{counted(len(entries), 'session')}{f', {failed} failed' if failed else ''}",
        columns=columns,
        rows=[
            _collect_shown(entry, row, columns, path.parent, speeds) for entry, row in zip(entries, rows, strict=True)
        ],
        drift=_drift(entries, columns),
        speeds="" if speeds is None else f"to {shown(1000 * speeds[1][1], 0)} mm/s",
        csv=path.with_suffix(".csv").name,
    )
    write_whole(path, page)
    return path, path.with_suffix(".csv")


def _row(entry: IndexEntry, folder: Path) -> dict[str, object]:
    """Collect the numbers of a session in SI units and millimetres, by column of the CSV; nan where there is none."""
    fit, gap = entry.fit, None if entry.gap is None else entry.gap.gap
    trials = list(fit.trials.values()) if fit else []
    held = fit.summary["holdout"] if fit else None
    best = fit.forecasts.best_baseline if fit else ""
    row: dict[str, object] = {
        "session": entry.name,
        "folder": "" if entry.folder is None else _relative(entry.folder, folder),
        "date": entry.date,
        "error": entry.error,
        "effort": entry.effort,
        "verdict": entry.verdict,
        "fit_trials": sum(trial.role == "fit" for trial in trials),
        "held_out_trials": sum(trial.role != "fit" for trial in trials),
        "slowest_hz": min((trial.frequency_hz for trial in trials), default=nan),
        "fastest_hz": max((trial.frequency_hz for trial in trials), default=nan),
        "twin_speed_error_m_s": held.speed_mae_twin if held else nan,
        "corrected_speed_error_m_s": fit.forecasts.mean(GIVEN, "speed_error") if fit else nan,
        "ebt_speed_error_m_s": held.speed_mae_ebt if held else nan,
        "baseline": best or "",
        "baseline_error_m_s": fit.forecasts.mean(best, "speed_error") if fit and best else nan,
        "twin_marker_error_mm": held.marker_error_mm if held else nan,
    }
    for i, name in enumerate(FluidCoefficients._fields):
        marginal = fit.posterior.get(name) if fit else None
        low, high = map(float, fit.fit.interval[i]) if fit else (nan, nan)
        row[name] = fit.coefficients[i] if fit else nan
        row[f"{name}_q05"], row[f"{name}_q95"] = (marginal.q05, marginal.q95) if marginal else (low, high)
    low, high = (gap.shrinkage_ci95 if gap else None) or (nan, nan)
    return row | {
        "diagnosis": entry.gap.verdict if entry.gap else "",
        "effects": " + ".join("|".join(group) for group in entry.gap.groups) if entry.gap else "",
        "gap_before_mm": gap.baseline_mm if gap else nan,
        "gap_after_mm": gap.with_effects_mm if gap else nan,
        "shrinkage": gap.shrinkage if gap else nan,
        "shrinkage_low": low,
        "shrinkage_high": high,
        "caveats": len(entry.caveats) if fit else "",
        "explained_caveats": entry.explained if fit else "",
        "flags": " ".join(dict.fromkeys(flag.kind for flag in fit.standing_flags if flag.kind != EBT_RATIO_ONLY))
        if fit
        else "",
    }


def _relative(path: Path, folder: Path) -> str:
    """Return the path as seen from the index; absolute where they share no root."""
    try:
        return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    except ValueError:  # another drive on Windows
        return path.absolute().as_posix()


def _number(row: Mapping[str, Any], name: str) -> float:
    value = row[name]
    return value if isinstance(value, float) else nan


def _cell(text: str, value: object = None, below: str = "") -> _Cell:
    return _Cell(text or MISSING, below, text if value is None else value if value == value else "")


def _speed_error(name: str, below: str = "") -> Callable[[Mapping[str, Any]], _Cell]:
    """Make the function of a cell with an error in mm/s, and under it the name of the model, where the row has it."""

    def cell(row: Mapping[str, Any]) -> _Cell:
        return _cell(in_mm(_number(row, name)), _number(row, name), MODELS.get(str(row.get(below)), ""))

    return cell


def _coefficient(name: str) -> Callable[[Mapping[str, Any]], _Cell]:
    def cell(row: Mapping[str, Any]) -> _Cell:
        value, low, high = (_number(row, f"{name}{end}") for end in ("", "_q05", "_q95"))
        if not isfinite(value):
            return _cell("")
        return _cell(of_its_size(value), value, spanned(low, high, of_its_size))

    return cell


def _frequencies(row: Mapping[str, Any]) -> _Cell:
    slowest, fastest = _number(row, "slowest_hz"), _number(row, "fastest_hz")
    return _cell(spanned(slowest, fastest, lambda hz: shown(hz, 2)), slowest)


def _gap(row: Mapping[str, Any]) -> _Cell:
    before, after = _number(row, "gap_before_mm"), _number(row, "gap_after_mm")
    return _cell(f"{shown(before)} → {shown(after)}" if isfinite(after) else shown(before), before)


def _diagnosis(row: Mapping[str, Any]) -> _Cell:
    effects = str(row["effects"]).replace("|", " or ").replace("_", " ")
    return _cell(f"{in_words(str(row['diagnosis']))}{': ' if effects else ''}{effects}")


def _caveats(row: Mapping[str, Any]) -> _Cell:
    explained = f" + {row['explained_caveats']} explained" if row["explained_caveats"] else ""
    return _cell(f"{row['caveats'] or 'none'}{explained}", row["caveats"], in_words(str(row["flags"])))


_COLUMNS = (
    _Column("verdict", "", ("verdict",), lambda row: _cell(in_words(row["verdict"]))),
    _Column(
        "trials",
        "fit + held out",
        ("fit_trials",),
        lambda row: _cell(f"{row['fit_trials']} + {row['held_out_trials']}"),
    ),
    _Column("frequency", "Hz", ("slowest_hz",), _frequencies),
    _Column("twin", "off by, mm/s", (_TWIN,), _speed_error(_TWIN)),
    _Column("corrected", "mm/s", ("corrected_speed_error_m_s",), _speed_error("corrected_speed_error_m_s")),
    _Column("EBT", "mm/s", (_EBT,), _speed_error(_EBT)),
    _Column("best baseline", "mm/s", (_BASELINE,), _speed_error(_BASELINE, "baseline")),
    *(_Column(in_words(name), "90 %", (name,), _coefficient(name)) for name in FluidCoefficients._fields),
    _Column("gap", "mm, with effects", ("gap_before_mm",), _gap),
    _Column("diagnosis", "", ("diagnosis",), _diagnosis),
    _Column("caveats", "and flags", ("caveats", "flags"), _caveats),
)


def _collect_shown(
    entry: IndexEntry, row: Mapping[str, Any], columns: Sequence[_Column], folder: Path, speeds: "_Range | None"
) -> dict[str, object]:
    """Collect what the page shows of a session."""
    name = str(row["folder"]) or entry.name
    parts = (entry.name if entry.name not in Path(name).parts else "", entry.date if entry.date not in name else "")
    return {
        "name": _Cell(name, ", ".join(filter(None, parts)), name),
        "href": "" if entry.report is None else _href(entry.report, folder),
        "error": entry.error,
        "speeds": Markup() if entry.fit is None else _spark(*_speeds(entry), speeds),
        "cells": [column.cell(row) for column in columns],
    }


def _href(report: Path, folder: Path) -> str:
    """Make a relative link that works after both have moved together; absolute where they share no root."""
    try:
        return quote(Path(os.path.relpath(report, folder)).as_posix())
    except ValueError:  # another drive on Windows
        return report.absolute().as_uri()


def _speeds(entry: IndexEntry) -> tuple[Points, Points]:
    """List measured speeds and those of the twin, m/s, over the frequency."""
    trials = [] if entry.fit is None else sorted(entry.fit.trials.values(), key=lambda trial: trial.frequency_hz)
    hz = [trial.frequency_hz for trial in trials]
    measured, twin = ([getattr(trial, name) for trial in trials] for name in ("speed_measured", "speed_twin"))
    return list(zip(hz, measured, strict=True)), list(zip(hz, twin, strict=True))


def _drift(entries: Sequence[IndexEntry], columns: Sequence[_Column]) -> list[Markup]:
    """Draw each coefficient over the sessions, by date where their names have one; nothing below other columns."""
    fits = [entry.fit for entry in sorted(entries, key=lambda entry: entry.date) if entry.fit is not None]
    found = []
    for column in columns:
        values = [
            (float(k), float(getattr(fit.coefficients, column.shows[0])))
            for k, fit in enumerate(fits)
            if len(fits) > 1 and column.shows[0] in FluidCoefficients._fields
        ]
        found.append(_spark(values, values, _range(values)))
    return found


def _range(points: Points) -> _Range | None:
    """Find the smallest and the largest of the known points, the second number from 0; None where nothing is known."""
    known = [point for point in points if isfinite(point[1])]
    if not known:
        return None
    (left, low), (right, high) = (tuple(map(end, zip(*known, strict=True))) for end in (min, max))
    return (left, min(low, 0.0)), (right, max(high, 0.0))


def _spark(dots: Points, line: Points, within: _Range | None) -> Markup:
    known = [point[1] for point in (*dots, *line) if isfinite(point[1])]
    if within is None or not known:
        return Markup()
    (left, low), (right, high) = within

    def place(point: tuple[float, float]) -> tuple[float, float]:
        x, y = (point[0] - left) / ((right - left) or 1.0), (point[1] - low) / ((high - low) or 1.0)
        return 3 + x * (_WIDE - 6), _HIGH - 3 - y * (_HIGH - 6)

    path = " ".join("{:.1f},{:.1f}".format(*place(point)) for point in line if isfinite(point[1]))
    circle = '<circle cx="{:.1f}" cy="{:.1f}" r="2"/>'
    circles = "".join(circle.format(*place(point)) for point in dots if isfinite(point[1]))
    return Markup(  # numbers alone
        f'<svg class="spark" width="{_WIDE}" height="{_HIGH}" role="img" aria-label="{shown(min(known), 2)} to '
        f'{shown(max(known), 2)}"><polyline points="{path}"/>{circles}</svg>'
    )
