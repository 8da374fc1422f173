"""The list that a release has to pass: what it finds, and that this tree has none of it."""

from __future__ import annotations

import subprocess
import sys

import pytest

from release.check import CHECKS, docs_problems, licence_problems, lock_problems, main, tree_problems, version_problems
from tests.packaging.builds import LONG, ROOT
from tests.soak import rare

HASH = f"--hash=sha256:{'0' * 64}"
QUICK = [promise for promise in CHECKS if not promise.startswith(("all is committed", "the wheel"))]
GENERATED = "the generated documentation is up to date"  # which other tests find as well


@pytest.mark.parametrize("promise", [*(name for name in QUICK if name != GENERATED), *rare(GENERATED)])
def test_this_tree_keeps(promise: str) -> None:
    assert list(CHECKS[promise]()) == []


@pytest.mark.parametrize("version", ["0.1.0", "1.2.3-rc.1", "10.0.0-alpha+build.7"])
@pytest.mark.parametrize("when", [" (unreleased)", " (2027-03-01)"])
def test_a_version_with_its_heading_is_fine(version: str, when: str) -> None:
    assert (
        list(version_problems(version, f"# Changelog\n\n## {version}{when}\n### Added\n\n## 0.0.1 (2026-01-01)\n"))
        == []
    )
    assert list(version_problems(version, "# Changelog\n\n## Unreleased\n")) == []


@pytest.mark.parametrize(
    ("version", "changelog", "problem"),
    [
        ("1.2", "## 1.2 (unreleased)", "'1.2' is no version of SemVer"),
        ("01.2.3", "## 01.2.3 (unreleased)", "'01.2.3' is no version of SemVer"),
        ("1.2.3-01", "## 1.2.3-01 (unreleased)", "'1.2.3-01' is no version of SemVer"),
        ("0.2.0", "## 0.1.0 (unreleased)", "the version is 0.2.0, the newest heading of CHANGELOG.md 0.1.0"),
        ("0.2.0", "## 0.2.0 (soon)", "'## 0.2.0 (soon)' of CHANGELOG.md is neither"),
        ("0.2.0", "# Changelog", "CHANGELOG.md has no heading"),
    ],
)
def test_a_version_that_does_not_fit_is_told(version: str, changelog: str, problem: str) -> None:
    [found] = version_problems(version, changelog)
    assert found.startswith(problem)


def test_what_is_not_committed_is_told() -> None:
    status = " M rbxcompose/a.py\n?? notes.txt\n"
    assert list(tree_problems(status)) == ["not committed: rbxcompose/a.py", "not committed: notes.txt"]
    assert list(tree_problems("")) == []


def test_a_lock_file_that_does_not_fit_is_told() -> None:
    lock = f"Py_YAML==6.0 \\\n    {HASH} \\\n    {HASH}\n    # via rbxcompose\nnumpy==1.9 \\\n    {HASH}\nbare==1\n"
    assert list(lock_problems("x.lock", ["py-yaml>=6", "numpy>=2", "mcap[lz4]>=1"], lock)) == [
        "x.lock has numpy 1.9, and >=2 is asked for: make lock",
        "x.lock lacks mcap: make lock",
        "x.lock has no hash of bare: make lock",
    ]


def test_a_package_without_a_licence_is_told() -> None:
    page = "| package | what | licence |\n| --- | --- | --- |\n| numpy, Py_YAML | arrays | BSD |\n| mcap | files | |\n"
    assert list(licence_problems(["NumPy", "py-yaml"], page)) == []
    assert list(licence_problems(["mcap", "trimesh"], page)) == [
        "docs/dependencies.md has no licence of mcap",
        "docs/dependencies.md has no licence of trimesh",
    ]


def test_a_page_that_is_out_of_date_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("docs.generate.pages", lambda: {"a.md": "new", "b.md": "same"})
    monkeypatch.setattr("docs.generate.written", lambda: {"a.md": "old", "b.md": "same", "c.md": "gone"})
    monkeypatch.setattr("release.check.schemas", lambda: {"toy.schema.json": "{}"})
    assert list(docs_problems()) == [
        "docs/a.md is out of date: make docs",
        "docs/c.md is of something that is gone: make docs",
        "schemas/toy.schema.json is out of date: make docs",
    ]


def test_all_that_fails_is_told_and_is_the_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert main({"one": lambda: [], "two": lambda: ["this", "that"], "three": lambda: ["those"]}) == 1
    assert capsys.readouterr().out == (
        "ok      one\nfailed  two\n        this\n        that\nfailed  three\n        those\n2 of 3 failed\n"
    )
    assert main({"one": lambda: []}) == 0
    assert capsys.readouterr().out == "ok      one\nready for a release\n"


@pytest.mark.soak
@pytest.mark.timeout(LONG)
def test_the_whole_list_runs() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "release.check"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    wrong = [line for line in done.stdout.splitlines() if line.startswith("failed")]
    assert wrong in ([], ["failed  all is committed"]), done.stdout + done.stderr
