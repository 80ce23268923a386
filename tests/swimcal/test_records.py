"""Records as plain data: what is read back is what was written, and the schema describes it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swimcal.flags import Flag
from swimcal.results import KEPT_ELSEWHERE, from_plain, plain_json, to_plain


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
    by_name: Mapping[str, Pair]
    either: Pair | Mapping[str, float]
    kept: int = field(metadata=KEPT_ELSEWHERE)


numbers = st.floats(width=64)
flags = st.builds(
    Flag,
    st.text(),
    st.lists(st.text()).map(tuple),
    st.none() | st.tuples(st.integers(0, 99), st.integers(0, 99)),
    st.text(),
)
pairs = st.builds(Pair, numbers.filter(np.isfinite), st.integers())
records = st.builds(
    Everything,
    numbers.filter(lambda x: not np.isinf(x)),
    st.none() | numbers.filter(np.isfinite),
    st.text(),
    st.booleans(),
    pairs,
    st.tuples(numbers.filter(np.isfinite), numbers.filter(np.isfinite)),
    st.lists(flags, max_size=3).map(tuple),
    st.lists(numbers).map(np.array) | st.lists(numbers.filter(np.isfinite)).map(lambda x: 1j * np.array(x, complex)),
    st.just(Named("one")),
    st.lists(st.sampled_from([Named("one"), Named("two")])).map(tuple),
    st.dictionaries(st.text(), pairs),
    pairs | st.dictionaries(st.sampled_from("xyz"), st.just(1.5)),
    st.just(3),
)


@given(records)
def test_a_record_read_back_is_the_one_that_was_written(record: Everything) -> None:
    arrays: dict[str, np.ndarray] = {}
    plain = json.loads(json.dumps(plain_json(to_plain(record, (Named,), arrays, "all"))))
    elsewhere = {Named: {"one": Named("one"), "two": Named("two")}, "kept": 3}
    read = from_plain(Everything, plain, elsewhere, arrays)

    assert type(read) is Everything
    for name in ("perhaps", "text", "yes", "pair", "range_hz", "flags", "other", "others", "by_name", "either", "kept"):
        assert getattr(read, name) == getattr(record, name)
        assert type(getattr(read, name)) is type(getattr(record, name))
    np.testing.assert_equal(read.number, record.number)
    np.testing.assert_array_equal(read.series, record.series)


@dataclass(frozen=True, eq=False)
class Small:
    """Of which arrays stand in the file."""

    word: Literal["a", "b"]
    table: np.ndarray
    pair: Pair | None = None
    pairs: tuple[Pair, ...] = ()


@pytest.mark.parametrize("table", [[[1.0, np.nan]], np.zeros((0, 5)), [True, False]])
def test_arrays_are_in_the_file_unless_they_are_kept_apart(table: Any) -> None:
    made = Small("a", np.array(table), Pair(1.0, 2))
    plain = json.loads(json.dumps(plain_json(to_plain(made))))
    read = from_plain(Small, plain)
    np.testing.assert_array_equal(read.table, made.table)
    assert (read.table.dtype, read.table.shape) == (made.table.dtype, made.table.shape)
    assert read.pair == made.pair


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"word": "c"}, "found 'c', expected one of 'a', 'b'"),
        ({"pair": 3}, "Pair: found int, expected its fields by name"),
        ({"pair": {"left": "one", "right": 2}}, "could not convert"),
        ({"pair": {"left": 1.0, "right": 2.5}}, "found 2.5, expected a value of type int"),
        ({"strange": 1}, "Small has no strange"),
    ],
)
def test_data_of_another_form_are_refused(change: dict[str, Any], message: str) -> None:
    plain = {"word": "a", "table": [1.0]} | change
    with pytest.raises((KeyError, TypeError, ValueError), match=message):
        from_plain(Small, plain)
