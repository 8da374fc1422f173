"""The main of a process group: its scheduler, clock, bus, host and driver, controlled by the supervisor."""

from __future__ import annotations

import faulthandler
import gc
import math
import os
import signal
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from rbxcompose.base.clock import DISPUTE, Clock, ExternalClock, MonotonicClock, SteppedClock, Turn
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Refused, to_data
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import admin_key
from rbxcompose.bus.transport import Closable, Question, Transport
from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs.rosgraph_msgs import Clock as ClockMessage
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.log import LogFile, Record
from rbxcompose.runtime.process_group.connection import (
    HANG,
    CallbackInbox,
    Driver,
    ExternalDriver,
    Lifeline,
    RealTimeDriver,
    SteppedDriver,
    Turns,
    Watchdog,
    open_bus,
)
from rbxcompose.runtime.process_group.host import Host, Notice
from rbxcompose.runtime.process_group.parameters import Deciders
from rbxcompose.runtime.process_group.worker import LONGEST
from rbxcompose.runtime.processes import give_back_free_memory
from rbxcompose.runtime.recording.tape import PLAN, Tape
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic
from rbxcompose.sdk.component import MissionOver, MissionWaits
from rbxcompose.sdk.parameters import RobotRules
from rbxcompose.sdk.ports import Qos
from rbxcompose.sdk.registry import component_type

if TYPE_CHECKING:
    from rbxcompose.runtime.recording.files import Recorder
import io
import logging
import stat
import sys
from types import TracebackType
from typing import TextIO

OnLine = Callable[[Level, str, str], None]  # level, text, detail; called in the thread that printed

_OUTPUT = Path("/proc/self/fd/1")


class Capture:
    """Takes standard output, standard error and all loggers of this process while it is entered."""

    def __init__(self, on_line: OnLine) -> None:
        self._on_line = on_line
        self._is_passing = threading.local()

    def __enter__(self) -> Capture:
        self._before = sys.stdout, sys.stderr
        sys.stdout = _Lines(sys.__stdout__, lambda line: self._pass_on(Level.OK, line))
        sys.stderr = _Lines(sys.__stderr__, lambda line: self._pass_on(Level.WARN, line))
        self._handler = _Handler(self._pass_on)
        root = logging.getLogger()
        root.addHandler(self._handler)
        self._level = root.level
        root.setLevel(logging.INFO)
        logging.captureWarnings(True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, _Lines):
                stream.end()
        sys.stdout, sys.stderr = self._before
        logging.captureWarnings(False)
        logging.getLogger().removeHandler(self._handler)
        logging.getLogger().setLevel(self._level)

    def _pass_on(self, level: Level, text: str, detail: str = "") -> None:
        if getattr(self._is_passing, "now", False):
            os.write(2, f"{text}\n{detail}".encode(errors="backslashreplace"))  # the log itself reports something
            return
        self._is_passing.now = True
        try:
            self._on_line(level, text, detail)
        finally:
            self._is_passing.now = False


class _Lines(io.TextIOBase):
    """A stream of whole lines; the unfinished line of a thread waits for its rest."""

    def __init__(self, raw: TextIO | None, on_line: Callable[[str], None]) -> None:
        self._raw, self._on_line = raw, on_line
        self._begun: dict[int, str] = {}  # by thread

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        if self._raw is None:
            raise io.UnsupportedOperation("there is no file below")
        return self._raw.fileno()

    def write(self, text: str) -> int:
        thread = threading.get_ident()
        *lines, rest = (self._begun.pop(thread, "") + text).split("\n")
        if rest:
            self._begun[thread] = rest
        for line in lines:
            self._say(line)
        return len(text)

    def end(self) -> None:
        """Log lines that were begun and will not be finished."""
        while self._begun:
            self._say(self._begun.popitem()[1])

    def _say(self, line: str) -> None:
        if line.strip():
            self._on_line(line.rstrip("\r"))


