"""A simulated chore: it moves the base while it lasts, rests when it is held, and does one thing at a time."""

from __future__ import annotations

import pytest

from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav2_msgs import Wait
from rbxcompose.msgs.stamps import to_duration, to_seconds
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk import Ended, Outcome, Reply, SentGoal
from rbxcompose.testing import Bench, instance

AT_REST = Twist()


class Cleaner:
    """A client that keeps what it is told, and hears the commands to the base."""

    def __init__(self) -> None:
        self.bench = Bench(instance("vacuum", "chore_sim"))
        self.commands = self.bench.collect("cmd_vel", Twist)
        self.ended: list[Ended[Wait.Result]] = []
        self.left: list[float] = []
        self.client = self.bench.bus.action_client("bench", "/chore", Wait)
        self.bench.advance(0.1)

    def send(self, seconds: float) -> SentGoal:
        goal = Wait.Goal(time=to_duration(seconds))
        return self.client(goal, self.ended.append, lambda feedback: self.left.append(to_seconds(feedback.time_left)))

    @property
    def outcomes(self) -> list[Outcome]:
        return [end.outcome for end in self.ended]


def test_it_takes_the_time_of_its_goal_and_leaves_the_base_at_rest() -> None:
    cleaner = Cleaner()
    cleaner.send(5.0)
    cleaner.bench.advance(4.9)
    assert cleaner.outcomes == []
    assert {command.linear.x for command in cleaner.commands} == {0.05, -0.05}
    cleaner.bench.advance(0.3)
    assert cleaner.outcomes == [Outcome.SUCCEEDED]
    assert cleaner.commands[-1] == AT_REST
    result = cleaner.ended[0].result
    assert result is not None
    assert to_seconds(result.total_elapsed_time) == pytest.approx(5.0)


def test_it_tells_how_much_is_left() -> None:
    cleaner = Cleaner()
    cleaner.send(2.0)
    cleaner.bench.advance(3.0)
    assert cleaner.left == sorted(cleaner.left, reverse=True)
    assert cleaner.left[0] == pytest.approx(1.95)
    assert cleaner.left[-1] == 0.0


def test_a_second_goal_is_refused_while_it_is_busy() -> None:
    cleaner = Cleaner()
    cleaner.send(2.0)
    cleaner.bench.advance(1.0)
    cleaner.send(2.0)
    cleaner.bench.advance(2.0)
    assert cleaner.outcomes == [Outcome.REJECTED, Outcome.SUCCEEDED]
    assert any("busy" in text for text in cleaner.bench.texts())


def test_a_goal_that_is_cancelled_ends_at_once_and_another_one_may_come() -> None:
    cleaner = Cleaner()
    sent = cleaner.send(60.0)
    cleaner.bench.advance(1.0)
    sent.cancel()
    cleaner.send(1.0)
    cleaner.bench.advance(0.1)
    assert cleaner.outcomes == [Outcome.CANCELED]
    cleaner.bench.advance(1.1)
    assert cleaner.outcomes == [Outcome.CANCELED, Outcome.SUCCEEDED]
    assert cleaner.commands[-1] == AT_REST


def test_while_it_is_paused_it_rests_and_its_time_stands_still() -> None:
    cleaner = Cleaner()
    pause = cleaner.bench.bus.client("bench", "/chore/pause", SetBool)
    replies: list[Reply[SetBool.Response]] = []
    cleaner.send(2.0)
    cleaner.bench.advance(1.0)
    pause(SetBool.Request(data=True), replies.append)
    cleaner.bench.advance(30.0)
    assert cleaner.commands[-1] == AT_REST
    assert cleaner.outcomes == []
    pause(SetBool.Request(data=False), replies.append)
    cleaner.bench.advance(1.2)
    assert cleaner.outcomes == [Outcome.SUCCEEDED]


@pytest.mark.parametrize("seconds", [-1.0, 1e6])
def test_a_time_that_makes_no_sense_is_refused(seconds: float) -> None:
    cleaner = Cleaner()
    cleaner.send(seconds)
    cleaner.bench.advance(0.1)
    assert cleaner.outcomes == [Outcome.REJECTED]


def test_a_stop_cancels_it() -> None:
    cleaner = Cleaner()
    cleaner.send(5.0)
    cleaner.bench.advance(1.0)
    cleaner.bench.host.stop()
    cleaner.bench.advance(0.1)
    assert cleaner.outcomes == [Outcome.CANCELED]
    assert cleaner.commands[-1] == AT_REST
