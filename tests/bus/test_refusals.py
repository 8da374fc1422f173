from __future__ import annotations

from threading import Thread

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus.local import RefusalReason, Refusals, sentence

reasons = st.lists(st.sampled_from(RefusalReason))


@given(st.lists(reasons, max_size=5))
def test_each_refusal_is_news_exactly_once(rounds: list[list[RefusalReason]]) -> None:
    refusals = Refusals()
    for some in rounds:
        for reason in some:
            refusals.add(reason)
        assert refusals.news() == {reason: some.count(reason) for reason in RefusalReason if reason in some}
    assert refusals.total == sum(map(len, rounds))
    assert refusals.news() == {}


def test_several_threads_lose_no_count() -> None:
    refusals = Refusals()

    def refuse() -> None:
        for _ in range(2000):
            refusals.add(RefusalReason.TOO_MANY)

    threads = [Thread(target=refuse) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    refusals.add(RefusalReason.TOO_MANY)
    assert refusals.total == 8001


def test_the_sentence_counts_and_names_each_reason() -> None:
    assert sentence("/cmd_vel", {RefusalReason.LENGTH: 12}) == "12 messages were refused on /cmd_vel: wrong length"
    assert (
        sentence("/cmd_vel", {RefusalReason.NOT_FINITE: 1})
        == "1 message was refused on /cmd_vel: a number is not finite"
    )
    both = {RefusalReason.TOO_MANY: 900, RefusalReason.CONTENT: 2}
    assert sentence("/a", both) == "902 messages were refused on /a: 900 too many at once, 2 unreadable content"