class _Handler(logging.Handler):
    def __init__(self, on_line: OnLine) -> None:
        super().__init__()
        self._on_line = on_line

    def emit(self, record: logging.LogRecord) -> None:
        try:
            text, detail = f"{record.name}: {record.getMessage()}", ""
            if record.exc_info:
                detail = logging.Formatter().formatException(record.exc_info)
        except Exception:  # arguments that do not fit their text: logging itself reports it like this
            self.handleError(record)
            return
        self._on_line(_level_of(record.levelno), text, detail)


def _level_of(number: int) -> Level:
    if number >= logging.ERROR:
        return Level.ERROR
    return Level.WARN if number >= logging.WARNING else Level.OK


def take_printed() -> list[str]:
    """Return the lines written past Python to the file of standard output, such as from C, and empty it."""
    about = os.fstat(1)
    if not stat.S_ISREG(about.st_mode) or not about.st_size:
        return []
    text = _OUTPUT.read_text(encoding="utf-8", errors="replace")
    os.ftruncate(1, 0)
    return [line for line in text.splitlines() if line.strip()]


PATH = "stop"  # below the robot's own keys; a process adds its name


def stop_key(robot: str, process: str = "*") -> str:
    """Return the Zenoh key of the stop query of a process; without a name, that of all processes."""
    return admin_key(robot, f"{PATH}/{process}")


def open_stop_line(
    transport: Transport,
    robot: str,
    process: str,
    stop: Callable[[], None],
    post: Callable[[str, Callable[[], None]], None],
) -> Closable:
    """Call `stop` in the scheduler's thread for each query, and answer with the name of the process."""

    def asked(question: Question) -> None:
        def carry_out() -> None:
            stop()
            question.reply(process.encode(), b"")

        post("", carry_out)

    return transport.serve(stop_key(robot, process), asked)


def change_settings(host: Host, order: messages.ComponentSettingOrder, channel: messages.Channel) -> None:
    """Carry out an order, and answer it."""
    changes = host.parameters.changes
    match order:
        case messages.PrepareChange():
            channel.send(_prepared(host, order))
        case messages.CommitChange(number, decides):
            if decides is not None:
                changes.claim(number, decides)
            reason = changes.commit(number)
            channel.send(messages.ChangeFollowed(number, reason))
            if decides is not None and not reason:
                changes.end(number)
                host.parameters.decided(decides, None)
        case messages.UndoChange(number):
            channel.send(messages.ChangeFollowed(number, changes.undo(number)))
        case messages.EndChange(number):
            changes.end(number)
        case messages.ChangeDecided(number, refusal):
            host.parameters.decided(number, refusal)


def _prepared(host: Host, order: messages.PrepareChange) -> messages.ChangePrepared:
    changes = host.parameters.changes
    try:
        found = changes.prepare(order.number, order.wanted)
    except Refused as refusal:
        return messages.ChangePrepared(order.number, str(refusal))
    new = {change.hosted.instance.name: change.new for change in found if change.is_ruled}
    return messages.ChangePrepared(order.number, "", changes.text(changes.live), changes.text(new))


