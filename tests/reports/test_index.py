"""The index of several sessions."""

from pathlib import Path

from fitting.calibration_file import calibration_result
from reports import write_index
from tests.reports.page import Page
from tests.reports.sample import made_calibration

RESULT = calibration_result(made_calibration())


def test_it_lists_key_numbers_and_links_to_each_report(tmp_path: Path) -> None:
    report = tmp_path / "my pool #1" / "results" / "report.html"
    write_index(tmp_path / "index.html", [("my pool #1", report, RESULT)])
    page = Page((tmp_path / "index.html").read_text())
    summary = RESULT.summary["holdout"]
    assert summary is not None

    assert "my%20pool%20%231/results/report.html" in page.targets
    assert "my pool #1 2 + 1 0.50 to 1.30" in page.text
    assert f"{summary.marker_error_mm:.1f} {summary.speed_mae_twin * 1000:.1f}" in page.text
    assert "an estimate sits at the bound of its range" in page.text


def test_an_empty_index_says_so(tmp_path: Path) -> None:
    write_index(tmp_path / "index.html", [])

    assert "No session is listed here yet." in Page((tmp_path / "index.html").read_text()).text
