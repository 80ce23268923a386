"""What pages tell to type: Python compiles and uses names that there are; command lines parse."""

import ast
import inspect
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

import calib
from calib.capture.functions import _parser
from calib.cli import app
from tests.test_documents import DOCUMENTS, ROOT

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
COMMANDS = typer.main.get_command(app)


def blocks(*languages: str) -> Iterator[Any]:
    """Code of pages, a parameter each."""
    for page in DOCUMENTS:
        for number, (language, text) in enumerate(BLOCK.findall(page.read_text()), 1):
            if language in languages:
                yield pytest.param(text, id=f"{page.relative_to(ROOT).as_posix()}-{number}")


def command_lines() -> Iterator[Any]:
    """Every use of `calib` in a block for a shell, as words."""
    for block in blocks("sh", "bash"):
        for line in block.values[0].splitlines():
            for number, part in enumerate(re.split(r"&&|\|| & ?$|;", without_comment(line)), 1):
                words = shlex.split(part, comments=True)
                if words and Path(words[0]).name == "calib":
                    yield pytest.param(words[1:], id=f"{block.id}-{number}-{' '.join(words[1:4])}")


def without_comment(line: str) -> str:
    """A line without its comment, so that an apostrophe in it opens no text."""
    return re.sub(r"(^|\s)#.*$", "", line)


@pytest.mark.parametrize("code", [*blocks("python")])
def test_python_compiles_and_uses_names_and_arguments_that_there_are(code: str) -> None:
    tree = ast.parse(code)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "calib":
            assert hasattr(calib, node.attr), node.attr
        if isinstance(node, ast.Call) and re.fullmatch(r"calib\.\w+", name := ast.unparse(node.func)):
            known = inspect.signature(getattr(calib, name.removeprefix("calib."))).parameters
            assert {each.arg for each in node.keywords} <= set(known), ast.unparse(node)


@pytest.mark.parametrize("words", [*command_lines()])
def test_command_lines_parse(words: list[str]) -> None:
    command = COMMANDS
    while words and not words[0].startswith("-") and words[0] in getattr(command, "commands", {}):
        command, words = command.commands[words[0]], words[1:]
        if command.name == "capture":
            _parser("calib capture").parse_args(words)
            return
    assert not hasattr(command, "commands"), words
    command.make_context(command.name, list(words))
