from __future__ import annotations

import math

import pytest

from calib.motor.motor_physics import RPM, MotorConstants, MotorPhysics

NO_LOAD, STALL = 72 * RPM, 6.9


def motor(load: float = 0.0, goal: float = 5.0, acceleration: float = math.inf) -> MotorPhysics:
    physics = MotorPhysics(MotorConstants(), load, angle_rad=0.0)
    physics.drive.enabled = True
    physics.drive.goal_rad_s = goal
    physics.drive.acceleration_rad_s2 = acceleration
    return physics


@pytest.mark.parametrize("time_s", [0.1, 0.77, 1.9, 2.5, 10.0])
def test_a_ramp_is_the_closed_form(time_s: float) -> None:
    goal, acceleration = 4.0, 2.0
    physics = motor(0.3, goal, acceleration)

    physics.advance(time_s)

    ramp = min(time_s, goal / acceleration)
    assert physics.velocity_rad_s == pytest.approx(acceleration * ramp, rel=1e-9)
    assert physics.angle_rad == pytest.approx(0.5 * acceleration * ramp**2 + goal * (time_s - ramp), abs=1e-5)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("load", "supply_v"), [(0.0, 12.0), (2.0, 12.0), (5.0, 12.0), (1.0, 10.0)])
def test_speed_sags_along_the_line_of_speed_and_torque(load: float, supply_v: float, direction: int) -> None:
    physics = motor(load, goal=direction * 20.0)
    physics.supply_v = supply_v

    physics.advance(2.0)

    assert physics.velocity_rad_s == pytest.approx(direction * NO_LOAD * (supply_v / 12 - load / STALL), rel=1e-6)
    assert physics.torque_nm == pytest.approx(direction * load, abs=1e-6)
    assert physics.current_a == pytest.approx(direction * 4.9 * load / STALL, abs=1e-6)


def test_it_stalls_at_full_torque_and_full_current() -> None:
    physics = motor(9.0, goal=4.0)

    physics.advance(0.7)

    assert (physics.velocity_rad_s, physics.angle_rad) == (0.0, 0.0)
    assert (physics.torque_nm, physics.current_a) == pytest.approx((STALL, 4.9))
    assert physics.overloaded_s == pytest.approx(0.7)


@pytest.mark.parametrize("time_s", [30.0, 600.0])
def test_the_winding_warms_as_one_thermal_mass(time_s: float) -> None:
    physics, own = motor(3.0, goal=2.0), MotorConstants()

    physics.advance(time_s)

    power = (4.9 * 3.0 / STALL) ** 2 * 12 / 4.9
    rise = own.thermal_resistance_k_w * power
    tau = own.thermal_resistance_k_w * own.thermal_capacity_j_k
    assert physics.temperature_c == pytest.approx(own.ambient_c + rise * -math.expm1(-time_s / tau), abs=0.05)
