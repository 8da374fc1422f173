"""Changes of several components at once: whatever happens in between, all values are set or none."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters
from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterValue
from rbxcompose.params.history import ChangeCause
from rbxcompose.params.transaction import Transaction

NODES = ("a", "b", "c")
TOO_MUCH = 9  # a value that is refused only when it is set


class Store:
    """Three nodes, each with one parameter that is a small number."""

    def __init__(self) -> None:
        self.values = dict.fromkeys(NODES, 0)

    def ask(self, node: str, request: ChangeParameters.Request) -> ChangeParameters.Response:
        (wanted,) = request.parameters
        if any(one.value.integer_value != self.values[node] for one in request.expected):
            return ChangeParameters.Response(message="it was changed meanwhile")
        if wanted.value.integer_value < 0 or (wanted.value.integer_value == TOO_MUCH and not request.only_check):
            return ChangeParameters.Response(message="no")
        if not request.only_check:
            self.values[node] = wanted.value.integer_value
        return ChangeParameters.Response(success=True)


def transaction(store: Store, wanted: dict[str, int], by: str = "x") -> Transaction:
    known = {node: (parameter(store.values[node]),) for node in wanted}
    return Transaction({node: (parameter(one),) for node, one in wanted.items()}, known, ChangeCause(by))


def parameter(value: int) -> Parameter:
    return Parameter("size", ParameterValue(type=2, integer_value=value))


def step(one: Transaction, store: Store) -> None:
    node, request = next(iter(one.requests))
    one.take(node, store.ask(node, request))


WANTED = st.dictionaries(st.sampled_from(NODES), st.integers(1, 5), min_size=1)


@given(first=WANTED, second=WANTED, turns=st.lists(st.booleans(), max_size=30))
def test_two_clients_at_once_leave_all_of_one_or_of_both(
    first: dict[str, int], second: dict[str, int], turns: list[bool]
) -> None:
    store = Store()
    one = transaction(store, first)
    other = transaction(store, {node: value + 10 for node, value in second.items()})
    for is_first in [*turns, *[True] * 20, *[False] * 20]:
        chosen = one if is_first else other
        if not chosen.is_over:
            step(chosen, store)
    done = [values for each, values in ((one, first), (other, second)) if not each.refusal]
    expected = [dict.fromkeys(NODES, 0)]
    for values in ([*done], [*reversed(done)]):
        serial = dict.fromkeys(NODES, 0)
        for each in values:
            serial |= {node: value + 10 * (each is second) for node, value in each.items()}
        expected.append(serial)
    assert store.values in expected[1:]
    assert {**one.stuck, **other.stuck} == {}
    assert not (one.refusal and other.refusal)


@given(wanted=WANTED, late=st.sampled_from(NODES))
def test_what_is_refused_late_leaves_nothing_behind(wanted: dict[str, int], late: str) -> None:
    store = Store()
    one = transaction(store, {**wanted, late: TOO_MUCH})
    while not one.is_over:
        step(one, store)
    assert store.values == dict.fromkeys(NODES, 0)
    assert one.refusal == f"'{late}': no"
    assert one.went_back == sorted((node for node in wanted if node < late), reverse=True)


def test_what_is_refused_early_is_set_nowhere() -> None:
    store = Store()
    one = transaction(store, {"a": 1, "b": -1, "c": 2})
    asked = []
    while not one.is_over:
        asked += [request.only_check for _, request in one.requests]
        step(one, store)
    assert (store.values["a"], all(asked), one.refusal) == (0, True, "'b': no")


def test_a_value_that_somebody_sets_meanwhile_is_not_overwritten_by_going_back() -> None:
    store = Store()
    one = transaction(store, {"a": 1, "b": TOO_MUCH})
    for _ in range(3):
        step(one, store)
    store.values["a"] = 7
    while not one.is_over:
        step(one, store)
    assert store.values["a"] == 7
    assert one.stuck == {"a": "it was changed meanwhile"}


def test_a_node_that_does_not_answer_is_told_as_unknown() -> None:
    store = Store()
    one = transaction(store, {"a": 1, "b": 2})
    for _ in range(3):
        step(one, store)
    one.take("b", None, "no answer")
    step(one, store)
    assert (one.is_over, store.values["a"], one.refusal) == (True, 0, "'b': no answer")
    assert one.stuck == {"b": "whether it has the new values is not known"}
