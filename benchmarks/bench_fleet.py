"""What a robot of a fleet costs, by the number of robots: `python -m benchmarks.bench_fleet fleet domains links 100`.

Each robot is the patrol robot with an ideal simulator, in a system on this machine, which patrols until it goes down;
with `waiting`, it has no mission yet. With `fleet`, it has that profile: one process. A further robot, the watcher,
subscribes to the odometry of each.
One word says how they are linked: by routers of their `own`, as robots of systems are, so the watcher takes what they
share; as `domains` of one router, so that nobody can watch; or by `names`, namespaces of one domain and router. With
`links`, processes are linked with that one router only.

A line below a row tells if this machine has too much to do: then processor and messages are what it has left for each.
Each number of robots has eight minutes, and whatever happens, all robots go down.
"""

from __future__ import annotations

import contextlib
import math
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
import zenoh

from benchmarks.measuring import COMMAND, ROOT, memory_of, processor_time, program
from rbxcompose.bus.zenoh_session import open_client, open_router
from rbxcompose.runtime.folder import RobotFolder, RobotState
from rbxcompose.runtime.processes import longest_wait, wait_until_ended, waits_of

SETTLED, WATCHED, COUNTED, LIMIT, ENDED = 5.0, 10.0, 4.0, 480, 60.0  # [s]
NEEDED, LINK, KEPT = 0.13e9, 0.35e6, 2e9  # [bytes] of a robot, of each end of a link between processes, for all else
PROCESSES, TRIES = 3, 20  # of a robot on the bus; of a visitor to get in
VISITED = 10  # robots whose messages and tokens are counted
WEIGHT = "-10"  # niceness of the one router among robots, some nine times the share of a processor
LATE = 0.1  # share of the time that robots wait for a processor, from which on they are late
OWN, DOMAINS, NAMES, LINKS, FLEET, WAITING = "own", "domains", "names", "links", "fleet", "waiting"
ROUTER = "tcp/127.0.0.1:7440"
SYSTEM = """
rbx: 1
kind: System
name: fleet
hosts: {{here: {{}}}}
robots:
{bots}
"""
WATCHER = "rbx: 1\nkind: Robot\nname: watcher\n{bus}components:\n{seen}"
BUS = {
    DOMAINS: "bus: {{router: " + ROUTER + ", {links}domain: {number}}}\n",
    NAMES: "bus: {{router: " + ROUTER + ", {links}namespace: {name}}}\n",
}
SEEN = "  seen_{0}: {{type: topic_monitor, topic: /bot_{0}/odom, message: nav_msgs/Odometry, rate: 5 Hz}}\n"


@dataclass(frozen=True, slots=True)
class FleetFigures:
    """Medians of the robots of a fleet, and what the watcher costs; shares of one core, messages as they are sent."""

    robots: int
    start: float  # [s] until all are up
    memory: float  # [bytes] of a robot, proportional set size
    processor: float
    messages: float  # [1/s] of a robot that leave a process
    tokens: float  # on its bus
    links: float  # of its processes
    discovery: float  # [s] for a visitor to learn of all nodes on the bus of a robot
    router_memory: float  # [bytes] of the one router; 0 if each robot has its own
    router_processor: float
    watcher_memory: float  # [bytes]; 0 if there is none
    watcher_processor: float
    busy: float  # the share of this machine's processors that is in use, by whatever
    late: float  # the share of the time in which a thread of a robot waits for a processor
    restarted: int  # robots of which a process ended meanwhile; their figures are left out

    def line(self) -> str:
        """Return a row of the table."""
        cells = (
            f"{self.robots}",
            f"{self.start:.1f} s",
            f"{self.memory / 1e6:.0f} MB",
            f"{self.processor:.1%}",
            f"{self.messages:.0f}",
            f"{self.tokens:.0f}",
            f"{self.links:.0f}",
            f"{self.discovery * 1e3:.0f} ms",
            f"{self.router_memory / 1e6:.0f} MB",
            f"{self.router_processor:.1%}",
            f"{self.watcher_memory / 1e6:.0f} MB",
            f"{self.watcher_processor:.1%}",
            f"{self.busy:.0%}",
            f"{self.late:.0%}",
            f"{self.restarted}",
        )
        return f"| {' | '.join(cells)} |"

    @property
    def warning(self) -> str:
        """Return what to think of the figures if this machine has too much to do, else nothing."""
        if self.late < LATE:
            return ""
        cores = psutil.cpu_count()
        return (
            f"Too much for {cores} processors: {self.busy:.0%} in use, robots wait {self.late:.0%} of the time. "
            "Memory, tokens and links hold; times and shares of the processor do not.\n"
        )


