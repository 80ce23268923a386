"""`results/structure.json` and its arrays: what is read back is what was written."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fitting.structure import DryExperiments, Structure, identify_structure, read_structure, structure_payload
from fitting.structure.records import Named as By
from fitting.structure.records import from_plain, to_plain
from session import Flag, Provenance, plain_json, read_result_json, write_result_json
from tests.fitting.structure.experiments import DESCRIBED, measured

STAMP = Provenance("4.0.0", "0" * 64, {"session.toml": "1" * 64}, 0, "quick")


class Pair(NamedTuple):
    """Of two numbers."""

    left: float
    right: int


@dataclass(frozen=True)
class Named:
    """Written by its name alone."""

    name: str


@dataclass(frozen=True, eq=False)
class Everything:
    """One field of each kind that results have."""

    number: float
    perhaps: float | None
    text: str
    yes: bool
    pair: Pair
    range_hz: tuple[float, float]
    flags: tuple[Flag, ...]
    series: np.ndarray
    other: Named
    others: tuple[Named, ...]


numbers = st.floats(width=64)
flags = st.builds(
    Flag,
    st.text(),
    st.lists(st.text()).map(tuple),
    st.none() | st.tuples(st.integers(0, 99), st.integers(0, 99)),
    st.text(),
)
records = st.builds(
    Everything,
    numbers.filter(lambda x: not np.isinf(x)),
    st.none() | numbers.filter(np.isfinite),
    st.text(),
    st.booleans(),
    st.builds(Pair, numbers.filter(np.isfinite), st.integers()),
    st.tuples(numbers.filter(np.isfinite), numbers.filter(np.isfinite)),
    st.lists(flags, max_size=3).map(tuple),
    st.lists(numbers).map(np.array) | st.lists(numbers).map(lambda x: 1j * np.array(x, complex)),
    st.just(Named("one")),
    st.lists(st.sampled_from([Named("one"), Named("two")])).map(tuple),
)


@pytest.mark.long
@given(records)
def test_a_record_read_back_is_the_one_that_was_written(record: Everything) -> None:
    arrays: dict[str, np.ndarray] = {}
    text = json.dumps(plain_json(to_plain(record, (Named,), arrays, "all")))
    named: By = {Named: {"one": Named("one"), "two": Named("two")}}
    read = from_plain(Everything, json.loads(text), named, arrays)

    assert type(read) is Everything
    for name in ("perhaps", "text", "yes", "pair", "range_hz", "flags", "other", "others"):
        assert getattr(read, name) == getattr(record, name)
        assert type(getattr(read, name)) is type(getattr(record, name))
    np.testing.assert_equal(read.number, record.number)
    np.testing.assert_array_equal(read.series, record.series)


@pytest.fixture(scope="module")
def structure() -> Structure:
    """One dry run and the free decay."""
    return identify_structure(DryExperiments(measured().decays, measured().runs[1:]), DESCRIBED)


@pytest.mark.long
def test_a_structure_read_back_is_the_one_that_was_written(structure: Structure, tmp_path: Path) -> None:
    payload, arrays = structure_payload(structure)
    write_result_json(tmp_path / "results" / "structure.json", STAMP, payload)
    np.savez(tmp_path / "arrays.npz", allow_pickle=False, **arrays)
    data = read_result_json(tmp_path / "results" / "structure.json")
    with np.load(tmp_path / "arrays.npz") as kept:
        read = read_structure(data, kept, DESCRIBED, measured().runs)

    assert read.robot == structure.robot
    assert (read.sources, read.hinges, read.flags) == (structure.sources, structure.hinges, structure.flags)
    assert read.crank is not None
    assert read.crank.trials[0].measured is measured().runs[1]
    again = structure_payload(read)
    assert plain_json(again.payload) == plain_json(payload)
    assert again.arrays.keys() == arrays.keys()
    for key, array in arrays.items():
        assert array.dtype == again.arrays[key].dtype
        np.testing.assert_array_equal(again.arrays[key], array)


@pytest.mark.long
def test_its_numbers_stand_in_the_file_and_its_arrays_beside_it(structure: Structure) -> None:
    payload, arrays = structure_payload(structure)
    (decay,) = payload["decays"]
    run: dict[str, Any] = payload["crank"]["trials"][0]

    assert decay["stiffness_n_m"] == structure.decays[0].stiffness_n_m
    assert run["measured"] == "dry_fast"
    assert arrays[run["surface"]["distance_m"]].shape == (21, 81, 60)
    assert not any(array.dtype == object for array in arrays.values())
    assert len(json.dumps(plain_json(payload))) < 10_000
