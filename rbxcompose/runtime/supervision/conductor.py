"""The decisions of the supervisor, pure: when each process is started, informed or ended, and how the robot ends.

The shell around it (`supervisor.py`) carries out the `ConductorEffects` and reports what happened; time comes from
a scheduler.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import takewhile

from rbxcompose.base.levels import Level
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.supervision.members import (
    BLOCKED,
    DONE,
    LOOK,
    BlockedComponents,
    ConductorEffects,
    KeptValues,
    Member,
    Phase,
    Silence,
    is_commanding,
)
from rbxcompose.runtime.supervision.other_hosts import OtherHosts
from rbxcompose.runtime.supervision.plan_change import LONGEST, WORLD, Changes, Changing, WhenDone, text_of
from rbxcompose.runtime.supervision.stop_latch import StopLatch
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.component import ComponentNoted, MissionOver, RobotHeld
from rbxcompose.sdk.registry import component_type, declared

END_BOUND = 0.9  # [s] to end after everything is at rest; what is left then is killed


def rest_time(plan: Plan) -> float:
    """Return how long the components of a plan may take to come to rest [s]."""
    return max((component_type(instance.type).rest_time(instance.config) for instance in plan.instances), default=0.0)


class Closing:
    """Brings processes to rest and ends them one by one; `phase` is its progress."""

    def __init__(self, members: Mapping[str, Member], effects: ConductorEffects, router: str | None) -> None:
        self.phase = Phase.BRAKING
        self._members, self._effects, self._router = members, effects, router
        self._left: list[str] = []  # processes still to be shut down, the next one last

    def brake(self) -> None:
        """Bring everything that may move to rest."""
        for member in self._there():
            if member.is_configured and member.name != self._router:
                self._effects.send(member.name, messages.Brake())
            elif member.name != self._router:
                self._effects.end(member.name)  # it cannot listen yet; its components brake before it ends
        self.close_when_at_rest()

    def hurry(self) -> None:
        """End everything that is left immediately."""
        for member in self._there():
            self._effects.kill(member.name)

    def exited(self) -> None:
        """Continue after the end of a process."""
        self.close_when_at_rest()
        self._close_next()

    def close_when_at_rest(self) -> None:
        """Shut down if nothing moves any more."""
        moving = [member for member in self._there() if member.name != self._router and not member.is_at_rest]
        if self.phase is Phase.BRAKING and not moving:
            self.close()

    def close(self) -> None:
        """Shut down even if something still moves."""
        if self.phase is Phase.BRAKING:
            self.phase = Phase.CLOSING
            self._left = list(self._members)  # the router first, so that it ends last
            self._close_next()

    def _there(self) -> list[Member]:
        return [member for member in self._members.values() if member.is_there]

    def _close_next(self) -> None:
        """Shut down the next process once the one before has ended."""
        if self.phase is not Phase.CLOSING:
            return
        if self._left and self._members[self._left[-1]].is_there is False:
            self._left.pop()
            self._close_next()
        elif self._left:
            self._shutdown_once(self._left[-1])
        else:
            self.phase = Phase.ENDED

    def _shutdown_once(self, name: str) -> None:
        member = self._members[name]
        if member.is_closing:
            return
        member.is_closing = True
        if member.is_configured:
            self._effects.send(name, messages.Shutdown())
        else:
            self._effects.end(name)


FINE, MISSION_FAILED, ROBOT_FAILED, INTERRUPTED = 0, 3, 4, 130

_OWNER = "supervisor"


class Conductor:
    """Leads the processes of a robot from the first fork to the last exit."""

    def __init__(
        self, plan: Plan, options: RunOptions, scheduler: Scheduler, effects: ConductorEffects, *, router: str | None
    ) -> None:
        """Take `router`: the name of the router's process, or None if an existing router serves."""
        self.exit_code = FINE
        self.reason = ""  # why it went down
        self.endpoint = plan.bus.router
        self.facts: dict[str, dict[str, str]] = {}
        self.time = 0.0  # [s] of robot time, as far as known
        self.states: dict[str, tuple[str, int]] = {instance.name: ("unconfigured", 0) for instance in plan.instances}
        self.is_real_time = not options.is_stepped and not plan.follows_clock
        self.blocked = BlockedComponents(effects, is_stepped=options.is_stepped)
        self.plan, self.layers = plan, options.layers
        self.generation = 0  # of the plan: how often it was changed
        self._changing: Changing | None = None
        self.kept = KeptValues()
        self._options, self._router, self._scheduler, self._effects = options, router, scheduler, effects
        self.members = {name: Member(name) for name in (*([router] if router else []), *plan.groups)}
        self.latch = StopLatch(effects, self._holding, lambda: scheduler.now if self.is_real_time else self.time)
        self._is_running = False  # everything has been active
        self._starts_mission = True  # that of `start`, with its process: not once it is over, nor by another plan
        self._silence = Silence(effects, self._report_lost, scheduler.now)
        self.hosts = OtherHosts(plan.share, effects, self._to_configured)
        self._closing: Closing | None = None  # set once the robot goes down

    @property
    def is_stopped(self) -> bool:
        """Return whether everything that moves is held."""
        return self.latch.is_stopped

    def state_of(self, name: str) -> tuple[str, int]:
        """Return the state of a component and its restarts; it is BLOCKED if it waits for a failed one to start."""
        state, restarts = self.states[name]
        return (BLOCKED if name in self.blocked.unstarted else state), restarts

    @property
    def phase(self) -> Phase:
        """Return the phase of the whole robot."""
        if self._closing:
            return self._closing.phase
        return Phase.RUNNING if self._is_running else Phase.STARTING

    # The beginning

    def begin(self) -> None:
        """Start all processes."""
        for name in self.members:
            self._fork(name)
        if not self._options.is_stepped:
            self._scheduler.every(LOOK, _OWNER, lambda dt: self._look_for_silence())

    def _fork(self, name: str) -> None:
        member = self.members[name]
        member.forked(self._scheduler.now)
        member.is_stopped = self.is_stopped
        self._effects.fork(name, is_restart=member.was_started, is_stopped=self.is_stopped)
        if self.generation:  # the pre-fork parent knows only the first plan
            self._effects.send(name, messages.Adopt(text_of(self.plan, self.plan.of_group(name))))
        if name == self._router or self.endpoint is not None:
            self._effects.send(name, messages.Configure(self.endpoint, self.time))

    def _proceed(self) -> None:
        """Do the next step of starting, for the whole robot or for restarted processes."""
        self.blocked.look(self.plan, self.states, self.hosts.failed, self.members)
        if self.is_going_down or not self._all_configured():
            return
        waiting = [instance for instance in self.plan.instances if self.state_of(instance.name)[0] not in DONE]
        fresh = [instance for instance in waiting if instance.name not in self.members[instance.process].requested]
        if self.phase is Phase.STARTING and waiting[:1] != fresh[:1]:
            return  # the answer of the first one is pending, or it is being restarted in place
        late = {instance.name for instance in waiting}
        fresh = [instance for instance in self.hosts.reached(fresh) if late.isdisjoint(instance.starts_after)]
        if fresh:
            group = fresh[0].process
            names = [one.name for one in takewhile(lambda instance: instance.process == group, fresh)]
            self.members[group].requested.update(names)
            self._effects.send(group, messages.Activate(names))
            return
        if self.phase is Phase.STARTING:
            if waiting or not self.hosts.is_complete():
                return
            self._is_running = True
            self._effects.is_up()  # before anything that starts can report
            if self._options.duration is not None and self.is_real_time:
                self._scheduler.at(self._options.duration, _OWNER, lambda: self.go_down(FINE, "the time is up"))
        for group in self.plan.groups:
            self._start(self.members[group])
        if self._changing:
            self._changing.look({name: self.state_of(name) for name in self.states}, self.blocked.causes)

    def _all_configured(self) -> bool:
        members = (self.members[group] for group in self.plan.groups)
        return all(member.is_configured or member.is_given_up for member in members)

    def _start(self, member: Member) -> None:
        if not member.is_started and not member.is_given_up:
            member.is_started = member.was_started = True
            self._effects.send(member.name, messages.Start(self._starts_mission))
            for text, request in self.kept.repeated(self.plan.of_group(member.name) if member.restarts else ()):
                self._effects.send(member.name, messages.Ask(0, text, request))  # nobody waits for the answer

    # What processes say

    def receive(self, name: str, message: messages.ChannelWord) -> None:
        """Handle a message of a process."""
        member = self.members[name]
        member.last_word = self._scheduler.now
        match message:
            case messages.Configured(endpoint):
                self._configured(member, endpoint)
            case messages.States(states):
                self._are(states)
                self._proceed()
            case messages.Failed(instance, text, time):
                self.time = max(self.time, time)
                self._failed(instance, text)
            case messages.Repeated() | messages.SettingsKept() | ComponentNoted():
                self.kept.receive(message)
                self._effects.states_changed()
            case MissionOver():
                self._starts_mission = False
                self._mission_over(message)
            case messages.TimeIsUp():
                self.go_down(FINE, "the time is up")
            case messages.StoppedByBus() if not self.is_stopped:
                self._effects.log(Level.WARN, "stop over the bus: everything that moves is held until 'release'")
                self.stop("the command 'stop', over the bus")
            case RobotHeld():
                self.latch.receive(member, message)
            case messages.AtRest():
                member.is_at_rest = True
                if self._closing:
                    self._closing.close_when_at_rest()
            case messages.Answered(number, answer):
                self._effects.answer(number, answer)
            case messages.Refusal(number, reason):
                self._effects.refuse(number, reason)
            case messages.Summary(time, facts):
                self.time = max(self.time, time)
                self.facts.update(facts)
            case messages.FromHost(report):
                self._receive_report(report)
            case messages.Retired() if self._changing:
                self._changing.retired(name)
                self._proceed()
            case messages.Reconfigured(refused) if self._changing:
                self._reconfigured(self._changing, name, refused)
            case messages.Alive(time, moves, runs):
                if name != self._router:  # whose time is that of this computer, also where the robot's is not
                    self.time = max(self.time, time)
                member.moves, member.runs = moves, runs
                self._alive(member)
                self._look_at_duration()

    def _configured(self, member: Member, endpoint: str | None) -> None:
        member.is_configured = True
        member.policy.ready(self._scheduler.now)
        if member.is_stopped is not self.is_stopped:  # that changed after it was forked
            self.latch.notify(member)
        self.blocked.notify(self.plan, member)
        for instance in self.plan.of_group(member.name) if member.restarts else ():
            if (settings := self.kept.settings.get(instance.name)) is not None:
                self._effects.send(member.name, settings)
        if member.name == self._router and self.endpoint is None:
            self.endpoint = endpoint
            for group in self.plan.groups:
                if self.members[group].is_there:
                    self._effects.send(group, messages.Configure(endpoint))
        self._proceed()

    def _mission_over(self, over: MissionOver) -> None:
        if self._options.is_detached or over.mission != self.plan.start:
            return
        because = f": {over.message}" if over.message else ""
        exit_code = FINE if over.outcome == "success" else MISSION_FAILED
        self.go_down(exit_code, f"mission {over.mission}: {over.outcome}{because}")

    # Faults

    def exited(self, name: str, how: str, detail: str = "") -> None:
        """Handle the end of a process: `how` it ended in words, and what it printed."""
        member = self.members[name]
        how = member.exited(how)
        if self._closing:
            self._closing.exited()
            return
        if member.is_closing:  # it holds no components any more
            self._went_on_without(name)
            return
        lost = self.plan.of_group(name)
        is_for_good = bool(lost) and all(item.restart.when == "never" for item in lost)
        self._are({item.name: ("failed" if is_for_good else "unconfigured", 0) for item in lost})
        delay = member.policy.after_failure(self._scheduler.now)
        if name == WORLD or (self._options.is_stepped and lost):  # there, one process holds all, with the time
            self.go_down(ROBOT_FAILED, f"process '{name}' {how}, and simulated truth with it", Level.ERROR, detail)
        elif is_for_good:
            self._give_up(member, how, detail)
        elif delay is None:
            self.go_down(ROBOT_FAILED, f"process '{name}' {how}, too often to continue", Level.ERROR, detail)
        else:
            self._effects.log(Level.ERROR, f"process '{name}' {how}; restarting it", detail)
            self._report_lost(member, how)
            member.restarts += 1
            self._scheduler.at(self._scheduler.now + delay, _OWNER, lambda: self._fork_again(member))
        self._went_on_without(name)

    def _give_up(self, member: Member, how: str, detail: str) -> None:
        member.is_given_up = True
        self._effects.log(Level.ERROR, f"process '{member.name}' {how}; nothing in it is ever restarted", detail)
        self._report_lost(member, how)
        self._proceed()

    def _fork_again(self, member: Member) -> None:
        is_wanted = self.members.get(member.name) is member and not member.is_there
        if is_wanted and not self.is_going_down:
            self._fork(member.name)

    def _went_on_without(self, name: str) -> None:
        if self._changing:
            self._changing.exited(name)
            self._proceed()

    def _failed(self, name: str, message: str) -> None:
        """Handle a component that failed too often: the robot ends, unless a change has just started this component."""
        if self._changing and self._changing.failed(name, message):
            self._effects.log(Level.ERROR, message)
            self._are({name: ("failed", self.states[name][1])})
            self._proceed()
        else:
            self.go_down(ROBOT_FAILED, message, Level.ERROR)

    def _are(self, states: Mapping[str, tuple[str, int]]) -> None:
        """Apply new states; if a component has failed on the path of commands, hold motion."""
        states = {name: state for name, state in states.items() if name in self.states}
        new = {name for name, (state, _) in states.items() if state == "failed" and self.states[name][0] != "failed"}
        self.states.update(states)
        self._effects.states_changed()
        self._notify_hosts()
        if self._options.is_stepped:  # there it would be received at another instant in each run
            return
        commanding = [
            instance.name for instance in self.plan.instances if instance.name in new and is_commanding(instance)
        ]
        if commanding and not self.is_stopped and self.phase is Phase.RUNNING:
            text = f"'{commanding[0]}' failed on the path of commands"
            self._effects.log(Level.ERROR, f"{text}: all motion is held until 'release'")
            self.stop(text)

    def _report_lost(self, member: Member, cause: str) -> None:
        names = [one.name for one in self.plan.of_group(member.name)]
        if names and not member.is_reported_lost:
            member.is_reported_lost = True
            self._to_configured(messages.Lost(names, f"process '{member.name}' {cause}"))

    def _look_for_silence(self) -> None:
        now = self._scheduler.now
        is_excused = self._silence.look_at_all(self.members.values(), now, is_going_down=self.is_going_down)
        self.hosts.look(now, is_excused=is_excused)
        self._notify_hosts()

    def _receive_report(self, report: messages.HostReport) -> None:
        if (end := self.hosts.receive(report, self._scheduler.now)) is not None:
            self.go_down(end.exit_code, f"{end.reason} (host '{report.host}')")
        self.latch.heard_host(report)
        self._proceed()

    def _notify_hosts(self) -> None:
        is_of_all = self.is_going_down and self.exit_code != INTERRUPTED  # a signal is for this host alone
        end = messages.RobotEnd(self.exit_code, self.reason) if is_of_all else None
        states = {name: self.state_of(name) for name in self.states}
        self.hosts.report(states, self.latch.shared, end, is_going_down=self.is_going_down)

    def _alive(self, member: Member) -> None:
        if member.is_reported_lost and member.is_configured:
            member.is_reported_lost = False
            self._effects.log(Level.WARN, f"process '{member.name}' answers again")

    def _look_at_duration(self) -> None:
        """End the run when time from outside has reached the duration; on a stepped clock the process itself does."""
        duration = self._options.duration
        if self.plan.follows_clock and duration is not None and self.time >= duration:
            self.go_down(FINE, "the time is up")

    # What people want

    def stop(self, by: str) -> None:
        """Hold everything that moves until `release`; `by` tells people who wants it."""
        self.latch.set(by)

    def release(self) -> None:
        """Allow motion again."""
        self.latch.release()

    def _holding(self) -> list[Member]:
        """Return the processes that hold components."""
        return [self.members[group] for group in self.plan.groups]

    def _to_configured(self, message: messages.ChannelOrder) -> None:
        for member in self._holding():
            if member.is_configured:
                self._effects.send(member.name, message)

    # Another plan

    @property
    def reached(self) -> list[str]:
        """Return the processes that take orders; none if the robot goes down."""
        groups = () if self.is_going_down else self.plan.groups
        return [name for name in groups if self.members[name].is_configured]

    def hindrance(self, changes: Changes) -> str:
        """Return why changes are not even to be considered now, or nothing if they are."""
        if self._options.is_stepped:
            return "it runs on a stepped clock, where a change would make two runs differ"
        if self.phase is not Phase.RUNNING:
            return "it is not up yet" if self.phase is Phase.STARTING else "it is going down"
        if self._changing:
            return "it is already being changed"
        return changes.impossible[0] if changes.impossible else ""

    def why_not(self, changes: Changes) -> str:
        """Return why changes cannot be made now, or nothing if they can."""
        if hindrance := self.hindrance(changes):
            return hindrance
        moves = [text for member in self.members.values() for text in member.moves]
        runs = {name: text for member in self.members.values() for name, text in member.runs.items()}
        return changes.unsafe(moves, runs)

    def change(self, changes: Changes, done: WhenDone) -> None:
        """Carry out changes that `why_not` allows; `done` is called with the result."""

        def end(text: str, is_refused: bool) -> None:
            self._changing = None
            self._effects.states_changed()
            done(text, is_refused)

        changing = self._changing = Changing(changes, self.members, self._effects, self._switch, self._fork, end)
        self._after(LONGEST, lambda: changing.time_is_up(self.states))
        changing.proceed()
        self._proceed()

    def _switch(self, changes: Changes) -> None:
        """Apply the new plan, now that everything that stops has stopped."""
        executives = {one.name for one in changes.after.instances if declared(one.type, one.config, RunsMissions)}
        self._starts_mission &= changes.after.start == self.plan.start and executives.isdisjoint(changes.starting)
        self.plan, self.generation = changes.after, self.generation + 1
        fresh = {
            instance.name: ("unconfigured", 0) for instance in self.plan.instances if instance.name in changes.starting
        }
        for name in changes.starting:
            self.kept.settings.pop(name, None)
        self.hosts.adopt(self.plan.share)
        if self._router and changes.links_change and self.members[self._router].is_there:
            self._effects.send(self._router, messages.Adopt(text_of(self.plan, ())))
        self.latch.forget([instance.name for instance in self.plan.instances])
        self.states = {
            instance.name: fresh.get(instance.name) or self.states[instance.name] for instance in self.plan.instances
        }

    def _reconfigured(self, changing: Changing, process: str, refused: Mapping[str, str]) -> None:
        changing.reconfigured(process, refused)
        old = {instance.name: instance for instance in changing.changes.before.instances}
        kept = tuple(old[instance.name] if instance.name in refused else instance for instance in self.plan.instances)
        self.plan = replace(self.plan, instances=kept)  # what the next change is compared with
        self._proceed()

    # Going down

    @property
    def is_going_down(self) -> bool:
        """Return whether the robot goes down."""
        return self._closing is not None

    def go_down(self, exit_code: int, reason: str, level: Level = Level.OK, detail: str = "") -> None:
        """Brake, wait for rest, shut down in reverse order, end what is left; the first reason counts."""
        if self.is_going_down:
            return
        self._closing = closing = Closing(self.members, self._effects, self._router)
        self.exit_code, self.reason = exit_code, reason
        if self._changing:
            self._changing.cut_off(f"the robot goes down: {reason}")
        if level > Level.OK:
            self._effects.log(level, f"{reason}; the robot goes down", detail)
        self._notify_hosts()
        bound = rest_time(self.plan)
        self._after(bound, closing.close)
        self._after(bound + END_BOUND, closing.hurry)
        closing.brake()

    def hurry(self) -> None:
        """End everything that is left of a robot that goes down immediately."""
        if self._closing:
            self._closing.hurry()

    def _after(self, seconds: float, callback: Callable[[], None]) -> None:
        self._scheduler.at(self._scheduler.now + seconds, _OWNER, callback)
