import numpy as np
import pytest

from benchmarks.reality import Trial, World, simulate
from benchmarks.reality.mechanism import worn
from benchmarks.reality.mechanisms import CATALOGUED, EVERY, OUTSIDE
from swimcal.create_session import FISHSIM_MARKERS
from tests.benchmarks.reality.motions import COEFFICIENTS

SEEN_IN = (
    Trial("swim", 4.0, 0.9, phase_rad=0.4, place_m=-0.3 - 0.1j, heading_rad=0.2),
    Trial("dry", 2.0, 0.9, phase_rad=1.4),
    Trial("free_decay", 2.0, bent_rad=(0.2,) * 5, release_s=0.3),
)
SPEEDS_HZ = (0.4, 0.7, 1.0, 1.4)
EACH = pytest.mark.parametrize("name", EVERY)


def drawn(name, seed):
    return EVERY[name](np.random.default_rng(seed))


def rms_px(one, other):
    return float(np.sqrt(((one.position_px - other.position_px) ** 2).sum(axis=-1).mean()))


def test_no_name_is_that_of_two():
    assert not set(OUTSIDE) & set(CATALOGUED)


@EACH
def test_one_generator_draws_one_mechanism(name):
    first, again, other = drawn(name, 5), drawn(name, 5), drawn(name, 6)
    assert repr(first(2.0)) == repr(again(2.0))
    assert repr(first(2.0)) != repr(other(2.0))
    assert repr(first(1.0)) != repr(first(2.0))
    assert first(0.0) == ()


@pytest.mark.long
def test_each_grows_with_its_strength_from_nothing():
    """In the pixels of a moment's swim of a robot that was in use before."""
    strengths, swim = (1e-6, 1.0, 3.0, 10.0), Trial("swim", 0.5, 1.0, 0.7, run_in_s=0.0, start_speed_m_s=0.25)
    names = [name for name in EVERY if name != "timing_glitch"]  # none of them in so short a time
    worlds = [World(COEFFICIENTS, mechanisms=worn(drawn(name, 1)(s), 50.0)) for name in names for s in strengths]
    base, *others = simulate([(World(COEFFICIENTS), swim), *((world, swim) for world in worlds)], FISHSIM_MARKERS)
    sizes = np.reshape([rms_px(each, base) for each in others], (len(names), -1))
    for name, size in zip(names, sizes, strict=True):
        assert size[0] < 0.1, name  # a crank that stops to start, a wake at the start
        assert (np.diff(size) > 0.01).all(), name


@pytest.fixture(scope="module")
def base():
    return simulate([(World(COEFFICIENTS), trial) for trial in SEEN_IN], FISHSIM_MARKERS)


@pytest.mark.long
@EACH
def test_typical_strength_is_seen_and_no_wonder(name, base):
    world = World(COEFFICIENTS, mechanisms=drawn(name, 8)(1.0))
    on = simulate([(world, trial) for trial in SEEN_IN], FISHSIM_MARKERS)
    off = [rms_px(one, other) for one, other in zip(on, base, strict=True)]
    assert 0.05 < max(off) < 60


@pytest.mark.long
@EACH
def test_nothing_diverges_at_ten_times_and_twenty(name):
    trials = [Trial("swim", 3.0, hz, phase_rad=2 * hz) for hz in SPEEDS_HZ]
    trials += [Trial("dry", 2.0, hz, phase_rad=hz) for hz in SPEEDS_HZ]
    trials.append(SEEN_IN[-1])
    worlds = [World(COEFFICIENTS, mechanisms=drawn(name, seed)(s)) for seed in (0, 1) for s in (10.0, 20.0)]
    for each in simulate([(world, trial) for world in worlds for trial in trials], FISHSIM_MARKERS):
        assert np.isfinite(each.position_px).all()
