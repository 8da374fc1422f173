"""What a viewer sees: the whole at first, then what has changed; together it is always what is there."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.missions.view.replica import Mirror, joined, status_list

NOTHING: dict[str, Any] = {"statuses": {}, "data": {}}


class Changing:
    """An engine of which a viewer sees only this."""

    def __init__(self) -> None:
        self.statuses = [0] * 6
        self.data: dict[str, float] = {"round": 0.0}


changes = st.lists(
    st.one_of(
        st.tuples(st.just("status"), st.integers(0, 5), st.integers(0, 4)),
        st.tuples(st.just("data"), st.sampled_from(["round", "other"]), st.floats(0, 3)),
        st.just(("look", 0, 0)),
    ),
    max_size=40,
)


@given(changes)
def test_deltas_add_up_to_the_whole(steps: list[tuple[str, Any, Any]]) -> None:
    engine = Changing()
    mirror, known = Mirror(engine), NOTHING  # type: ignore[arg-type]
    version = 0
    for what, key, value in steps:
        if what == "status":
            engine.statuses[key] = value
        elif what == "data":
            engine.data[key] = value
        else:
            known = joined(known, json.loads(json.dumps(mirror.look(version))))
            version = known["version"]
    known = joined(known, mirror.look(version))
    assert status_list(known, 6) == engine.statuses
    assert known["data"] == engine.data


def test_only_what_changed_is_told() -> None:
    engine = Changing()
    mirror = Mirror(engine)  # type: ignore[arg-type]
    first = mirror.look()
    engine.statuses[2] = 1
    news = mirror.look(first["version"])
    assert (news["whole"], news["statuses"], news["data"]) == (False, {2: 1}, {})
    assert mirror.look(news["version"])["statuses"] == {}


def test_a_viewer_of_another_run_gets_the_whole() -> None:
    mirror = Mirror(Changing())  # type: ignore[arg-type]
    assert mirror.look(99)["whole"]
