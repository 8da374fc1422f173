"""`topic hz`."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict

from rbxcompose.cli.bus.entities import wanted
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.pace import PaceMeter
from rbxcompose.cli.output.console import tell

_PERIOD = 1.0  # [s] between two lines


def measure(guest: Guest, arguments: argparse.Namespace) -> int:
    """Print every second how often messages arrive."""
    topic = wanted(guest.graph().topics, arguments.topic, "topic")
    meter = PaceMeter(arguments.window)
    guest.listen(topic, lambda heard: meter.arrived(heard.time))
    left = math.inf if arguments.duration is None else arguments.duration
    while left > 0:
        guest.run(lambda: False, min(_PERIOD, left))
        left -= _PERIOD
        _tell_pace(meter, arguments.json)
    return 0


def _tell_pace(meter: PaceMeter, as_json: bool) -> None:
    pace = meter.take()
    if as_json:
        tell(json.dumps(asdict(pace) if pace else None))
    elif pace is None:
        tell("nothing new")
    else:
        intervals = f"min {pace.shortest:.4f} s, max {pace.longest:.4f} s, jitter {pace.jitter:.4f} s"
        tell(f"{pace.rate:.2f} Hz, {intervals}, {pace.messages} messages")
