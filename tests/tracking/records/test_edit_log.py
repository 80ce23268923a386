import pytest
from hypothesis import given
from hypothesis import strategies as st

from swimcal.errors import InputError
from tracking.edits import Drop, Edit, EditLog, Relabel, SetBox, Swap, Undo

MARKERS = ("nose", "neck", "tail_1")
FRAMES = 20

frame = st.integers(0, FRAMES - 1)
stretch = st.one_of(
    st.tuples(frame, frame).map(lambda pair: (min(pair), max(pair))), frame.map(lambda first: (first, None))
)
pairs = st.permutations(MARKERS).map(lambda names: tuple(names[:2]))
notes = st.text(max_size=8)
edits = st.one_of(
    st.builds(Swap, markers=pairs, frames=stretch, note=notes),
    st.builds(Drop, markers=st.permutations(MARKERS).map(tuple), frames=stretch, note=notes),
    st.builds(lambda pair, frames: Relabel(marker=pair[0], to=pair[1], frames=frames), pairs, stretch),
    st.builds(
        lambda marker, frame, box: SetBox(marker=marker, frame=frame, box=box),
        st.sampled_from(MARKERS),
        frame,
        st.tuples(*[st.floats(1, 99)] * 4),
    ),
)


def in_json(edit: Edit) -> str:
    return edit.model_dump_json(exclude_none=True)


def loaded(path, text: str) -> EditLog:
    path.write_text(text, encoding="utf-8")
    return EditLog.load(path, MARKERS, FRAMES)


def test_a_log_written_by_hand_is_read_with_its_lines(tmp_path):
    log = loaded(
        tmp_path / "f.edits.jsonl",
        '# the tail crosses\r\n{"op": "swap", "markers": ["nose", "neck"], "frames": [12, null]}\r\n\r\n'
        '{"op": "box", "marker": "nose", "frame": 3, "box": [10, 20, 5, 4]}\n{"op": "undo", "line": 2}',
    )
    assert [line for line, _ in log.edits] == [2, 4, 5]
    assert log.edits[0].edit == Swap(markers=("nose", "neck"), frames=(12, None))
    assert [line for line, _ in log.in_force] == [4]
    assert log.edits[1].edit.box == (10, 20, 5, 4)


@given(st.lists(edits, max_size=8))
def test_the_log_is_only_added_to_and_comes_back(tmp_path_factory, several):
    path = tmp_path_factory.mktemp("log") / "f.edits.jsonl"
    path.write_text("# by hand, without a line feed at the end")
    log = EditLog.load(path, MARKERS, FRAMES)
    for edit in several:
        before = path.read_bytes()
        log = log.append(in_json(edit))
        assert path.read_bytes().startswith(before)
    again = EditLog.load(path, MARKERS, FRAMES)
    assert again == log
    assert [edit for _, edit in again.edits] == several
    assert [line for line, _ in again.edits] == list(range(2, 2 + len(several)))


@given(st.lists(st.one_of(edits, st.integers(0, 7)), max_size=8))
def test_an_undo_leaves_what_was_in_force_before_the_edit(tmp_path_factory, several):
    log = EditLog(tmp_path_factory.mktemp("log") / "f.edits.jsonl", MARKERS, FRAMES)
    for one in several:
        if not isinstance(one, int):
            log = log.append(in_json(one))
        elif log.edits:
            log = log.append(in_json(Undo(line=log.edits[one % len(log.edits)].line)))
    line = len(log.edits) + 1
    undone = log.append(in_json(Drop(markers=("nose",)))).append(in_json(Undo(line=line)))
    assert undone.in_force == log.in_force
    redone = undone.append(in_json(Undo(line=line + 1)))
    assert [one.line for one in redone.in_force] == [*(one.line for one in log.in_force), line]


def test_all_faults_are_reported_at_once_with_their_lines(tmp_path):
    with pytest.raises(InputError) as raised:
        loaded(
            tmp_path / "f.edits.jsonl",
            "\n".join(
                [
                    '{"op": "swap", "markers": ["nose", "nek"], "frames": [5, 30]}',
                    '{"op": "drop", "markers": ["nose"], "frames": [9, 5]}',
                    "swap nose and neck",
                    '{"op": "swop"}',
                    '{"op": "drop", "marker": "nose"}',
                    '{"op": "box", "marker": "nose", "frame": -1, "box": [1, 2, 0, 3]}',
                    '{"op": "undo", "line": 9}',
                    '{"op": "relabel", "marker": "nose", "to": "nose"}',
                    "7",
                ]
            ),
        )
    assert str(raised.value).splitlines()[1:] == [
        "  1. line 1, swap: no such marker; found 'nek'; choices: nose, neck, tail_1. Did you mean 'neck'?",
        "  2. line 1, swap: no such frame; found 30; expected 0 to 19",
        "  3. line 2, drop: the frames are the wrong way round; found 9 to 5; expected first, last",
        "  4. line 3: not JSON; found 'swap nose and neck': Expecting value: line 1 column 1 (char 0); "
        'expected one edit, as {"op": "drop", "markers": ["nose"], "frames": [50, 61]}',
        "  5. line 4: no operation of the edit log; found 'swop'; "
        'expected one edit, as {"op": "drop", "markers": ["nose"], "frames": [50, 61]}; '
        "choices: swap, drop, relabel, box, undo. Did you mean 'swap'?",
        "  6. line 5, drop.markers: key is missing; expected a list",
        "  7. line 5, drop.marker: unknown key; found 'marker'; expected a known key; "
        "choices: note, frames, op, markers. Did you mean 'markers'?",
        "  8. line 6, box.frame: wrong value; found -1; expected greater than or equal to 0",
        "  9. line 6, box.box.2: wrong value; found 0; expected greater than 0",
        "  10. line 7, undo: no edit to undo; found line 9; expected the line of an edit above it; choices: 1",
        "  11. line 8, relabel: a marker relabelled as itself; found 'nose'; expected another marker in `to`",
        "  12. line 9: no operation of the edit log; found 7; "
        'expected one edit, as {"op": "drop", "markers": ["nose"], "frames": [50, 61]}; '
        "choices: swap, drop, relabel, box, undo",
    ]


def test_an_edit_that_does_not_fit_is_not_written(tmp_path):
    path = tmp_path / "f.edits.jsonl"
    log = EditLog.load(path, MARKERS, FRAMES).append('{"op": "drop", "markers": ["nose"], "note": "glint"}')
    before = path.read_bytes()
    for edit, message in (
        (Undo(line=2), "line 2, undo: no edit to undo"),
        (Drop(markers=("fin",)), "line 2, drop: no such marker"),
        (Drop(markers=("nose",), frames=(99, None)), "line 2, drop: no such frame; found 99"),
    ):
        with pytest.raises(InputError, match=message):
            log.append(in_json(edit))
    assert path.read_bytes() == before
    assert before.decode() == '{"op": "drop", "markers": ["nose"], "frames": [0, null], "note": "glint"}\n'
