"""The command line as Markdown, from the commands themselves."""

import argparse
import inspect
from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

import typer


def command_line() -> str:
    """Every command with its arguments, options and example; a heading each."""
    from calib.capture import command as capture
    from calib.cli import app

    lines = [*_overview(typer.main.get_command(app))]
    for name, command in _commands(typer.main.get_command(app), "calib"):
        if name == "calib capture":
            lines += [*_capture(capture._parser("calib capture"))]
        else:
            lines += [*_described(name, command)]
    return "\n".join(lines)


def _overview(program: Any) -> Iterator[str]:
    """A table of the commands with what each is for; none where the program does not say it in a few words."""
    told = [(name, command.short_help) for name, command in _commands(program, "calib") if command.short_help]
    if told:
        rows = [f"| [`{name}`](#{_anchor(name)}) | {about} |" for name, about in told]
        yield "\n".join(["| command | makes |\n|---|---|", *rows, ""])


def _anchor(name: str) -> str:
    return {"capture": "capture-scan"}.get(name := name.removeprefix("calib "), name.replace(" ", "-"))


def _commands(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    """All that do something, by their full names; those of a group after each other."""
    below = getattr(command, "commands", None)
    if below is None:
        yield name, command
        return
    for word, one in below.items():
        yield from _commands(one, f"{name} {word}")


def _described(name: str, command: Any) -> Iterator[str]:
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    options = [each for each in command.params if each.param_type_name == "option" and each.name != "help"]
    yield f"### {name.removeprefix('calib ')}\n"
    usage = " ".join([name, *map(_shown, arguments), *(["[OPTIONS]"] if options else [])])
    yield f"```text\n{usage}\n```\n"
    yield inspect.cleandoc(command.help or "") + "\n"
    rows = [(f"`{_shown(each)}`", _help(each), "") for each in arguments]
    rows += [(_flags(each), _help(each), _default(each)) for each in options]
    yield from _table(rows)
    if command.epilog:
        yield f"```sh\n{command.epilog.removeprefix('Example: ')}\n```\n"


def _shown(argument: Any) -> str:
    return str(argument.metavar or argument.name.upper())


def _flags(option: Any) -> str:
    """The option's names, and what it takes."""
    names = ", ".join(f"`{each}`" for each in (*option.opts, *option.secondary_opts))
    if option.is_flag:
        return names
    kind = _of_one(option.type_descriptor.annotation)
    if get_origin(kind) is Literal:
        return f"{names} {' or '.join(f'`{each}`' for each in get_args(kind))}"
    return f"{names} *{_WORDS.get(kind, 'text')}*"


_WORDS: dict[Any, str] = {Path: "file", int: "number", float: "number"}


def _of_one(annotation: Any) -> Any:
    """The type of one value: without None and lists."""
    while get_origin(annotation) in (Union, UnionType, list):
        annotation = next(each for each in get_args(annotation) if each is not type(None))
    return annotation


def _help(parameter: Any) -> str:
    return str(parameter.help or "")


def _default(option: Any) -> str:
    default = option.default
    return "" if default in (None, "", False, ()) or callable(default) else f"`{default}`"


def _table(rows: list[tuple[str, str, str]]) -> Iterator[str]:
    if rows:
        cells = [tuple(cell.replace("|", "\\|") for cell in row) for row in rows]
        yield "\n".join(["| | | default |", "|---|---|---|", *(f"| {' | '.join(row)} |" for row in cells)]) + "\n"


def _capture(parser: argparse.ArgumentParser) -> Iterator[str]:
    """The commands of the motor, which need nothing but the standard library and so have another parser."""
    (group,) = (each for each in parser._actions if isinstance(each, argparse._SubParsersAction))
    about = {each.dest: each.help or "" for each in group._choices_actions}
    for word, one in group.choices.items():
        options = [each for each in one._actions if each.dest != "help"]
        yield f"### capture {word}\n"
        yield f"```text\n{' '.join(one.format_usage().removeprefix('usage: ').replace('[-h] ', '').split())}\n```\n"
        yield f"{about[word].capitalize()}.\n"
        yield from _table([(_of_capture(each), _help_of_capture(each), "") for each in options])


def _help_of_capture(action: argparse.Action) -> str:
    return (action.help or "").replace("%(default)s", f"{action.default}")


def _of_capture(action: argparse.Action) -> str:
    names = ", ".join(f"`{each}`" for each in action.option_strings)
    if action.choices:
        return f"{names} {' or '.join(f'`{each}`' for each in action.choices)}"
    return names if action.nargs == 0 else f"{names} *{'text' if action.type is None else _WORDS[action.type]}*"
