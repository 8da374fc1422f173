"""The corpus of misconfigured robots: what each is, what `check` should say of it and where, and what it does say.

A case is one file, or a folder of files. A robot stands for itself; a mission is checked on the robot beside this file.
Comments tell what is expected: `# expect: CODE` at the line of the mistake, `# expect-next: CODE` on the line above it,
`# noise: CODE` for findings that only follow from it, `# misses: why` at a mistake that no finding tells. At the top
stand `# check: OPTIONS` (`--profile NAME`, `--set PATH=VALUE`, `--real`) and `# environment: NAME=VALUE`.
"""

from __future__ import annotations

import re
import shlex
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import yaml

from rbxcompose.base.findings import Finding
from rbxcompose.commands.finding_pages import all_kinds, title_of
from rbxcompose.compiler.compile import compile_robot

HERE = Path(__file__).parent
EXPECT = re.compile(r"# expect(-next)?: ([A-Z0-9, ]+)$")
OPTION = re.compile(r"^# (check|environment): (.*)$", re.MULTILINE)
NOISE = re.compile(r"# noise: ([A-Z0-9, ]+)$", re.MULTILINE)
MISSES = re.compile(r"# misses: (.*)$", re.MULTILINE)
KNOWN = (".yaml", ".urdf", ".scene", ".stl", ".xyz")  # endings of files of a case
ROBOT, MISSION = "robot.yaml", "mission.yaml"
VALUES = "values:\n  battery: battery.battery_level\n"  # for missions that read it

Mark = tuple[str, int, str]  # file, line, code


