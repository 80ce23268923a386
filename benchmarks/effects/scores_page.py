"""What came of a suite as a page that opens offline, as JSON, and its figures as pictures."""

import json
from collections.abc import Mapping, Sequence

from benchmarks.effects.cases import write_cases
from benchmarks.effects.folder import SuiteFolder
from benchmarks.effects.followed import FollowedScore
from benchmarks.effects.goals import CLEAR_ALONE, GOALS, GOALS_FOLLOWED, GOALS_WITHOUT, Goal
from benchmarks.effects.report import estimate_text, percent_text, share_text, together_rows
from benchmarks.effects.score import Score
from benchmarks.effects.score_figures import (
    by_detectability_figure,
    confusion_figure,
    goals_figure,
    reliability_figure,
    shrinkage_figure,
)
from benchmarks.effects.scoring import PROGRAM, Outcome
from benchmarks.effects.shares import Estimate, Share
from benchmarks.effects.together import TogetherScore
from benchmarks.effects.without import WithoutScore
from benchmarks.reality.mechanisms import CATALOGUED
from reports.blocks import Column, Plot, Plots, Prose, Section, Table
from reports.page import render_page
from session import plain_json, write_whole

_ORDER = tuple(name for names in CATALOGUED.values() for name in names)
_DOTS_PER_INCH = 160.0
_D = (
    "Detectability d: how far what an effect does lies from what its nearest rival, refitted, can do, in standard "
    "deviations of noise, nuisances and discrepancy; two effects at d are confused in a share Φ(−d / 2) of cases."
)


def write_scores(suite: SuiteFolder, outcome: Outcome) -> None:
    """Writes `scores.json`, `scores.html`, `figures/*.png` and `cases.jsonl` into the folder of the suite.

    Raises:
        ResultsNotWritable: they cannot be written.
    """
    write_whole(suite.folder / "scores.json", json.dumps(plain_json(outcome.to_json()), indent=1) + "\n")
    if PROGRAM in outcome.scores:
        write_cases(suite.folder / "cases.jsonl", outcome.scores[PROGRAM])
    write_whole(suite.folder / "scores.html", render_scores(outcome))
    for drawn in _drawn(outcome):
        write_whole(suite.folder / "figures" / f"{drawn.name}.png", drawn.png(_DOTS_PER_INCH))


def render_scores(outcome: Outcome) -> str:
    """The page."""
    score = _main(outcome.scores)
    kinds = [case.answer.kind for case in score.cases]
    plots = {drawn.name: drawn for drawn in _drawn(outcome)}
    sections = [
        Section("Against what is asked", "asked", (Plots((plots["goals"],)), _goals_table(outcome.scores))),
        Section(
            "The right name",
            "names",
            (
                Prose(_D),
                Plots((plots["by_detectability"], plots["reliability"])),
                *([Plots((plots["confusion"],))] if "confusion" in plots else []),
                _names_table(score),
            ),
        ),
    ]
    if "shrinkage" in plots:
        sections.append(Section("How far the gap shrinks", "shrinking", (Plots((plots["shrinkage"],)),)))
    if outcome.without is not None:
        blocks = (Plots((plots["without_goals"], plots["without_by_detectability"])), _without_table(outcome.without))
        sections.append(Section("Without the effect in the catalogue", "without", blocks))
    if outcome.followed is not None:
        table = _followed_table(outcome.followed)
        sections.append(Section("With the trial that was recommended", "followed", (table,)))
    if outcome.together is not None:
        sections.append(Section("All effects at once", "together", (_together_table(outcome.together),)))
    if score.look_alikes:
        sections.append(Section("What cannot be told apart", "alike", (_look_alikes_table(score),)))
    return render_page(
        "report.html.j2",
        title="Withheld effects – swimcal",
        session="Withheld effects",
        byline=f"{len(kinds)} sessions: {kinds.count('null')} with nothing in them, {kinds.count('single')} with one "
        f"effect, {kinds.count('double')} with two, {kinds.count('many')} with many, "
        f"{kinds.count('outside')} with something that no catalogue holds",
        sections=sections,
    )


def _drawn(outcome: Outcome) -> list[Plot]:
    scores, score = outcome.scores, _main(outcome.scores)
    who = next(iter(scores))
    found = [
        Plot(
            goals_figure({name: each.headline for name, each in scores.items()}, GOALS),
            "goals",
            "Shares of sessions beside what is asked (shaded).",
        ),
        Plot(
            by_detectability_figure({name: each.by_detectability for name, each in scores.items()}, "right name first"),
            "by_detectability",
            "Sessions with one effect: how often it is the first name, by how detectable it is.",
        ),
        Plot(
            reliability_figure(score),
            "reliability",
            f"Probabilities of the {who}: on the diagonal they come true as often as they say.",
        ),
    ]
    if score.confusion:
        caption = f"Sessions with one effect and d ≥ 5: what the {who} named first."
        found.append(Plot(confusion_figure(score.confusion, _ORDER), "confusion", caption))
    if any(case.told.shrinkage is not None for case in score.cases):
        caption = "Shrinkage of the gap on held-out swims: what was told, with its interval, over what can be reached."
        found.append(Plot(shrinkage_figure(score), "shrinkage", caption))
    if outcome.without is not None:
        of = outcome.without
        found += [
            Plot(
                goals_figure({PROGRAM: of.headline}, GOALS_WITHOUT),
                "without_goals",
                "The same sessions, diagnosed by a catalogue that lacks the effect that is there.",
            ),
            Plot(
                by_detectability_figure({PROGRAM: of.by_detectability}, "unexplained"),
                "without_by_detectability",
                "How often such a session is told to be unexplained, by how detectable the effect is.",
            ),
        ]
    return found


