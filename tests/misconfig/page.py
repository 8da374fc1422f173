"""The page of the docs about the corpus: each kind of misconfiguration, and whether `check` catches it."""

from __future__ import annotations

from collections.abc import Sequence

from tests.misconfig.corpus import Case, Figures, Outcome, figures, kinds, outcomes

TOP = """# Misconfigurations

What can be wrong with a robot's files, by kind, and whether `rbxcompose check` reports it. Each kind has a folder of
small robots in `tests/misconfig/wrong/`, each with its error marked in a comment. `tests/misconfig/right/` holds
unusual but correct robots; none of them may give a finding. This page is generated from the output of `check`.
"""
HEADER = ("| kind | what is wrong | robots | findings | reported |", "| --- | --- | ---: | --- | ---: |")
CANNOT = (
    "- Incompatible qualities of service: they belong to the type of a port, so both sides have the same.",
    "- A parameter file for a node with another name or namespace: settings are in the component's own entry.",
    "- A wrong frame in a goal: places are in `map`, and skills declare which frames they look up.",
    "- Mixed simulated and wall time: the whole robot runs on one clock.",
    "- Fixed pauses instead of a start order: a component starts when those in its `starts_after` are active.",
)


def page() -> str:
    """Return the page as it should be."""
    found = outcomes()
    rows = [
        _row(kind, about, [outcome for outcome in found if outcome.case.kind == kind])
        for kind, about in kinds().items()
    ]
    missed = [f"- `{outcome.case.name}`: {outcome.case.misses}" for outcome in found if outcome.case.misses]
    otherwise = [f"- `{outcome.case.name}`" for outcome in found if outcome.is_elsewhere and outcome.case.kind]
    sections = {
        "Figures": _figures(figures()),
        "Kinds": [*HEADER, *rows],
        "Reported differently than a user would want": otherwise,
        "Not reported": missed,
        "What cannot be written": list(CANNOT),
    }
    return TOP + "".join(f"\n## {title}\n\n{chr(10).join(lines)}\n" for title, lines in sections.items())


def _figures(count: Figures) -> list[str]:
    return [
        "| | |",
        "| --- | ---: |",
        f"| wrong robots | {count.wrong} |",
        f"| reported at the line of the error | {count.caught} ({count.caught / count.wrong:.0%}) |",
        f"| reported elsewhere, or differently than a user would want | {count.elsewhere} |",
        f"| not reported | {count.missed} |",
        f"| unwanted findings in wrong robots | {count.noise} |",
        f"| kinds | {count.kinds} |",
        f"| kinds with every robot reported at its line | {count.kinds_caught} |",
        f"| correct robots | {count.right} |",
        f"| correct robots with a finding (false alarms) | {count.false_alarms} |",
    ]


def row_start(kind: str, about: str, cases: Sequence[Case]) -> str:
    """Return what the row of a kind says before it tells what came of its cases."""
    codes = sorted({code for case in cases for _, _, code in case.expected})
    links = " ".join(f"[{code}](findings/{code}.md)" for code in codes)
    return f"| `{kind}` | {about} | {len(cases)} | {links} |"


def _row(kind: str, about: str, found: list[Outcome]) -> str:
    caught = sum(outcome.is_caught for outcome in found)
    told = "all" if caught == len(found) else f"{caught} of {len(found)}"
    return f"{row_start(kind, about, [outcome.case for outcome in found])} {told} |"
