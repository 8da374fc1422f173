"""How a change of a running robot is carried out, without processes and in virtual time."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.compiler.plan.dump import load
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.supervision.plan_change import changes
from tests.runtime.stage import Stage, placed, robot
from tests.runtime.test_giving_up import NEVER, with_never

DRIVER = "'base' moves"


def changed(plan: Plan, name: str, **fields: object) -> Plan:
    """Return a plan in which one instance is another."""
    instances = tuple(replace(instance, **fields) if instance.name == name else instance for instance in plan.instances)  # type: ignore[arg-type]
    return replace(plan, instances=instances)


def with_settings(plan: Plan, name: str, **config: object) -> Plan:
    old = next(instance for instance in plan.instances if instance.name == name)
    return changed(plan, name, config=old.config.model_copy(update=config))


def lamp(process: str = "robot") -> Instance:
    return placed("lamp", "transforms", process)


class Changed(Stage):
    """A robot that is up and gets another plan."""

    def __init__(self, before: Plan | None = None) -> None:
        super().__init__(before)
        self.start()
        self.sent.clear()
        self.forks.clear()
        self.done: list[tuple[str, bool]] = []

    def apply(self, after: Plan) -> Changed:
        failed = [name for name, (state, _) in self.conductor.states.items() if state == "failed"]
        found = changes(self.conductor.plan, after, failed)
        assert self.conductor.why_not(found) == ""
        self.conductor.change(found, lambda text, is_refused: self.done.append((text, is_refused)))
        return self

    def why_not(self, after: Plan) -> str:
        return self.conductor.why_not(changes(self.conductor.plan, after))

    def retire(self, *processes: str) -> None:
        for process in processes:
            self.speak(process, say.Retired())

    def prepared(self) -> dict[str, list[str]]:
        orders = [(name, order) for name, order in self.sent if isinstance(order, say.Prepare)]
        return {name: [instance.name for instance in load(order.plan).instances] for name, order in orders}


def test_what_changes_is_retired_in_reverse_order_then_started_in_order() -> None:
    stage = Changed()
    stage.apply(
        with_settings(with_settings(robot(), "mission", services={"x": "std_srvs/srv/Trigger"}), "mux", output="other")
    )
    assert stage.sent == [("mission", say.Retire(["mission"]))]
    stage.retire("mission")
    assert stage.sent[-1] == ("robot", say.Retire(["mux"]))
    assert stage.prepared() == {}
    stage.retire("robot")
    assert stage.prepared() == {"robot": ["mux"], "mission": ["mission"]}
    stage.configure("mission", "robot")
    stage.activate()
    assert stage.orders(say.Activate) == [("robot", say.Activate(["mux"])), ("mission", say.Activate(["mission"]))]


def test_what_was_set_while_it_ran_is_forgotten_of_what_starts_with_another_plan() -> None:
    stage = Changed()
    for name in ("mux", "base"):
        stage.speak("robot", say.SettingsKept(name, "as text"))
    stage.apply(with_settings(robot(), "mux", output="other"))
    stage.retire("robot")
    assert stage.conductor.kept.settings.keys() == {"base"}


def test_components_are_activated_once_they_are_configured_and_then_it_is_told() -> None:
    stage = Changed().apply(with_settings(robot(), "mux", output="other"))
    stage.retire("robot")
    assert stage.prepared() == {"robot": ["mux"]}
    assert (stage.told(say.Activate), stage.done) == ([], [])
    stage.configure("robot")
    stage.activate()
    assert stage.orders(say.Activate) == [("robot", say.Activate(["mux"]))]
    assert stage.done == [("mux restarted", False)]
    assert (stage.forks, stage.told(say.Start), stage.ups) == ([], [], 1)


def test_a_live_setting_is_sent_to_its_process_and_nothing_stops() -> None:
    after = with_settings(robot(), "go_to", speed=0.1)
    stage = Changed().apply(after)
    [(process, order)] = stage.sent
    assert isinstance(order, say.Reconfigure)
    assert (process, order.keys) == ("robot", {"go_to": ["speed"]})
    assert stage.done == []
    stage.speak("robot", say.Reconfigured({}))
    assert stage.done == [("go_to changed live", False)]
    assert stage.conductor.plan == after


def test_who_refuses_a_live_setting_keeps_the_old_one_and_that_is_told() -> None:
    stage = Changed().apply(with_settings(robot(), "go_to", speed=0.1))
    stage.speak("robot", say.Reconfigured({"go_to": "'go_to' refuses: not now"}))
    assert stage.done == [("only in part: 'go_to' refuses: not now; 'rbxcompose ps' shows what runs", True)]
    assert stage.conductor.plan == robot()


def test_an_executive_in_another_process_begins_no_mission() -> None:
    moved = [replace(one, process="brain") if one.name == "mission" else one for one in robot().instances]
    stage = Changed().apply(replace(robot(), instances=tuple(moved)))
    stage.retire("mission")
    stage.exit("mission")
    stage.configure("brain")
    stage.activate()
    assert stage.orders(say.Start) == [("brain", say.Start(starts_mission=False))]


def test_a_new_process_is_forked_with_the_new_plan_and_started() -> None:
    stage = Changed().apply(replace(robot(), instances=(*robot().instances, lamp("lights"))))
    assert [name for name, *_ in stage.forks] == ["lights"]
    adopt, configure = (order for name, order in stage.sent if name == "lights")
    assert isinstance(adopt, say.Adopt)
    assert [instance.name for instance in load(adopt.plan).instances] == ["lamp"]
    assert isinstance(configure, say.Configure)
    stage.configure("lights")
    stage.activate()
    assert stage.told(say.Start) == ["lights"]
    assert stage.done == [("lamp added", False)]
    stage.conductor.go_down(0, "asked")
    assert stage.told(say.Brake) == ["world", "robot", "mission", "lights"]


def test_a_process_that_holds_nothing_any_more_ends_and_does_not_come_back() -> None:
    stage = Stage(replace(robot(), instances=(*robot().instances, lamp("lights"))))
    stage.configure("router", "world", "robot", "mission", "lights")
    stage.activate()
    told: list[tuple[str, bool]] = []
    stage.conductor.change(changes(stage.plan, robot()), lambda text, is_refused: told.append((text, is_refused)))
    stage.speak("lights", say.Retired())
    assert stage.sent[-1] == ("lights", say.Shutdown())
    stage.exit("lights", "ended with status 0")
    assert told == [("lamp removed", False)]
    stage.pass_time(1.0)
    assert "lights" not in stage.conductor.members
    assert "lamp" not in stage.conductor.states
    assert not stage.conductor.is_going_down


def test_a_component_moves_from_one_process_to_another() -> None:
    stage = Changed().apply(changed(robot(), "go_to", process="legs"))
    stage.retire("robot")
    assert [name for name, *_ in stage.forks] == ["legs"]
    assert stage.prepared() == {}
    stage.configure("legs")
    stage.activate()
    assert stage.done == [("go_to restarted", False)]


def test_a_new_component_that_fails_is_told_and_the_robot_goes_on_without() -> None:
    stage = Changed(replace(robot(), instances=robot().instances))
    stage.apply(replace(robot(), instances=(*robot().instances, lamp())))
    stage.configure("robot")
    stage.speak("robot", say.Failed("lamp", "'lamp' failed too often: no"))
    assert stage.done == [("only in part: 'lamp' failed too often: no; 'rbxcompose ps' shows what runs", True)]
    assert not stage.conductor.is_going_down
    assert stage.conductor.states["lamp"][0] == "failed"


def test_a_new_component_that_fails_and_is_never_restarted_is_told() -> None:
    stage = Changed().apply(replace(robot(), instances=(*robot().instances, replace(lamp(), restart=NEVER))))
    stage.configure("robot")
    stage.speak("robot", say.States({"lamp": ("failed", 0)}))
    told = "'lamp' has failed and is never restarted, the log says why"
    assert stage.done == [(f"only in part: {told}; 'rbxcompose ps' shows what runs", True)]
    assert not stage.conductor.is_going_down


def test_a_failure_of_what_was_there_before_ends_the_robot_also_during_a_change() -> None:
    stage = Changed().apply(replace(robot(), instances=(*robot().instances, lamp())))
    stage.speak("robot", say.Failed("go_to", "no"))
    assert stage.conductor.is_going_down
    assert stage.done == [("only in part: the robot goes down: no; 'rbxcompose ps' shows what runs", True)]


def test_a_process_that_dies_while_it_retires_comes_back_with_the_new_plan() -> None:
    stage = Changed().apply(with_settings(robot(), "mux", output="other"))
    stage.exit("robot")
    assert stage.prepared() == {}
    stage.pass_time(0.3)
    [adopt] = [order for name, order in stage.sent if name == "robot" and isinstance(order, say.Adopt)]
    assert [instance.name for instance in load(adopt.plan).instances] == ["mux", "go_to"]
    stage.configure("robot")
    stage.activate()
    assert stage.done == [("mux restarted", False)]


def test_what_is_never_active_is_told_when_the_time_is_up() -> None:
    stage = Changed().apply(replace(robot(), instances=(*robot().instances, lamp())))
    stage.pass_time(25.0)
    assert stage.done == [("only in part: not active after 20 s: lamp; 'rbxcompose ps' shows what runs", True)]
    assert stage.why_not(robot()) == ""


def test_one_change_waits_for_another() -> None:
    stage = Changed().apply(with_settings(robot(), "go_to", speed=0.1))
    assert stage.why_not(robot()) == "it is already being changed"


def test_a_robot_that_starts_goes_down_or_is_stepped_is_not_changed() -> None:
    after = with_settings(robot(), "go_to", speed=0.1)
    assert Stage().conductor.why_not(changes(robot(), after)) == "it is not up yet"
    going = Stage().start()
    going.conductor.go_down(0, "asked")
    assert going.conductor.why_not(changes(robot(), after)) == "it is going down"
    assert "stepped" in Stage(options=RunOptions(is_stepped=True)).start().conductor.why_not(changes(robot(), after))


def test_signs_of_life_tell_what_moves_and_what_a_restart_would_cut_off() -> None:
    stage, mux = Changed(), with_settings(robot(), "mux", output="other")
    stage.speak("world", say.Alive(1.0, [DRIVER]))
    assert stage.why_not(mux).startswith(DRIVER)
    stage.speak("world", say.Alive(2.0))
    assert stage.why_not(mux) == ""
    stage.speak("mission", say.Alive(2.0, [], {"mission": "mission patrol runs"}))
    assert stage.why_not(changed(robot(), "mission", process="other")).startswith("mission patrol runs")
    stage.exit("mission")
    assert stage.why_not(changed(robot(), "mission", process="other")) == ""


# Who waits for what has failed


def test_who_needs_what_has_failed_for_good_is_marked_and_told() -> None:
    stage = Changed(with_never("mux", "go_to"))
    stage.exit("robot")
    assert stage.conductor.blocked.causes == {"base": "mux"}
    assert (Level.WARN, "'base' waits for mux, which failed") in stage.records
    assert stage.orders(say.Blocked) == [("world", say.Blocked({"base": "waits for mux, which failed"}))]


def test_a_robot_whose_path_of_commands_has_failed_is_held() -> None:
    stage = Changed(with_never("mux", "go_to"))
    stage.exit("robot")
    assert stage.conductor.is_stopped
    assert (Level.ERROR, "'mux' failed on the path of commands: all motion is held until 'release'") in stage.records


def test_what_has_failed_for_good_comes_back_with_the_next_change_and_nobody_waits_any_more() -> None:
    stage = Changed(with_never("mux", "go_to"))
    stage.exit("robot")
    stage.apply(with_never("mux", "go_to"))
    assert [name for name, *_ in stage.forks] == ["robot"]
    stage.configure("robot")
    stage.activate()
    assert stage.done == [("mux go_to restarted", False)]
    assert stage.conductor.blocked.causes == {}
    assert stage.orders(say.Blocked)[-1] == ("world", say.Blocked({}))


def test_on_a_stepped_clock_nobody_is_told_at_another_instant_in_each_run() -> None:
    stage = Stage(with_never("go_to"), RunOptions(is_stepped=True)).start()
    stage.speak("robot", say.States({"go_to": ("failed", 0)}))
    assert stage.told(say.Blocked) == stage.told(say.Stop) == []


@pytest.mark.parametrize("name", ["mux", "go_to", "mission"])
def test_the_state_that_ps_tells_is_kept_after_each_change(name: str) -> None:
    stage = Changed()
    before = stage.writes
    stage.speak(stage.conductor.plan.instances[1].process, say.States({name: ("active", 1)}))
    assert stage.writes > before
