"""A viewer elsewhere: whatever is lost or late on the way, in the end it knows what is there."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.missions.view.replica import MOST_WAITING, Mirror, Replica


class Sender:
    """The other side: an engine of which only this is seen, and a window on it that may be opened again."""

    def __init__(self) -> None:
        self.statuses = [0] * 4
        self.data: dict[str, int] = {}
        self.process = 0
        self.begin()

    def begin(self) -> None:
        self.process += 1
        self.mirror, self.version, self.sequence = Mirror(self), 0, 0  # type: ignore[arg-type]

    def message(self, value: Mapping[str, Any]) -> Any:
        message = {"schema": 1, "source": f"s/{self.process}", "sequence": self.sequence, "value": value}
        return json.loads(json.dumps(message))

    def news(self) -> Any:
        value = self.mirror.look(self.version)
        self.version = value["version"]
        self.sequence += 1
        return self.message(value)

    def whole(self) -> Any:
        return self.message({**self.mirror.look(), "picture": "p"})


steps = st.lists(
    st.one_of(
        st.tuples(st.just("change"), st.integers(0, 3), st.integers(0, 4)),
        st.tuples(st.sampled_from(["lose", "hear", "ask", "arrive", "restart"]), st.just(0), st.just(0)),
    ),
    max_size=40,
)


@given(steps)
def test_it_ends_up_with_what_is_there(steps: list[tuple[str, int, int]]) -> None:
    sender, replica = Sender(), Replica()
    late: list[Any] = []  # wholes on their way
    for what, number, status in steps:
        if what == "change":
            sender.statuses[number] = status
            sender.data["last"] = number
        elif what == "lose":
            sender.news()
        elif what == "ask" or (what == "hear" and replica.apply(sender.news())):
            late.append(sender.whole())
        elif what == "arrive" and late:
            replica.answered(late.pop(0))
        elif what == "restart":
            sender.begin()
    for whole in late:
        replica.answered(whole)
    while replica.apply(sender.news()):
        replica.answered(sender.whole())
    assert [replica.seen["statuses"][index] for index in range(4)] == sender.statuses
    assert replica.seen["data"] == sender.data
    assert replica.seen["picture"] == "p"


def test_news_that_overtake_the_whole_are_not_lost() -> None:
    sender, replica = Sender(), Replica()
    whole = sender.whole()
    sender.statuses[1] = 2
    assert replica.apply(sender.news())
    assert not replica.answered(whole)
    assert replica.seen["statuses"][1] == 2


def test_more_news_than_it_keeps_need_another_whole() -> None:
    sender, replica = Sender(), Replica()
    whole = sender.whole()
    for _ in range(MOST_WAITING + 1):
        replica.apply(sender.news())
    assert replica.answered(whole)
    assert not replica.answered(sender.whole())
