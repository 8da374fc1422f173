"""Results of tests as JUnit XML, for continuous integration."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from rbxcompose.mission_tests.report import FileOutcome, Teller
from rbxcompose.printable import FORBIDDEN


def junit(outcomes: Sequence[FileOutcome]) -> str:
    """Return one suite with a case for each test; what kept a test from running is an error, the rest a failure."""
    failed = [one for one in outcomes if one.verdict and not one.passed]
    broken = [one for one in outcomes if not one.verdict]
    counts = {"tests": len(outcomes), "failures": len(failed), "errors": len(broken)}
    numbers = {key: str(value) for key, value in counts.items()}
    took = f"{sum(one.took for one in outcomes):.3f}"
    root = ElementTree.Element("testsuites", {"name": "rbxcompose test", "time": took, **numbers})
    suite = ElementTree.SubElement(root, "testsuite", {"name": "missions", "time": took, **numbers})
    for one in outcomes:
        mission = one.verdict.trial.mission if one.verdict else one.file
        case = ElementTree.SubElement(
            suite,
            "testcase",
            name=_fit(one.name or one.file),
            classname=_fit(mission),
            time=f"{one.took:.3f}",
            file=_fit(one.file),
        )
        if one.verdict and not one.passed:
            messages = [problem.message for problem in one.verdict.problems]
            _add(case, "failure", messages[0], Teller().trace(one.verdict))
        elif not one.verdict:
            _add(case, "error", "the test has errors", "\n".join(f"{f.span or ''} {f.message}" for f in one.findings))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add(case: ElementTree.Element, tag: str, message: str, text: str) -> None:
    ElementTree.SubElement(case, tag, message=_fit(message)).text = _fit(text)


def _fit(text: str) -> str:
    """Return a text without characters that XML cannot hold, or that would change how a reader of it shows the text."""
    return FORBIDDEN.sub("?", text)
