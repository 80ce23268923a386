"""Several sessions at a time: a broken one stops no other, and the index and its CSV compare the rest."""

import shutil
from pathlib import Path

import pandas as pd
import pytest

import calib as front
from tests.calib.door import Front


@pytest.fixture
def broken(fresh_session: Path, tmp_path: Path) -> Path:
    folder = Path(shutil.copytree(fresh_session, tmp_path / "broken"))
    (folder / "session.toml").write_text("nonsense")
    return folder


def test_a_broken_session_stops_no_other(calib: Front, finished: Path, broken: Path) -> None:
    outcome = calib("run", finished, broken, "--effort", "quick", "--jobs", "2")
    assert outcome.code == 2
    assert "calib: broken: failed after" in outcome.err
    assert "done after" in outcome.err
    assert f"calib: broken failed: {broken / 'session.toml'}" in outcome.err
    page = (finished.parent / "index.html").read_text()
    assert 'href="' in page
    assert str(broken / "session.toml") in page


def test_the_csv_has_coefficients_with_intervals_and_the_reason_of_what_failed(finished: Path, broken: Path) -> None:
    made = front.report([finished, broken])
    assert list(made.failures) == ["broken"]
    fit = front.fit(finished, "quick", progress=False)
    table = pd.read_csv(made.file.with_suffix(".csv"), index_col="session")
    row = table.loc[fit.session.name]
    assert row.kutta_lift == pytest.approx(fit.coefficients.kutta_lift)
    assert row.kutta_lift_q05 <= row.kutta_lift <= row.kutta_lift_q95
    assert row.twin_marker_error_mm == pytest.approx(fit.data.summary["holdout"].marker_error_mm)  # type: ignore[union-attr]
    assert row.verdict == fit.verdict
    assert "session.toml" in table.loc["broken"].error


def test_of_a_single_session_there_is_no_index(finished: Path) -> None:
    made = front.report(finished)
    assert [file.name for file in made.files] == ["report.html"]
    assert not (finished.parent / "index.html").exists()
