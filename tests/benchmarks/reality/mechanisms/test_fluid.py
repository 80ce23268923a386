from dataclasses import replace

import numpy as np
import pytest

from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanisms.fluid import (
    AddedMassReaction,
    BackgroundCurrent,
    FluidMemory,
    SegmentCoefficients,
    SurfaceMotion,
    WallProximity,
    WaveDrag,
)
from tests.benchmarks.reality.mechanisms.one_fish import (
    LAYOUT,
    STILL,
    STRAIGHT,
    added,
    ahead,
    bent_by,
    instant,
    of_one,
    prepared,
)

HEIGHT, LENGTH = LAYOUT.strips.half_height_m, LAYOUT.strips.length_m
WAVY = bent_by(0.05 * np.sin(np.arange(LAYOUT.hinges)))


def test_the_reaction_weighs_on_sway_as_slices_of_water_do() -> None:
    mass = instant((AddedMassReaction(0.7),))[0].mass - instant(())[0].mass
    assert mass[0, 1, 1] == pytest.approx(0.7 * 1000 * np.pi * (HEIGHT**2 * LENGTH).sum(), rel=1e-9)
    assert mass[0, 0, 0] == pytest.approx(0, abs=1e-12)


def test_around_the_ends_of_the_body_less_water_is_accelerated() -> None:
    share = prepared((AddedMassReaction(0.7, lost=0.5),)).added_mass_reaction[0]
    ends, middle = share[[0, -1]], share[len(share) // 2]
    assert (ends < 0.5).all()
    assert (ends > 0.35).all()
    assert 0.65 < middle <= 0.7
    assert (np.diff(share)[:6] > 0).all()
    mass = instant((AddedMassReaction(0.7, lost=0.5),))[0].mass - instant(())[0].mass
    assert mass[0, 1, 1] == pytest.approx(1000 * np.pi * (share * HEIGHT**2 * LENGTH).sum(), rel=1e-9)
    assert np.linalg.eigvalsh(mass[0]).min() > -1e-9


def test_the_segments_factors_are_on_keel_and_fin_alone() -> None:
    head, fin = (0.1, 0.2, 0.3, 0.4, 0.5), (-0.1,) * 5
    factor = (prepared((SegmentCoefficients(head, fin),)).coefficients / prepared().coefficients)[0]
    plate = LAYOUT.strips.plate
    assert factor[:, plate == 0] == pytest.approx(np.exp(head)[:, None] * np.ones((plate == 0).sum()))
    assert factor[:, plate == plate[-1]] == pytest.approx(np.exp(-0.1))
    assert (factor[:, (plate > 0) & (plate < plate[-1])] == 1).all()


def test_a_wake_gives_way_as_wagners_function_says() -> None:
    speed, semichord, step_s = 0.2, 0.01, 1e-3
    at, _ = instant((FluidMemory(semichord),), WAVY, ahead(speed))
    memory, state = of_one(FluidMemory, semichord), np.zeros((1, 6 * len(HEIGHT) + 1))
    steady = at.now.water.across_n
    assert memory.water(at.now, at.now.water, state).across_n == pytest.approx(0.5 * steady)
    for _ in range(500):
        state = memory.advance(at.now, state, step_s)
    s = speed * 501 * step_s / semichord  # from the wakes to now is another step
    wagner = 1 - 0.165 * np.exp(-0.0455 * s) - 0.335 * np.exp(-0.3 * s)
    assert memory.water(at.now, at.now.water, state).across_n == pytest.approx(wagner * steady, rel=1e-6)


def test_a_wake_that_is_there_changes_nothing() -> None:
    assert np.abs(added(FluidMemory(0.01), WAVY, ahead(0.2))).max() < 1e-12


def test_water_that_moves_along_exerts_nothing() -> None:
    drifting = np.concatenate([[0.03, -0.04], STILL[2:]])
    drift = instant((BackgroundCurrent(0.03, -0.04, 0.0),), WAVY, drifting)[0].force
    assert drift == pytest.approx(instant((), WAVY)[0].force, abs=1e-9)


def test_an_eddy_carries_a_fish_around() -> None:
    rate, strips = 0.1, LAYOUT.strips
    eddy = BackgroundCurrent(0.0, 0.0, rate)
    around = np.concatenate([[0.0, 0.0], np.full(len(STILL) - 2, rate)])
    at, state = instant((eddy,), STRAIGHT, around)
    together = of_one(BackgroundCurrent, 0.0, 0.0, rate)
    water = together.water(at.now, at.now.water, state)
    assert np.abs(at.now.flow.across_m_s).max() > 0.04
    assert max(np.abs(water.along_n).max(), np.abs(water.across_n).max()) < 1e-9 * strips.length_m.sum()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_wall_draws_with_the_square_of_height_over_clearance(side: float) -> None:
    force = added(WallProximity(side, 1.0), STRAIGHT, ahead(0.2))
    drawn = (1000 * HEIGHT * LENGTH * HEIGHT**2).sum() * 0.2**2
    assert -side * force[1] == pytest.approx(drawn, rel=0.02)  # its left is -y, as it heads for -x
    assert abs(force[0]) < 1e-12


def test_a_wall_holds_a_fish_off() -> None:
    beyond = STRAIGHT + np.concatenate([[0.0, -0.02], STILL[2:]])
    wall = of_one(WallProximity, 1.0, 0.01)
    at, _ = instant((WallProximity(1.0, 0.01),), beyond)
    there = np.array([[0.0, -1j]])  # the wall is left of a start at the origin
    assert (wall.water(at.now, at.now.water, there).across_n - at.now.water.across_n > 0).all()


def test_waves_drag_most_on_the_hump() -> None:
    hump = 0.5 * np.sqrt(9.81 * 0.355)
    drag = {speed: added(WaveDrag(0.5, 0.5, 0.5), STRAIGHT, ahead(speed))[0] for speed in (0.25, hump)}
    assert drag[hump] == pytest.approx(0.5 * 1000 * 0.1 * 0.5 * hump**2)
    assert drag[0.25] / drag[hump] == pytest.approx((0.25 / hump) ** 2 * np.exp(-2 * np.log(0.25 / hump) ** 2))


def seen(nose_m: np.ndarray) -> Sight:
    time_s = np.arange(len(nose_m)) / 60
    both = np.repeat(nose_m[:, None], 2, axis=1)
    return Sight(
        ("nose", "caudal_fin"), time_s, both + np.array([0.0, 0.55]), np.ones(both.shape, complex), 0 * both.real
    )


def test_roll_answers_as_a_driven_oscillator() -> None:
    hz, roll_hz, damping, gain = 1.0, 2.0, 0.3, 0.1
    time_s = np.arange(600) / 60
    sight = seen(1j * 0.04 * np.sin(2 * np.pi * hz * time_s))
    swung = SurfaceMotion(gain, 0.0, roll_hz, 1.5, damping, 0.0).place(sight)
    swing = (swung.marker_m - sight.marker_m)[:, 1].imag[300:]
    w, w0 = 2 * np.pi * hz, 2 * np.pi * roll_hz
    roll = gain * 0.04 * w**2 / np.hypot(w0**2 - w**2, 2 * damping * w0 * w)
    assert np.abs(swing).max() == pytest.approx(0.05 * roll, rel=0.02)
    assert (swung.marker_m[:, 0] == sight.marker_m[:, 0]).all()  # the nose is where it rolls about


def test_pitch_lifts_one_end_and_lowers_the_other() -> None:
    time_s = np.arange(600) / 60
    sight = seen(0.01 * np.sin(4 * np.pi * time_s))
    swung = SurfaceMotion(0.0, 1.0, 2.0, 1.5, 0.3, 0.0).place(sight)
    height = swung.height_m[300:]
    assert (height[:, 0] * height[:, 1] <= 0).all()
    assert np.abs(height).max() > 1e-4


def test_a_head_at_rest_does_not_swing_and_a_frame_seen_twice_is_no_jolt() -> None:
    motion = SurfaceMotion(1.0, 1.0, 2.0, 1.5, 0.3, 0.02)
    still = seen(np.zeros(60, complex))
    assert np.abs(motion.place(still).marker_m - still.marker_m).max() < 1e-12
    again = seen(1j * 0.04 * np.sin(np.arange(60) / 10))
    frames = np.r_[0:30, 29, 30:60]
    twice = replace(
        again,
        time_s=again.time_s[frames] + 1e-15 * np.arange(61),
        marker_m=again.marker_m[frames],
        axis=again.axis[frames],
        height_m=again.height_m[frames],
    )
    assert motion.place(twice).marker_m == pytest.approx(motion.place(again).marker_m[frames], abs=1e-6)
