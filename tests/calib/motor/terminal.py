"""ROBOTIS' SDK on a true terminal, on a machine that may be busy."""

from __future__ import annotations

import dynamixel_sdk as sdk

PATIENCE_MS = 5000.0


def open_port(path: str, baud: int = 1_000_000, patient: bool = True) -> sdk.PortHandler:
    """The SDK's port; a patient one waits longer for an answer than the SDK's 34 ms."""
    port = sdk.PortHandler(path)
    if patient:
        port.setPacketTimeout = lambda _: port.setPacketTimeoutMillis(PATIENCE_MS)
    assert port.setBaudRate(baud)
    return port
