"""The index of several sessions."""

from pathlib import Path

from fitting import calibration_payload
from reports import IndexEntry, write_index
from session.results import plain_json
from tests.reports.page import Page
from tests.reports.sample import made_calibration

PAYLOAD = plain_json(calibration_payload(made_calibration()))


def test_it_lists_key_numbers_and_links_to_each_report(tmp_path: Path) -> None:
    report = tmp_path / "my pool #1" / "results" / "report.html"
    write_index(tmp_path / "index.html", [IndexEntry.from_calibration("my pool #1", report, PAYLOAD)])
    page = Page((tmp_path / "index.html").read_text())
    summary = PAYLOAD["summary"]["holdout"]

    assert "my%20pool%20%231/results/report.html" in page.targets
    assert "my pool #1 2 + 1 0.50 to 1.30" in page.text
    assert f"{summary['marker_error_mm']:.1f} {summary['speed_mae_twin'] * 1000:.1f}" in page.text
    assert "an estimate sits at the bound of its range" in page.text


def test_what_a_session_lacks_is_a_dash(tmp_path: Path) -> None:
    payload = plain_json(calibration_payload(made_calibration(("medium",), flagged=False)))
    payload["trials"]["medium"]["frequency_hz"] = None
    payload["flags"] = []
    entry = IndexEntry.from_calibration("a <b>", tmp_path / "report.html", payload)
    write_index(tmp_path / "index.html", [entry])
    text = Page((tmp_path / "index.html").read_text()).text

    assert f"a <b> 1 + 0 – {entry.marker_error_mm[0]:.1f} – – – –" in text


def test_an_empty_index_says_so(tmp_path: Path) -> None:
    write_index(tmp_path / "index.html", [])

    assert "No session is listed here yet." in Page((tmp_path / "index.html").read_text()).text