def _goals_table(scores: Mapping[str, Score]) -> Table:
    """Intervals for the first alone: there is no room for those of the rules, and the figure shows them."""
    shares = {name: score.headline for name, score in scores.items()}
    first, *rules = shares.values()
    rows = [
        (goal.label, goal.asked, share_text(first[what]), *(share_text(each[what], interval=False) for each in rules))
        for what, goal in GOALS.items()
    ]
    rows += [
        ("calibration error", "≤ 0.05", *_numbers([score.calibration_error for score in scores.values()])),
        (
            "the same, probabilities ≥ 10 %",
            "≤ 0.05",
            *_numbers([score.calibration_error_of_suspects for score in scores.values()]),
        ),
        (
            "by chance, were these right",
            "",
            *_numbers([score.calibration_error_by_chance for score in scores.values()]),
        ),
        ("shrinkage over the oracle's, d ≥ 5", "≥ 0.9", *_numbers([s.shrinkage_of_oracle for s in scores.values()])),
        ("share of the gap on its stage", "", *_numbers([s.share_on_stage for s in scores.values()])),
        ("seconds a session", "≤ 60", *_numbers([score.seconds for score in scores.values()])),
    ]
    said = [score.said_right for score in scores.values()]
    rows.append(
        (
            "what is said holds what is there",
            "",
            share_text(said[0]),
            *(share_text(s, interval=False) for s in said[1:]),
        )
    )
    alone = [score.clear_alone for score in scores.values()]
    rows += [
        (
            f"{label}, d ≥ 5",
            "",
            share_text(alone[0][what]),
            *(share_text(each[what], interval=False) for each in alone[1:]),
        )
        for what, label in CLEAR_ALONE.items()
    ]
    rows += [
        (f"{label}, all d: reachable", "", percent_text(_main(scores).reachable[what]), *("" for _ in rules))
        for what, label in CLEAR_ALONE.items()
    ]
    columns = (Column("", numeric=False), Column("asked"), *(Column(name) for name in scores))
    caption = (
        "Shares, medians and errors, the first column with 95 % intervals (of shares by Wilson, of what chance would "
        "make of the probabilities that were told by drawing whether they come true, else by drawing "
        "sessions anew). Last, of clear sessions alone; and, "
        "reachable, the share of all sessions, weak ones with them, that a matched filter which knows what to look "
        "for would see with one false alarm in a hundred."
    )
    return Table(caption, columns, tuple(rows))


def _look_alikes_table(score: Score) -> Table:
    rows = tuple(
        (name.replace("_", " "), rival.replace("_", " "), str(count))
        for name, row in score.look_alikes.items()
        for rival, count in sorted(row.items(), key=lambda item: -item[1])
    )
    columns = (Column("present", numeric=False), Column("not told from", numeric=False), Column("sessions"))
    return Table("Effects that few rivals follow, each refitted: here a set is the right answer.", columns, rows)


def _without_table(score: WithoutScore) -> Table:
    return _asked_table("Shares with their 95 % interval (Wilson).", score.headline, GOALS_WITHOUT)


def _followed_table(score: FollowedScore) -> Table:
    caption = (
        "Sessions in which an effect that is there was told as one of several, diagnosed once more with the first "
        "trial that was recommended. Shares with their 95 % interval (Wilson)."
    )
    return _asked_table(caption, score.headline, GOALS_FOLLOWED)


def _together_table(score: TogetherScore) -> Table:
    caption = (
        "How often all effects at once, each a little, are called for; and, where they are, how far held-out speeds "
        "are off what was measured: medians, and shares with their 95 % interval."
    )
    columns = (Column("", numeric=False), Column(PROGRAM))
    return Table(caption, columns, tuple(together_rows(score)))


def _asked_table(caption: str, shares: Mapping[str, Share], goals: Mapping[str, Goal]) -> Table:
    rows = tuple((goal.label, goal.asked, share_text(shares[what])) for what, goal in goals.items())
    return Table(caption, (Column("", numeric=False), Column("asked"), Column(PROGRAM)), rows)


def _numbers(estimates: Sequence[Estimate]) -> tuple[str, ...]:
    return tuple(estimate_text(each, interval=number == 0) for number, each in enumerate(estimates))


def _names_table(score: Score) -> Table:
    """By how detectable it is, then, of clear ones, by effect."""
    levels, effects = score.in_three_by_detectability, score.in_three_by_effect
    found = [
        (f"d = {level:g}" if level else "d below 1", first, levels[level])
        for level, first in score.by_detectability.items()
    ]
    found += [(name.replace("_", " "), first, effects[name]) for name, first in score.by_effect.items()]
    rows = tuple((label, share_text(first), share_text(among)) for label, first, among in found)
    columns = (Column("", numeric=False), Column("right name first"), Column("among at most three"))
    return Table("Sessions with one effect by its detectability, then those with d ≥ 5 by effect.", columns, rows)


def _main(scores: Mapping[str, Score]) -> Score:
    """Of the program, or of the first rule where none was run."""
    return next(iter(scores.values()))
