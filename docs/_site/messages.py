"""Markdown of every error message, from the code that raises it: what is wrong, what is expected, what to do."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
TOPICS = {
    "The session folder and its recordings": (
        "swimcal/session",
        "swimcal/create_session",
        "swimcal/toml",
        "swimcal/tables",
        "swimcal/tracks",
        "swimcal/motor_log",
        "swimcal/results",
        "swimcal/stage",
        "swimcal/errors",
    ),
    "The robot and effects": ("swimcal/",),
    "Start boxes and corrections": (
        "tracking/boxes",
        "tracking/find_boxes",
        "tracking/body_chain",
        "tracking/edits",
        "tracking/follow_video",
    ),
    "Tracks of other programs": (
        "tracking/foreign",
        "tracking/other_programs",
        "tracking/plain_table",
        "tracking/formats",
        "tracking/tracked",
        "tracking/gaps",
    ),
    "Videos, camera and lens": ("tracking/", "reports/record"),
    "Trials and fits": ("fitting/", "diagnosis/", "swimsynth/"),
    "Policies": ("swimgym/",),
    "Clusters": ("calib/batch.py",),
    "The motor": ("calib/capture/",),
    "Options and results": ("calib/",),
}
"""Beginnings of the files that messages come from, by topic; the first that fits counts."""
RAISED = (
    "NotEnoughData",
    "NotConverged",
    "SimulationDiverged",
    "ModelMismatch",
    "SessionLocked",
    "ResultsNotWritable",
    "UserError",
    "MotorFault",
    "NoAnswer",
)
_ORDER = ("file", "where", "what", "found", "expected", "choices", "next_step")  # fields of `swimcal.errors.Fault`
_LONGEST = 70  # A heading has at most this many characters.


class Message(NamedTuple):
    """Message that a user may read; parts that differ from case to case are "…"."""

    error: str
    what: str
    expected: str = ""
    step: str = ""


def messages() -> str:
    """Return a heading for each topic, and below it one for each message."""
    told: dict[str, dict[str, Message]] = {topic: {} for topic in TOPICS}
    for path in sorted(
        path
        for folder in {place.split("/")[0] for places in TOPICS.values() for place in places}
        for path in (ROOT / folder).rglob("*.py")
    ):
        name = path.relative_to(ROOT).as_posix()
        topic = next((topic for topic, places in TOPICS.items() if name.startswith(places)), None)
        for message in _find_messages(path) if topic else ():
            told[topic or ""].setdefault(message.what, message)
    return "\n".join(
        line for topic, found in told.items() for line in (f"## {topic}\n", *map(_format_entry, found.values()))
    )


def _format_entry(message: Message) -> str:
    """Return a heading, the rest of the message, and which error it is."""
    head = re.split(r"; |: | \(|, but |\. ", message.what)[0]
    head = head if len(head) <= _LONGEST else head[:_LONGEST].rsplit(" ", 1)[0] + " …"
    body = [_format_sentence(message.what)] if head != message.what else []
    body += [f"*Expected:* {_format_sentence(message.expected)}"] if message.expected.strip("… ") else []
    body += [f"*Do:* {_format_sentence(message.step)}"] if message.step.strip("… ") else []
    error = f"[{message.error}](errors.md#{message.error.lower()})"
    return f"### {_escape(head)}\n\n{' '.join([*map(_escape, body), error])}\n"


def _format_sentence(text: str) -> str:
    return text if text.endswith((".", "?", "!", "…")) else f"{text}."


def _escape(text: str) -> str:
    return text.replace("<", "\\<").replace("[", "\\[").replace("]", "\\]")


def _find_messages(path: Path) -> Iterator[Message]:
    tree = ast.parse(path.read_text())
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    returned = {function.name: list(_list_returned(function)) for function in functions}
    for function in functions:
        names = returned | dict(_list_assigned(function))
        for call in [node for node in ast.walk(function) if isinstance(node, ast.Call)]:
            yield from _build_messages(call, names)


def _build_messages(call: ast.Call, names: dict[str, list[ast.expr]]) -> Iterator[Message]:
    name = ast.unparse(call.func).rsplit(".", 1)[-1]
    given = {each.arg: each.value for each in call.keywords if each.arg}
    if name in RAISED and call.args:
        for text in _list_texts(call.args[0], names):
            yield Message(name, text.removeprefix("…: ").removeprefix("trial …: "))
        return
    if name == "Fault":
        given |= dict(zip(_ORDER, call.args, strict=False))
    elif name == "add" and len(call.args) >= 2:
        given |= {"where": call.args[0], "what": call.args[1]}
    elif name == "key_error" and call.args:
        given |= {"what": call.args[0]}
    else:
        return
    parts = {
        key: " ".join(_list_texts(value, names)[:1]) for key, value in given.items() if key in ("expected", "next_step")
    }
    for what in _list_texts(given["what"], names) if "what" in given else ():
        yield Message("InputError", what, parts.get("expected", ""), parts.get("next_step", ""))


def _list_assigned(function: ast.FunctionDef) -> Iterator[tuple[str, list[ast.expr]]]:
    """Yield the names of a function with what they are given."""
    found: dict[str, list[ast.expr]] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            pairs = zip(target.elts, value.elts, strict=False) if both else [(target, value)]  # type: ignore[attr-defined]
            for name, given in pairs:
                if isinstance(name, ast.Name):
                    found.setdefault(name.id, []).append(given)
    yield from found.items()


def _list_returned(function: ast.FunctionDef) -> Iterator[ast.expr]:
    for node in ast.walk(function):
        if isinstance(node, ast.Return) and node.value is not None:
            yield node.value


def _list_texts(node: ast.expr, names: dict[str, list[ast.expr]], depth: int = 2) -> list[str]:
    """List the texts that an expression may be, with "…" for what is not known; none where nothing is."""
    if isinstance(node, ast.Name) and depth:
        return [text for given in names.get(node.id, []) for text in _list_texts(given, names, depth - 1)]
    if isinstance(node, ast.Call) and (name := ast.unparse(node.func).removeprefix("self.")) in names and depth:
        return [text for given in names[name] for text in _list_texts(given, names, depth - 1)]
    if isinstance(node, ast.IfExp):
        return _list_texts(node.body, names, depth) + _list_texts(node.orelse, names, depth)
    text = _join_text(node)
    return [" ".join(text.split())] if any(letter.isalpha() for letter in text) else []


def _join_text(node: ast.expr) -> str:
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(each.value if isinstance(each, ast.Constant) else "…" for each in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _join_text(node.left) + _join_text(node.right)
    return ""
