"""Several sessions compared: a page that sorts and filters, and the same numbers as CSV."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from urllib.parse import quote

import pandas as pd
from markupsafe import Markup

from diagnosis.result import DiagnosisResult
from fitting import CalibrationResult
from fitting.ebt import EBT_RATIO_ONLY
from fitting.model.session_forecast import GIVEN
from reports.forecast_words import MODELS
from reports.numbers import MISSING, counted, in_mm, in_words, of_its_size, shown, spanned
from reports.page import render_page
from session.results import write_whole
from swimmer import FluidCoefficients

_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")  # in the name of a session
_WIDE, _HIGH = 84, 26  # px of a sparkline


@dataclass(frozen=True, eq=False)
class IndexEntry:
    """One session of an index: its page, and its fit with effort and verdict; what it lacks stays empty, and why."""

    name: str
    report: Path | None = None
    fit: CalibrationResult | None = None
    effort: str = ""
    verdict: str = ""
    gap: DiagnosisResult | None = None
    error: str = ""

    @property
    def date(self) -> str:
        """The date in its name, if there is one."""
        found = _DATE.search(self.name)
        return found[0] if found else ""


def write_index(path: Path, entries: Sequence[IndexEntry]) -> tuple[Path, Path]:
    """Writes the page, with links relative to it, and a CSV of the same name; whole or not at all.

    Raises:
        ResultsNotWritable: a file cannot be written.
    """
    rows = [_row(entry) for entry in entries]
    table = pd.DataFrame(rows, columns=list(_row(IndexEntry(""))))
    write_whole(path.with_suffix(".csv"), table.to_csv(index=False))
    failed = sum(bool(entry.error) for entry in entries)
    page = render_page(
        "index.html.j2",
        title="Calibrated sessions",
        summary=f"{counted(len(entries), 'session')}{f', {failed} failed' if failed else ''}",
        coefficients=[in_words(name) for name in FluidCoefficients._fields],
        rows=[_shown(entry, row, path.parent) for entry, row in zip(entries, rows, strict=True)],
        drift=[_drift(entries, i) for i in range(len(FluidCoefficients._fields))],
        csv=path.with_suffix(".csv").name,
    )
    write_whole(path, page)
    return path, path.with_suffix(".csv")


def _row(entry: IndexEntry) -> dict[str, object]:
    """The numbers of a session in SI units and millimetres, by column of the CSV; nan where there is none."""
    fit, gap = entry.fit, None if entry.gap is None else entry.gap.gap
    trials = list(fit.trials.values()) if fit else []
    held = fit.summary["holdout"] if fit else None
    best = fit.forecasts.best_baseline if fit else ""
    row: dict[str, object] = {
        "session": entry.name,
        "date": entry.date,
        "error": entry.error,
        "effort": entry.effort,
        "verdict": entry.verdict,
        "fit_trials": sum(trial.role == "fit" for trial in trials),
        "held_out_trials": sum(trial.role != "fit" for trial in trials),
        "slowest_hz": min((trial.frequency_hz for trial in trials), default=nan),
        "fastest_hz": max((trial.frequency_hz for trial in trials), default=nan),
        "speed_error_m_s": fit.forecasts.mean(GIVEN, "speed_error") if fit else nan,
        "baseline": best or "",
        "baseline_error_m_s": fit.forecasts.mean(best, "speed_error") if fit and best else nan,
        "twin_speed_error_m_s": held.speed_mae_twin if held else nan,
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
        "flags": " ".join(dict.fromkeys(flag.kind for flag in fit.flags if flag.kind != EBT_RATIO_ONLY)) if fit else "",
    }


def _shown(entry: IndexEntry, row: Mapping[str, object], folder: Path) -> dict[str, object]:
    """What the page shows of a row; a cell is its text and the value that it is sorted by."""

    def number(name: str) -> float:
        value = row[name]
        return value if isinstance(value, float) else nan

    def cell(text: str, value: object = None) -> tuple[str, object]:
        return text, text if value is None else value if value == value else ""

    best = str(row["baseline"])
    baseline = f" ({MODELS[best]} {in_mm(number('baseline_error_m_s'))})" if best else ""
    coefficients = [
        cell(
            f"{of_its_size(number(name))} ({spanned(number(f'{name}_q05'), number(f'{name}_q95'), of_its_size)})"
            if isfinite(number(name))
            else MISSING,
            number(name),
        )
        for name in FluidCoefficients._fields
    ]
    effects = str(row["effects"]).replace("|", " or ").replace("_", " ")
    before, after = number("gap_before_mm"), number("gap_after_mm")
    cells = [
        cell(in_words(entry.verdict) or MISSING),
        cell(f"{row['fit_trials']} + {row['held_out_trials']}"),
        cell(spanned(number("slowest_hz"), number("fastest_hz"), lambda hz: shown(hz, 2)), number("slowest_hz")),
        cell(f"{in_mm(number('speed_error_m_s'))}{baseline}", number("speed_error_m_s")),
        *coefficients,
        cell(f"{shown(before)} → {shown(after)}" if isfinite(after) else shown(before), before),
        cell(f"{in_words(str(row['diagnosis']))}{': ' if effects else ''}{effects}" or MISSING),
        cell(in_words(str(row["flags"])) or MISSING),
    ]
    return {
        "name": entry.name,
        "href": "" if entry.report is None else _href(entry.report, folder),
        "error": entry.error,
        "speeds": _speeds(entry),
        "cells": cells,
    }


def _href(report: Path, folder: Path) -> str:
    """A relative link that works after both have moved together; absolute where they share no root."""
    try:
        return quote(Path(os.path.relpath(report, folder)).as_posix())
    except ValueError:  # another drive on Windows
        return report.absolute().as_uri()


def _speeds(entry: IndexEntry) -> Markup:
    if entry.fit is None:
        return Markup()
    trials = sorted(entry.fit.trials.values(), key=lambda trial: trial.frequency_hz)
    hz = [trial.frequency_hz for trial in trials]
    twin, measured = [trial.speed_twin for trial in trials], [trial.speed_measured for trial in trials]
    return _spark(list(zip(hz, measured, strict=True)), list(zip(hz, twin, strict=True)))


def _drift(entries: Sequence[IndexEntry], i: int) -> Markup:
    """A coefficient over the sessions, by date where their names have one."""
    fits = [entry.fit for entry in sorted(entries, key=lambda entry: entry.date) if entry.fit is not None]
    values = [(float(k), float(fit.coefficients[i])) for k, fit in enumerate(fits)]
    return _spark(values, values) if len(values) > 1 else Markup()


def _spark(dots: Sequence[tuple[float, float]], line: Sequence[tuple[float, float]]) -> Markup:
    known = [point for point in (*dots, *line) if isfinite(point[1])]
    if not known:
        return Markup()
    (left, low), (right, high) = (tuple(map(end, zip(*known, strict=True))) for end in (min, max))

    def place(point: tuple[float, float]) -> tuple[float, float]:
        x, y = (point[0] - left) / ((right - left) or 1.0), (point[1] - low) / ((high - low) or 1.0)
        return 3 + x * (_WIDE - 6), _HIGH - 3 - y * (_HIGH - 6)

    path = " ".join("{:.1f},{:.1f}".format(*place(point)) for point in line if isfinite(point[1]))
    circle = '<circle cx="{:.1f}" cy="{:.1f}" r="2"/>'
    circles = "".join(circle.format(*place(point)) for point in dots if isfinite(point[1]))
    return Markup(  # numbers alone
        f'<svg class="spark" width="{_WIDE}" height="{_HIGH}" role="img" aria-label="{shown(low, 2)} to '
        f'{shown(high, 2)}"><polyline points="{path}"/>{circles}</svg>'
    )
