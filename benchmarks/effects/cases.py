"""What is scored as a file, a line a session: shards made and diagnosed apart are scored together, their lines in one.

A line holds the answer, which is no secret any more, and what was told, by the contract of `diagnosis.json`.
"""

import json
from dataclasses import asdict
from pathlib import Path

from benchmarks.effects.answer import Answer
from benchmarks.effects.score import Case, Score
from benchmarks.effects.told import told_of
from session import FaultCollector, InputError, plain_json, write_whole


def write_cases(path: Path, score: Score) -> None:
    """Writes a line for each session.

    Raises:
        ResultsNotWritable: it cannot be written.
    """
    lines = [{"answer": asdict(case.answer), "told": case.told.to_json()} for case in score.cases]
    write_whole(path, "".join(json.dumps(plain_json(line)) + "\n" for line in lines))


def read_cases(path: Path) -> Score:
    """Reads what `write_cases` wrote, or several such files one after the other.

    Raises:
        InputError: it cannot be read, holds a session twice, or something that is no line of it; all at once.
    """
    faults, cases, seen = FaultCollector(str(path)), [], set()
    try:
        lines = path.read_text().splitlines()
    except (OSError, ValueError) as error:
        faults.add("", "cannot be read", found=str(error), expected="a cases.jsonl", next_step="Give another file.")
        faults.raise_if_any()
        raise
    if not lines:
        faults.add("", "holds no case", found="nothing", expected="a line a session", next_step="Give another file.")
    for number, line in enumerate(lines, start=1):
        try:
            stands = json.loads(line)
            cases.append(Case(Answer.of(stands["answer"]), told_of(stands["told"], f"{path}:{number}")))
        except InputError as error:
            faults.extend_capped(list(error.faults))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            expected, next_step = "a line of a cases.jsonl", "Write the file anew with --part score."
            faults.add(f"line {number}", "is no case", found=repr(error), expected=expected, next_step=next_step)
        else:
            if (name := cases[-1].answer.session) in seen:
                faults.add(
                    f"line {number}",
                    "a session stands there twice",
                    found=name,
                    expected="each once",
                    next_step="Remove one of the lines.",
                )
            seen.add(name)
    faults.raise_if_any()
    return Score(tuple(cases))
