"""A folder with what the examples of the interface use, and stand-ins for what takes minutes or a motor."""

import shutil
import threading
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

import calib as front
from calib.capture import emulator, functions
from calib.capture import trials as search
from calib.capture.bus import Clock, open_port
from calib.capture.emulator import MotorEmulator
from calib.capture.trials import capture
from calib.pipeline import Pipeline
from diagnosis.result import EffectTestResult, GapSize
from swimcal.flags import Flag
from swimcal.results import write_whole
from swimcal.session_file import CameraCalibration
from swimgym.policy import SHIPPED, load_policy
from swimsynth.plan import SyntheticDecay, SyntheticPlan
from swimsynth.session import make_session
from tests.calib.motor.virtual_port import VirtualClock, VirtualPort
from tests.tracking.lens.render import Scene, poses
from tracking.board import BoardSpec

LENS = CameraCalibration(
    width_px=480, height_px=270, fx_px=285.0, fy_px=285.0, cx_px=239.5, cy_px=134.5, distortion=(0.0,) * 5
)
PORT = "/dev/ttyUSB0"


def lay_out(desk: Path, pool: Path, unsampled: Path) -> None:
    """`pool`, a finished session; `short`, one without a posterior; `old`, of another engine; `bench`, a free decay;
    `filmed`, one of films; films and pictures.

    Args:
        desk: the folder, in which `pool` may be.
        pool: a finished session.
        unsampled: one without a posterior.
    """
    if pool != desk / "pool":
        shutil.copytree(pool, desk / "pool")
    shutil.copytree(unsampled, desk / "short")
    results = desk / "old" / "results"
    results.mkdir(parents=True)
    made = (pool / "results" / "calibration.json").read_text()
    engine = made.split('"mujoco": "')[1].split('"')[0]
    write_whole(results / "calibration.json", made.replace(f'"mujoco": "{engine}"', '"mujoco": "3.9.0"'))
    make_session(desk / "bench", SyntheticPlan(free_decays=(SyntheticDecay(name="decay", seconds=1.5),)))
    films = [desk / "f0_75.mp4", desk / "f1_25.mp4"]
    for film in films:
        writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"mp4v"), 60.0, (64, 48))
        for _ in range(12):
            writer.write(np.zeros((48, 64, 3), np.uint8))
        writer.release()
    front.new_session(desk / "filmed", videos=films)
    scene, draws = Scene(LENS, BoardSpec(columns=9, rows=6, square_m=0.03)), np.random.default_rng(0)
    for number, pose in enumerate(poses(scene, 4, draws), start=1):
        cv2.imwrite(str(desk / f"board_{number}.png"), scene.picture(pose[:3], pose[3:], draws))
    level = np.array([-0.135, -0.09, 0.00112 * LENS.fx_px])
    cv2.imwrite(str(desk / "board_on_water.png"), scene.picture(np.zeros(3), level, draws))


def stand_in(patch: pytest.MonkeyPatch) -> None:
    """For the motor an emulated one in virtual time; for what takes long what it may find."""
    patch.setattr(Pipeline, "effect_test", lambda _, effects: _tested(effects))
    refused = SimpleNamespace(draws=SimpleNamespace(flags=(Flag("not_converged", message="R-hat 1.2 of Magnus lift"),)))
    patch.setattr("fitting.posterior.posterior.sample_posterior", lambda *_: refused)
    patch.setattr("calib.stages.fit.mode_of", lambda *_: None)
    patch.setattr("calib.policy._train_policy", lambda *_: load_policy(SHIPPED / "circle"))
    clock = VirtualClock()
    motor = MotorEmulator(clock=clock, load_nm=0.3)

    def plugged(name: str, baud: int) -> Any:
        if name != PORT:
            return open_port(name, baud)
        port = VirtualPort(motor)
        port.baudrate = baud
        port.closePort = lambda: None
        return port

    for module in (functions, search):
        patch.setattr(module, "open_port", plugged)
    patch.setattr(functions, "ports", lambda: [PORT])
    patch.setattr(functions, "capture", partial(capture, clock=Clock(clock, clock.sleep)))
    ended = SimpleNamespace(Thread=threading.Thread, RLock=threading.RLock, Event=_CtrlC)
    patch.setattr(emulator, "threading", ended)


class _CtrlC:
    """An event during which the user presses Ctrl-C."""

    def wait(self) -> None:
        raise KeyboardInterrupt


def _tested(effects: tuple[str, ...]) -> EffectTestResult:
    return EffectTestResult(effects, -1.2, dict.fromkeys(effects, -1.2), {}, GapSize(), GapSize())
