"""What a swim shows of its lens: nose to neck is as long wherever in the picture it is seen."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from tracking.camera import HALF_WIDTH, lens_flags
from tracking.lens_check import MeasuredDistortion, measure_distortion

PICTURE_PX = (1280, 720)
CAMERA = CameraSpec(60.0, 0.142)


def swim(
    k1: float, random: np.random.Generator, share: float = 0.8, seconds: float = 4.0, tilt: float = 0.0
) -> xr.Dataset:
    """Nose and neck of a swim along `share` of the picture's width, with a beating head, seen by a bending lens."""
    time_s = np.arange(0, seconds, 1 / 60)
    heading = random.uniform(-0.3, 0.3) + random.choice([0.0, np.pi])
    course = HALF_WIDTH * share * np.linspace(-1, 0.7, len(time_s)) * np.exp(1j * heading)
    course += complex(0, random.uniform(-0.1, 0.1))
    yaw = heading + 0.15 * np.sin(2 * np.pi * random.uniform(0.6, 1.5) * time_s + random.uniform(0, 6))
    ideal = np.stack([course + 0.2 * np.exp(1j * yaw), course], axis=1)
    ideal = ideal * (1 + tilt * ideal.real)
    bent = ideal * (1 + k1 * np.abs(ideal) ** 2)
    px = np.stack([bent.real, bent.imag], axis=-1) / HALF_WIDTH * PICTURE_PX[0] / 2 + (np.array(PICTURE_PX) - 1) / 2
    fades = np.exp(-1 / 6.0)
    noise = np.sqrt(1 - fades**2) * random.standard_normal(px.shape)
    for i in range(1, len(noise)):  # it lasts a tenth of a second
        noise[i] += fades * noise[i - 1]
    return as_tracks(("nose", "neck"), time_s, px + 0.1 * noise, np.ones(px.shape[:2]))


def distortion(tracks: xr.Dataset) -> MeasuredDistortion:
    found = measure_distortion(tracks, PICTURE_PX, HALF_WIDTH)
    assert found is not None
    return found


@pytest.mark.parametrize("k1", [0.0, 0.02, -0.08])
def test_the_distortion_is_recovered_within_its_uncertainty(k1: float) -> None:
    random = np.random.default_rng(3)
    found = [distortion(swim(k1, random, tilt=random.uniform(-0.02, 0.02))) for _ in range(60)]
    off = np.array([(each.k1 - k1) / each.sd for each in found])
    assert (np.abs(off) < 2).mean() > 0.85
    assert np.median([each.sd for each in found]) < 0.004


def test_a_good_lens_is_not_flagged_and_a_bad_one_is_told_with_its_size() -> None:
    random = np.random.default_rng(4)
    assert sum(bool(lens_flags(CAMERA, swim(0.0, random), PICTURE_PX)) for _ in range(30)) <= 3
    for _ in range(30):
        (flag,) = lens_flags(CAMERA, swim(-0.08, random), PICTURE_PX)
        assert flag.kind == "no_lens"
        assert "shorter towards the edges" in flag.message


@pytest.mark.parametrize("share", [0.0, 0.05])
def test_a_robot_that_stays_on_the_spot_shows_nothing_of_the_lens(share: float) -> None:
    random = np.random.default_rng(5)
    for _ in range(20):
        (flag,) = lens_flags(CAMERA, swim(random.choice([0.0, -0.08]), random, share), PICTURE_PX)
        assert flag.kind == "no_lens"


def test_a_mirrored_a_turned_and_a_larger_picture_show_the_same_lens() -> None:
    tracks = swim(-0.03, np.random.default_rng(6))
    before, px = distortion(tracks), tracks.position.values - (np.array(PICTURE_PX)[:, None] - 1) / 2
    for turned in (px * [[-1], [1]], px[:, ::-1] * [[1], [-1]], px):
        other = tracks.assign(position=(tracks.position.dims, turned + (np.array(PICTURE_PX)[:, None] - 1) / 2))
        after = distortion(other)
        assert (after.k1, after.sd) == pytest.approx((before.k1, before.sd), rel=1e-6)


def test_samples_that_must_not_be_trusted_do_not_count() -> None:
    tracks = swim(-0.03, np.random.default_rng(8))
    before = distortion(tracks)
    wrong = tracks.copy(deep=True)
    wrong.position[5, :, :], wrong.confidence[5] = 1e4, 0.0
    assert distortion(wrong).k1 == pytest.approx(before.k1, abs=before.sd)
    assert distortion(wrong).farthest == before.farthest


def test_without_nose_or_with_few_frames_nothing_is_told() -> None:
    tracks = swim(0.0, np.random.default_rng(7))
    assert measure_distortion(tracks.isel(time=slice(0, 40)), PICTURE_PX, HALF_WIDTH) is None
    assert measure_distortion(tracks.isel(keypoint=[1]), PICTURE_PX, HALF_WIDTH) is None


@given(seed=st.integers(0, 10_000), kind=st.sampled_from(["noise", "on a point", "a jump", "far away", "half gone"]))
def test_no_tracks_make_it_fall(seed: int, kind: str) -> None:
    random = np.random.default_rng(seed)
    tracks = swim(float(random.uniform(-0.5, 0.5)), random)
    px = tracks.position.values
    if kind == "noise":
        px[:] = random.uniform(-500, 2000, px.shape)
    elif kind == "on a point":
        px[:, :, 1] = px[:, :, 0]
    elif kind == "a jump":
        px[random.integers(1, len(px)) :] += random.uniform(-5000, 5000)
    elif kind == "far away":
        px[:] *= 10.0 ** random.uniform(1, 9)
    else:
        px[random.random(px.shape) < 0.5] = np.nan
    for flag in lens_flags(CAMERA, tracks, PICTURE_PX):
        assert flag.kind == "no_lens"
        assert "nan" not in flag.message
