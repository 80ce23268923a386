import numpy as np
import pytest

from benchmarks.reality import Trial, World, simulate
from benchmarks.reality.mechanisms import CATALOGUED, OUTSIDE, catalogued, drawn_of, uncatalogued
from session.create import FISHSIM_MARKERS
from tests.benchmarks.reality.motions import COEFFICIENTS

FAMILY = {name: family for family, names in CATALOGUED.items() for name in names} | dict.fromkeys(OUTSIDE, "outside")
SEEN_IN = (
    Trial("swim", 4.0, 0.9, phase_rad=0.4, place_m=-0.3 - 0.1j, heading_rad=0.2),
    Trial("dry", 2.0, 0.9, phase_rad=1.4),
    Trial("free_decay", 2.0, bent_rad=(0.2,) * 5, release_s=0.3),
)
SPEEDS_HZ = (0.4, 0.7, 1.0, 1.4)
EVERY = pytest.mark.parametrize("name", FAMILY)


def drawn(name, seed):
    return drawn_of(FAMILY[name], name)(np.random.default_rng(seed))


def rms_px(one, other):
    return float(np.sqrt(((one.position_px - other.position_px) ** 2).sum(axis=-1).mean()))


def test_the_table_holds_every_name_once():
    assert list(catalogued()) == [name for names in CATALOGUED.values() for name in names]
    assert tuple(uncatalogued()) == OUTSIDE
    assert not set(uncatalogued()) & set(catalogued())


@EVERY
def test_one_generator_draws_one_mechanism(name):
    first, again, other = drawn(name, 5), drawn(name, 5), drawn(name, 6)
    assert repr(first(2.0)) == repr(again(2.0))
    assert repr(first(2.0)) != repr(other(2.0))
    assert repr(first(1.0)) != repr(first(2.0))


def test_at_strength_zero_nothing_changes_to_the_bit():
    trial = Trial("swim", 0.1, 1.0, phase_rad=0.4, run_in_s=0.05)
    there = [mechanisms for name in FAMILY if (mechanisms := drawn(name, 3)(0.0))]
    base, *others = simulate([(World(COEFFICIENTS, mechanisms=m), trial) for m in ((), *there)], FISHSIM_MARKERS)
    for each in others:
        assert np.array_equal(each.position_px, base.position_px)
        assert np.array_equal(each.time_s, base.time_s)


@pytest.fixture(scope="module")
def base():
    return simulate([(World(COEFFICIENTS), trial) for trial in SEEN_IN], FISHSIM_MARKERS)


@pytest.mark.long
@EVERY
def test_typical_strength_is_seen_and_no_wonder(name, base):
    world = World(COEFFICIENTS, mechanisms=drawn(name, 8)(1.0))
    on = simulate([(world, trial) for trial in SEEN_IN], FISHSIM_MARKERS)
    off = [rms_px(one, other) for one, other in zip(on, base, strict=True)]
    assert 0.05 < max(off) < 60


@pytest.mark.long
@EVERY
def test_nothing_diverges_at_ten_times_and_twenty(name):
    trials = [Trial("swim", 3.0, hz, phase_rad=2 * hz) for hz in SPEEDS_HZ]
    trials += [Trial("dry", 2.0, hz, phase_rad=hz) for hz in SPEEDS_HZ]
    trials.append(SEEN_IN[-1])
    worlds = [World(COEFFICIENTS, mechanisms=drawn(name, seed)(s)) for seed in (0, 1) for s in (10.0, 20.0)]
    for each in simulate([(world, trial) for world in worlds for trial in trials], FISHSIM_MARKERS):
        assert np.isfinite(each.position_px).all()
