import pickle

import pytest

from swimcal.errors import SHOWN_PER_KIND, Fault, FaultCollector, InputError, SwimcalError


def test_fault_says_place_what_found_expected_choices_and_next_step() -> None:
    fault = Fault("a.toml", "line 3, x", "wrong value", "'b'", "a letter", ("c", "d"), "Did you mean 'c'?")
    assert str(fault) == (
        "a.toml: line 3, x: wrong value; found 'b'; expected a letter; choices: c, d. Did you mean 'c'?"
    )


def test_message_names_each_file_once_and_orders_its_faults_by_line() -> None:
    faults = [
        Fault("b.csv", "line 12", "late", "", ""),
        Fault("a.toml", "line 1", "odd", "", ""),
        Fault("b.csv", "line 2", "early", "", ""),
        Fault("b.csv", "", "on the whole", "", ""),
    ]
    assert str(InputError(faults)) == (
        "a.toml: line 1: odd\nb.csv: 3 faults\n  1. line 2: early\n  2. line 12: late\n  3. on the whole"
    )


def test_collector_takes_over_nested_faults_and_raises_them_with_its_own() -> None:
    faults = FaultCollector("a.toml")
    faults.add("line 1", "odd")
    with faults.nested():
        raise InputError([Fault("b.csv", "line 2", "ragged", "", "")])
    with pytest.raises(InputError, match=r"line 1: odd\nb\.csv: line 2: ragged"):
        faults.raise_if_any()


def test_many_faults_of_a_kind_are_counted() -> None:
    faults = FaultCollector("a.csv")
    faults.extend_capped([Fault("a.csv", f"line {k}", "ragged", "", "") for k in range(1, 38)])
    assert len(faults.faults) == SHOWN_PER_KIND + 1
    assert faults.faults[-1].what == "and 27 more like the last, up to line 37"


def test_every_error_of_the_tree_ends_the_command_with_two_and_survives_pickling() -> None:
    kinds = SwimcalError.__subclasses__()
    assert InputError in kinds
    assert all(kind.exit_code == 2 for kind in kinds)
    error = InputError([Fault("a", "", "odd", "", "")])
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