class Taping:
    """Writes a tape of a robot to a file, with its plan; secrets of the plan are left out."""

    def __init__(self, path: Path, plan: Plan, clock: Clock, log: Callable[[str], None]) -> None:
        """Take the robot's `clock`; `log` is called once with the reason if a recording ends too early."""
        self._path, self._log = path, log
        self._real = MonotonicClock()  # so that a killed recorder loses little
        self._recorder: Recorder | None = None
        self._try(lambda: self._begin(plan))
        self.tape = Tape(clock, self._declare, self._add)

    def keep(self) -> None:
        """Write what is due; must be called several times a second."""
        self._do(lambda recorder: recorder.keep(self._real.now()))

    def finish(self) -> None:
        """End the file, which then has its index and its name."""
        self._do(lambda recorder: recorder.finish())
        self._recorder = None

    def _begin(self, plan: Plan) -> None:
        from rbxcompose.runtime.recording.files import Recorder  # imports MCAP, which only a recorded run needs

        self._recorder = Recorder(self._path, self._real.now())
        self._recorder.attach(PLAN, dump(plan).encode())

    def _declare(self, topic: RecordedTopic) -> None:
        self._do(lambda recorder: recorder.declare(topic))

    def _add(self, message: Recorded) -> None:
        self._do(lambda recorder: recorder.add(message))

    def _do(self, action: Callable[[Recorder], None]) -> None:
        """Do something with the recorder, if there is one."""
        recorder = self._recorder
        if recorder is not None:
            self._try(lambda: action(recorder))

    def _try(self, action: Callable[[], None]) -> None:
        try:
            action()
        except OSError as error:
            if self._recorder is not None:
                self._recorder.abandon()
            self._recorder = None
            self._log(f"the recording '{self._path}' ends here: {error.strerror or error}")


LONGEST_CONFIGURE = 30.0  # [s]
LONGEST_CLOSE = 1.0  # [s] to deactivate, clean up and leave the bus
STEPPED_REST_BOUND = 2.0  # [s] of robot time to come to rest on a stepped clock, at least
CLOCK_TOPIC = "/clock"
CLOCK_STATUS = "bus.clock"  # what diagnostics call it: no component has a dot in its name
_TOLD = {
    Turn.GOES: (Level.OK, f"{CLOCK_TOPIC} runs: robot time follows it, and each deadline starts over"),
    Turn.STANDS: (Level.STALE, f"{CLOCK_TOPIC} stands still: so does robot time; only stops are commanded"),
    Turn.JUMPED: (Level.WARN, f"{CLOCK_TOPIC} has jumped: robot time continues from here, each deadline starts over"),
    Turn.DISPUTED: (
        Level.ERROR,
        f"{CLOCK_TOPIC} jumps back and forth: more than one source must be publishing it; robot time stands still "
        f"and only stops are commanded, until there has been no jump for {DISPUTE:g} s",
    ),
}


