"""Measures every subject: `python -m benchmarks.run [SUBJECT ...]` writes the results and the page of the docs.

A subject is a file of this folder with a function `rows()`, and the paths that it `MEASURES`. Each runs in a process of
its own. Rows that got worse go to the changelog; those that cannot be measured here, since their peer or their files
are missing, stay as they are. `--marks` measures nothing; it marks rows whose paths have changed.
"""

from __future__ import annotations

import ast
import datetime
import importlib
import json
import os
import platform
import subprocess
import sys
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks.measuring import ROOT, Row

FOLDER = Path(__file__).parent
RESULTS = FOLDER / "results.json"
PAGE = ROOT / "docs" / "benchmarks.md"
CHANGELOG = ROOT / "CHANGELOG.md"
CHANGED = "### Changed\n"
ONE, MARKS = "--one", "--marks"
NOISE = 1.2  # by which figures differ without a reason
ABOUT = """# Benchmarks

`make bench` measures all of this and writes the page. In each table, *ours* is rbxcompose, *peer* the program in
brackets, *ratio* ours divided by theirs, and *bar* what we want to reach. Times are medians, *p99* is the 99th
percentile: wall time for whole commands, processor time within a process. Ours and a peer are measured in turns, in the
same run, so that ratios hold where times do not: these differ between machines by a factor of two or three. *Measured*
has the date and the commit; where what is measured **has changed since**, the figure is an old one.

{missed}

{tables}

Last measured on {machine}; load of other work at the start: {load:.1f}. Rows beside ROS 1 and dora are measured only
where these are installed, and those beside RoboPlan where `RBXCOMPOSE_ROBOPLAN` names a Python that has it.
"""


def subjects() -> list[str]:
    """Return the names of all files that have rows."""
    files = sorted(FOLDER.glob("*.py"))
    return [file.stem for file in files if "\ndef rows(" in file.read_text(encoding="utf-8")]


def measured(subject: str) -> list[dict[str, Any]]:
    """Return the rows of a subject, measured in a process of its own.

    Raises:
        CalledProcessError: if it fails.
    """
    command = [sys.executable, "-m", "benchmarks.run", ONE, subject]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT)
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


def as_data(row: Row, subject: str) -> dict[str, Any]:
    """Return a row with what follows from it."""
    return {"subject": subject, **asdict(row), "ratio": row.ratio, "bar": row.bar, "met": row.met}


def page(results: dict[str, Any]) -> str:
    """Return the page of the docs: the bars that are missed, then a table for each subject."""
    rows: list[dict[str, Any]] = results["rows"]
    missed = dict.fromkeys(row["name"] for row in rows if row["met"] is False)
    words = f"Bars that are missed: {'; '.join(missed)}." if missed else "All bars are met."
    tables = "\n\n".join(_section(subject, list(found)) for subject, found in groupby(rows, lambda row: row["subject"]))
    return ABOUT.format(missed=words, tables=tables, machine=results["machine"], load=results["load"])


def _section(subject: str, rows: list[dict[str, Any]]) -> str:
    """Return the table of a subject below the first line of its file."""
    about = ast.get_docstring(ast.parse((FOLDER / f"{subject}.py").read_text(encoding="utf-8"))) or subject
    title, _, rest = about.partition("\n")[0].rstrip(".").partition(": ")
    lines = [
        f"## {title}",
        *([f"{rest[:1].upper()}{rest[1:]}.", ""] if rest else []),
        "| what | ours | p99 | peer | ratio | bar | | measured | how |",
        "| --- | ---: | ---: | ---: | ---: | --- | --- | --- | --- |",
    ]
    for row in rows:
        met = {True: "met", False: "**missed**", None: ""}[row["met"]]
        peer = f"{_figure(row['peer'])} ({row['against']})" if row["peer"] else ""
        ratio = f"{_figure(row['ratio'])}x" if row["ratio"] else ""
        ours = f"{_figure(row['ours'])} {row['unit']}".strip()
        when = f"{row['date']}, {row['commit']}{', **changed since**' if row['changed'] else ''}"
        cells = [row["name"], ours, _figure(row["p99"]), peer, ratio, row["bar"], met, when, row["how"]]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _figure(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.0f}" if abs(value) >= 100 or value == int(value) else f"{value:.3g}"


