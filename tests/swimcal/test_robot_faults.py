import re
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swimcal.errors import InputError
from swimcal.mjcf import build_mjcf
from swimcal.robot import load_robot

FISH_TOML = (files("swimcal") / "robots" / "fish_057.toml").read_text()


def line_of(text: str) -> int:
    """The line of the built-in robot's file that begins with a text; of the first, where there are several."""
    return next(n for n, line in enumerate(FISH_TOML.split("\n"), start=1) if line.startswith(text))


def message(tmp_path: Path, *changes: tuple[str, str]) -> str:
    """What loading the built-in robot says after the first of each text is replaced by another."""
    text = FISH_TOML
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "robot.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_robot(path)
    assert caught.value.exit_code == 2
    return str(caught.value)


CASES = {
    "unknown key": (
        ("stiffness_n_m = 20000.0", "stifness_n_m = 20000.0"),
        lambda: [
            f"line {line_of('stiffness_n_m')}, tendons.stifness_n_m: unknown key",
            "choices: stiffness_n_m, damping_n_s_m. Did you mean 'stiffness_n_m'?",
            "tendons.stiffness_n_m: key is missing; expected a number",
        ],
    ),
    "marker on a link the robot lacks": (
        ('tail_3 = { body = "tail_3"', 'tail_3 = { body = "tail_33"'),
        lambda: [
            f"line {line_of('tail_3 = ')}, markers.tail_3.body: the marker is on a link the robot lacks; "
            "found 'tail_33'; expected a link of the robot; "
            "choices: head, tail_1, tail_2, tail_3, tail_4, tail_5. Did you mean 'tail_3'?"
        ],
    ),
    "no neck": (
        ("neck = {", "throat = {"),
        lambda: [
            "markers.neck: marker 'neck' is missing; found ['nose', 'throat', 'pectoral_left',",
            "expected nose and neck among the markers: they make the head frame",
        ],
    ),
    "nose on the tail": (
        ('nose = { body = "head"', 'nose = { body = "tail_1"'),
        lambda: [
            f"line {line_of('nose = ')}, markers.nose.body: a marker of the head frame is not on the head; "
            "found 'tail_1'; expected 'head'"
        ],
    ),
    "nose behind neck": (
        ("position_m = [-0.077,", "position_m = [0.077,"),
        lambda: [
            f"line {line_of('nose = ')}, markers.nose.position_m: the nose is not before the neck; "
            "found x = 0.077; expected less than that of the neck, 0.065. x runs from nose to tail."
        ],
    ),
    "anchor off the arm": (
        ("anchor_inset_m = 0.005", "anchor_inset_m = 0.0395"),
        lambda: [
            f"line {line_of('anchor_inset_m')}, crank.anchor_inset_m: the tendon anchor is not on the arm; "
            "found 0.0395; expected less than arm_m = 0.0395"
        ],
    ),
    "crank too long": (
        ("arm_m = 0.0395", "arm_m = 0.2"),
        lambda: [
            f"line {line_of('start_m')}, tail.start_m: the crank would hit the tail; "
            "found 0.278; expected more than crank.position_m[0] + crank.arm_m = 0.3655"
        ],
    ),
    "segment too short for its guide": (
        ("length_m = 0.015", "length_m = 0.002"),
        lambda: [
            f"line {line_of('length_m')}, tail.segment[0].length_m: the tendon guide is before the segment; "
            "found 0.002; expected at least tail.guide_inset_m = 0.003"
        ],
    ),
    "guide plates without a size": (
        ("guide_plate_height_m = 0.014", "guide_plate_height_m = 0.0"),
        lambda: [
            f"line {line_of('guide_plate_width_m')}, tail.segment[0].guide_plate_width_m: a guide plate without its "
            "size; found 0.0485; expected tail.guide_plate_height_m above 0",
            "tail.segment[4].guide_plate_width_m: a guide plate without its size",
        ],
    ),
    "a guide plate of negative width": (
        ("guide_plate_width_m = 0.0485", "guide_plate_width_m = -0.0485"),
        lambda: [
            f"line {line_of('guide_plate_width_m')}, tail.segment[0].guide_plate_width_m: wrong value; found -0.0485; "
            "expected greater than or equal to 0"
        ],
    ),
    "strip in grams": (
        ("strip_mass_kg = 0.001 ", "strip_mass_kg = 1000.0 "),
        lambda: ["strip_mass_kg: wrong value; found 1000.0; expected less than or equal to 100. Is it in kilograms?"],
    ),
    "two parts of one name": (
        ('name = "body"', 'name = "front_plate"'),
        lambda: ["head.part[4].name: two parts of one name; found 'front_plate'; expected names that differ"],
    ),
    "negative mass": (
        ("mass_kg = 0.53", "mass_kg = -0.53"),
        lambda: ["head.part[2].mass_kg: wrong value; found -0.53; expected greater than or equal to 0.000001"],
    ),
    "millimetres for metres": (
        ("length_m = 0.015", "length_m = 15.0"),
        lambda: ["segment[0].length_m: wrong value; found 15.0; expected less than or equal to 10. Is it in metres?"],
    ),
    "no segments": (
        ("[[tail.segment]]", "[[tail.segmnt]]"),
        lambda: ["tail.segmnt: unknown key", "Did you mean 'segment'?"],
    ),
    "text for a number": (
        ("thickness_m = 0.003", 'thickness_m = "3 mm"'),
        lambda: ["tail.segment[0].thickness_m: wrong value; found '3 mm'; expected a valid number"],
    ),
}


