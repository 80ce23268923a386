"""A fit by another search or objective than the usual one stands until another fit is asked for."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.pipeline import Options, Pipeline, open_session
from fitting.evidence import EVIDENCE
from fitting.objective import Swims
from tests.calib.door import Front, with_little_effort
from tests.calib.test_run import remade
from tests.cases import later

QUICK = ["--effort", "quick"]
CHOSEN = {
    "method": Options("quick", method="bo-nm", comparison="published"),
    "objective": Options("quick", method="gradient", comparison="shape"),
}
FOUND, USUAL = {"method": "bo-nm", "objective": "shape"}, {"method": "gradient", "objective": "published"}
NAMED = {
    "method": "Bayesian optimisation, then Nelder-Mead",
    "objective": "shape-only objective: distance relative to the nose",
}


def fit_of(folder: Path) -> dict[str, Any]:
    found = json.loads((folder / "results" / "calibration.json").read_text())
    return {"method": found["fit"]["method"], "objective": found["objective"]}


@pytest.fixture(scope="module", params=[*later("method"), "objective"])
def choice(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def fitted_otherwise(choice: str, fresh_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = Path(shutil.copytree(fresh_session, tmp_path_factory.mktemp(choice) / "pool"))
    with pytest.MonkeyPatch.context() as patch:
        with_little_effort(patch)
        Pipeline(open_session(folder), CHOSEN[choice]).fit()
    return folder


@pytest.fixture
def otherwise(fitted_otherwise: Path, tmp_path: Path) -> Path:
    """A session with such a fit, of the test's own."""
    return Path(shutil.copytree(fitted_otherwise, tmp_path / "pool"))


@pytest.mark.long
def test_the_command_line_asks_for_it(calib: Front, otherwise: Path, choice: str) -> None:
    """What it asks for stands there already, so that nothing is made again."""
    with remade(otherwise):
        assert calib("fit", otherwise, *QUICK, f"--{choice}", FOUND[choice]).code == 0
    assert fit_of(otherwise) == USUAL | {choice: FOUND[choice]}


@pytest.mark.long
@pytest.mark.usefixtures("true_report")
def test_the_report_tells_of_the_fit_that_was_asked_for(calib: Front, otherwise: Path, choice: str) -> None:
    with remade(otherwise, "evidence.json", "report.html"):
        assert calib("run", otherwise, *QUICK).code == 0
        assert calib("report", otherwise).code == 0

    page = (otherwise / "results" / "report.html").read_text()
    assert NAMED[choice] in page
    assert ("The coefficients were found by the shape-only objective" in page) == (choice == "objective")


def test_neither_model_nor_recording_replaces_it(calib: Front, otherwise: Path, tmp_path: Path) -> None:
    with remade(otherwise, "session.rrd"):
        assert calib("mjcf", otherwise, "--out", tmp_path / "fish.xml").code == 0
        assert calib("view", otherwise).code == 0

    assert (tmp_path / "fish.xml").read_text() == (otherwise / "results" / "calibrated.xml").read_text()


@pytest.mark.long
def test_a_fit_that_replaces_it_says_what_differs(calib: Front, otherwise: Path, choice: str) -> None:
    outcome = calib("fit", otherwise, *QUICK)

    assert f"was made otherwise ({choice} {FOUND[choice]} -> {USUAL[choice]}) and is made again" in outcome.out
    assert fit_of(otherwise)[choice] == USUAL[choice]


@pytest.mark.long
def test_distances_beside_it_are_the_published_ones(otherwise: Path) -> None:
    pipeline = Pipeline(open_session(otherwise), Options("quick"))
    calibration = pipeline.calibrated()
    evidence = EVIDENCE.read(pipeline.evidence().parent)

    fit, fitted = calibration.fit, tuple(trial for trial in pipeline.trials if trial.role == "fit")
    point = np.append(calibration.coefficients, fit.phase_rad)[:, None]
    distances = {of: Swims(pipeline._twin(), fitted, of).mean_distance(point)[0] for of in ("published", "shape")}
    assert distances["published"] > 1.2 * distances["shape"]
    assert [evidence.profiles.best_m, fit.mean_distance_m] == pytest.approx([distances["published"]] * 2, rel=1e-9)
    assert fit.trace[-1][1] == pytest.approx(distances[calibration.objective], rel=1e-9)
