from __future__ import annotations

import pytest

from fitting.measure_trial import measure_trial
from fitting.published import Swims
from fitting.trial import MeasuredTrial
from swimcal.create_session import new_from_fishsim
from swimcal.robot import load_robot
from swimcal.session import load_session
from swimcal.tracks import load_tracks
from swimcal.twin import Twin
from swimsynth.session import Truth, make_session
from tests.fitting.swims import PLAN, noise_free
from tests.once import made_once
from tests.swimcal.sample import FISHSIM


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, MeasuredTrial], Truth]:
    """Noise-free swims of the twin, and their truth."""
    return noise_free(made_once(tmp_path_factory, "noise_free", lambda folder: make_session(folder, PLAN)))


@pytest.fixture(scope="session")
def trials(made: tuple[dict[str, MeasuredTrial], Truth]) -> dict[str, MeasuredTrial]:
    return made[0]


@pytest.fixture(scope="session")
def truth(made: tuple[dict[str, MeasuredTrial], Truth]) -> Truth:
    return made[1]


@pytest.fixture(scope="session")
def swims(trials: dict[str, MeasuredTrial]) -> Swims:
    """The two fit trials and a twin for them."""
    return Swims(Twin(load_robot(), trials["slow"].markers), (trials["slow"], trials["fast"]))


@pytest.fixture(scope="session")
def public(tmp_path_factory: pytest.TempPathFactory) -> list[MeasuredTrial]:
    """Five public trials; two of them are fitted. Of the three others too few samples can be used."""
    folder = tmp_path_factory.mktemp("real") / "public"
    session = load_session(new_from_fishsim(folder, FISHSIM, ("f1_00", "f1_75")))
    found = []
    for spec in session.trials:
        if spec.name in ("f1_50", "f2_00", "f2_25"):
            continue
        tracks = load_tracks(spec.tracks, session.markers, session.camera.fps)  # type: ignore[arg-type]
        found.append(measure_trial(spec, tracks, session.camera, load_robot(), session.warmup_s))
    return found
