"""The chain of the dry experiments: what it recovers, what it assumes, and what it does not believe."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitting.free_decay import DecayTrial
from fitting.hinges import with_hinges
from fitting.structure import STRUCTURE, DryExperiments, Source, Structure, identify_structure, read_structure
from swimcal.errors import SimulationDiverged
from swimcal.flags import Flag
from swimcal.results import Provenance
from tests.cases import later
from tests.fitting.structure.experiments import DESCRIBED, TRUE, measured, robot_with, with_few_points

STAMP = Provenance("4.0.0", "0" * 64, {"session.toml": "1" * 64}, 0, "quick")
MOVES = Flag("head_moves", message="the head moves by 9 mm")


@pytest.fixture
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    with_few_points(monkeypatch)


@pytest.fixture(scope="module")
def structure() -> Structure:
    """From all experiments, and a description that is wrong about all they tell."""
    return identify_structure(measured(), DESCRIBED)


@pytest.fixture(scope="module")
def of_decay() -> Structure:
    """From the free decay alone."""
    return identify_structure(measured()._replace(runs=()), DESCRIBED)


def by_quantity(structure: Structure) -> dict[str, Source]:
    return {source.quantity: source for source in structure.sources}


def shaken(position: np.ndarray, size_m: float) -> np.ndarray:
    return position + np.random.default_rng(0).normal(0.0, size_m, position.shape)


@pytest.mark.long
def test_it_recovers_a_robot_unlike_its_description(structure: Structure) -> None:
    tail, found = structure.robot.tail, by_quantity(structure)

    assert tail.hinge_stiffness_n_m == pytest.approx(TRUE["hinge_stiffness"], rel=0.02)
    assert tail.hinge_damping_n_m_s == pytest.approx(TRUE["hinge_damping"], rel=0.1)
    assert structure.robot.crank.arm_m == pytest.approx(TRUE["crank_arm"], rel=0.005)
    for quantity, true in TRUE.items():
        se = found[quantity].se
        assert se is not None
        assert abs(found[quantity].value - true) < 3 * se
    assert not [flag for flag in structure.flags if flag.kind == "not_used"]
    assert found["hinge_stiffness"].trials == found["hinge_damping"].trials == ("pull",)
    assert found["crank_arm"].trials == ("dry_slow", "dry_fast")
    assert found["crank_arm"].sentence.endswith("mm (standard error) from dry runs dry_slow, dry_fast")
    assert not any(source.assumed for source in structure.sources)
    assert structure.robot == robot_with({quantity: source.value for quantity, source in found.items()})


@pytest.mark.long
@pytest.mark.usefixtures("few_points")
def test_the_dry_runs_are_fitted_with_the_hinges_of_the_decay(structure: Structure) -> None:
    """The motion that the crank is read from is that of the measured hinges: the same runs, reported those hinges."""
    hinges = DESCRIBED.tail.model_copy(
        update={name: getattr(structure.robot.tail, name) for name in ("hinge_stiffness_n_m", "hinge_damping_n_m_s")}
    )
    reported = identify_structure(
        measured()._replace(decays=()), DESCRIBED.model_copy(update={"tail": hinges}), origin="robot.toml"
    )

    unlike = identify_structure(measured()._replace(decays=()), DESCRIBED).robot.crank.arm_m
    assert reported.robot.crank.arm_m == pytest.approx(structure.robot.crank.arm_m, rel=1e-4)
    assert unlike != pytest.approx(structure.robot.crank.arm_m, rel=4e-4)
    assert reported.decays == ()
    assert by_quantity(reported)["hinge_stiffness"].sentence.startswith("no free decay: hinge stiffness 0.7")
    assert by_quantity(reported)["hinge_stiffness"].sentence.endswith("as in robot.toml")


def test_without_a_dry_run_the_arm_is_assumed(of_decay: Structure) -> None:
    arm = by_quantity(of_decay)["crank_arm"]

    assert of_decay.crank is None
    assert of_decay.robot.crank == DESCRIBED.crank
    assert (arm.assumed, arm.se) == (True, None)
    assert arm.sentence == "no dry run: crank arm 39.5 mm as in the built-in robot"
    assert not by_quantity(of_decay)["hinge_stiffness"].assumed


@pytest.mark.long
@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (lambda trial: replace(trial, flags=(MOVES,)), "the head moves by 9 mm"),
        *later((lambda trial: replace(trial, position_m=shaken(trial.position_m, 0.006)), "the twin explains only")),
    ],
    ids=["loose head", "shaken tracks"],
)
def test_a_decay_that_must_not_be_believed_is_reported_and_not_used(
    wrong: Callable[[DecayTrial], DecayTrial], why: str, of_decay: Structure
) -> None:
    good = measured().decays[0]
    bad = replace(wrong(good), name="bad")
    alone = identify_structure(DryExperiments([bad]), DESCRIBED)
    beside = identify_structure(DryExperiments([bad, good]), DESCRIBED)

    assert alone.robot == DESCRIBED
    assert alone.hinges is None
    assert [fit.name for fit in alone.decays] == ["bad"]
    assert by_quantity(alone)["hinge_stiffness"].sentence.startswith("free decay bad not used: hinge stiffness 0.65")
    (flag,) = alone.flags
    assert flag.kind == "not_used"
    assert flag.message.startswith(f"free decay bad is not used: {why}")
    assert [fit.name for fit in beside.decays] == ["bad", "pull"]
    assert by_quantity(beside)["hinge_stiffness"] == by_quantity(of_decay)["hinge_stiffness"]


@pytest.mark.long
@pytest.mark.usefixtures("few_points")
def test_a_wrong_dry_run_does_not_spoil_the_others() -> None:
    slow, fast = measured().runs
    bad = replace(slow, place_m=slow.place_m + shaken(np.zeros(slow.place_m.shape), 0.02))
    found = identify_structure(DryExperiments(runs=[bad, fast]), DESCRIBED)

    assert by_quantity(found)["crank_arm"].trials == ("dry_fast",)
    assert found.robot.crank.arm_m == pytest.approx(TRUE["crank_arm"], rel=0.01)
    assert found.flags[0].kind == "not_used"
    assert "dry run dry_slow is not used" in found.flags[0].message


def test_a_decay_of_something_else_is_not_used() -> None:
    """A tail that goes on at a rate no hinge could give."""
    decay = measured().decays[0]
    odd = 0.05 * np.sin(2 * np.pi * 14.9 * decay.time_s)[:, None, None] * [0.0, 1.0]
    still = np.broadcast_to(decay.position_m[-1], decay.position_m.shape)
    (flag,) = identify_structure(DryExperiments([replace(decay, position_m=still + odd)]), DESCRIBED).flags

    assert flag.message.startswith("free decay pull is not used: the twin explains only")


def test_hinges_that_are_another_robots_are_told() -> None:
    """A frame rate that is off by two makes the stiffness four times too large."""
    stiff = with_hinges(DESCRIBED, TRUE["hinge_stiffness"] / 4, TRUE["hinge_damping"])
    found = identify_structure(measured()._replace(runs=()), stiff)

    assert [flag.kind for flag in found.flags] == ["robot_off"]
    assert "4 times the hinge stiffness" in found.flags[0].message


@pytest.mark.long
def test_a_structure_read_back_is_the_one_that_was_written(structure: Structure, tmp_path: Path) -> None:
    text, beside = STRUCTURE.write(tmp_path, STAMP, structure)
    read = read_structure(tmp_path, DESCRIBED, measured().runs)

    assert read.robot == structure.robot
    assert (read.sources, read.hinges, read.flags) == (structure.sources, structure.hinges, structure.flags)
    assert read.crank is not None
    assert read.crank.trials[0].measured is measured().runs[0]
    one, two = (STRUCTURE.write(tmp_path / name, STAMP, each) for name, each in {"a": structure, "b": read}.items())
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]

    payload = json.loads(text.read_text())
    (decay,) = payload["decays"]
    run = payload["crank"]["trials"][0]
    assert decay["stiffness_n_m"] == structure.decays[0].stiffness_n_m
    assert run["measured"] == "dry_slow"
    with np.load(beside) as arrays:
        assert arrays[run["surface"]["distance_m"]].shape == (21, 81, 60)
    assert text.stat().st_size < 20_000


def test_a_decay_whose_twin_diverges_stops_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def diverge(*_: object, **__: object) -> None:
        raise SimulationDiverged("The free decay of the twin diverges")

    monkeypatch.setattr("fitting.structure.fit_decay", diverge)
    structure = identify_structure(measured()._replace(runs=()), DESCRIBED)
    assert structure.decays == ()
    assert ["The free decay of the twin diverges" in flag.message for flag in structure.flags] == [True]
    assert by_quantity(structure)["hinge_stiffness"].assumed
