from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.compiler.model.flow import cycle_of, start_order

NAMES = st.sampled_from("abcdef")


def test_without_wishes_the_given_order_stays() -> None:
    assert start_order({"c": [], "a": [], "b": []}) == ["c", "a", "b"]


def test_a_circle_is_told_in_the_direction_of_waiting() -> None:
    assert cycle_of({"c": ["a"], "a": ["b"], "b": ["c"]}) == ["a", "b", "c"]
    assert cycle_of({"a": ["a"]}) == ["a"]


@given(st.dictionaries(NAMES, st.lists(NAMES, max_size=3)))
def test_each_name_comes_once_and_after_what_it_waits_for_unless_there_is_a_circle(after: dict[str, list[str]]) -> None:
    circle = cycle_of(after)
    if circle:
        following = [*circle[1:], circle[0]]
        assert all(other in after[name] for name, other in zip(circle, following, strict=True))
        return
    order = start_order(after)
    assert sorted(order) == sorted(after)
    assert all(order.index(other) < order.index(name) for name in after for other in after[name] if other in after)


def test_long_chains_and_dense_wishes_take_no_longer_than_they_are() -> None:
    chain = {str(number): [str(number + 1)] for number in range(20_000)}
    assert start_order(chain) == [str(number) for number in reversed(range(20_000))]
    dense = {str(number): [str(other) for other in range(number)] for number in range(200)}
    assert start_order(dense) == [str(number) for number in range(200)]  # 2**200 paths lead to the last
    backwards = dict(reversed(dense.items()))
    assert start_order(backwards) == [str(number) for number in range(200)]
