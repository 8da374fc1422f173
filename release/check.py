"""The list that a release has to pass: `make release-check`. It tells all that fails, and ends with 1 if anything does.

Each point is a function that yields what is wrong, of texts and not of the machine where that is possible.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import rbxcompose
from docs import generate
from rbxcompose.compiler.schema.documents import files as schemas
from release.build import ROOT, BuildError, build

SEMVER = re.compile(
    r"(0|[1-9]\d*)\.(0|[1-9]\d*)\.(0|[1-9]\d*)"
    r"(?:-(?:0|[1-9]\d*|\d*[a-zA-Z-][0-9a-zA-Z-]*)(?:\.(?:0|[1-9]\d*|\d*[a-zA-Z-][0-9a-zA-Z-]*))*)?"
    r"(?:\+[0-9a-zA-Z-]+(?:\.[0-9a-zA-Z-]+)*)?"
)
HEADING = re.compile(r"^## (.+)$", re.MULTILINE)
RELEASED = re.compile(r"(?P<version>\S+) \((?P<when>unreleased|\d{4}-\d{2}-\d{2})\)")
PINNED = re.compile(r"^([A-Za-z0-9][A-Za-z0-9._-]*)==(\S+)((?: \\\n +--hash=sha256:[0-9a-f]{64})*)", re.MULTILINE)
LOCKS: Mapping[str, tuple[str, ...]] = {
    "requirements.lock": (),
    "requirements-test.lock": ("test",),
    "requirements-docs.lock": ("docs",),
}
"""The extras that each lock file has, beside what rbxcompose itself needs."""

IN_WHEEL = ("rbxcompose/domains/console/static/index.html", "rbxcompose/library/robots/turtlebot/robot.yaml")
Check = Callable[[], Iterable[str]]


def project() -> dict[str, Any]:
    """Return the section `project` of `pyproject.toml`."""
    found: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return found


def version_problems(version: str, changelog: str) -> Iterator[str]:
    """Yield what is wrong with a version, and with the newest heading of the changelog."""
    if SEMVER.fullmatch(version) is None:
        yield f"'{version}' is no version of SemVer"
    heading = HEADING.search(changelog)
    if heading is None:
        yield "CHANGELOG.md has no heading '## VERSION (unreleased)' or '## VERSION (YYYY-MM-DD)'"
    elif heading[1].lower() != "unreleased":
        found = RELEASED.fullmatch(heading[1])
        if found is None:
            yield f"'## {heading[1]}' of CHANGELOG.md is neither 'VERSION (unreleased)' nor 'VERSION (YYYY-MM-DD)'"
        elif found["version"] != version:
            yield f"the version is {version}, the newest heading of CHANGELOG.md {found['version']}"


def tree_problems(status: str) -> Iterator[str]:
    """Yield what `git status --porcelain` tells."""
    yield from (f"not committed: {line[3:]}" for line in status.splitlines())


def docs_problems() -> Iterator[str]:
    """Yield the generated files that are out of date."""
    made, there = generate.pages(), generate.written()
    yield from (f"docs/{name} is out of date: make docs" for name in made if made[name] != there.get(name))
    yield from (f"docs/{name} is of something that is gone: make docs" for name in there.keys() - made.keys())
    for name, text in schemas().items():
        file = ROOT / "schemas" / name
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            yield f"schemas/{name} is out of date: make docs"


def lock_problems(name: str, wanted: Iterable[str], text: str) -> Iterator[str]:
    """Yield what a lock file lacks of requirements, and what it does not hash."""
    pins = {canonicalize_name(found[1]): (found[2], found[3]) for found in PINNED.finditer(text)}
    for requirement in map(Requirement, wanted):
        version, _ = pins.get(canonicalize_name(requirement.name), ("", ""))
        if not version:
            yield f"{name} lacks {requirement.name}: make lock"
        elif not requirement.specifier.contains(version, prereleases=True):
            yield f"{name} has {requirement.name} {version}, and {requirement.specifier} is asked for: make lock"
    yield from (f"{name} has no hash of {package}: make lock" for package, (_, hashes) in pins.items() if not hashes)


def licence_problems(names: Iterable[str], page: str) -> Iterator[str]:
    """Yield the packages without a row in the tables of dependencies, or with one that names no licence."""
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in page.splitlines()]
    licences = {
        canonicalize_name(package): row[2] for row in cells if len(row) == 3 for package in re.split(r"[,;] ", row[0])
    }
    for name in sorted(set(map(canonicalize_name, names))):
        if not licences.get(name):
            yield f"docs/dependencies.md has no licence of {name}"


def _version() -> Iterator[str]:
    return version_problems(rbxcompose.__version__, (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))


def _tree() -> Iterator[str]:
    git = subprocess.run(["git", "status", "--porcelain"], cwd=ROOT, capture_output=True, text=True, check=True)
    return tree_problems(git.stdout)


def _locks() -> Iterator[str]:
    found = project()
    for name, wanted in LOCKS.items():
        asked = [*found["dependencies"], *(each for extra in wanted for each in found["optional-dependencies"][extra])]
        yield from lock_problems(name, asked, (ROOT / name).read_text(encoding="utf-8"))


def _licences() -> Iterator[str]:
    found = project()
    asked = [*found["dependencies"], *(each for extra in found["optional-dependencies"].values() for each in extra)]
    page = (ROOT / "docs/dependencies.md").read_text(encoding="utf-8")
    return licence_problems((Requirement(each).name for each in asked), page)


def _wheel() -> Iterator[str]:
    with tempfile.TemporaryDirectory(prefix="rbxcompose_release_") as folder:
        first, second = Path(folder, "first"), Path(folder, "second")
        try:
            once, again = build(first), build(second, umask=0o077, environment={"TZ": "Asia/Tokyo"})
        except BuildError as error:
            yield f"the build failed: {error}"
            return
        yield from (f"{name} differs when it is built again" for name in once if again.get(name) != once[name])
        for wheel in first.glob("*.whl"):
            with zipfile.ZipFile(wheel) as archive:
                names = archive.namelist()
            yield from (f"{wheel.name} lacks {name}" for name in IN_WHEEL if name not in names)


CHECKS: Mapping[str, Check] = {
    "the version follows SemVer and is that of the changelog": _version,
    "all is committed": _tree,
    "the generated documentation is up to date": docs_problems,
    "the lock files fit what pyproject.toml asks for, with hashes": _locks,
    "the licence of each dependency is listed": _licences,
    "the wheel and the source distribution are reproducible and whole": _wheel,
}


def main(checks: Mapping[str, Check] = CHECKS) -> int:
    """Run all checks, tell each, and return the exit code."""
    failed = 0
    for promise, check in checks.items():
        problems = list(check())
        failed += bool(problems)
        sys.stdout.write(f"{'failed' if problems else 'ok    '}  {promise}\n")
        sys.stdout.writelines(f"        {problem}\n" for problem in problems)
    sys.stdout.write(f"{failed} of {len(checks)} failed\n" if failed else "ready for a release\n")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
