import re

import pytest

from swimcal import runs as engine_module
from swimcal.errors import ModelMismatch
from swimcal.mjcf import FluidCoefficients
from swimcal.results import Provenance
from swimcal.runs import ENGINE, check_engine, model_sha256, workers_of
from swimcal.twin import Twin
from tests.swimcal.robots import FISH, THREE_LINK, changed


def stamp(mujoco: str = ENGINE) -> Provenance:
    return Provenance(mujoco, model_sha256(FISH), {}, 0, "quick")


def test_another_release_of_the_engine_is_refused_by_name() -> None:
    with pytest.raises(ModelMismatch) as caught:
        check_engine(stamp("3.12.0"), FISH, "results/calibration.json")
    text = str(caught.value)
    assert text.startswith("results/calibration.json: this calibration was made with another engine or model")
    assert f"MuJoCo: made with 3.12.0, here {ENGINE}" in text
    assert "model: made with" not in text
    assert text.endswith("Fit again with `calib fit`.")
    assert caught.value.exit_code == 2


def test_another_model_is_refused_with_both_fingerprints() -> None:
    with pytest.raises(ModelMismatch) as caught:
        check_engine(stamp(), THREE_LINK, "calibration.json")
    ours, theirs = model_sha256(FISH)[:16], model_sha256(THREE_LINK)[:16]
    assert f"model: made with {ours}, here {theirs}" in str(caught.value)
    assert "MuJoCo" not in str(caught.value)


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("crank", "arm_m", 0.040),
        ("tail", "hinge_stiffness_n_m", 0.66),
        ("tail", "density_kg_m3", 1240.0),
        ("caudal_fin", "mass_kg", 0.011),
        ("tendons", "damping_n_s_m", 190.0),
        ("water", "density_kg_m3", 1025.0),
        ("head", "fluid_centre_m", (0.1, 0.0, 0.0)),
    ],
)
def test_the_fingerprint_changes_with_what_the_motion_depends_on(table: str, key: str, value: object) -> None:
    assert model_sha256(changed(FISH, **{table: {key: value}})) != model_sha256(FISH)


def test_the_fingerprint_does_not_change_with_coefficients_or_what_the_twin_does_not_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = model_sha256(FISH)
    assert re.fullmatch(r"[0-9a-f]{64}", before)
    assert model_sha256(changed(FISH, elongated_body={"depth_m": 0.12})) == before
    other = FluidCoefficients(1.0, 2.0, 3.0, 4.0, 5.0)
    monkeypatch.setattr("swimcal.mjcf.PUBLISHED_COEFFICIENTS", other)
    assert engine_module.model_sha256(FISH) == before


@pytest.mark.parametrize(("wanted", "setting", "found"), [(3, "2", 3), (0, "2", 2), (0, None, 0), (2, None, 2)])
def test_as_many_threads_as_wanted_else_as_the_environment_says(
    monkeypatch: pytest.MonkeyPatch, wanted: int, setting: str | None, found: int
) -> None:
    monkeypatch.delenv("SWIMCAL_WORKERS", raising=False)
    if setting is not None:
        monkeypatch.setenv("SWIMCAL_WORKERS", setting)
    assert workers_of(wanted) == found
    assert Twin(FISH, workers=wanted).workers == found


def test_a_number_of_threads_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SWIMCAL_WORKERS", "many")
    with pytest.raises(ValueError, match="SWIMCAL_WORKERS: found 'many', expected a number"):
        workers_of(0)
