"""What the tags of other programs are in a manifest."""

from __future__ import annotations

from rbxcompose.printable import plain

_OF_VARIABLES = ("!env", "!env_var", "!ENV", "!ENV_VAR")


def help_for_tag(tag: str, value: str) -> str:
    """Return what to write in place of a tag that manifests do not have, and of the value after it."""
    word = plain(value.split()[0], 60) if value.split() else "NAME"
    if tag in _OF_VARIABLES:
        return f"write '${{env.{word}}}'"
    if tag == "!secret":
        return f"write '${{secret.{word}}}'"
    if tag.startswith("!include"):
        return "write its contents here; a part of a robot in a file of its own is named below 'include'"
    return "put quotes around it if it is text; the only tags are '!remove' and '!replace'"
