"""The reference pages are complete: every flag, error, name, result file, key and command has its place."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
import typer

from calib import interface
from calib.capture.bus import CaptureError
from calib.cli import app
from swimcal.errors import InputError, SwimcalError
from swimcal.flags import FLAG_KINDS
from swimcal.session_file import CameraCalibration, SessionFile
from tests.test_documents import ROOT, anchors, on_the_site

REFERENCE = ROOT / "docs" / "reference"
PACKAGES = ("swimcal", "tracking", "fitting", "swimsynth", "diagnosis", "reports", "swimgym", "calib")


@cache
def nodes() -> list[ast.AST]:
    """Calls, assignments and tuples of all code."""
    trees = (ast.parse(path.read_text()) for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return [node for tree in trees for node in ast.walk(tree) if isinstance(node, (ast.Call, ast.Assign, ast.Tuple))]


def called(name: str) -> Iterator[ast.Call]:
    """Calls of a function with arguments."""
    for node in nodes():
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name and node.args:
            yield node


def constants() -> dict[str, str]:
    """Texts that have a name, by that name."""
    found = {}
    for node in nodes():
        if isinstance(node, ast.Assign):
            names, texts = (
                each.elts if isinstance(each, ast.Tuple) else [each] for each in (node.targets[0], node.value)
            )
            for name, text in zip(names, texts, strict=False):
                if isinstance(name, ast.Name) and isinstance(text, ast.Constant) and isinstance(text.value, str):
                    found[name.id] = text.value
    return found


def kinds() -> set[str]:
    """Kinds of flags that the code has: those that are listed, those that are set, and those of the lens."""
    named = constants()
    found = set(FLAG_KINDS)
    for call in called("Flag"):
        kind = call.args[0]
        found |= {kind.value} if isinstance(kind, ast.Constant) else set()
        found |= {named[kind.id]} if isinstance(kind, ast.Name) and kind.id in named else set()
    of_lens = [node.elts[0] for node in nodes() if isinstance(node, ast.Tuple) and len(node.elts) == 2]
    texts = {text.value for text in of_lens if isinstance(text, ast.Constant) and isinstance(text.value, str)}
    return found | {text for text in texts if text.startswith("lens_")}


def classes_of(error: type) -> Iterator[type]:
    """An error and all that derive from it; what derives from `InputError` reaches users as that."""
    yield error
    if error is InputError:
        return
    for derived in error.__subclasses__():
        yield from classes_of(derived)


def test_every_flag_has_its_anchor_and_says_what_to_do_and_there_are_no_others() -> None:
    entries = re.split(r"^##? .*$", (REFERENCE / "flags.md").read_text(), flags=re.MULTILINE)
    found = dict(entry.partition("\n")[::2] for part in entries for entry in re.split(r"^### ", part, flags=re.M)[1:])
    assert [kind for kind in sorted(kinds()) if "*Do:*" not in found.get(kind, "")] == []
    assert found.keys() <= kinds()


@pytest.mark.parametrize(
    "error", [*classes_of(SwimcalError), *classes_of(CaptureError)], ids=lambda error: error.__name__
)
def test_every_error_has_its_anchor(error: type) -> None:
    if error is not SwimcalError and error.__module__.startswith(PACKAGES):
        assert error.__name__.lower() in anchors(REFERENCE / "errors.md")


def test_every_error_has_messages() -> None:
    page = on_the_site(REFERENCE / "messages.md")
    bases = {"SwimcalError", "CaptureError", "Interrupted"}
    raised = {each.__name__ for error in (SwimcalError, CaptureError) for each in classes_of(error)} - bases
    assert [name for name in raised if f"[{name}](errors.md" not in page] == []
    assert anchors(REFERENCE / "messages.md") >= {"no-such-trial-to-fit", "boxes-without-a-marker", "no-workers"}


@pytest.mark.parametrize("name", interface.__all__)
def test_every_public_name_is_documented(name: str) -> None:
    assert re.search(rf"auto\w+:: (calib\.)?{name}$", on_the_site(REFERENCE / "interface.md"), re.MULTILINE)


def test_every_result_file_has_its_keys() -> None:
    page = on_the_site(REFERENCE / "results.md")
    for call in called("ResultFile"):
        file, record = call.args[:2]
        assert isinstance(file, ast.Constant)
        assert isinstance(record, ast.Name)
        assert f"\n## {file.value}\n" in page
        assert f"\n### {record.id}\n" in page


def test_every_key_of_a_session_is_described() -> None:
    page = (REFERENCE / "session-folder.md").read_text()
    for name, field in SessionFile.model_fields.items():
        assert f"[{name}]" in page
        shape = field.annotation
        table = next(t for t in (shape, *getattr(shape, "__args__", ())) if hasattr(t, "model_fields"))
        for key in table.model_fields:
            assert re.search(rf"^{key} = ", page, re.MULTILINE), key
    for key in CameraCalibration.model_fields:
        assert f"`{key}" in page


def test_every_command_is_described() -> None:
    page = on_the_site(REFERENCE / "command-line.md")
    missing, groups = [], [typer.main.get_command(app)]
    while groups:
        for name, command in groups.pop().commands.items():  # type: ignore[attr-defined]
            groups += [command] if hasattr(command, "commands") else []
            example = (command.epilog or "").removeprefix("Example: ")
            told = hasattr(command, "commands") or name == "capture" or (example and example in page)
            missing += [] if told else [name]
    assert missing == []
    assert anchors(REFERENCE / "command-line.md") >= {"capture-scan", "capture-run", "capture-emulate"}


def test_pages_of_the_site_are_listed_in_its_menu() -> None:
    docs = ROOT / "docs"
    menu = re.findall(r"^(?:.*<)?([\w/.-]+)>?$", (docs / "index.md").read_text(), re.MULTILINE)
    listed = {(docs / f"{name}.md").resolve() for name in menu}
    assert {page for page in docs.rglob("*.md") if page != docs / "index.md"} <= listed | {Path()}
