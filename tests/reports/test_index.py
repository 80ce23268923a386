"""The index of several sessions."""

import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from fitting.calibration_file import calibration_result
from reports.index import IndexEntry, write_index
from tests.reports.diagnoses import made_diagnosed
from tests.reports.page import Page
from tests.reports.sample import made_calibration

RESULT = calibration_result(made_calibration())


def entry(name: str, folder: Path, session: str = "") -> IndexEntry:
    """A session in a folder of its name, or in one of another name."""
    page = folder / name / "results" / "report.html"
    return IndexEntry(session or name, page, RESULT, "quick", "doubtful", made_diagnosed(), folder=folder / name)


def test_it_lists_key_numbers_and_links_to_each_report(tmp_path: Path) -> None:
    write_index(tmp_path / "index.html", [entry("my pool #1", tmp_path)])
    page = Page((tmp_path / "index.html").read_text())
    assert "my%20pool%20%231/results/report.html" in page.targets
    assert "my pool #1 doubtful 2 + 1 0.50 to 1.30" in page.text
    assert "named: tendon slack + wave drag at bound" in page.text


def test_sessions_are_compared_by_date_and_the_csv_has_the_same_numbers(tmp_path: Path) -> None:
    entries = [entry("pool-2026-06-01", tmp_path), entry("pool-2026-05-12", tmp_path), IndexEntry("x", error="no fit")]
    page, table = write_index(tmp_path / "index.html", entries)
    assert page.read_text().count('class="spark"') == 2 + 5  # speeds of two sessions, drift of five coefficients
    assert "3 sessions, 1 failed" in page.read_text()
    rows = pd.read_csv(table, index_col="session")
    assert list(rows.date.dropna()) == ["2026-06-01", "2026-05-12"]
    assert rows.error["x"] == "no fit"
    assert rows.effects.iloc[0] == "tendon_slack + wave_drag"


def test_sessions_of_one_name_are_told_apart_by_folder_and_date(tmp_path: Path) -> None:
    names = ["2026-05-12-pool", "tank"]
    page, table = write_index(tmp_path / "index.html", [entry(name, tmp_path, "synthetic") for name in names])
    text = Page(page.read_text()).text
    assert "2026-05-12-pool synthetic doubtful" in text
    assert "tank synthetic doubtful" in text
    rows = pd.read_csv(table, index_col="folder")
    assert list(rows.index) == names
    assert rows.date["2026-05-12-pool"] == "2026-05-12"


def test_elongated_body_theory_stands_beside_the_twin(tmp_path: Path) -> None:
    page, table = write_index(tmp_path / "index.html", [entry("pool", tmp_path)])
    held_out = RESULT.summary["holdout"]
    assert held_out is not None
    assert pd.read_csv(table).ebt_speed_error_m_s[0] == pytest.approx(held_out.speed_mae_ebt)
    assert "EBT mm/s" in Page(page.read_text()).text


def test_columns_in_which_no_session_has_a_value_are_left_out_of_page_and_csv(tmp_path: Path) -> None:
    page, table = write_index(tmp_path / "index.html", [IndexEntry("pool", fit=RESULT, effort="quick", verdict="good")])
    columns = set(pd.read_csv(table).columns)
    assert {"session", "folder", "twin_speed_error_m_s"} <= columns
    assert not {"date", "error", "diagnosis", "gap_before_mm"} & columns
    text = Page(page.read_text()).text
    assert "diagnosis" not in text.partition("Speed errors are")[0]


def test_speeds_of_all_sessions_are_drawn_on_one_scale(tmp_path: Path) -> None:
    def heights(entries: list[IndexEntry]) -> list[str]:
        page, _ = write_index(tmp_path / "index.html", entries)
        return re.findall(r'<td><svg class="spark".*?</svg>', page.read_text())

    trials = {name: replace(trial, speed_measured=2 * trial.speed_measured) for name, trial in RESULT.trials.items()}
    slow = entry("slow", tmp_path)
    fast = replace(slow, name="fast", fit=replace(RESULT, trials=trials))
    alone, beside = heights([slow])[0], heights([slow, fast])[0]
    assert alone != beside
    assert heights([slow, slow])[0] == alone


def test_an_empty_index_says_so(tmp_path: Path) -> None:
    write_index(tmp_path / "index.html", [])
    assert "No session is listed here yet." in Page((tmp_path / "index.html").read_text()).text