class ProcessGroup:
    """One process group, from `Configure` to `Shutdown`. It stops by itself when the supervisor is gone."""

    def __init__(
        self,
        plan: Plan,
        name: str,
        options: RunOptions,
        log: LogFile,
        channel: messages.Channel,
        *,
        start: float,
        is_restart: bool = False,
        is_stopped: bool = False,
        rules: RobotRules | None = None,
    ) -> None:
        """Take `start`, the robot's start on the monotonic clock [s]."""
        self.is_over = False
        self._plan, self._name, self._options, self._log, self._channel = plan, name, options, log, channel
        self._is_restart, self._is_stopped, self._rules = is_restart, is_stopped, rules
        self._clock = self._made_clock(start)
        self._scheduler = Scheduler()
        self._inbox = CallbackInbox()
        self._turns = Turns(self._scheduler, self._clock, self._inbox)
        self._watchdog = Watchdog(lambda: self._host.place if self._host is not None else "")
        self._bus: Bus | None = None
        self._lifeline: Lifeline | None = None
        self._taping: Taping | None = None
        self._host: Host | None = None
        self._driver = self._made_driver()
        self._has_begun = False  # something has been activated, and may move
        self._is_ending = False  # nothing more will come; brake at the end of this instant
        self._is_orphaned = False
        self._rest_deadline: float | None = None  # [s] of robot time; None: not braking
        self._is_settled = False  # at rest for good

    def run(self) -> None:
        """Run until the supervisor ends it or is gone."""
        signal.signal(signal.SIGTERM, self._on_sigterm)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
        try:
            with Capture(self._printed):
                self._driver.run()
        finally:
            if self._bus is not None:
                self._bus.close()
            if self._taping is not None:
                self._taping.finish()

    # What the driver calls

    def handle(self, message: messages.ChannelMessage) -> None:
        """Carry out a message from the supervisor."""
        if isinstance(message, messages.Stop | messages.Release):
            self._mind_outside(type(message).__name__.lower())
        match message:
            case messages.Configure(str(router), time):
                self._configure(router, time)
            case messages.Activate(names):
                self._activate(names)
            case messages.Start(starts_mission):
                self._start(starts_mission)
            case messages.Stop():
                self._made_host().stop()
            case messages.Release():
                self._made_host().release()
            case messages.Brake():
                self._is_ending = True
            case messages.Lost(names, cause):
                self._made_host().lost(names, cause)
            case messages.Ask(0, instance, request):
                self._made_host().recall(instance, request)
            case messages.Ask():
                self._channel.send(self._answer(self._made_host(), message))
            case messages.Consider(number, plan):
                self._channel.send(messages.Considered(number, *self._made_host().consider(load(plan).instances)))
            case messages.Adopt(plan):
                self._plan = load(plan)
            case messages.Retire() | messages.Prepare() | messages.Reconfigure():
                self._change(self._made_host(), message)
            case _ if isinstance(message, messages.ComponentSettingOrder):
                change_settings(self._made_host(), message, self._channel)
            case messages.SettingsKept(instance, text):
                self._made_host().restore(instance, text)
            case messages.Blocked(causes):
                self._made_host().statuses.block(causes)
            case messages.Shutdown():
                self._shutdown()
            case _:
                raise RuntimeError(f"not a message for a process group: {message}")

    def _stop_by_bus(self) -> None:
        """Hold everything that moves; the supervisor may be suspended and is informed when it runs."""
        self._made_host().stop()
        self._channel.send(messages.StoppedByBus())

    def orphaned(self) -> None:
        """Come to rest and end: the supervisor is gone."""
        self._is_orphaned = self._is_ending = True
        self._is_settled = self._is_settled or self._host is None

    def beat(self) -> None:
        """Report to the supervisor and the watchdog that the loop runs."""
        self._watch(HANG)
        if self._taping is not None:
            self._taping.keep()
        if not self._options.is_stepped:  # its log must be the same in each run
            for line in take_printed():
                self._printed(Level.WARN, line, "")
        if self._lifeline is not None and not self._options.is_stepped:  # then everything is in this process
            self._lifeline.beat()
        if self._host is not None:
            self._host.look_at_workers()
        if not self._channel.is_behind:
            moves, runs = self._host.work() if self._host is not None else ([], {})
            self._channel.send(messages.Alive(self._clock.now(), moves, runs))

    def settle(self) -> None:
        """Check whether the run must end, whether it has come to rest, and whether the supervisor is gone."""
        if self._time_is_up():
            self._is_ending = True
            self._channel.send(messages.TimeIsUp())
        if self._is_ending and self._rest_deadline is None and self._host is not None:
            self._brake(self._host)
        if self._rest_deadline is not None and not self._is_settled:
            self._look_for_rest(self._made_host(), self._rest_deadline)
        if self._is_orphaned and self._is_settled and not self.is_over:
            self._shutdown()

    # Messages

    def _configure(self, router: str, time: float) -> None:
        self._watch(LONGEST_CONFIGURE)
        if isinstance(self._clock, ExternalClock):
            self._clock.join(time)
            self._scheduler.advance(time)
        instances = self._plan.of_group(self._name)
        if self._options.record is not None:
            self._taping = Taping(
                self._options.record, self._plan, self._clock, lambda text: self._complain("robot", text)
            )
        tape = self._taping.tape if self._taping else None
        loop = self._scheduler, self._clock, self._inbox, self._turns
        try:
            self._bus, self._lifeline, transport = open_bus(self._plan, self._name, router, *loop, self._complain, tape)
        except ConnectionRefusedError as error:
            self._channel.send(messages.Failed("", str(error.strerror)))
            return
        open_stop_line(transport, self._plan.robot, self._name, self._stop_by_bus, self._inbox.put)
        self._host = Host(
            self._plan,
            instances,
            self._scheduler,
            self._clock,
            self._bus,
            self._log.write,
            self._notify,
            is_stopped=self._is_stopped,
            is_restart=self._is_restart,
            **({"on_order": tape.order} if tape else {}),
            post=self._inbox.put if isinstance(self._clock, MonotonicClock) else None,
            router="" if self._options.is_stepped else router,
            stands_until_start=self._options.is_stepped,
            deciders=Deciders(rules=self._rules) if self._options.is_stepped else Deciders(self._channel.send),
        )
        if isinstance(self._driver, ExternalDriver):
            self._follow(self._driver, self._host)
        self._host.configure()
        self._watch(HANG)
        self._channel.send(messages.Configured())

    def _activate(self, names: Sequence[str]) -> None:
        self._has_begun = True
        self._made_host().activate(names)
        self._channel.send(messages.States(self._made_host().states()))

    def _start(self, starts_mission: bool) -> None:
        gc.collect()
        gc.freeze()  # what lives now lives until the end: later collections need not inspect it
        give_back_free_memory()
        self._made_host().start(starts_mission)
        self._watch(HANG)
        if isinstance(self._driver, SteppedDriver):
            self._driver.go(self._options.duration)
        if isinstance(self._driver, RealTimeDriver):
            self._turns.open()

    def _answer(self, host: Host, asked: messages.Ask) -> messages.Answered | messages.Refusal:
        try:
            request = host.request(asked.instance, asked.request)
            if isinstance(request, Command):
                self._mind_outside(f"{asked.instance} {request.words}")
            return messages.Answered(asked.number, to_data(host.ask(asked.instance, request)))
        except Refused as refusal:
            return messages.Refusal(asked.number, str(refusal))

    def _change(self, host: Host, message: messages.Retire | messages.Prepare | messages.Reconfigure) -> None:
        self._watch(LONGEST_CONFIGURE)
        match message:
            case messages.Retire(names):
                host.retire(names)
                self._channel.send(messages.Retired())
            case messages.Prepare(plan):
                host.prepare(load(plan).instances)
                self._channel.send(messages.Configured())
            case messages.Reconfigure(plan, keys):
                self._channel.send(messages.Reconfigured(host.follow(load(plan).instances, keys)))
        self._watch(HANG)

    def _shutdown(self) -> None:
        self._turns.close()
        if not self._options.is_stepped:
            faulthandler.dump_traceback_later(LONGEST_CLOSE, exit=True)  # nothing moves any more: end a hang by force
        if self._host is not None:
            if self._rest_deadline is None:
                self._host.brake()  # the order to brake came together with this one
            self._channel.send(messages.Summary(self._clock.now(), self._host.summary()))
            self._host.shutdown()
        self.is_over = True

    def _mind_outside(self, words: str) -> None:
        if self._options.is_stepped:
            text = f"from outside: {words}; this run is not reproducible"
            self._log.write(Record(self._clock.now(), Level.WARN, "robot", text))

    # Coming to rest

    def _time_is_up(self) -> bool:
        # In real time the supervisor watches the duration; on a stepped clock it would be late.
        duration = self._options.duration
        is_counting = self._options.is_stepped and not self._is_ending and duration is not None
        return is_counting and duration is not None and self._clock.now() >= duration

    def _brake(self, host: Host) -> None:
        self._turns.close()  # from now on, each callback is followed by a look for rest
        host.brake()
        bound = max(host.rest_time, STEPPED_REST_BOUND if self._options.is_stepped else 0.0)
        self._rest_deadline = self._clock.now() + bound
        if isinstance(self._driver, SteppedDriver):
            self._driver.hurry()
            self._driver.go(self._rest_deadline)

    def _look_for_rest(self, host: Host, deadline: float) -> None:
        stands_still = isinstance(self._clock, ExternalClock) and self._clock.is_standing
        if not host.is_at_rest and self._clock.now() < deadline and not stands_still:
            return
        self._is_settled = True
        if isinstance(self._driver, SteppedDriver):
            self._driver.halt()
        self._channel.send(messages.AtRest())

    # Time from outside

    def _follow(self, driver: ExternalDriver, host: Host) -> None:
        """Take robot time from the bus; until it runs, everything is held."""
        host.hold()
        host.bus.subscribe(
            host.owner,
            CLOCK_TOPIC,
            ClockMessage,
            Qos.COMMAND,
            lambda message: driver.receive(to_nanoseconds(message.clock)),
            max_rate=math.inf,  # a limit counts in robot time, which might stand still until this message advances it
        )
        driver.follow(MonotonicClock())

    def _turned(self, turn: Turn) -> None:
        """Hold or continue as outside time stops or runs; one process logs it for all."""
        if self._host is None:
            return
        if turn is not Turn.GOES:
            self._host.hold()
        if turn not in (Turn.STANDS, Turn.DISPUTED):
            self._host.go_on()
        if self._name == self._plan.groups[0]:
            level, text = _TOLD[turn]
            self._host.log("robot", level, text)
            self._host.statuses.set(CLOCK_STATUS, Level.OK if turn is Turn.JUMPED else level, text, {})

    # Parts

    def _made_clock(self, start: float) -> MonotonicClock | SteppedClock:
        if self._options.is_stepped:
            return SteppedClock()
        return ExternalClock() if self._plan.follows_clock else MonotonicClock(start)

    def _made_driver(self) -> Driver:
        if isinstance(self._clock, ExternalClock):
            return ExternalDriver(self._scheduler, self._clock, self._inbox, self._channel, self, self._turned)
        if isinstance(self._clock, SteppedClock):
            rate = self._options.rate
            return SteppedDriver(self._scheduler, self._clock, self._inbox, self._channel, self, rate=rate)
        return RealTimeDriver(self._scheduler, self._clock, self._inbox, self._turns, self._channel, self)

    def _made_host(self) -> Host:
        if self._host is None:
            raise RuntimeError("the process group has not been configured")
        return self._host

    def _notify(self, notice: Notice) -> None:
        if isinstance(notice, MissionWaits):  # on a stepped clock nothing arrives from outside: it would wait for ever
            if self._options.is_stepped:
                self._notify(MissionOver(notice.mission, "failure", notice.message))
            return
        self._channel.send(notice)
        is_over = isinstance(notice, MissionOver) and notice.mission == self._plan.start
        is_the_end = isinstance(notice, messages.Failed) or (is_over and not self._options.is_detached)
        if is_the_end and self._options.is_stepped:
            self._is_ending = True  # here and not by a message, which would arrive at another instant in each run

    def _printed(self, level: Level, text: str, detail: str) -> None:
        """Log printed text under the component that runs in the printing thread, else under the process."""
        host, thread = self._host, threading.current_thread()
        if host is None:
            self._log.write(Record(self._clock.now(), level, self._name, text, detail))
            return
        is_here = thread is threading.main_thread()
        name = host.at_work if is_here else thread.name
        source = name if name in host.hosted else self._name
        if is_here:
            host.log(source or self._name, level, text, detail)
        else:
            self._inbox.put("", lambda: host.log(source or self._name, level, text, detail))

    def _complain(self, owner: str, text: str) -> None:
        self._log.write(Record(self._clock.now(), Level.WARN, owner, text))

    def _watch(self, seconds: float) -> None:
        if self._options.is_stepped:  # then calls that may block run here, too, and nothing real waits for them
            has_started = self._host is not None and self._host.has_started
            types = (component_type(instance.type) for instance in self._plan.of_group(self._name))
            seconds = LONGEST if has_started else sum((one.configures_within for one in types), LONGEST)
        self._watchdog.feed(seconds)

    def _on_sigterm(self, number: int, frame: FrameType | None) -> None:
        if not self._has_begun:
            os._exit(0)  # nothing can move yet, and configuring may take long
        self._inbox.put("", self.orphaned)
