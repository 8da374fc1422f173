"""Pairs of links that need not be watched for collisions, each with its reason, and the file that keeps them."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Literal, get_args

from pydantic import Field

from rbxcompose.base.config import LINK, Config, LinkName
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import Finding, Report
from rbxcompose.base.geometry import Transform3
from rbxcompose.base.printable import escaped
from rbxcompose.domains.body.files import LARGEST
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode, ScalarNode
from rbxcompose.manifest.validate import validate

LinkPair = tuple[str, str]
"""Two links or objects, in the order of the alphabet."""
_PLAIN = re.compile(r"(?!(?:true|false|null|yes|no|on|off|y|n)$)[A-Za-z_]\w*", re.ASCII | re.IGNORECASE)
_DIGITS = 6  # of numbers in a digest, so that another machine's rounding changes nothing
_HEAD = """\
# Which pairs of links need not be watched, and why. `rbxcompose arm setup` writes it: run it again when the body has
# changed. To have links that touch at rest left out for good, write `user` in place of `default`; that stays.
"""


PairReason = Literal["adjacent", "always", "user", "default", "never"]
REASONS: tuple[PairReason, ...] = get_args(PairReason)
"""A joint connects them; they collided in all positions that were tried; somebody said so; they collide at rest, and
not always, so that a shape or the rest is wrong; they collided in none."""


@dataclass(frozen=True, slots=True)
class CollisionMatrix:
    """Pairs with their reasons, how many positions of all joints were tried, and for which body."""

    pairs: Mapping[LinkPair, PairReason]
    samples: int
    seed: int
    digest: str

    def having(self, *reasons: PairReason) -> list[LinkPair]:
        """Return the pairs that have one of these reasons, sorted."""
        return sorted(pair for pair, reason in self.pairs.items() if reason in reasons)

    def counts(self) -> Mapping[PairReason, int]:
        """Return how many pairs have each reason."""
        found = Counter(self.pairs.values())
        return {reason: found[reason] for reason in REASONS if found[reason]}

    def text(self) -> str:
        """Return it as a file."""
        rows = "".join(f"- [{_name(text)}, {_name(item)}, {self.pairs[text, item]}]\n" for text, item in _sorted(self))
        head = f"{_HEAD}body: {json.dumps(self.digest)}\nsamples: {self.samples}\nseed: {self.seed}\n"
        return f"{head}pairs:\n{rows}" if rows else f"{head}pairs: []\n"


class _PairsFile(Config):
    body: str
    samples: int = Field(ge=0)
    seed: int = Field(ge=0)
    pairs: list[tuple[LinkName, LinkName, PairReason]]


def pair_of(first: str, second: str) -> LinkPair:
    """Return two names as a pair."""
    return (first, second) if first <= second else (second, first)


def _sorted(matrix: CollisionMatrix) -> list[LinkPair]:
    return sorted(matrix.pairs, key=lambda pair: (REASONS.index(matrix.pairs[pair]), pair))


def _name(link: str) -> str:
    return link if _PLAIN.fullmatch(link) else escaped(json.dumps(link, ensure_ascii=False))


def read_matrix(text: str, shown: str, body: Body, digest: str) -> tuple[CollisionMatrix | None, list[Finding]]:
    """Return what a file of pairs has, None with findings if it is none; `shown` is its name in them.

    If it is of another body than the one with this digest, its links may be unknown.
    """
    root, findings = read_text(text, shown)
    if root is None or findings:
        return None, findings
    written = root.get("body") if isinstance(root, MappingNode) else None
    is_current = isinstance(written, ScalarNode) and written.text == digest
    report = Report()
    read = validate(_PairsFile, root, (), report, {LINK: body.links} if is_current else {})
    if read is None:
        return None, list(report)
    pairs = {pair_of(name, other): reason for name, other, reason in read.pairs}
    return CollisionMatrix(pairs, read.samples, read.seed, read.body), []


def digest_of(body: Body, meshes: Mapping[str, Path]) -> str:
    """Return a short text that differs for bodies whose joints or shapes of collisions differ.

    Colours, masses, comments and virtual joints do not count; `meshes` are the files of meshes by their names in the
    URDF.
    """
    found = sha256()
    joints = (joint for joint in body.joints.values() if joint.parent != body.frame)
    for row in (*sorted(map(_joint, joints)), *sorted(_shapes(body))):
        found.update(f"{row}\n".encode())
    used = {shape.geometry.file for link in body.links.values() for shape in link.collisions}
    for name in sorted(used & meshes.keys()):
        with suppress(OSError):  # a mesh that cannot be read is reported elsewhere
            found.update(read_regular(meshes[name], LARGEST))
    return found.hexdigest()[:16]


def _joint(one: BodyJoint) -> str:
    ends = (one.limits.lower, one.limits.upper) if one.limits is not None and one.kind != "continuous" else ()
    mimic = (one.mimic.joint, *_rounded((one.mimic.multiplier, one.mimic.offset))) if one.mimic is not None else ()
    bounds = [None if end is None else round(end, _DIGITS) for end in ends]
    return f"{one.name} {one.kind} {one.parent} {one.child} {_place(one.origin)} {_rounded(one.axis)} {bounds} {mimic}"


def _shapes(body: Body) -> Iterator[str]:
    for link in body.links.values():
        for collision in link.collisions:
            shape = collision.geometry
            yield f"{link.name} {shape.kind} {_rounded(shape.size)} {shape.file} {_place(collision.origin)}"


def _place(pose: Transform3) -> str:
    sign = -1.0 if pose.rotation[3] < 0.0 else 1.0  # both are the same rotation
    return f"{_rounded(pose.translation)} {_rounded(sign * value for value in pose.rotation)}"


def _rounded(numbers: Iterable[float]) -> tuple[float, ...]:
    return tuple(round(number, _DIGITS) + 0.0 for number in numbers)  # 0.0 for -0.0
