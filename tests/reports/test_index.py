"""The index of several sessions."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

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
    assert "named: tendon slack + wave drag none at bound" in page.text


def test_sessions_are_compared_by_date_and_the_csv_has_the_same_numbers(tmp_path: Path) -> None:
    entries = [entry("pool-2026-06-01", tmp_path), entry("pool-2026-05-12", tmp_path), IndexEntry("x", error="no fit")]
    page, table = write_index(tmp_path / "index.html", entries)
    assert page.read_text().count('class="spark"') == 2 + 5  # speeds of two sessions, drift of five coefficients
    assert "3 sessions, 1 failed" in page.read_text()
    rows = pd.read_csv(table, index_col="session")
    assert list(rows.date.dropna()) == ["2026-06-01", "2026-05-12"]
    assert rows.error["x"] == "no fit"
    assert rows.effects.iloc[0] == "tendon_slack + wave_drag"


def test_caveats_are_counted_as_in_the_terminal_and_those_of_a_failed_session_are_not_known(tmp_path: Path) -> None:
    one = replace(entry("doubtful", tmp_path), caveats=("First.", "Second."))
    page, table = write_index(tmp_path / "index.html", [one, entry("sound", tmp_path), IndexEntry("x", error="no fit")])
    assert list(pd.read_csv(table).caveats.fillna(-1)) == [2, 0, -1]
    assert "caveats and flags" in Page(page.read_text()).text


def test_an_empty_index_says_so(tmp_path: Path) -> None:
    write_index(tmp_path / "index.html", [])
    assert "No session is listed here yet." in Page((tmp_path / "index.html").read_text()).text
