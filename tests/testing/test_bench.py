"""A bench finds in virtual time what would fail on a robot."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.msgs.std_msgs import Float32, String
from rbxcompose.sdk import Component, Config, In, Out, component
from rbxcompose.testing import Bench, instance
from tests.loops import for_all


class ToyConfig(Config):
    """Nothing to set."""


@component("toy_echo")
class ToyEcho(Component[ToyConfig]):
    """Publishes what it gets, as it is.

    Example:
        echo: {type: toy_echo}
    """

    number = In(Float32, "number")
    text_out = Out(String, "text_out")
    number_out = Out(Float32, "number_out")
    answer: Callable[[ToyEcho], None]

    def on_number(self, message: Float32) -> None:
        """Publish."""
        type(self).answer(self)


@for_all(
    "answer",
    [
        lambda echo: echo.number_out(Float32(data="abc")),  # type: ignore[arg-type]
        lambda echo: echo.number_out(Float32(data=1e300)),
        lambda echo: echo.text_out(String(data=None)),  # type: ignore[arg-type]
        lambda echo: echo.text_out(String(data="\ud800")),
    ],
)
def test_who_publishes_what_cannot_be_sent_fails_though_nobody_listens(answer: Callable[[ToyEcho], None]) -> None:
    ToyEcho.answer = answer
    bench = Bench(instance("echo", "toy_echo"))
    bench.publish("number", Float32())
    assert "CdrError" in bench.records[0].text
