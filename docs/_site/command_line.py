"""Markdown of the command line, from the commands themselves."""

import argparse
import re
from collections.abc import Iterator

import typer
from typer.cli import get_docs_for_click


def command_line() -> str:
    """Return every command with its arguments, options and example, a heading each."""
    from calib.capture import functions as capture
    from calib.cli import app

    program = typer.main.get_command(app)
    page = get_docs_for_click(obj=program, ctx=typer.Context(program, info_name="calib"), name="calib")
    overview, _, commands = page.partition("**Commands**:\n")[2].partition("\n## ")
    overview = re.sub(r"^\* `(.+?)`:", r"* [`\1`](#\1):", overview, flags=re.M)
    commands = re.sub(r"^Example: (.+)$", r"```sh\n\1\n```", f"## {commands}", flags=re.M)
    commands = re.sub(r"^##+ `calib (.+)`$", r"### \1", commands, flags=re.M)
    return "\n".join([overview, commands, *_list_motor_commands(capture._parser("calib capture"))])


def _list_motor_commands(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Yield the commands of the motor, which need nothing but the standard library and so have another parser."""
    (group,) = (each for each in parser._actions if isinstance(each, argparse._SubParsersAction))
    for word, one in group.choices.items():
        yield f"### capture {word}\n\n```text\n{one.format_help()}```\n"
