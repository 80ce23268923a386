"""Captures in virtual time against the emulated motor."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from calib.capture import TrialResult
from calib.capture.bus import Clock
from calib.capture.emulator import MotorEmulator
from calib.capture.live import Live, show_nothing
from calib.capture.trials import CaptureSettings, capture
from tests.calib.motor.faults import Faults, FaultyEmulator
from tests.calib.motor.virtual_port import VirtualClock, VirtualPort

SILENCE_S = 0.4


@dataclass
class Bench:
    """An emulated motor, its port and what the capture reported.

    `events` are called once their virtual time has come, between two exchanges.
    """

    motor: MotorEmulator
    port: VirtualPort
    clock: VirtualClock
    messages: list[str] = field(default_factory=list)
    events: list[tuple[float, Callable[[], object]]] = field(default_factory=list)

    def capture(
        self, out: Path, *hz: float, seconds: float = 1.0, coded: bool = False, live: Live = show_nothing
    ) -> list[TrialResult]:
        settings = CaptureSettings(out, hz or (0.6,), seconds, coded=coded)
        return capture(settings, self.port, self.messages.append, Clock(self.clock, self._sleep), live)

    @property
    def stopped_soon(self) -> bool:
        """Whether the motor is stopped once the watchdog had its time."""
        self.clock.sleep(SILENCE_S + 0.1)
        return self.motor.stopped and self.motor["present_velocity"] == 0

    def _sleep(self, seconds: float) -> None:
        self.clock.sleep(seconds)
        while self.events and self.clock() >= self.events[0][0]:
            self.events.pop(0)[1]()


def bench(faults: Faults | None = None, load: float = 0.3, latency_s: float = 1e-3, seed: int = 0) -> Bench:
    """A motor with factory settings at 1 Mbaud."""
    clock = VirtualClock()
    settings = {"clock": clock, "load_nm": load, "seed": seed}
    motor = FaultyEmulator(faults, **settings) if faults else MotorEmulator(**settings)
    return Bench(motor, VirtualPort(motor, latency_s), clock)
