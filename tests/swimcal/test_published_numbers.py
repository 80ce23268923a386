"""Numbers of "Simple Models, Real Swimming" (2026) that the built-in robot should give, and how near it comes."""

import numpy as np
import pytest

from swimcal.mjcf import DRY, build_mjcf, natural_hz
from swimcal.twin import Twin
from tests.swimcal.engine_state import stretch
from tests.swimcal.robots import FISH
from tests.swimcal.swims import runs


def test_the_robot_weighs_what_was_published() -> None:
    """1.48 kg, of which 75 g behind the first hinge: segments, fin, guide plates and flexible strips."""
    model = build_mjcf(FISH).compile()
    assert model.body_mass.sum() == pytest.approx(1.48, abs=0.005)
    assert sum(model.body(hinge).mass[0] for hinge in FISH.hinges) == pytest.approx(0.075, abs=0.0005)


def test_the_robot_is_as_long_as_published() -> None:
    assert FISH.length_m == pytest.approx(0.57, abs=0.01)


def test_the_lowest_natural_frequency_in_air_without_tendons_is_that_published() -> None:
    """3.5 Hz published, 3.55 Hz here at the published hinge stiffness."""
    assert natural_hz(FISH) == pytest.approx(3.5, rel=0.02)


def test_guide_plates_and_strips_are_as_published() -> None:
    """Two plates on each segment, 30 g in all; ten strips on the tail of 1 g each; none of them feels the water."""
    model = build_mjcf(FISH).compile()
    names = [model.geom(i).name for i in range(model.ngeom)]
    plates = [2e3 * FISH.guide_plate_mass_kg(i) for i in range(5)]
    np.testing.assert_allclose(np.array(plates) / 2, [5.1, 4.0, 3.0, 1.9, 0.9], atol=0.06)
    assert sum(plates) == pytest.approx(30, abs=0.5)
    assert sum(name.startswith("guide_plate_") for name in names) == 10
    assert sum(name.startswith("strip_") for name in names) == 10
    dry = [model.geom(name).id for name in names if name.startswith(("guide_plate_", "strip_"))]
    assert not model.geom_fluid[dry, 0].any()
    across = [abs(model.geom(f"guide_plate_{i}_{side}").pos[1]) for side in ("left", "right") for i in range(1, 6)]
    np.testing.assert_allclose(across, 2 * [0.02575, 0.02075, 0.01575, 0.01075, 0.00575], atol=1e-9)


@pytest.mark.parametrize("frequency_hz", [0.60, 1.19])
def test_tendons_change_their_length_by_less_than_the_published_three_per_cent(frequency_hz: float) -> None:
    """About 3 % in use published; 2 % in a dry run here, and shorter, not longer, than on the straight tail.

    The springs push as well as pull, so neither tendon goes slack; the difference is left to the diagnosis.
    """
    time_s = np.arange(1.0, 1.0 + 1 / frequency_hz, 1 / 60)
    swum = Twin(FISH, scene=DRY).simulate(runs(frequency_hz), time_s)
    model = build_mjcf(FISH, scene=DRY).compile()
    both = np.array(
        [stretch(model, FISH, c, h) for c, h in zip(swum.crank_rad[0], swum.hinges_rad[0], strict=True)]
    )  # (f, 2)
    for tendon in both.T:
        assert 0.015 < np.ptp(tendon) < 0.03
        assert tendon.max() < 1e-3
