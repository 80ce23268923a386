from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path

import dynamixel_sdk as sdk
import pytest

from calib.motor import run_emulator
from tests.calib.motor.terminal import open_port

ROOT = Path(__file__).resolve().parents[3]


def test_it_tells_its_path_first_and_how_the_motor_was_left_last() -> None:
    told: list[str] = []
    end = threading.Event()

    def tell(line: str) -> None:
        told.append(line)
        if len(told) == 2:
            port = open_port(told[0], 57_600)
            assert sdk.Protocol2PacketHandler().ping(port, 7) == (1180, sdk.COMM_SUCCESS, 0)
            port.closePort()
            end.set()

    run_emulator(id=7, baud=57_600, tell=tell, until=end)

    assert "id 7, at 57600 baud" in told[1]
    assert told[-1] == "Ended. The motor is not driven, at 0.00 turns/s, 25 degrees C."


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_sigterm_end_it_in_peace(number: int) -> None:
    code = "import calib.motor as m; m.run_emulator(tell=lambda line: print(line, flush=True))"
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True) as serving:
        assert serving.stdout is not None
        assert Path(serving.stdout.readline().strip()).exists()
        serving.stdout.readline()
        serving.send_signal(number)
        rest = serving.stdout.read()

    assert serving.returncode == 0
    assert "Ended. The motor is not driven" in rest


def test_it_needs_the_standard_library_alone() -> None:
    code = (
        "import sys; before = set(sys.modules)\n"
        "import calib.motor, calib.motor.pseudo_terminal\n"
        "new = {name.split('.')[0] for name in set(sys.modules) - before}\n"
        "print(sorted(name for name in new if name not in sys.stdlib_module_names))\n"
    )
    done = subprocess.run([sys.executable, "-S", "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)

    assert done.stdout.strip() == "['calib']"
