"""In a notebook the figures are methods of a calibration, and show themselves."""

from __future__ import annotations

import inspect
from dataclasses import replace

import pytest

from reports import Gallery, Picture, picture_of_tracks
from tests.reports.sample import ROLES, made_calibration, made_evidence, made_searches

METHODS = {
    name: inspect.signature(method).parameters
    for name, method in inspect.getmembers(Gallery, inspect.isfunction)
    if not name.startswith("_") and name != "trial"
}
OF_A_TRIAL = [name for name, parameters in METHODS.items() if "trial" in parameters]


@pytest.fixture(scope="module")
def gallery() -> Gallery:
    return Gallery(made_calibration(), made_evidence(), made_searches())


@pytest.mark.parametrize("name", METHODS)
def test_each_method_gives_a_picture_that_shows_itself_and_says_what_it_is(gallery: Gallery, name: str) -> None:
    picture: Picture = getattr(gallery, name)(*[next(iter(ROLES))] * (name in OF_A_TRIAL))

    assert picture._repr_png_().startswith(b"\x89PNG")
    assert picture.says in repr(picture)


def test_the_same_picture_has_the_same_bytes(gallery: Gallery) -> None:
    assert gallery.sweep()._repr_png_() == gallery.sweep()._repr_png_()


@pytest.mark.parametrize("name", OF_A_TRIAL)
def test_a_trial_that_is_not_there_is_answered_with_those_that_are(gallery: Gallery, name: str) -> None:
    with pytest.raises(ValueError, match=f"found 'nonsense', expected one of {', '.join(ROLES)}"):
        getattr(gallery, name)("nonsense")


@pytest.mark.parametrize("name", ["profiles", "mean_shapes", "pair_errors", "pair_coefficients"])
def test_what_needs_evidence_asks_for_it(gallery: Gallery, name: str) -> None:
    with pytest.raises(ValueError, match=r"evidence: found none, expected .* Gallery\(calibration, evidence\)"):
        getattr(Gallery(gallery.calibration), name)()


def test_what_needs_pairs_or_searches_asks_for_them(gallery: Gallery) -> None:
    two = Gallery(gallery.calibration, replace(made_evidence(), pairs=()))
    with pytest.raises(ValueError, match="pairs: found none, expected at least three swims and evidence of full"):
        two.pair_errors()
    with pytest.raises(ValueError, match="searches: found none on the shape objective, expected those of calib bench"):
        two.searches_compared("shape")


def test_tracks_can_be_looked_at_before_any_fit(gallery: Gallery) -> None:
    trial = gallery.calibration.trials[0].measured

    assert picture_of_tracks(trial)._repr_png_() == gallery.tracks(trial.name)._repr_png_()
