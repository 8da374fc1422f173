"""`arm setup --propose`: arms and grippers that a body seems to have, as a manifest to correct."""

from __future__ import annotations

import argparse
from pathlib import Path

from rbxcompose.body.description import Description
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.findings import kind
from rbxcompose.importing.arm_drafts import manifest_of
from rbxcompose.importing.arm_proposals import proposed_arms
from rbxcompose.manifest.files import shown_name
from rbxcompose.scaffold.answers import name_like
from rbxcompose.scaffold.new_files import write_new

NO_ARM = kind("RBX9422")


def run_proposal(arguments: argparse.Namespace, description: Description, file: Path) -> int:
    """Write a robot with the arms that a body seems to have, or print it; it is never written over a file."""
    drafts = proposed_arms(description.body)
    if not drafts:
        return refuse(NO_ARM.at(None, f"'{shown_name(file)}' has no row of joints that could be an arm"))
    name = name_like(file.stem) or "robot"
    top = f"# Proposed by `rbxcompose arm setup --propose` for {file.name}: correct what is a guess.\n"
    text = f"{top}rbx: 1\nkind: Robot\nname: {name}\n\n{manifest_of(description.body, drafts, file.name)}"
    if arguments.out is None:
        tell(text.rstrip("\n"))
        return 0
    out = Path(arguments.out)
    if (problem := write_new(out.parent, {out.name: text})) is not None:
        return refuse(problem)
    tell(f"wrote {shown_name(out.absolute())}: {', '.join(one.name for one in drafts)}")
    return 0
