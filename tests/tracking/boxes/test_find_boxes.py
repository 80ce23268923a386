"""Start boxes found in a picture: right at any place, heading, scale and bend, or refused with the reason."""

from collections import Counter

import numpy as np
import pytest

from swimcal.errors import InputError
from tests.cases import later
from tests.swimcal.sample import FISHSIM, needs_fishsim
from tests.tracking.boxes.drawn import ELEVEN, NINE, Scene, draw, layout, places_px
from tracking.boxes import StartBoxes
from tracking.find_boxes import find_boxes

PUBLIC = ("f0_50", "f0_75", "f1_00", "f1_25", "f1_75")


def found(scene: Scene, centre_px: np.ndarray | None = None) -> tuple[StartBoxes, np.ndarray]:
    """What is found, and how far (m,) the centres are off, px."""
    drawn = draw(scene, centre_px)
    boxes = find_boxes(drawn.luma, layout(scene.markers), scene.markers)
    return boxes, np.linalg.norm(boxes.centres_px(scene.markers) - drawn.centre_px, axis=1)


def refused(scene: Scene) -> str:
    with pytest.raises(InputError) as caught:
        found(scene)
    return str(caught.value)


@pytest.mark.parametrize(
    ("heading_deg", "bright"),
    [(15, True), (105, False), (195, True), (285, False), *later((15, False), (105, True), (195, False), (285, True))],
)
def test_every_marker_is_found_whatever_the_heading(heading_deg: float, bright: bool) -> None:
    assert found(Scene(heading_deg=heading_deg, bright=bright, bend_deg=(12, 10, -5, -14, -8)))[1].max() < 0.3


@pytest.mark.parametrize("bend_deg", [(30, 30, 30, 30, 30), *later(((-30, -25, 0, 25, 30),)), (0, 0, 0, 0, 35)])
def test_a_strongly_bent_tail_is_followed(bend_deg: tuple[float, ...]) -> None:
    assert found(Scene(bend_deg=bend_deg))[1].max() < 0.3


@pytest.mark.parametrize(("px_per_m", "diameter"), [(560, 8.5), (965, 16), (2000, 30)])
def test_the_scale_is_found_from_the_picture(px_per_m: float, diameter: float) -> None:
    scene = Scene(size=(1400, 900), centre=(700, 450), px_per_m=px_per_m, diameter=diameter, heading_deg=20)
    boxes, off_px = found(scene)

    assert off_px.max() < 0.3
    assert boxes.boxes["nose"].width == pytest.approx(1.4 * diameter, rel=0.1)


@pytest.mark.parametrize("heading_deg", [10, *later(130), 250])
def test_the_pectorals_keep_their_sides(heading_deg: float) -> None:
    assert found(Scene(markers=ELEVEN, heading_deg=heading_deg))[1].max() < 0.5


@pytest.mark.long
def test_a_small_robot_in_a_large_picture_with_glints_is_found() -> None:
    scene = Scene(size=(3840, 2160), centre=(3100, 500), px_per_m=965, heading_deg=75, glints=25, ripple=6, seed=2)

    assert found(scene)[1].max() < 0.5


@needs_fishsim
@pytest.mark.parametrize("name", [*PUBLIC[:2], *later(*PUBLIC[2:])])
def test_the_places_of_the_public_recordings_are_recognised(name: str) -> None:
    places = np.loadtxt(FISHSIM / f"{name}.csv", delimiter=",", max_rows=1).reshape(-1, 2)
    scene = Scene(diameter=12, body=False, noise=0)

    assert found(scene, places - places.mean(axis=0) + [400, 300])[1].max() < 0.5


def test_the_boxes_hold_their_markers_alone() -> None:
    boxes, _ = found(scene := Scene(diameter=17, bend_deg=(8, 8, 8, 8, 8)))
    places = places_px(scene)

    for name, box in boxes.boxes.items():
        inside = (np.abs(places - box.centre_px) < np.array([box.width, box.height]) / 2).all(axis=1)
        assert [NINE[k] for k in np.flatnonzero(inside)] == [name]
        assert box.width >= 17


