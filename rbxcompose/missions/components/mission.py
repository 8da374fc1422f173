"""The executive: runs the robot's missions with the actions of other components."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rbxcompose.base.requests import Command
from rbxcompose.missions.engine.events import MissionEnded, MissionEvent
from rbxcompose.missions.engine.world import POSE, World
from rbxcompose.missions.execution import equipment, requests
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.program.outcomes import IDLE, Result
from rbxcompose.msgs.rbxcompose_msgs import RunMission
from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk import Capability, Component, Level, Port, Refused, RunsMissions, ServesAction, answers, component
from rbxcompose.sdk.component import MissionOver, MissionWaits

if TYPE_CHECKING:  # a check needs no engine: it is imported when the component is configured
    from rbxcompose.missions.engine.interventions import Intervention
    from rbxcompose.missions.engine.logbook import LogRecord
    from rbxcompose.missions.execution.mission_run import LeftMission, MissionRun
    from rbxcompose.missions.execution.world import RobotWorld

RUN = "run_mission"
RATE = 10.0  # [Hz]
LOOK_AGAIN = 0.1  # [s] between two checks for a pose that has not arrived yet
RESTART, ASK = "restart", "ask"  # after a crash
NO_INPUTS: Mapping[str, str] = {}


@component("mission")
class Mission(Component[MissionConfig]):
    """Runs missions; each action of the robot is a skill. One starts by itself; people and triggers start others.

    It is made of the sections `missions`, `start`, `triggers`, `values` and `places`.

    Example:
        executive: {type: mission}
    """

    made_by = "A robot with missions runs one."
    process = "mission"
    steps_for_goals = True

    @classmethod
    def rate_of(cls, config: MissionConfig) -> float:
        """Return how often it looks at the goal of another component [Hz]."""
        return RATE if config.for_others else 0.0

    @classmethod
    def ports(cls, config: MissionConfig) -> dict[str, Port[Any]]:
        """Return a port for each used value, skill, topic and service, and for the pose if missions read it."""
        runs = {RUN: ServesAction(RunMission, RUN, skill=None).named(RUN)} if config.for_others else {}
        return equipment.ports_for(config) | equipment.ports_of_triggers(config.triggers.values()) | runs

    @classmethod
    def capabilities(cls, config: MissionConfig) -> tuple[Capability, ...]:
        """Declare that it is the executive."""
        return (RunsMissions(),)

    def configure(self) -> None:
        """Start with no values and no missions."""
        from rbxcompose.missions.execution.errands import Desks
        from rbxcompose.missions.execution.mission_run import OrderedMission
        from rbxcompose.missions.execution.missions import Broadcast, RunningMissions
        from rbxcompose.missions.execution.snapshots import SnapshotStore
        from rbxcompose.missions.execution.triggers import Triggering, TriggerMemory
        from rbxcompose.missions.execution.world import Arrivals, RobotWorld

        self.arrivals, self.desks = Arrivals(self.config.values), Desks(self)
        self.missions = RunningMissions(self.config, self.world, self.story, self.publish)
        address = self.context.address
        self.snapshots = SnapshotStore(address.robot, is_kept=bool(address.router))
        self.broadcast = Broadcast(self.config.programs, self.context.window)
        self.ordered = OrderedMission(
            lambda name: programs[name].inputs if name in (programs := self.config.programs) else (),
            self.begin,
            self.end,
        )
        seen = RobotWorld(self, self.arrivals, self.desks, lambda leaf, result: None, lambda event: None)
        memory = TriggerMemory(self.snapshots.triggers_file)
        self.triggering = Triggering(self.config.triggers, self.config.names, seen, self, memory)
        self.is_held = False  # stopped before the start; a release alone lets nothing begin
        self.restarts_held = False  # the start mission, which was paused and cannot go on where it was
        self.kept: dict[str, requests.RunMission] = {}  # requests by people that began missions that still run
        self.repeated: tuple[Command, ...] = ()  # those, and the breakpoints
        self.left: list[LeftMission] = []  # those that were paused when another executive took over
        self.trouble = ""  # with what is kept on disk
        self.restored: dict[str, float] = {}  # wall-clock time of the snapshots of missions that wait for people [s]
        self.shown = ""  # the last reported status
        self.planned: float | None = None  # the last requested wake [s]
        self.misfits: set[str] = set()  # values whose messages have another shape

    def world(
        self, ended: Callable[[int, Result], None], say: Callable[[MissionEvent], None]
    ) -> tuple[World, RobotWorld]:
        """Return the world of a mission, and the robot in it; tests wrap the robot in another world."""
        from rbxcompose.missions.execution.world import RobotWorld

        robot = RobotWorld(self, self.arrivals, self.desks, ended, say)
        return robot, robot

    def start(self) -> None:
        """Run the start mission, as soon as every value that it reads has arrived; from now on, triggers count."""
        self.begin_first()
        self.triggering.start()

    def begin_first(self) -> None:
        """Begin the start mission, if there is one."""
        if (name := self.config.start) is None:
            self.show(Level.OK, "no mission to start")
            return
        if name in self.missions.names:  # taken over
            return
        try:
            begins = self.context.starts_mission or self.restarts_held
            run = self.recovered(name) if begins or self.context.is_again else None
            if run is None and begins:
                run = self.begin(name)
            if run is None:
                self.show(Level.OK, f"{name} waits to be run")
            elif self.is_held and not run.is_paused:
                self.hold_back(run)
        except Refused as refusal:  # a person has already begun it
            self.warn(f"mission {name} does not start: {refusal}")

    def begin(
        self, name: str, inputs: Mapping[str, str] = NO_INPUTS, state: str = "", lent: frozenset[str] = frozenset()
    ) -> MissionRun:
        """Begin a mission; while the robot is stopped, hold it until the resume.

        Raises:
            Refused: if it cannot run, with the reason.
        """
        run = self.missions.run(name, inputs, state, lent)
        self.snapshots.set_aside(name)
        if missing := run.missing():
            self.info(f"mission {name} waits for {', '.join(missing)}")
        if self.context.is_stopped:
            self.hold_back(run)
        self.look_soon()
        return run

    def recovered(self, name: str) -> MissionRun | None:
        """Return a mission that a crash had cut short, if it is to go on where it was; else None."""
        policy = self.config.after_crash.get(name, RESTART)
        snapshot = self.snapshots.read(name) if policy != RESTART else None
        if snapshot is None:
            return None
        found = self.snapshots.left_over(name, runs=False)
        try:
            run = self.missions.resumed(name, snapshot, self.now)
        except Refused as refusal:
            self.warn(f"{refusal}; it starts again")
            return None
        self.snapshots.take_up(name)
        self.restored[name] = found[0] if found else 0.0
        self.continue_with(run, is_asked=policy == ASK or bool(snapshot["is_paused"]))
        return run

    def continue_with(self, run: MissionRun, *, is_asked: bool) -> str:
        """Let a restored mission go on as soon as it knows what it reads, unless a person is asked."""
        run.goes_on = not is_asked and not self.context.is_stopped
        self.look_soon()
        until = "as soon as its values have arrived" if run.goes_on else "when it is resumed"
        return self.announce(f"mission {run.name} is restored from its snapshot; it goes on {until}")

    def hold_back(self, run: MissionRun) -> None:
        """Let a mission begin only at the resume."""
        run.is_paused = True
        self.announce(f"mission {run.name} is held until it is resumed")

    def received(self, port: str, message: Any) -> None:
        """Take a value and wake the missions that read it; or take the outcome of an order."""
        if port.startswith(equipment.ENDS):
            self.desks.ended(port, message)
            return
        if port.startswith(equipment.TRIGGER):
            self.triggering.message(port.removeprefix(equipment.TRIGGER))
            return
        name = port.removeprefix(equipment.VALUE)
        wrong = self.arrivals.take(name, message, self.now)
        if wrong and name not in self.misfits:
            self.misfits.add(name)
            self.warn(f"value {name}: {wrong}")
        if self.triggering.reads(name) or any(mission.reads(name) for mission in self.missions):
            self.look_soon()

    def look_soon(self) -> None:
        """Request a wake at this instant."""
        self.context.wake_at(self.now)

    def step(self, dt: float) -> None:
        """Run the mission that a component wants."""
        self.ordered.step(self.bound[RUN].current)

    def wake(self) -> None:
        """Do what is due."""
        if self.planned is not None and self.planned <= self.now:
            self.planned = None
        wakes = self.triggering.turn()
        for mission in self.missions:
            wakes += self.turn(mission)
            if (due := self.snapshots.keep(mission, self.now)) is not None:
                wakes.append(due)
        trouble = self.snapshots.trouble or self.triggering.trouble
        if trouble != self.trouble and trouble:
            self.warn(trouble)
        self.trouble = trouble
        while self.snapshots.unusable:
            self.warn(self.snapshots.unusable.popitem()[1])
        if wakes:
            self.plan(min(wakes))
        self.broadcast.publish(self.missions)

    def turn(self, run: MissionRun) -> list[float]:
        """Do what is due in a mission; return its next wake [s], if any."""
        if run.goes_on:
            if missing := run.missing():
                return self.wait(run, ", ".join(missing))
            run.resume(self.now)
        if run.is_paused:
            run.look(self.now)
            due = run.next_wake()
            return [due] if due is not None else []
        if run.engine.status == IDLE and (missing := run.missing()):
            return self.wait(run, ", ".join(missing))
        if run.began is None:
            self.show(Level.OK, self.running_text())
        run.tick(self.now)
        if run.end is not None:
            self.finish(run.name, run.end)
        elif run.engine.stops:
            self.show(Level.OK, f"mission {run.name} is stopped at {run.stopped_at[0]['place']}")
        due = run.next_wake()
        return [due] if due is not None else []

    def wait(self, run: MissionRun, missing: str) -> list[float]:
        """Report what a mission waits for before it starts; return when to check again [s]."""
        self.show(Level.OK, f"waiting for {missing}")
        if run.loses_patience(self.now):
            from rbxcompose.missions.execution.mission_run import PATIENCE

            text = f"waits for {missing}, which has not arrived for {PATIENCE:g} s"
            self.warn(f"mission {run.name} {text}")
            self.context.notify(MissionWaits(run.name, text))
        return [self.now + LOOK_AGAIN if POSE in missing else run.patient_until or self.now]

    def plan(self, time: float) -> None:
        """Request a wake, once per time."""
        if time != self.planned:
            self.context.wake_at(time)
        self.planned = time

    @property
    def occupation(self) -> str:
        """Return which missions run."""
        names = [mission.name for mission in self.missions if not mission.is_paused]
        return f"mission {names[0]} runs" if len(names) == 1 else f"missions {', '.join(names)} run" if names else ""

    @property
    def claims(self) -> bool:
        """Return whether a mission uses a skill that claims a part of the robot."""
        return any(mission.claims for mission in self.missions)

    # Another configuration

    def consider(self, new: MissionConfig) -> Iterator[str]:
        """Say how the missions that run go on with what has changed."""
        for run, _, exchanged in self.missions.followed(new):
            yield f"mission {run.name} goes on where it is"
            yield from exchanged.notes

    def reconfigure(self, old: MissionConfig) -> None:
        """Exchange the missions that have changed, also while they run."""
        gone = self.missions.follow(self.config, self.missions.followed(self.config), self.now)
        for breakpoint_ in gone:
            self.warn(f"the breakpoint at '{breakpoint_}' is gone")
        self.keep()
        self.triggering.follow(self.config.names)
        self.broadcast.follow(self.config.programs)
        self.look_soon()

    def take_over(self, old: Mission) -> None:
        """Be held if the missions were, leave those that were paused where they are, start nothing that was started."""
        self.is_held = old.is_held  # as the start mission was held
        self.triggering.take_over(old.triggering)
        self.missions.breakpoints.take_over(old.missions.breakpoints)
        for left in old.left:
            try:
                run = self.missions.taken_over(left, self.now)
            except Refused as refusal:
                self.restarts_held |= left.name == self.config.start
                self.warn(f"{refusal}; it starts again")
            else:
                self.announce(f"mission {run.name} is where it was, and still paused")

    def finish(self, name: str, end: MissionEnded) -> None:
        """Report that a mission has ended; after the start mission, the robot may go down."""
        level = Level.ERROR if end.result == "failure" else Level.WARN if end.doubt else Level.OK
        self.show(level, ": ".join(filter(None, (name, end.result, end.doubt))))
        self.snapshots.drop(name)
        self.restored.pop(name, None)
        self.keep()
        self.triggering.ended(name, end)
        if name == self.config.start:
            self.context.notify(MissionOver(name, end.result, end.words))

    def stop(self) -> None:
        """Pause all missions; the resume requests their unfinished actions again."""
        self.is_held = not self.missions.runs
        self.triggering.stop()
        for mission in self.missions:
            if not mission.is_paused or mission.goes_on:
                self.hold_running(mission, "stopped")

    def brake(self) -> None:
        """End all missions: the robot is going down, or another executive takes over."""
        self.is_held = self.is_held or any(run.is_paused for run in self.missions)
        self.left = [run.left for run in self.missions if run.is_paused and run.began is not None]
        for mission in self.missions:
            mission.abort(self.now)
            self.snapshots.drop(mission.name)
        self.broadcast.publish(self.missions)

    # Commands from people

    @answers(requests.RunMission)
    def run(self, request: requests.RunMission) -> str:
        """Begin a mission, and restart it after a crash."""
        if not (request.is_repeated and self.recovered(request.mission)):
            self.begin(request.mission, request.inputs, request.start)
        self.keep(replace(request, is_repeated=True))
        if self.context.is_stopped:
            return f"mission {request.mission} is held: the robot is stopped; 'release' it, then 'mission resume'"
        return f"mission {request.mission} starts"

    @answers(requests.CancelMission)
    def cancel(self, request: requests.CancelMission) -> str:
        """End a mission for good."""
        run = self.missions.running(request.mission)
        self.end(run)
        return f"mission {run.name} cancelled"

    def end(self, run: MissionRun) -> None:
        """End a mission that runs."""
        run.abort(self.now)
        if run.end is not None:
            self.finish(run.name, run.end)
        self.broadcast.publish(self.missions)

    @answers(requests.PauseMission)
    def pause(self, request: requests.PauseMission) -> str:
        """Hold a mission."""
        run = self.missions.running(request.mission, lambda one: not one.is_paused)
        if run.is_paused and not run.goes_on:
            raise Refused(f"mission {run.name} is already paused")
        return self.hold_running(run, "paused")

    @answers(requests.ResumeMission)
    def resume(self, request: requests.ResumeMission) -> str:
        """Resume a mission, unless the robot is held by a stop."""
        run = self.missions.running(request.mission, lambda one: one.is_paused, "paused")
        if self.context.is_stopped:
            raise Refused("the robot is stopped: release it first")
        if not run.is_paused:
            raise Refused(f"mission {run.name} is not paused")
        run.resume(self.now)
        self.restored.pop(run.name, None)
        self.look_soon()
        return self.announce(f"mission {run.name} resumed")

    # Debugging

    @answers(requests.SetBreakpoint)
    def set_breakpoint(self, request: requests.SetBreakpoint) -> str:
        """Stop a mission at a node or a transition, now and whenever it runs again."""
        self.arm(self.missions.breakpoints.add(request.where, request.mission, self.missions.names))
        here = [one for one in self.missions.breakpoints.listed() if one.where == request.where]
        return "; ".join(f"breakpoint in {one.mission}: {one.place}, {one.text}" for one in here)

    @answers(requests.ClearBreakpoints)
    def clear_breakpoints(self, request: requests.ClearBreakpoints) -> str:
        """Clear one breakpoint or all."""
        self.arm(self.missions.breakpoints.clear(request.where, request.mission))
        return "breakpoint cleared" if request.where else "all breakpoints cleared"

    @answers(requests.ListBreakpoints)
    def list_breakpoints(self, request: requests.ListBreakpoints) -> tuple[requests.ListedBreakpoint, ...]:
        """Return all breakpoints."""
        return self.missions.breakpoints.listed()

    @answers(requests.ListOutcomes)
    def list_outcomes(self, request: requests.ListOutcomes) -> requests.OutcomesByNode:
        """Return in which outcomes nodes may be forced to end."""
        from rbxcompose.missions.execution.breakpoints import outcomes_of

        run = self.missions.running(request.mission)
        return outcomes_of(run.engine.program, run.engine.robot)

    @answers(requests.ListData)
    def list_data(self, request: requests.ListData) -> tuple[requests.ListedDatum, ...]:
        """Return the data of a mission that runs."""
        from rbxcompose.missions.execution.breakpoints import data_of

        return tuple(data_of(self.missions.running(request.mission)))

    def arm(self, missions: Iterable[str]) -> None:
        """Let missions stop at their breakpoints, and keep these over a crash."""
        for run in self.missions:
            if run.name in missions:
                run.stop_at(self.missions.breakpoints.of(run.name), self.now)
        self.keep()

    @answers(requests.StepMission)
    def take_step(self, request: requests.StepMission) -> str:
        """Let a mission go on to its next leaf or transition."""
        from rbxcompose.missions.engine.interventions import TakeStep

        run = self.begun(request.mission, lambda one: one.is_paused)
        if self.context.is_stopped:
            raise Refused("the robot is stopped: release it first")
        run.intervene(TakeStep(), self.now)
        if run.is_paused:
            run.resume(self.now)
        self.restored.pop(run.name, None)
        self.look_soon()
        return f"mission {run.name} goes on to its next step"

    @answers(requests.ForceNode)
    def force(self, request: requests.ForceNode) -> str:
        """Let a node that runs end."""
        from rbxcompose.missions.execution.breakpoints import forced

        return self.intervene(request.mission, lambda run: [forced(run, request.where, request.outcome)])

    @answers(requests.SetMissionData)
    def set_data(self, request: requests.SetMissionData) -> str:
        """Set data of a mission."""
        from rbxcompose.missions.execution.breakpoints import changed

        return self.intervene(request.mission, lambda run: changed(run, request.values))

    @answers(requests.JumpMission)
    def jump(self, request: requests.JumpMission) -> str:
        """Bring a machine into another state."""
        from rbxcompose.missions.execution.breakpoints import jump

        return self.intervene(request.mission, lambda run: [jump(run, request.state)])

    def begun(self, name: str, what: Callable[[MissionRun], bool] = lambda one: True) -> MissionRun:
        """Return a mission that runs and has begun; raise `Refused` if there is none."""
        run = self.missions.running(name, what)
        if run.engine.status == IDLE:
            raise Refused(f"mission {run.name} has not begun")
        return run

    def intervene(self, name: str, wanted: Callable[[MissionRun], Iterable[Intervention]]) -> str:
        """Do in a mission what a person wants, all of it or nothing; raise `Refused` if it cannot be done."""
        from rbxcompose.missions.engine.interventions import NotPossible

        run = self.begun(name)
        try:
            for intervention in wanted(run):
                run.intervene(intervention, self.now)
        except NotPossible as error:
            raise Refused(str(error)) from error
        self.look_soon()
        self.broadcast.publish(self.missions)
        return f"mission {run.name}: done; it goes on from there {'when it is resumed' if run.is_paused else 'now'}"

    @answers(requests.RestoreMission)
    def restore(self, request: requests.RestoreMission) -> str:
        """Go on with a mission where a crash had cut it short."""
        name, snapshot = self.cut_short(request.mission)
        run = self.missions.resumed(name, snapshot, self.now)
        self.snapshots.take_up(name)
        self.keep(requests.RunMission(name, is_repeated=True))
        return self.continue_with(run, is_asked=False)

    @answers(requests.ForgetMission)
    def forget(self, request: requests.ForgetMission) -> str:
        """Drop the snapshot of a mission that a crash had cut short."""
        name, _ = self.cut_short(request.mission)
        try:
            self.snapshots.forget(name, runs=name in self.missions.names)
        except OSError as error:
            raise Refused(f"the snapshot of mission {name} cannot be removed: {error.strerror}") from error
        return f"the run of mission {name} that did not end is forgotten"

    def cut_short(self, mission: str) -> tuple[str, Mapping[str, Any]]:
        """Return a mission that a crash had cut short, the only one if none is named, and its snapshot."""
        names, active = [mission] if mission else [*self.config.programs], self.missions.names
        found = {name: left[1] for name in names if (left := self.snapshots.left_over(name, runs=name in active))}
        if len(found) != 1:
            several = f"several missions have one: {', '.join(found)}; name one"
            raise Refused(several if found else "there is no snapshot of a mission that was cut short")
        return next(iter(found.items()))

    @answers(requests.ListSnapshots)
    def list_snapshots(self, request: requests.ListSnapshots) -> tuple[requests.ListedSnapshot, ...]:
        """Return the runs that did not end, by a crash or a loss of power."""
        return tuple(one for name in self.config.programs if (one := self.left_over(name)))

    def left_over(self, name: str) -> requests.ListedSnapshot | None:
        """Return what is left of a run that did not end, unless it goes on."""
        from rbxcompose.missions.engine.snapshot import save
        from rbxcompose.missions.execution.snapshots import described

        program, is_active = self.missions.breakpoints.linked(name), name in self.missions.names
        if is_active and name in self.restored and (run := self.missions.runs[name]).is_paused and not run.goes_on:
            return described(name, self.restored[name], save(run.engine), program, waits=True)
        if (found := self.snapshots.left_over(name, runs=is_active)) is None:
            return None
        at, snapshot = found
        return described(name, at, snapshot["state"], program, changed=self.missions.changed_since(name, snapshot))

    @answers(requests.ListMissions)
    def listed(self, request: requests.ListMissions) -> tuple[requests.ListedMission, ...]:
        """Return all missions."""
        return self.missions.listed()

    @answers(requests.ListTriggers)
    def listed_triggers(self, request: requests.ListTriggers) -> tuple[requests.ListedTrigger, ...]:
        """Return all triggers."""
        return self.triggering.listed()

    @answers(requests.ShowPicture)
    def picture(self, request: requests.ShowPicture) -> requests.PictureData:
        """Return the picture of a mission."""
        return self.missions.picture(request.mission)

    @answers(requests.LookAtMission)
    def look_at(self, request: requests.LookAtMission) -> requests.Seen:
        """Return the updates of a mission, and all of its data as text under `shown`."""
        missions, name = self.missions, request.mission
        return {**missions.seen(name, request.since), "shown": missions.shown(name)}

    @answers(requests.LookAtAll)
    def look_at_all(self, request: requests.LookAtAll) -> requests.Seen:
        """Return the state of a mission, with its picture, and all of its data as text under `shown`."""
        missions, name = self.missions, request.mission
        return {**missions.seen(name), "picture": missions.picture(name), "shown": missions.shown(name)}

    @answers(requests.ReadLog)
    def log_part(self, request: requests.ReadLog) -> requests.LogPart:
        """Return records of the log."""
        return self.missions.since(request.after)

    def hold_running(self, run: MissionRun, why: str) -> str:
        """Hold a mission and return the report of it."""
        run.pause(self.now)
        self.broadcast.publish(self.missions)
        self.look_soon()  # the snapshot has that it is paused
        return self.announce(f"mission {run.name} {why}")

    def keep(self, begun: requests.RunMission | None = None) -> None:
        """Let the supervisor repeat, after a crash, what set breakpoints and began missions that still run."""
        kept = {**self.kept, **({begun.mission: begun} if begun else {})}
        self.kept = {name: entry for name, entry in kept.items() if name in self.missions.names}
        repeated = (*self.missions.breakpoints.requests, *self.kept.values())
        if repeated != self.repeated:
            self.repeated = repeated
            self.context.repeat(repeated)

    # Reports

    def story(self, mission: str, level: Level, text: str) -> None:
        """Log a line of a mission's story, with its name if several run."""
        is_named = len(self.missions.names) > 1 and not text.startswith("mission ")
        self.context.log(level, f"{mission}: {text}" if is_named else text)

    def publish(self, record: LogRecord) -> None:
        """Publish a record of the log, unless it only records an input."""
        from rbxcompose.missions.engine.logbook import INPUTS

        if record["event"] not in INPUTS:
            self.bound[equipment.port_name(equipment.PUBLISHES, equipment.EVENTS)](String(data=json.dumps(record)))

    def running_text(self) -> str:
        """Return the running missions in words."""
        return f"running {', '.join(self.missions.names)}"

    def announce(self, text: str) -> str:
        """Log a text and make it the status."""
        self.info(text)
        self.show(Level.OK, text)
        return text

    def show(self, level: Level, text: str) -> None:
        """Make a text the status, if it has changed."""
        if text != self.shown:
            self.shown = text
            self.status(level, text)

    def summary(self) -> dict[str, str]:
        """Return the states of the missions and what they did."""
        runs = list(self.missions.runs.values())
        states = "; ".join(f"{run.name}: {run.end.result if run.end else run.state}" for run in runs)
        skills = "; ".join(text for run in runs if (text := run.story.skills()))
        return {name: text for name, text in (("mission", states), ("skills", skills)) if text}