def measured(number: int, how: str = OWN, *options: str) -> FleetFigures:
    """Run a fleet and return its figures.

    Raises:
        MemoryError: if this machine has not enough for it.
    """
    links = 0 if how == OWN or LINKS in options else (PROCESSES * number) ** 2
    if psutil.virtual_memory().available < (needed := number * NEEDED + links * LINK + KEPT):
        raise MemoryError(f"{number} robots need {needed / 1e9:.0f} GB of memory")
    with TemporaryDirectory() as folder:
        path, environment = Path(folder), {"XDG_RUNTIME_DIR": folder}
        _write(path, number, how, options)
        system, began = str(path / "system.yaml"), time.perf_counter()
        with contextlib.nullcontext() if how == OWN else _one_router() as router:
            signal.alarm(LIMIT)
            try:
                program([*COMMAND, "up", system, "--host", "here", "-d"], environment)()
                return _looked_at(path, how, time.perf_counter() - began, router)
            except subprocess.CalledProcessError as error:
                sys.stderr.write(f"{error.output}{error.stderr}")
                raise
            finally:
                signal.alarm(0)
                _bring_down(path)


def _bring_down(folder: Path) -> None:
    """End all robots at once, as a service manager would: `down` takes a program for each.

    Raises:
        RuntimeError: if one does not end.
    """
    deadline = time.monotonic() + ENDED
    while supervisors := [state.supervisor for state in _states(folder).values() if state.is_supervised]:
        for supervisor in supervisors:
            supervisor.send_signal(signal.SIGTERM)
        if wait_until_ended(supervisors, max(0.0, deadline - time.monotonic())):
            raise RuntimeError(f"robots in {folder} do not go down")


def _write(folder: Path, number: int, how: str, options: Collection[str]) -> None:
    """Write the manifests of a fleet."""
    text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
    mission = f"{{file: {ROOT}/missions/patrol.yaml, with: {{rounds: 1000}}}}"
    text = text.replace("../../missions/patrol.yaml", mission)
    text = text.replace("start: patrol\n", "") if WAITING in options else text
    links = "links: router, " if LINKS in options else ""
    bots = []
    for index in range(1, number + 1):
        bus = BUS[how].format(links=links, number=index, name=f"bot_{index}") if how in BUS else ""
        (folder / f"robot_{index}.yaml").write_text(text + bus, encoding="utf-8")
        more = f"{', share: [odom]' if how == OWN else ''}{', profile: fleet' if FLEET in options else ''}"
        bots.append(f"  bot_{index}: {{robot: robot_{index}.yaml{more}}}")
    if how != DOMAINS:
        bus = BUS[how].format(links=links, name="watcher") if how in BUS else ""
        seen = "".join(SEEN.format(one) for one in range(1, number + 1))
        (folder / "watcher.yaml").write_text(WATCHER.format(bus=bus, seen=seen), encoding="utf-8")
        bots.append("  watcher: {robot: watcher.yaml}")
    (folder / "system.yaml").write_text(SYSTEM.format(bots="\n".join(bots)), encoding="utf-8")


@contextlib.contextmanager
def _one_router() -> Iterator[int]:
    """Run the router of all robots; yield its process."""
    words = [sys.executable, "-m", "benchmarks.bench_fleet", ROUTER]
    process = subprocess.Popen(words, cwd=ROOT, stdin=subprocess.PIPE, start_new_session=True)
    with contextlib.suppress(OSError):  # only root may; Linux shares processors between sessions, of which it is one
        Path(f"/proc/{process.pid}/autogroup").write_text(WEIGHT, encoding="ascii")
    try:
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def _looked_at(folder: Path, how: str, start: float, router: int | None) -> FleetFigures:
    time.sleep(SETTLED)
    states = _states(folder)
    pids = {name: _pids(state) for name, state in states.items()} | {"": [router] if router else []}
    psutil.cpu_percent()
    before = {name: _taken(some) for name, some in pids.items()}
    time.sleep(WATCHED)
    busy = psutil.cpu_percent() / 100
    after = {name: _taken(some) for name, some in pids.items()}
    bots = [name for name in states if name != "watcher"]
    steady = [name for name in bots if before[name] and after[name] and _pids_now(folder, name) == pids[name]]
    if not steady:
        raise RuntimeError("no robot kept its processes")
    taken = {name: _between(before[name], after[name]) for name in (*steady, "watcher", "") if name in pids}
    memory = {name: _memory(pids[name]) for name in taken}
    visited = steady[:: math.ceil(len(steady) / VISITED)]
    sent = _messages({name: states[name] for name in visited}, how)  # for a visitor, they take the way by the router
    found = [_tokens(states[name]) for name in visited]
    return FleetFigures(
        len(bots),
        start,
        statistics.median(memory[name] for name in steady),
        statistics.median(taken[name][0] for name in steady),
        statistics.median(sent.values()),
        statistics.median(count for count, _ in found),
        statistics.median(sum(map(_links, pids[name])) for name in visited),
        statistics.median(seconds for _, seconds in found),
        memory[""],
        taken[""][0],
        memory.get("watcher", 0.0),
        taken["watcher"][0] if "watcher" in taken else 0.0,
        busy,
        statistics.median(taken[name][1] for name in steady),
        len(bots) - len(steady),
    )


