import numpy as np
import pytest
from scipy.special import hankel2

from benchmarks.wake.lattice import Bound, Wake, Water
from tests.benchmarks.wake.plates import STILL, Moved, even_panels, surface_of, swept

ALPHA_RAD = 0.03


def added_mass(half_height_m: float, panels: int = 24) -> float:
    """Of a plate one metre long that is pushed across itself, in water of density 1."""
    surface = surface_of(even_panels(panels, half_height_m), Moved(0j, 1j))
    bound = Bound(surface, Wake.none(surface, 1e-4), STILL)
    return float((bound.weight_kg_m(1.0) * bound.circulation_m2_s).sum())


@pytest.mark.parametrize("panels", [6, 24])
def test_a_tall_plate_has_the_added_mass_of_two_dimensions(panels: int):
    height = 2 * 200.0 / np.sqrt(2)
    assert added_mass(200.0, panels) / height == pytest.approx(np.pi / 4, rel=1e-4)


def test_a_long_low_plate_tends_to_the_added_mass_of_slender_bodies():
    relative = [added_mass(h) / (np.pi * h**2) for h in (0.1, 0.05, 0.02)]
    assert relative == sorted(relative)
    assert relative[-1] == pytest.approx(1.0, abs=0.04)


def ahead(time_s: float) -> Moved:
    return Moved(-time_s + 0j, -1 + 0j, -ALPHA_RAD)


@pytest.mark.parametrize(("step_s", "panels"), [(0.05, 16), (0.025, 24)])
def test_the_lift_of_a_plate_that_starts_at_once_grows_as_wagner_found(step_s: float, panels: int):
    plate = swept(even_panels(panels), ahead, step_s, round(3 / step_s))
    for chords, wagner in ((0.5, 0.6010), (1.0, 0.6695), (2.0, 0.7581)):  # the function at 1, 2, 4 half chords
        lift = plate.force[round(chords / step_s)].imag / (np.pi * ALPHA_RAD)
        assert lift == pytest.approx(wagner, rel=0.04)


def test_a_plate_in_steady_flow_has_no_drag_but_by_the_suction_that_its_front_does_not_hold():
    with_suction = swept(even_panels(16), ahead, 0.2, 150, critical=np.inf).force[-2]
    without = swept(even_panels(16), ahead, 0.2, 150).force[-2]
    assert abs(with_suction.real) < 0.05 * without.real
    assert without.real == pytest.approx(without.imag * ALPHA_RAD, rel=0.01)


@pytest.mark.parametrize("reduced", [0.3, 0.8])
def test_a_heaving_plate_is_driven_as_garrick_found(reduced: float):
    half_chord, heave = 0.5, 0.02
    rate = reduced / half_chord
    steps = 80
    step_s = 2 * np.pi / rate / steps

    def motion(time_s: float) -> Moved:
        return Moved(-time_s + 1j * heave * np.sin(rate * time_s), -1 + 1j * heave * rate * np.cos(rate * time_s))

    plate = swept(even_panels(16), motion, step_s, 3 * steps + 1, critical=np.inf)
    thrust = -plate.force[-steps - 1 : -1].real.mean()
    theodorsen = hankel2(1, reduced) / (hankel2(1, reduced) + 1j * hankel2(0, reduced))
    assert thrust == pytest.approx(np.pi * half_chord * abs(theodorsen) ** 2 * (heave * rate) ** 2, rel=0.03)


def test_circulation_about_plate_and_wake_together_stays_zero():
    plate = swept(even_panels(12), ahead, 0.1, 40)
    far = 30 * np.exp(1j * np.linspace(0, 2 * np.pi, 400, endpoint=False))[None]
    velocity = plate.bound.carried(Wake(far, np.zeros((1, 399)), 1.0, 1e-4), STILL) + plate.wake.velocity(far)
    around = (velocity.conj() * 1j * far).real.sum() * 2 * np.pi / 400
    assert abs(around) < 0.01 * abs(plate.circulation[-1])


def test_no_water_passes_a_wall():
    surface = surface_of(even_panels(8, 0.1), Moved(0j, 1j))
    wall = Water(np.zeros((1, 1), complex), np.array([[0.3j]]), np.array([[-1j]]))
    wake = Wake.none(surface, 1e-4)
    bound = Bound(surface, wake, wall)
    along = (np.linspace(-1, 1, 9) + 0.3j)[None]
    passes = bound.carried(Wake(along, np.zeros((1, 8)), 0.1, 1e-4), wall)
    assert np.abs(passes.imag).max() < 1e-12
    assert np.abs(passes.real).max() > 1e-3
