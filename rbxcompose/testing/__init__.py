"""Tools for tests of robots and plug-ins: virtual time, an in-process bus, findings of a text, golden files."""

from rbxcompose.testing.bench import Bench, instance
from rbxcompose.testing.clocks import clock_uses
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_file, check_text
from rbxcompose.testing.robots import Ran, run_robot

__all__ = ["Bench", "Checked", "Golden", "Ran", "check_file", "check_text", "clock_uses", "instance", "run_robot"]
