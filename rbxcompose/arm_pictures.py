"""Pictures of the scene at the moment in which picking or placing failed, in a folder that does not grow for ever."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from rbxcompose.arm_config import ArmWorks
from rbxcompose.atomic_files import replace_file
from rbxcompose.body.extra import MissingLibraryError
from rbxcompose.motion.picture import ArmPicture, draw_arm
from rbxcompose.motion.reasons import StageFailure

MOST = 20  # pictures of one arm; the oldest goes when there is one more
NUMBERED = re.compile(r"-(\d{4,9})-[a-z_-]+\.png")
QUOTED = re.compile(r"'([^']+)'")


def picture_of_failure(
    folder: Path, arm: str, works: ArmWorks, positions: Mapping[str, float], failure: StageFailure
) -> str:
    """Draw the body at `positions` [rad or m] of its joints among its things, and what the failure names in red.

    Return the words about it for the failure's text: where the picture is, or why there is none.
    """
    names = set(QUOTED.findall(failure.text))
    shown = ArmPicture(
        works.kinematics.body,
        works.meshes,
        positions,
        works.objects,
        colliding=names,
        told=f"{arm}: {failure.stage}",
        problem=f"{failure.reason}: {failure.text}",
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        known = numbered(folder, arm)
        file = folder / f"{arm}-{max(known, default=0) + 1:04}-{failure.stage}-{failure.reason}.png"
        replace_file(file, draw_arm(shown))
        for number in sorted(known)[: max(0, len(known) + 1 - MOST)]:
            known[number].unlink()
    except MissingLibraryError as error:
        return f"no picture: {error.finding.message}"
    except (OSError, ValueError) as error:
        return f"no picture: {error}"
    return f"picture: {file}"


def numbered(folder: Path, arm: str) -> dict[int, Path]:
    """Return the pictures of an arm by their numbers."""
    files = [one for one in folder.iterdir() if one.name.startswith(f"{arm}-")]
    return {int(found[1]): one for one in files if (found := NUMBERED.fullmatch(one.name.removeprefix(arm)))}
