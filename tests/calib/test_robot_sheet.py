"""A robot's description is drawn, and its numbers are those of the simulated robot."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import calib
from swimcal.errors import InputError
from swimcal.mjcf import FREE_DECAY, build_mjcf, natural_hz
from swimcal.robot import load_robot


@pytest.mark.parametrize("stiffness", [1.0, 2.0])
def test_the_natural_frequency_is_that_of_a_small_free_decay(stiffness: float) -> None:
    robot = load_robot()
    robot = robot.changed(tail={"hinge_stiffness_n_m": stiffness * robot.tail.hinge_stiffness_n_m})
    model = build_mjcf(robot, scene=replace(FREE_DECAY, timestep_s=3e-4)).compile()
    model.dof_damping[:] *= 0.1
    data = mujoco.MjData(model)
    hinges = [model.joint(name).qposadr[0] for name in robot.hinges]
    data.qpos[hinges] = 0.002 * np.arange(1, len(hinges) + 1)  # nearly the shape of the slowest mode
    angle = []
    for _ in range(round(4.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
        angle.append(data.qpos[hinges[0]])
    spectrum = np.abs(np.fft.rfft(np.hanning(len(angle)) * angle, 16 * len(angle)))
    measured = np.fft.rfftfreq(16 * len(angle), model.opt.timestep)[np.argmax(spectrum)]
    assert natural_hz(robot) == pytest.approx(measured, rel=0.03)


def test_the_sheet_has_a_picture_and_the_numbers(tmp_path: Path) -> None:
    made = calib.draw_robot(out=tmp_path / "fish.png")
    assert made.file.read_bytes().startswith(b"\x89PNG")
    mass, ring, speed = made.notes
    assert "0.58 m from nose to fin" in mass
    assert f"{natural_hz(load_robot()):.1f} Hz in air" in ring
    assert f"{float(calib.load_twin().swim(1.0).speed[0]):.3f} m/s at 1 Hz" in speed


def test_another_ending_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"found fish\.gif.*\.png, \.svg, \.pdf"):
        calib.draw_robot(out=tmp_path / "fish.gif")
    assert not list(tmp_path.iterdir())