def test_a_size_of_guide_plates_that_no_segment_has_is_a_fault(tmp_path: Path) -> None:
    widths = [(line, "") for line in re.findall(r"guide_plate_width_m = .*\n", FISH_TOML)]
    text = message(tmp_path, *widths)
    assert "tail.segment: the guide plates have a size but no width; found " in text
    assert (
        "tail.guide_plate_length_m = 0.006, tail.guide_plate_height_m = 0.014; expected guide_plate_width_m in" in text
    )


def test_a_strip_before_the_fin_needs_a_gap(tmp_path: Path) -> None:
    text = message(tmp_path, ("gap_m = 0.010 ", "gap_m = 0.0 "))
    assert (
        f"line {line_of('strip_mass_kg = 0.001                      # of the one')}, caudal_fin.strip_mass_kg: " in text
    )
    assert "a flexible strip where there is no gap; found 0.001; expected 0, as caudal_fin.gap_m is 0" in text


@pytest.mark.parametrize(("change", "expected"), CASES.values(), ids=CASES.keys())
def test_a_fault_is_reported_with_its_line_and_what_would_be_right(
    change: tuple[str, str], expected: Callable[[], list[str]], tmp_path: Path
) -> None:
    text = message(tmp_path, change)
    for part in expected():
        assert part in text


def test_faults_that_do_not_hide_each_other_come_together(tmp_path: Path) -> None:
    text = message(
        tmp_path,
        ("density_kg_m3 = 1000.0", "density_kg_m3 = 0.0"),
        ("anchor_inset_m = 0.005", "anchor_inset_m = 0.05"),
        ('tail_2 = { body = "tail_2"', 'tail_2 = { body = "tail_9"'),
        ('neck = { body = "head"', 'neck = { body = "tail_1"'),
        ("span_m = 0.203", "span = 0.203"),
    )
    assert "6 faults" in text
    places = ("water.density_kg_m3", "crank.anchor_inset_m", "markers.tail_2.body", "markers.neck.body")
    for place in (*places, "caudal_fin.span:", "caudal_fin.span_m:"):
        assert place in text
    lines = [int(number) for number in re.findall(r"line (\d+)", text)]
    assert lines == sorted(lines)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    number=st.integers(min_value=0),
    value=st.one_of(
        st.floats(allow_nan=False).map(str),
        st.sampled_from(["nan", "-inf", "true", '""', "[]", "{}", "1e999", "0", "[1.0, 2.0]"]),
    ),
)
def test_one_broken_value_gives_a_robot_that_builds_or_a_clear_error(number: int, value: str, tmp_path: Path) -> None:
    values = list(re.finditer(r"(?<== )(-?[\d.e-]+|\[.*\]|\".*\"|true|false)(?=\s)", FISH_TOML))
    found = values[number % len(values)]
    path = tmp_path / "robot.toml"
    path.write_text(FISH_TOML[: found.start()] + value + FISH_TOML[found.end() :])
    try:
        robot = load_robot(path)
    except InputError:
        return
    build_mjcf(robot).compile()


def test_a_session_file_given_as_a_robot_is_called_that(tmp_path: Path) -> None:
    path = tmp_path / "session.toml"
    path.write_text('[session]\nname = "pool"\n\n[camera]\nfps = 60\n')
    with pytest.raises(InputError, match="describes a session, not a robot") as caught:
        load_robot(path)
    assert len(caught.value.faults) == 1
