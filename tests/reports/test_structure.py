"""The first section of the chain tells what was measured and assumed; what is not there has no section."""

from dataclasses import replace

from fitting.structure import Source, Structure, assumed
from reports.robot import build_structure
from swimcal.flags import Flag
from tests.reports.sample import made_calibration, made_context

MEASURED = (
    Source("hinge_stiffness", 0.6512, "N m/rad", 0.0021, ("decay_1", "decay_2"), ""),
    Source("hinge_damping", 0.0213, "N m s/rad", 0.0004, ("decay_1", "decay_2"), ""),
    Source("crank_arm", 0.03842, "m", 0.00006, ("dry_slow",), ""),
)


def of(changed: Structure):  # type: ignore[no-untyped-def]
    return made_context(replace(made_calibration(), structure=changed))


def test_what_was_measured_stands_with_its_error_and_its_trials() -> None:
    section = build_structure(of(replace(made_calibration().structure, sources=MEASURED)))
    (table,) = section.blocks

    assert table.caption.endswith("All of it was measured in this session.")  # type: ignore[union-attr]
    assert table.rows[:3] == (  # type: ignore[union-attr]
        ("hinge stiffness", "0.651 ± 0.002", "N m/rad", "decay_1 and decay_2"),
        ("hinge damping", "21.3 ± 0.4", "mN m s/rad", "decay_1 and decay_2"),
        ("crank arm", "38.42 ± 0.06", "mm", "dry_slow"),
    )


def test_what_was_assumed_is_named_with_why() -> None:
    sources = (*MEASURED[:2], assumed(made_calibration().robot).sources[2])
    section = build_structure(of(replace(made_calibration().structure, sources=sources)))

    assert "Crank arm was not measured in this session" in section.blocks[0].caption  # type: ignore[union-attr]
    row = section.blocks[0].rows[2]  # type: ignore[union-attr]
    assert row == ("crank arm", "39.5", "mm", "assumed; no dry run: crank arm 39.5 mm as in the built-in robot")


def test_experiments_that_are_not_used_are_reported_once_other_flags_stand_with_theirs() -> None:
    flags = (Flag("not_used", message="free decay decay_2 is not used: the head moves"), Flag("at_bound"))
    section = build_structure(of(replace(made_calibration().structure, flags=flags)))

    assert section.caveats == ("Free decay decay_2 is not used: the head moves.",)
