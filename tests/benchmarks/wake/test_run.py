import numpy as np
import pytest

from benchmarks import reality, wake
from benchmarks.reality import Recording, Trial, World
from benchmarks.reality.mechanism import Mechanism
from benchmarks.wake.mechanisms import CATALOGUED, MirrorWall, RoughSkin, UniformStream, WaveResistance
from benchmarks.wake.world import TrimmedTrial, WakeWorld
from swimcal.effects.catalogue import catalogue
from swimcal.errors import SimulationDiverged

SWIM = TrimmedTrial("swim", 3.0, 1.0, phase_rad=1.0, start_speed_m_s=0.1)
QUICK = TrimmedTrial("swim", 1.0, 1.0, phase_rad=1.0, start_speed_m_s=0.1)
WORLD = WakeWorld(drag_area_m2=0.07)


def way_m(recording: Recording) -> complex:
    """Of the head in the last beat, in the direction in which the swim began."""
    frames = round(recording.trial.fps / recording.trial.frequency_hz)
    moved = complex(*(recording.head[-1, :2] - recording.head[-1 - frames, :2]))
    return moved * np.exp(-1j * recording.trial.heading_rad)


def with_one(mechanism: Mechanism) -> WakeWorld:
    return WakeWorld(drag_area_m2=0.07, mechanisms=(mechanism,))


@pytest.fixture(scope="module")
def plain() -> Recording:
    return wake.simulate([(WORLD, SWIM)])[0]


def test_the_wake_drives_the_fish_ahead(plain: Recording):
    assert 0.05 < way_m(plain).real < 0.2


@pytest.mark.long
def test_more_beats_a_second_are_faster():
    slow, fast = (TrimmedTrial("swim", 2.5, f, start_speed_m_s=0.1 * f) for f in (0.6, 1.4))
    each = [way_m(r).real * r.trial.frequency_hz for r in wake.simulate([(WORLD, slow), (WORLD, fast)])]
    assert each[1] > 1.5 * each[0] > 0.0


@pytest.mark.long
def test_half_the_step_and_twice_the_panels_change_the_way_little(plain: Recording):
    (finer,) = wake.simulate([(WORLD, SWIM)], None, 0.002)
    (more,) = wake.simulate([(WORLD, SWIM)], None, 0.002, 2)
    assert abs(way_m(finer) - way_m(plain)) < 0.1 * abs(way_m(plain))
    assert abs(way_m(more) - way_m(plain)) < 0.12 * abs(way_m(plain))


@pytest.mark.long
def test_a_recording_hardly_depends_on_its_company(plain: Recording):
    other = TrimmedTrial("swim", 2.0, 1.0, phase_rad=2.0)
    _, same = wake.simulate([(WORLD, other), (WORLD, SWIM)])
    assert np.abs(same.position_px - plain.position_px).max() < 1e-3


@pytest.mark.long
def test_a_swim_turned_about_is_seen_turned_about(plain: Recording):
    turned = TrimmedTrial(**{**vars(SWIM), "heading_rad": SWIM.heading_rad + 2.0})
    (other,) = wake.simulate([(WORLD, turned)])
    place, moved = (r.marker_m @ np.array([1, 1j]) for r in (plain, other))
    assert np.abs(moved - np.exp(2j) * place).max() < 1e-6


@pytest.mark.long
def test_a_bent_tail_at_rest_turns_the_fish(plain: Recording):
    left, right = (TrimmedTrial(**{**vars(SWIM), "trim_rad": trim}) for trim in (0.04, -0.04))
    turns = [r.head[-1, 2] - r.head[0, 2] for r in wake.simulate([(WORLD, left), (WORLD, right)])]
    own = plain.head[-1, 2] - plain.head[0, 2]
    assert (turns[0] - own) * (turns[1] - own) < 0


@pytest.mark.long
def test_out_of_water_there_is_no_wake():
    dry = Trial("dry", 1.0, 1.0)
    (here,), (there,) = wake.simulate([(WORLD, dry)]), reality.simulate([(World(WORLD.coefficients), dry)])
    assert np.array_equal(here.position_px, there.position_px)


@pytest.mark.long
def test_a_stream_carries_the_fish_along(plain: Recording):
    (carried,) = wake.simulate([(with_one(UniformStream(0.0, 0.05)), SWIM)])
    assert (way_m(carried) - way_m(plain)).imag == pytest.approx(-0.05, abs=0.03)  # it heads for -x


@pytest.mark.parametrize("mechanism", [WaveResistance(5.0, 0.001), RoughSkin(20.0)])
@pytest.mark.long
def test_more_resistance_is_slower(plain: Recording, mechanism: Mechanism):
    (slower,) = wake.simulate([(with_one(mechanism), SWIM)])
    assert way_m(slower).real < 0.97 * way_m(plain).real


@pytest.mark.long
def test_a_wall_far_off_is_none_and_one_nearby_is_felt():
    quick = wake.simulate([(WORLD, QUICK)])[0]
    far, near = wake.simulate([(with_one(MirrorWall(1.0, d, 0.0)), QUICK) for d in (50.0, 0.25)])
    assert np.abs(far.position_px - quick.position_px).max() < 0.1
    assert np.abs(near.position_px - quick.position_px).max() > 1.0


@pytest.mark.long
def test_every_effect_is_of_the_catalogue_acts_and_is_none_at_zero():
    assert set(CATALOGUED) <= set(catalogue())
    drawn = {name: draw(np.random.default_rng(1)) for name, draw in CATALOGUED.items()}
    assert not any(at(0.0) for at in drawn.values())
    worlds = [WakeWorld(drag_area_m2=0.07, mechanisms=at(1.0)) for at in drawn.values()]
    quick, *others = wake.simulate([(world, QUICK) for world in (WORLD, *worlds)])
    for name, other in zip(drawn, others, strict=True):
        assert np.isfinite(other.position_px).all(), name
        assert np.abs(other.position_px - quick.position_px).max() > 0.05, name


@pytest.mark.long
def test_what_blows_up_is_told():
    with pytest.raises(SimulationDiverged, match="1 of 1 reference simulations diverged"):
        wake.simulate([(with_one(RoughSkin(-1e7)), QUICK)])
