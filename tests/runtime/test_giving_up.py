"""What follows the end of a process whose components are never restarted, and of a component that stays failed."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.base.config import Restart
from rbxcompose.base.levels import Level
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.supervision.members import Phase
from tests.runtime.stage import Stage, robot

NEVER = Restart(when="never")


def with_never(*names: str) -> Plan:
    plan = robot()
    instances = tuple(
        replace(instance, restart=NEVER) if instance.name in names else instance for instance in plan.instances
    )
    return replace(plan, instances=instances)


def test_a_process_is_not_started_again_if_none_of_its_components_may_be() -> None:
    stage = Stage(with_never("mux", "go_to")).start()
    forks = len(stage.forks)
    stage.exit("robot")
    stage.pass_time(2.0)
    assert len(stage.forks) == forks
    assert stage.conductor.phase is Phase.RUNNING
    assert [stage.conductor.states[name][0] for name in ("mux", "go_to", "base")] == ["failed", "failed", "active"]
    reason = "process 'robot' was killed by SIGKILL; nothing in it is ever restarted"
    assert (Level.ERROR, reason) in stage.records
    assert stage.told(say.Lost) == ["world", "mission"]


def test_a_process_is_started_again_if_one_of_its_components_may_be() -> None:
    stage = Stage(with_never("mux")).start()
    stage.exit("robot")
    stage.scheduler.advance(0.2)
    assert stage.forks[-1][:2] == ("robot", True)


def test_another_process_comes_back_while_one_stays_away() -> None:
    stage = Stage(with_never("mux", "go_to")).start()
    stage.exit("robot")
    stage.exit("mission")
    stage.scheduler.advance(0.2)
    stage.configure("mission")
    assert stage.sent[-1] == ("mission", say.Activate(["mission"]))


def test_the_start_goes_on_without_a_component_that_stays_failed() -> None:
    stage = Stage(with_never("base"))
    stage.configure("router", "world", "robot", "mission")
    stage.speak("world", say.States({"base": ("failed", 0)}))
    stage.speak("robot", say.States({"mux": ("active", 0), "go_to": ("active", 0)}))
    stage.speak("mission", say.States({"mission": ("active", 0)}))
    assert (stage.ups, stage.conductor.phase) == (1, Phase.RUNNING)
