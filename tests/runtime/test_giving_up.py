"""What follows the end of a process whose components are never restarted, and of a component that stays failed."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.base.config import Restart
from rbxcompose.base.levels import Level
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.supervision.members import Phase
from rbxcompose.runtime.supervision.plan_change import changes
from tests.runtime.stage import Stage, placed, robot

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


def prepared(where: str = "robot") -> Plan:
    """`prep` alone in its process, `go_to` starts after it, and `last` after that, in the process `where`."""
    base, mux, go_to, mission = robot().instances
    prep = replace(placed("prep", "transforms", "programs"), restart=NEVER)
    go_to = replace(go_to, starts_after=("prep",))
    last = replace(placed("last", "transforms", where), starts_after=("go_to",))
    return replace(robot(), instances=(prep, base, mux, go_to, last, mission))


def without_prep() -> Stage:
    """Return that robot, up although `prep` has failed."""
    stage = Stage(prepared())
    stage.configure("router", "programs", "world", "robot", "mission")
    stage.speak("programs", say.States({"prep": ("failed", 0)}))
    for process, name in (("world", "base"), ("robot", "mux"), ("mission", "mission")):
        stage.speak(process, say.States({name: ("active", 0)}))
    return stage


def ordered(stage: Stage) -> list[str]:
    return [name for _, order in stage.orders(say.Activate) if isinstance(order, say.Activate) for name in order.names]


def shown(stage: Stage) -> list[str]:
    return [stage.conductor.state_of(name)[0] for name in ("prep", "go_to", "last", "mux")]


def test_who_starts_after_one_that_failed_does_not_start_nor_who_starts_after_that() -> None:
    stage = without_prep()
    assert ordered(stage) == ["prep", "base", "mux", "mission"]
    assert shown(stage) == ["failed", "blocked", "blocked", "active"]
    assert stage.conductor.blocked.causes == {"go_to": "prep", "last": "prep"}
    assert (stage.ups, stage.conductor.phase) == (1, Phase.RUNNING)
    stage.exit("robot")
    stage.pass_time(0.2)
    stage.configure("robot")
    stage.speak("robot", say.States({"mux": ("active", 0)}))
    assert ordered(stage)[4:] == ["mux"]
    assert shown(stage) == ["failed", "blocked", "blocked", "active"]


def test_who_was_blocked_starts_once_the_cause_is_active_after_all() -> None:
    stage, told = without_prep(), list[tuple[str, bool]]()
    stage.conductor.change(changes(stage.plan, prepared(), ["prep"]), lambda *end: told.append(end))
    stage.speak("programs", say.Retired())
    stage.configure("programs")
    assert ordered(stage)[4:] == ["prep"]
    stage.activate()
    assert ordered(stage)[4:] == ["prep", "go_to", "last"]
    assert shown(stage) == ["active"] * 4
    assert told == [("prep restarted", False)]


def test_a_change_of_what_is_blocked_says_so_and_does_not_wait_for_it() -> None:
    stage, told = without_prep(), list[tuple[str, bool]]()
    stage.conductor.change(changes(stage.plan, prepared("mission")), lambda *end: told.append(end))
    stage.speak("robot", say.Retired())
    stage.configure("mission")
    assert told == [("only in part: 'last' waits for prep, which failed; 'rbxcompose ps' shows what runs", True)]


def test_who_has_started_goes_on_when_what_it_started_after_fails() -> None:
    stage = Stage(prepared())
    stage.configure("router", "programs", "world", "robot", "mission")
    stage.activate()
    stage.exit("programs")
    assert shown(stage) == ["failed", "active", "active", "active"]
    stage.speak("robot", say.States({"go_to": ("unconfigured", 1)}))  # restarted in place
    assert shown(stage) == ["failed", "unconfigured", "active", "active"]


def test_within_a_process_too_who_starts_after_another_waits_until_that_is_active() -> None:
    stage = Stage(prepared())
    stage.configure("router", "programs", "world", "robot", "mission")
    stage.speak("programs", say.States({"prep": ("active", 0)}))
    stage.speak("world", say.States({"base": ("active", 0)}))
    stage.speak("robot", say.States({"mux": ("active", 0), "go_to": ("failed", 0)}))
    assert ordered(stage) == ["prep", "base", "mux", "go_to", "mission"]
    assert shown(stage) == ["active", "failed", "blocked", "active"]
