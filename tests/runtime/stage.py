"""A robot of three processes, and a stage that plays them to the conductor."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.base.levels import Level
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.channel import HostReport
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.supervision.conductor import Conductor
from rbxcompose.testing.bench import instance

ENDPOINT = "tcp/127.0.0.1:7447"


def placed(name: str, type_name: str, process: str, **config: object) -> Instance:
    """Return an instance in a process, with the topics of its type."""
    return replace(instance(name, type_name, config), process=process)


def robot() -> Plan:
    """Three processes; `base` starts first, `world` holds simulated truth."""
    inputs = {name: {"priority": priority, "timeout": "0.5 s"} for name, priority in (("teleop", 9), ("way", 1))}
    go_to = placed("go_to", "go_to", "robot")
    through_mux = tuple(replace(wire, topic="/cmd_vel/way") if wire.port == "cmd_vel" else wire for wire in go_to.wires)
    instances = (
        placed("base", "diff_drive_sim", "world"),
        placed("mux", "mux", "robot", output="cmd_vel", inputs=inputs),
        replace(go_to, starts_after=("base",), wires=through_mux),
        placed("mission", "mission", "mission"),
    )
    return Plan("robot", "robot.yaml", instances, start="patrol")


class Stage:
    """Plays the processes: it records what the conductor does and answers as processes would."""

    def __init__(
        self, plan: Plan | None = None, options: RunOptions | None = None, router: str | None = "router"
    ) -> None:
        self.scheduler = Scheduler()
        self.run_id = "this run"
        self.plan = plan or robot()
        self.alive: set[str] = set()
        self.forks: list[tuple[str, bool, bool]] = []
        self.sent: list[tuple[str, say.ChannelOrder]] = []
        self.killed: list[str] = []
        self.suspended: set[str] = set()
        self.waited: dict[str | None, float] = {}  # for a processor [s]; None is the supervisor
        self.ended: list[str] = []
        self.reports: list[HostReport] = []
        self.records: list[tuple[Level, str]] = []
        self.answers: list[tuple[int, object, bool]] = []
        self.ups = 0
        self.writes = 0
        self.beats: set[str] = set()
        self.conductor = Conductor(self.plan, options or RunOptions(), self.scheduler, self, router=router)
        self.conductor.begin()

    # Effects

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        self.forks.append((process, is_restart, is_stopped))
        self.alive.add(process)
        self.beats.add(process)

    def send(self, process: str, message: say.ChannelOrder) -> None:
        self.sent.append((process, message))

    def to_hosts(self, report: HostReport) -> None:
        self.reports.append(report)

    def end(self, process: str) -> None:
        self.ended.append(process)

    def kill(self, process: str) -> None:
        self.killed.append(process)

    def is_suspended(self, process: str) -> bool:
        return process in self.suspended

    def waits(self, process: str | None) -> dict[str, float]:
        return {"thread": self.waited.get(process, 0.0)}

    def log(self, level: Level, text: str, detail: str = "") -> None:
        self.records.append((level, text))

    def is_up(self) -> None:
        self.ups += 1

    def states_changed(self) -> None:
        self.writes += 1

    def answer(self, number: int, answer: object) -> None:
        self.answers.append((number, answer, False))

    def refuse(self, number: int, reason: str) -> None:
        self.answers.append((number, reason, True))

    # Processes

    def speak(self, process: str, message: say.ChannelWord) -> None:
        self.conductor.receive(process, message)

    def exit(self, process: str, how: str = "was killed by SIGKILL") -> None:
        self.alive.discard(process)
        self.conductor.exited(process, how)

    def configure(self, *processes: str) -> None:
        for process in processes:
            self.speak(process, say.Configured(ENDPOINT if process == "router" else None))

    def activate(self) -> None:
        """Answer every order to activate, in turn, until there are no more."""
        answered = 0
        while answered < len(self.orders(say.Activate)):
            process, message = self.orders(say.Activate)[answered]
            assert isinstance(message, say.Activate)
            self.speak(process, say.States(dict.fromkeys(message.names, ("active", 0))))
            answered += 1

    def start(self) -> Stage:
        self.configure("router", "world", "robot", "mission")
        self.activate()
        return self

    def orders(self, kind: type[say.ChannelOrder]) -> list[tuple[str, say.ChannelOrder]]:
        return [(process, message) for process, message in self.sent if isinstance(message, kind)]

    def told(self, kind: type[say.ChannelOrder]) -> list[str]:
        return [process for process, _ in self.orders(kind)]

    def pass_time(self, seconds: float) -> None:
        """Let time pass while the processes in `beats` give signs of life."""
        for _ in range(round(seconds / 0.1)):
            for process in sorted(self.alive & self.beats):
                self.speak(process, say.Alive(self.scheduler.now))
            self.scheduler.advance(self.scheduler.now + 0.1)