@pytest.mark.parametrize(
    "hidden", ["nose", *later("neck", "dorsal_fin"), "tail_1", *later("tail_3", "tail_5"), "caudal_fin"]
)
def test_a_hidden_marker_is_refused(hidden: str) -> None:
    message = refused(Scene(hidden=(hidden,)))

    assert "the robot was not found" in message
    assert "8 bright blobs" in message
    assert "expected 9 round markers" in message
    assert "calib track SESSION --click" in message


def test_two_robots_are_refused_with_both_probabilities() -> None:
    scene = Scene(px_per_m=700, diameter=11)
    upper, lower = draw(scene.but(centre=(350, 150))).luma, draw(scene.but(centre=(450, 450), seed=1)).luma
    luma = np.vstack([upper[:300], lower[300:]])

    with pytest.raises(InputError, match="two ways to see the robot in them"):
        find_boxes(luma, layout(), NINE)


def test_a_marker_that_a_glint_runs_into_is_refused() -> None:
    places = places_px(scene := Scene())
    picture = draw(scene).luma.copy()
    x, y = places[1].astype(int)
    picture[y - 7 : y + 8, x : x + 18] = 180

    with pytest.raises(InputError, match="neck"):
        find_boxes(picture, layout(), NINE)


@pytest.mark.parametrize("level", [0, 128, 255])
def test_an_even_picture_is_refused(level: int) -> None:
    with pytest.raises(InputError, match="0 bright blobs and 0 dark blobs"):
        find_boxes(np.full((240, 320), level, dtype=np.uint8), layout(), NINE)


def test_too_few_markers_are_refused() -> None:
    markers = ("nose", "neck", "tail_1")
    with pytest.raises(InputError, match="at least 4 are needed"):
        find_boxes(np.zeros((240, 320), dtype=np.uint8), layout(markers), markers)


def drawn_by_chance(seed: int) -> Scene:
    """A scene of any kind: heading, bend, scale, size, contrast, noise, glints, ripple, polarity."""
    rng = np.random.default_rng(1000 + seed)
    size = (3840, 2160) if seed % 10 == 0 else (1280, 720)
    px_per_m = rng.uniform(650, 1200) * (1.5 if size[0] > 2000 else 1.0)
    markers = ELEVEN if rng.integers(2) else NINE
    bright = bool(rng.integers(2))
    return Scene(
        size=size,
        markers=markers,
        bend_deg=tuple(rng.uniform(-1, 1, 5) * rng.uniform(0, 30)),
        heading_deg=rng.uniform(0, 360),
        px_per_m=px_per_m,
        centre=(size[0] / 2 + rng.uniform(-40, 40), size[1] / 2 + rng.uniform(-15, 15)),
        diameter=rng.uniform(9, max(10.0, min(30.0, 0.0165 * px_per_m))),
        bright=bright,
        contrast=rng.uniform(35, 150 if bright else 120),
        noise=rng.uniform(0, 7),
        glints=int(rng.integers(0, 30)),
        ripple=float(rng.choice([0, 5, 15])),
        body=bool(rng.integers(4)),
        seed=seed,
    )


def outcome(scene: Scene) -> str:
    """``right``, ``refused`` or ``wrong``: a marker off by more than 2 px and 0.15 of its diameter."""
    try:
        _, off_px = found(scene)
    except InputError:
        return "refused"
    return "right" if off_px.max() < max(2.0, 0.15 * scene.diameter) else "wrong"


@pytest.mark.long
def test_of_240_scenes_none_is_wrong_silently_and_few_are_refused() -> None:
    counts = Counter(outcome(drawn_by_chance(seed)) for seed in range(240))

    assert counts["wrong"] == 0, counts
    assert counts["right"] >= 210, counts
