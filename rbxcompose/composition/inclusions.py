"""Records which file includes which, so that a finding in an included file can show how the robot includes it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import field, replace

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Related, Span
from rbxcompose.manifest.given_values import told_where_given

_MOST_CHAINS = 3  # per finding: a part may have many instances


@dataclass(frozen=True, slots=True)
class Inclusion:
    """One instance of a file: its path (`arm.hand`) and the entries that lead to it, nearest first."""

    instance: str
    chain: tuple[Span, ...]

    @property
    def related(self) -> Iterator[Related]:
        """Yield the chain, from the entry that includes the file up to the one in the robot's own file."""
        names = self.instance.split(".")
        for length, span in zip(range(len(names), 0, -1), self.chain, strict=True):
            yield Related(span, f"included here as '{'.'.join(names[:length])}'")


@dataclass(slots=True)
class Inclusions:
    """All instances, by the name of their file in findings."""

    of_file: dict[str, list[Inclusion]] = field(default_factory=dict)

    def add(self, file: str, inclusion: Inclusion) -> None:
        """Add one instance."""
        self.of_file.setdefault(file, []).append(inclusion)

    def told(self, findings: Iterable[Finding]) -> list[Finding]:
        """Return the findings, with the chain of includes added to each one inside a part.

        A mistake in a part with several instances is reported once; one in a given value, where it was given.
        """
        said: set[tuple[str, Span]] = set()
        out = []
        for finding in map(told_where_given, findings):
            inclusions = self.of_file.get(finding.span.file, []) if finding.span else []
            if not inclusions or finding.span is None:
                out.append(finding)
            elif (finding.code, finding.span) not in said:
                said.add((finding.code, finding.span))
                out.append(_with_chain(finding, inclusions))
        return out


def _with_chain(finding: Finding, inclusions: list[Inclusion]) -> Finding:
    chain = [related for one in inclusions[:_MOST_CHAINS] for related in one.related]
    fix = finding.fix
    prefixes = {one.instance.replace(".", "_") + "_" for one in inclusions}
    if fix and any(prefix in edit.text for edit in fix.edits for prefix in prefixes):
        fix = None  # the fix would write a name of the robot into the part, which has its own names
    return replace(finding, related=tuple(dict.fromkeys([*finding.related, *chain])), fix=fix)