def _states(folder: Path) -> dict[str, RobotState]:
    """Return the states of all robots that are up, by name."""
    folders = sorted((folder / "rbxcompose").glob("*/state.json"))
    found = {path.parent.name: RobotFolder(path.parent).read_state() for path in folders}
    return {name: state for name, state in found.items() if state is not None}


def _pids(state: RobotState) -> list[int]:
    return [state.supervisor.pid, *(process.pid for process in state.processes.values())]


def _pids_now(folder: Path, name: str) -> list[int]:
    state = RobotFolder(folder / "rbxcompose" / name).read_state()
    return _pids(state) if state is not None else []


Taken = tuple[float, list[dict[str, float]]]  # processor time [s], and waits for a processor by thread [s]


def _taken(pids: list[int]) -> Taken | None:
    """Return what some processes have had so far; None if one has ended."""
    try:
        return sum(map(processor_time, pids)), list(map(waits_of, pids))
    except FileNotFoundError:
        return None


def _between(before: Taken | None, after: Taken | None) -> tuple[float, float]:
    """Return the shares of a processor that were had, and of the time that was waited; 0 for what has ended."""
    if before is None or after is None:
        return 0.0, 0.0
    waited = max(map(longest_wait, before[1], after[1]), default=0.0)
    return (after[0] - before[0]) / WATCHED, waited / WATCHED


def _memory(pids: list[int]) -> float:
    """Return the memory of some processes [bytes]; those that have ended have none."""
    found = 0
    for pid in pids:
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            found += memory_of(pid)
    return float(found)


def _links(pid: int) -> int:
    found = psutil.Process(pid).net_connections("tcp")
    return sum(1 for connection in found if connection.status == psutil.CONN_ESTABLISHED)


def _messages(states: dict[str, RobotState], how: str) -> dict[str, float]:
    """Return how many messages per second pass the bus of each robot."""
    counts: dict[str, int] = dict.fromkeys(states, 0)
    sessions = []
    for name, state in states.items():

        def count(sample: zenoh.Sample, name: str = name) -> None:
            counts[name] += 1

        session = _visitor(state)
        session.declare_subscriber(f"{state.domain}/{name}/**" if how == NAMES else f"{state.domain}/**", count)
        sessions.append(session)
    time.sleep(COUNTED)
    found = {name: number / COUNTED for name, number in counts.items()}
    for session in sessions:
        session.close()  # type: ignore[no-untyped-call]
    return found


def _visitor(state: RobotState) -> zenoh.Session:
    """Return a session at the router of a robot; a loaded machine may need several tries."""
    for _ in range(TRIES):
        with contextlib.suppress(ConnectionRefusedError):
            return open_client(state.router or "")
    raise RuntimeError(f"no router answers at {state.router}")


def _tokens(state: RobotState) -> tuple[int, float]:
    """Return how many tokens a visitor finds on the bus of a robot, and how long this takes [s]."""
    began = time.perf_counter()
    session = _visitor(state)
    replies = session.liveliness().get(f"@ros2_lv/{state.domain}/**")
    found = sum(1 for reply in replies if reply.ok is not None)
    seconds = time.perf_counter() - began
    session.close()  # type: ignore[no-untyped-call]
    return found, seconds


COLUMNS = (
    "robots, start, memory, processor, messages/s, tokens, links, discovery, router, processor, watcher, processor, "
    "busy, waits, restarted"
)
HEAD = f"| {COLUMNS.replace(', ', ' | ')} |\n|{' --- |' * 15}"


def main(words: list[str]) -> None:
    """Print a table with a row for each number of robots; or be the one router, until the end of the input."""
    if words[:1] == [ROUTER]:
        session = open_router(ROUTER)
        sys.stdin.read()
        session.close()  # type: ignore[no-untyped-call]
        return
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # all robots go down first
    signal.signal(signal.SIGALRM, lambda *_: sys.exit(f"not measured within {LIMIT} s"))
    how = next((word for word in words if word in (OWN, DOMAINS, NAMES)), OWN)
    sys.stdout.write(f"{HEAD}\n")
    for count in [int(word) for word in words if word.isdigit()] or [1, 3]:
        figures = measured(count, how, *words)
        sys.stdout.write(f"{figures.line()}\n{figures.warning}")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