def paths_of(subject: str) -> list[str]:
    """Return the paths that a subject measures, its own file included."""
    file = FOLDER / f"{subject}.py"
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "MEASURES":
            return [*ast.literal_eval(node.value), str(file.relative_to(ROOT))]
    raise ValueError(f"{subject} does not say what it measures")


def has_changed(subject: str, commit: str) -> bool:
    """Return whether what a subject measures differs from a commit; so it does if that is not known here."""
    command = ["git", "diff", "--quiet", commit, "--", *paths_of(subject)]
    return subprocess.run(command, cwd=ROOT, stderr=subprocess.DEVNULL).returncode != 0  # it may be of a rewritten past


def worse(before: list[dict[str, Any]], after: list[dict[str, Any]]) -> list[str]:
    """Return a line for each row with a bar that got worse: its ratio to a peer, else its figure."""
    known = {(row["name"], row["how"], row["against"]): row for row in before}
    lines = []
    for row in after:
        old = known.get((row["name"], row["how"], row["against"]))
        if old is None or not row["bar"]:
            continue
        key = "ratio" if row["ratio"] and old["ratio"] else "ours"
        grows = row["least"] is None and row["least_ratio"] is None
        lost, least = (row[key], old[key]) if grows else (old[key], row[key])
        if lost > least * NOISE:
            unit = f"x of {row['against']}" if key == "ratio" else f" {row['unit']}"
            lines.append(f"- Worse: {row['name']}: {_figure(row[key])}{unit}, before {_figure(old[key])}{unit}.")
    return lines


def main(arguments: list[str]) -> None:
    """Measure all subjects, or those that are named, and write down everything that is known."""
    if arguments[:1] == [ONE]:
        module = importlib.import_module(f"benchmarks.{arguments[1]}")
        sys.stdout.write(json.dumps([as_data(row, arguments[1]) for row in module.rows()]))
        return
    old = json.loads(RESULTS.read_text(encoding="utf-8"))
    rows = {name: [row for row in old["rows"] if row["subject"] == name] for name in subjects()}
    if arguments != [MARKS]:
        old["load"] = os.getloadavg()[0]
        python = f"Python {platform.python_version()}"
        old["machine"] = f"{os.cpu_count()} cores, {python}, {platform.system()} {platform.machine()}"
        for name in arguments or subjects():
            rows[name] = _measured_now(name, rows[name])
    for name, found in rows.items():
        for row in found:
            row["changed"] = has_changed(name, row["commit"])
    results = {**old, "rows": [row for found in rows.values() for row in found]}
    RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(results), encoding="utf-8")


def _measured_now(subject: str, before: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Measure a subject; what got worse goes to the changelog."""
    commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    today = datetime.date.today().isoformat()
    rows = [{**row, "date": today, "commit": commit.stdout.strip()} for row in measured(subject)]
    for row in rows:
        sys.stderr.write(f"{row['name']}: {_figure(row['ours'])} {row['unit']}  [{row['bar']}] met: {row['met']}\n")
    if lines := worse(before, rows):
        text = CHANGELOG.read_text(encoding="utf-8")
        CHANGELOG.write_text(text.replace(CHANGED, "\n".join([CHANGED.strip(), *lines, ""]), 1), encoding="utf-8")
    known = {(row["name"], row["against"]) for row in rows} | {(row["name"], "") for row in rows}
    kept = [row for row in before if (row["name"], row["against"]) not in known]
    for row in kept:
        sys.stderr.write(f"{row['name']}: not measured here, kept as it was on {row['date']}\n")
    return [*rows, *kept]


if __name__ == "__main__":
    main(sys.argv[1:])
