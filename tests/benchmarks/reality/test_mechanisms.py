import numpy as np
import pytest

from benchmarks.reality import Mechanism, Trial, World, simulate
from benchmarks.reality.mechanisms.drive import MotorSpeedSag
from benchmarks.reality.mechanisms.fluid import FluidMemory
from tests.benchmarks.reality.motions import COEFFICIENTS

DRY = Trial("dry", 1.0, 1.0, phase_rad=0.4, run_in_s=0.2)


@pytest.mark.long
def test_the_water_matters_in_water_alone():
    plain, late = simulate([(World(COEFFICIENTS, mechanisms=m), DRY) for m in ((), (FluidMemory(0.01),))])
    assert np.abs(late.marker_m - plain.marker_m).max() < 1e-9


@pytest.mark.long
def test_the_drive_gives_the_crank_between_the_frames():
    plain, sagging = simulate([(World(COEFFICIENTS, mechanisms=m), DRY) for m in ((), (MotorSpeedSag(0.1, 2.0, 0.5),))])
    turned, late = (np.interp(each.time_s, each.drive.time_s, each.drive.angle_rad) for each in (plain, sagging))
    assert turned == pytest.approx(DRY.phase_rad + 2 * np.pi * DRY.frequency_hz * plain.time_s, abs=1e-9)
    assert (late[-1] - late[0]) / (turned[-1] - turned[0]) == pytest.approx(0.9, abs=0.08)
    work = np.trapezoid(plain.drive.torque_n_m, plain.drive.angle_rad)  # two tendons' damping at the least
    assert plain.drive.time_s[0] == pytest.approx(-0.2)
    assert work > 0


class Push(Mechanism):
    """A force on the head, along or across it."""

    way: str
    force_n: complex

    def force(self, now, state):  # noqa: ARG002
        turned = self.force_n * (1j if self.way == "across" else 1.0)
        return now.push(0, 0.0, turned * now.pose.direction[:, :1])


@pytest.mark.long
def test_mechanisms_that_differ_in_more_than_numbers_are_kept_apart():
    """Two of a class in one simulation, others next to it: each acts by its own fields, in any company."""
    sets = [
        (Push("along", -0.1 + 0j),),
        (Push("across", -0.1 + 0j),),
        (Push("along", -0.1 + 0j), Push("along", 0.05 + 0j)),
        (Push("along", -0.05 + 0j),),
        (Push("across", 0.1j),),
    ]
    short = Trial("swim", 0.3, 1.0, run_in_s=0.0)
    along, across, both, less, turned = simulate([(World(COEFFICIENTS, mechanisms=m), short) for m in sets])
    assert np.abs(along.head - across.head).max() > 1e-3
    assert both.head == pytest.approx(less.head, abs=1e-12)
    assert turned.head == pytest.approx(along.head, abs=1e-12)
