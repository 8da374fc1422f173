"""Values given to an argument: an error in one is reported where it was given, not where the argument is used."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from rbxcompose.findings import Finding, Related, Span
from rbxcompose.manifest.tree import KeyPath, TreeNode, at, children


class GivenSpan(Span):
    """The place of a value that was given to an argument; `uses` are the places where it is used, outermost first.

    It equals the plain place of the value.
    """

    uses: tuple[Span, ...] = ()


def given_span(given: Span, use: Span) -> GivenSpan:
    """Return the place `given` with `use`, where it is filled in; `given` may already have been passed on itself."""
    made = GivenSpan(*given)
    made.uses = (*(given.uses if isinstance(given, GivenSpan) else ()), use)
    return made


def decided_at(root: TreeNode, path: KeyPath, otherwise: Span) -> Span:
    """Return the place of the one value that was given for something at `path` or below it; else another place."""
    node = at(root, path)
    given, waiting = {}, [node] if node is not None else []
    while waiting:
        one = waiting.pop()
        waiting += (child for _, child in children(one))
        if isinstance(one.span, GivenSpan):
            given[Span(*one.span)] = one.span
    return next(iter(given.values())) if len(given) == 1 else otherwise


def told_where_given(finding: Finding) -> Finding:
    """Return a finding with plain places; if it is about a given value, it also shows where that value is used."""
    related = [one for other in finding.related for one in _plain(other)]
    if not isinstance(finding.span, GivenSpan):
        return finding if related == list(finding.related) else replace(finding, related=_once(related))
    uses = [Related(use, "passed on here") for use in finding.span.uses[:-1]]
    uses += [Related(use, "used here") for use in finding.span.uses[-1:]]
    return replace(finding, span=Span(*finding.span), related=_once([*uses, *related]))


def _plain(related: Related) -> Iterator[Related]:
    if not isinstance(related.span, GivenSpan):
        yield related
        return
    yield Related(Span(*related.span), related.message)
    yield from (Related(use, "used here") for use in related.span.uses[-1:])


def _once(related: Iterable[Related]) -> tuple[Related, ...]:
    return tuple(dict.fromkeys(related))