@dataclass(frozen=True, slots=True)
class Case:
    """One robot of the corpus; `kind` is empty for one that is right."""

    name: str
    kind: str
    files: Mapping[str, str]

    @property
    def expected(self) -> frozenset[Mark]:
        """The findings that a user would want."""
        found = set()
        for file, text in self.files.items():
            for number, line in enumerate(text.splitlines(), 1):
                if mark := EXPECT.search(line):
                    at = number + 1 if mark[1] else number
                    found |= {(file, at, code.strip()) for code in mark[2].split(",")}
        return frozenset(found)

    @property
    def known_noise(self) -> frozenset[str]:
        """The codes of findings that nobody wants, and that are there."""
        lists = (codes for text in self.files.values() for codes in NOISE.findall(text))
        return frozenset(code.strip() for codes in lists for code in codes.split(","))

    @property
    def misses(self) -> str:
        """Why no finding tells its mistake; empty where one does."""
        return next((found[1] for text in self.files.values() if (found := MISSES.search(text))), "")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What `check` says of a case."""

    case: Case
    found: frozenset[Mark] = field(default_factory=frozenset)
    findings: tuple[Finding, ...] = ()

    @property
    def is_caught(self) -> bool:
        """Tell whether every mistake is told at its line."""
        return bool(self.case.expected) and self.case.expected <= self.found

    @property
    def is_elsewhere(self) -> bool:
        """Tell whether something is told, but not all of it where it should be."""
        return not self.is_caught and bool(self.found)

    @property
    def noise(self) -> frozenset[Mark]:
        """The findings that nobody expects."""
        return self.found - self.case.expected


@cache
def cases() -> tuple[Case, ...]:
    """Return all cases, the wrong ones first."""
    wrong = (_case(path, kind.name) for kind in sorted((HERE / "wrong").iterdir()) for path in sorted(kind.iterdir()))
    right = (_case(path, "") for path in sorted((HERE / "right").iterdir()))
    return (*wrong, *right)


def described() -> dict[str, str]:
    """Return what those kinds of wrong robots are about that have words of their own."""
    read: dict[str, str] = yaml.safe_load((HERE / "kinds.yaml").read_text(encoding="utf-8"))
    return read


def kinds() -> dict[str, str]:
    """Return what each kind of wrong robot is about: its own words, or the title of the only code that it expects.

    Raises:
        ValueError: if it has neither.
    """
    words, pages = described(), all_kinds()
    codes: dict[str, set[str]] = {case.kind: set() for case in cases() if case.kind}
    for case in cases():
        if case.kind:
            codes[case.kind] |= {code for _, _, code in case.expected}
    for kind in codes.keys() - words.keys():
        if len(codes[kind]) != 1:
            raise ValueError(f"'{kind}' expects {len(codes[kind])} codes: say in kinds.yaml what it is about")
    return {kind: words.get(kind) or _in_a_cell(title_of(pages[min(codes[kind])])) for kind in codes}


def _in_a_cell(title: str) -> str:
    return title if title[1:2].isupper() else f"{title[:1].lower()}{title[1:]}"


def _case(path: Path, kind: str) -> Case:
    name = f"{kind}/{path.stem}" if kind else path.stem
    if path.is_dir():
        files = (file for file in sorted(path.rglob("*")) if file.suffix in KNOWN)
        return Case(name, kind, {str(file.relative_to(path)): _text(file) for file in files})
    text = _text(path)
    if "\nkind: Mission\n" in text:
        return Case(name, kind, {ROBOT: _text(HERE / ROBOT) + (VALUES if "$bat" in text else ""), MISSION: text})
    return Case(name, kind, {ROBOT: text})


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def run(case: Case, folder: Path) -> Outcome:
    """Write a case into an empty folder and check it."""
    for name, text in case.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    options, environment = _options(case.files[ROBOT])
    out = compile_robot(
        str(folder / ROBOT),
        profiles=[value for option, value in options if option == "--profile"],
        sets=[value for option, value in options if option == "--set"],
        real=("--real", "") in options,
        environment=environment,
        tries_profiles=True,
    )
    return Outcome(case, frozenset(_mark(finding) for finding in out.report), tuple(out.report))


def _mark(finding: Finding) -> Mark:
    span = finding.span
    return (Path(span.file).name, span.line, finding.code) if span else ("", 0, finding.code)


def _options(text: str) -> tuple[list[tuple[str, str]], dict[str, str]]:
    options: list[tuple[str, str]] = []
    environment: dict[str, str] = {}
    for what, rest in OPTION.findall(text):
        words = shlex.split(rest)
        if what == "environment":
            environment |= dict(word.split("=", 1) for word in words)
        else:
            values = iter(words)
            options += [(word, "" if word == "--real" else next(values)) for word in values]
    return options, environment


@cache
def outcomes(*, is_whole: bool = True) -> tuple[Outcome, ...]:
    """Check all cases, or those that are right and the first one of each kind that is wrong."""
    found, before = [], set[str]()
    for case in cases():
        if is_whole or not case.kind or case.kind not in before:
            with tempfile.TemporaryDirectory() as folder:
                found.append(run(case, Path(folder)))
        before.add(case.kind)
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Figures:
    """How the corpus comes out."""

    kinds: int
    kinds_caught: int
    wrong: int
    caught: int
    elsewhere: int
    missed: int
    noise: int
    right: int
    false_alarms: int


def figures(found: Iterable[Outcome] | None = None) -> Figures:
    """Count; a kind is caught if each of its cases is, at the right line."""
    found = outcomes() if found is None else tuple(found)
    wrong = [outcome for outcome in found if outcome.case.kind]
    right = [outcome for outcome in found if not outcome.case.kind]
    named = {outcome.case.kind for outcome in wrong}
    return Figures(
        kinds=len(named),
        kinds_caught=len(named - {outcome.case.kind for outcome in wrong if not outcome.is_caught}),
        wrong=len(wrong),
        caught=sum(outcome.is_caught for outcome in wrong),
        elsewhere=sum(outcome.is_elsewhere for outcome in wrong),
        missed=sum(not outcome.found for outcome in wrong),
        noise=sum(len(outcome.noise) for outcome in wrong),
        right=len(right),
        false_alarms=sum(bool(outcome.found) for outcome in right),
    )
