"""The motor behind the control table: speed ramp, torque-limited sag, current, temperature.

The shaft is a rotor of constant inertia J driven by a torque that the speed loop asks for and the speed-torque line
of a permanent-magnet DC motor bounds: |torque| <= stall_torque * (voltage / 12 V - |speed| / no_load_speed), so that
under a load the speed sags to no_load_speed * (voltage / 12 V - load / stall_torque). Winding heat goes into one
thermal mass. 72 rpm, 6.9 N m and 4.9 A at 12 V are ROBOTIS' numbers; inertia, friction and thermal constants are
not published and are assumed at plausible size.
"""

import math
from dataclasses import dataclass

RPM = 2 * math.pi / 60
STEP_S = 2e-3


@dataclass(frozen=True)
class MotorConstants:
    """What the motor is made of; SI units, voltages at the terminals."""

    no_load_rad_s: float = 72 * RPM
    stall_torque_nm: float = 6.9
    stall_current_a: float = 4.9
    nominal_v: float = 12.0
    inertia_kg_m2: float = 0.01
    gear_friction_nm: float = 0.5
    ambient_c: float = 25.0
    thermal_resistance_k_w: float = 3.0
    thermal_capacity_j_k: float = 100.0


@dataclass
class Drive:
    """What the control table asks of the motor: speed to reach, acceleration (inf: at once)."""

    enabled: bool = False
    goal_rad_s: float = 0.0
    acceleration_rad_s2: float = math.inf


class MotorPhysics:
    """State of the shaft and the winding, moved on by `advance`. Angles in rad, not wrapped; positive is CCW.

    `load_nm` is friction that opposes motion.
    """

    def __init__(self, constants: MotorConstants, load_nm: float, angle_rad: float) -> None:
        self.constants = constants
        self.load_nm = load_nm
        self.supply_v = constants.nominal_v
        self.drive = Drive()
        self.angle_rad = angle_rad
        self.velocity_rad_s = 0.0
        self.reference_rad_s = 0.0
        self.torque_nm = 0.0
        self.temperature_c = constants.ambient_c
        self.overloaded_s = 0.0

    @property
    def current_a(self) -> float:
        """Winding current in A, with the sign of the torque."""
        return self.torque_nm / self.constants.stall_torque_nm * self.constants.stall_current_a

    def advance(self, duration_s: float) -> None:
        """Moves on by a time, in steps of at most 2 ms unless it rests without torque."""
        remaining_s = duration_s
        while remaining_s > 0:
            resting = not self.drive.enabled and self.velocity_rad_s == 0.0
            step = remaining_s if resting else min(remaining_s, STEP_S)
            before = self.velocity_rad_s
            if self.drive.enabled:
                self._drive(step)
            else:
                self._coast(step)
            self.angle_rad += 0.5 * (before + self.velocity_rad_s) * step
            self._heat(step)
            remaining_s -= step

    def available_nm(self, direction: float) -> float:
        """Largest torque towards `direction` (its sign) at the present speed, from the speed-torque line."""
        own = self.constants
        voltage = self.supply_v / own.nominal_v
        speed = math.copysign(self.velocity_rad_s, self.velocity_rad_s * direction) / own.no_load_rad_s
        return own.stall_torque_nm * max(0.0, min(voltage - speed, voltage))

    def _drive(self, step_s: float) -> None:
        drive, inertia = self.drive, self.constants.inertia_kg_m2
        reach = drive.acceleration_rad_s2 * step_s
        self.reference_rad_s += min(max(drive.goal_rad_s - self.reference_rad_s, -reach), reach)
        towards = self.velocity_rad_s or self.reference_rad_s
        resisting = math.copysign(self.load_nm, towards) if towards else 0.0
        wanted = resisting + inertia * (self.reference_rad_s - self.velocity_rad_s) / step_s
        self.torque_nm = math.copysign(min(abs(wanted), self.available_nm(wanted)), wanted)
        if self.torque_nm == wanted:
            self.velocity_rad_s = self.reference_rad_s
        else:
            after = self.velocity_rad_s + (self.torque_nm - resisting) / inertia * step_s
            stops = self.torque_nm * towards >= 0 and after * towards < 0  # friction does not turn the shaft back
            self.velocity_rad_s = 0.0 if stops else after
        overloaded = abs(self.torque_nm) > 0.8 * self.constants.stall_torque_nm
        self.overloaded_s = self.overloaded_s + step_s if overloaded else 0.0

    def _coast(self, step_s: float) -> None:
        """Torque off: gear friction and load brake to rest; the gear (about 150:1) is not driven backwards."""
        braking = (self.constants.gear_friction_nm + self.load_nm) / self.constants.inertia_kg_m2 * step_s
        self.velocity_rad_s = math.copysign(max(0.0, abs(self.velocity_rad_s) - braking), self.velocity_rad_s)
        self.reference_rad_s = self.torque_nm = self.overloaded_s = 0.0

    def _heat(self, step_s: float) -> None:
        """One thermal mass: exact over a step of constant current."""
        own = self.constants
        winding_ohm = own.nominal_v / own.stall_current_a
        rest = own.ambient_c + own.thermal_resistance_k_w * self.current_a**2 * winding_ohm
        kept = math.exp(-step_s / (own.thermal_resistance_k_w * own.thermal_capacity_j_k))
        self.temperature_c = rest + (self.temperature_c - rest) * kept
