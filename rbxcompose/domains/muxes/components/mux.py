"""The command mux."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial
from typing import Any, ClassVar

from pydantic import ValidationError

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.requests import Command, Refused, answers
from rbxcompose.base.units import MOST
from rbxcompose.domains.muxes import requests
from rbxcompose.domains.muxes.config import NOBODY, TIMELESS, AddedInput, MuxConfig, handover_limits, is_own
from rbxcompose.domains.muxes.requests import AddMuxInput, DeleteMuxInput, LockMuxInputs, SelectMuxInput
from rbxcompose.msgs import registry
from rbxcompose.msgs.fields import is_finite
from rbxcompose.msgs.std_msgs import Bool, Empty, String
from rbxcompose.msgs.topic_tools_interfaces import MuxAdd, MuxDelete, MuxList, MuxSelect
from rbxcompose.msgs.types import Message
from rbxcompose.sdk import Capability, Component, ComponentNoted, Forwards, In, Level, Out, Port, Serves, component
from rbxcompose.sdk.capabilities import LocksInSilence, Setting
from rbxcompose.sdk.component import RECALLED_WITHIN


@dataclass(frozen=True, slots=True)
class RestMuxInputs(Command):
    """Have inputs come to rest once before they count again, for a mux that starts again."""

    about: ClassVar[str] = requests.MUX
    inputs: tuple[str, ...]


class MuxOrders:
    """The orders that still hold, in an order in which they can be repeated."""

    def __init__(self) -> None:
        self.resting: tuple[RestMuxInputs, ...] = ()
        self.added: dict[str, AddMuxInput] = {}
        self._deleted: dict[str, DeleteMuxInput] = {}
        self._locked: dict[str, LockMuxInputs] = {}
        self._selected: SelectMuxInput | None = None

    def take_over(self, old: MuxOrders, inputs: Collection[str]) -> None:
        """Continue with those of another plan that still have a meaning; what it deleted is up to the new plan."""
        self._locked = {name: mux_inputs for name, mux_inputs in old._locked.items() if name in inputs}
        if old._selected is not None and old._selected.input in inputs:
            self._selected = old._selected

    def keep(self, order: Command) -> None:
        """Keep an order, instead of earlier ones about the same."""
        match order:
            case AddMuxInput():
                self.added[order.input] = order
            case DeleteMuxInput():
                if self.added.pop(order.input, None) is None:
                    self._deleted[order.input] = order
                self._locked.pop(order.input, None)
            case LockMuxInputs():
                self._locked |= {name: LockMuxInputs(order.component, (name,), order.seconds) for name in order.inputs}
            case SelectMuxInput():
                self._selected = order

    def forget_locks(self, locked: Collection[str]) -> bool:
        """Forget the locks that have ended, of all but these inputs; return whether there were any."""
        ended = self._locked.keys() - locked
        for name in ended:
            del self._locked[name]
        return bool(ended)

    @property
    def all(self) -> tuple[Command, ...]:
        """Return all that hold; what was deleted first, since what was added may have its name, topic or priority."""
        selected = (self._selected,) if self._selected else ()
        free = [SelectMuxInput(order.component, requests.NONE) for order in selected]  # what is selected stays
        return (*free, *self._deleted.values(), *self.added.values(), *selected, *self._locked.values(), *self.resting)


def input_at(text: str, topics: Mapping[str, str]) -> str | None:
    """Return the input that has this name or topic; a full topic may begin with the namespace of the robot."""
    bare = text.strip("/")
    for name, topic in topics.items():
        own = topic.strip("/")
        if text == name or bare == own or (text.startswith("/") and bare.endswith(f"/{own}")):
            return name
    return None


def noted(locked: Iterable[tuple[str, float]]) -> str:
    """Return what is locked by hand, and until which robot time [s]; empty if nothing is."""
    locks = [name if until == float("inf") else f"{name} until {until:.1f} s" for name, until in locked]
    return f"locked by hand: {', '.join(locks)}" if locks else ""


LOCK = "lock_"  # prefix of the ports of locks
ANNOUNCED = "announced"  # the port at which it publishes who holds the output
KEPT = 200  # changes that can be read later
_WORD = "lower-case letters, digits and '_', starting with a letter"
NEEDED = {
    "name": f"it has {_WORD}, at most 60 of them",
    "topic": f"it has words of {_WORD}, joined by '/'",
    "timeout": "it is a finite time of at least 0 s",
}  # by field of an input that is added


@component("mux")
class Mux(Component[MuxConfig]):
    """Forwards the commands of one source: by priority, by selection, or of who sent last. It never repeats a message.

    The lock `stop` is above all inputs; `rbxcompose stop` latches it and `release` opens it. Who holds the output is
    announced at `<output>/active`.

    Example:
        cmd_vel: {type: mux, output: cmd_vel, inputs: {teleop: {priority: 100, timeout: 0.5 s}}}
    """

    made_by = "There is one for each entry of the section `muxes`."

    @classmethod
    def ports(cls, config: MuxConfig) -> dict[str, Port[Any]]:
        """Return the output, one input per source and one per lock, the announcement, and services to select."""
        message = registry.message(config.message)
        ports: dict[str, Port[Any]] = {
            "output": Out(message, config.output, qos=config.quality).named("output"),
            ANNOUNCED: Out(String, f"{config.output}/{config.announced}", qos="latched").named(ANNOUNCED),
        }
        for name, input_config in config.inputs.items():
            ports[name] = _input(name, config.topic_of(name), config, input_config.max_rate)
        for name, lock in config.locks.items():
            kind = Bool if lock.topic else Empty
            ports[LOCK + name] = In(kind, config.topic_of(name), qos="command", is_open=True).named(LOCK + name)
        if config.mode == "select":
            ports |= _services(config.output)
        return ports

    @classmethod
    def capabilities(cls, config: MuxConfig) -> tuple[Capability, ...]:
        """Declare which inputs it forwards, and which locks have a heartbeat."""
        ranked = sorted(config.inputs, key=lambda name: config.inputs[name].priority, reverse=True)
        locks = (
            LocksInSilence(Setting(name, f"locks.{name}"), Setting(lock.timeout, f"locks.{name}.timeout"))
            for name, lock in config.locks.items()
            if lock.timeout is not None
        )
        return (Forwards(tuple(ranked), "output"), *locks)

    def configure(self) -> None:
        """Build the core; a mux restarted while the robot is stopped starts closed."""
        from rbxcompose.domains.muxes.core import MuxAccount, core_of  # which only a running mux needs

        self.core = core_of(self.config, is_stopped=self.context.is_stopped)
        self.account = MuxAccount(self.core)
        self.topics = {name: self.config.topic_of(name) for name in self.config.inputs}
        self.reported: object = None
        self.announced: str | None = None
        self.noted = ""
        self.wakes_at = math.inf  # [s], the first of the wakes to come
        self.refused: list[str] = []
        self.broken: set[str] = set()  # inputs whose last message had a number that is none
        self.received_at: dict[str, float] = {}  # when an input last sent
        self.changes: deque[requests.MuxChange] = deque(maxlen=KEPT)
        self.orders = MuxOrders()
        self.knows_from = math.inf if self.context.is_again else -math.inf  # when all orders have come again
        self.listening = set(self.config.inputs)
        self.listen()

    def activate(self) -> None:
        """Announce who holds, and check that all locks send heartbeats, after each has had time to do so."""
        if beats := [lock.timeout for lock in self.config.locks.values() if lock.timeout]:
            self.context.wake_at(self.now + max(beats))
        self.send(self.core.tick(self.now))
        self.announce()

    def start(self) -> None:
        """Let nothing through until orders from before a restart have come again."""
        self.knows_from = min(self.knows_from, self.now + RECALLED_WITHIN)

    def reconfigure(self, old: MuxConfig) -> None:
        """Follow other limits of a hand-over."""
        self.core.bound(*handover_limits(self.config.handover))

    def take_over(self, old: Mux) -> None:
        """Take over who was sending, what was selected, and what people have locked and added."""
        for order in old.orders.added.values():
            if order.input not in self.core.inputs and self.does(partial(self.add_input, order)):
                self.orders.keep(order)
        self.core.take_over(old.core)
        self.received_at = old.received_at
        self.orders.take_over(old.orders, self.core.inputs)
        self.changed()

    # Messages

    def received(self, port: str, message: Any) -> None:
        """Forward a message of who holds the output, or take the message of a lock."""
        if port in self.topics:
            self.take(port, message)
        elif (lock := port.removeprefix(LOCK)) in self.config.locks:
            if self.config.locks[lock].topic:
                self.core.flag(lock, message.data, self.now)
            else:
                self.core.heartbeat(lock, self.now)
        self.settle()

    def take(self, name: str, message: Message) -> None:
        """Forward a message if its input holds the output; drop one with a number that is none, as if never sent."""
        if self.now < self.knows_from:
            return
        if not is_finite(message):
            if name not in self.broken:
                self.broken.add(name)
                self.warn(f"input '{name}' sends numbers that are not finite: they are dropped")
            return
        self.broken.discard(name)
        self.received_at[name] = self.now
        self.send(self.core.receive(name, message, self.now))

    def wake(self) -> None:
        """Send the single zero after the last source has ended."""
        self.wakes_at = math.inf
        self.send(self.core.tick(self.now))
        self.settle()

    def stop(self) -> None:
        """Latch the lock `stop` and send a zero immediately."""
        self.send(self.core.stop(self.now))
        self.settle()

    def release(self) -> None:
        """Open the lock; a source that is still sending must come to rest once."""
        self.core.release(self.now)
        self.settle()

    def hold(self) -> None:
        """Send a zero and let nothing through while robot time stands still."""
        self.send(self.core.hold(self.now))
        self.settle()

    def go_on(self) -> None:
        """Let new messages through."""
        self.core.resume(self.now)
        self.settle()

    def brake(self) -> None:
        """Send a last zero and let nothing through any more."""
        self.send(self.core.close(self.now))
        self.settle()

    def send(self, message: Message | None) -> None:
        """Publish on the output."""
        if message is not None:
            self.bound["output"](message)

    # Orders of people

    @answers(requests.LookAtMux)
    def look(self, request: requests.LookAtMux) -> requests.MuxState:
        """Return who holds the output and who waits."""
        core, config, now = self.core, self.config, self.now
        until = core.live_until(core.active) if core.active is not None else math.inf
        return requests.MuxState(
            self.name,
            config.output,
            config.message,
            config.mode,
            config.profile,
            now,
            self.account.why(now),
            core.active,
            until if until < math.inf else None,
            core.arbiter.selected,
            self.account.inputs(self.topics, self.received_at, now, has_priorities=config.has_priorities),
            self.account.locks({name: config.topic_of(name) for name in config.locks}, now),
        )

    @answers(requests.ReadMuxChanges)
    def read_changes(self, request: requests.ReadMuxChanges) -> tuple[requests.MuxChange, ...]:
        """Return what changed after a number."""
        return tuple(change for change in self.changes if change.number > request.after)

    @answers(requests.SelectMuxInput)
    def select(self, request: requests.SelectMuxInput) -> str:
        """Select an input, or none."""
        if self.config.mode != "select":
            raise Refused(f"the inputs of '{self.name}' are not selected: its mode is '{self.config.mode}'")
        name = None if request.input == requests.NONE else self.known(request.input)
        self.core.select(name, self.now)
        self.orders.keep(requests.SelectMuxInput(self.name, name or requests.NONE))
        self.changed()
        return self.log(f"'{name}' is selected" if name else "no input is selected")

    @answers(requests.AddMuxInput)
    def add(self, request: requests.AddMuxInput) -> str:
        """Add an input."""
        self.add_input(request)
        self.orders.keep(request)
        self.changed()
        return self.log(f"input '{request.input}' takes '{self.topics[request.input]}'")

    @answers(requests.DeleteMuxInput)
    def delete(self, request: requests.DeleteMuxInput) -> str:
        """Delete an input."""
        name = self.known(request.input)
        if name == self.core.arbiter.selected:
            raise Refused(f"'{name}' is selected: select another one first")
        self.core.delete(name, self.now)
        del self.topics[name]
        self.orders.keep(requests.DeleteMuxInput(self.name, name))
        self.changed()
        return self.log(f"input '{name}' is gone")

    @answers(requests.LockMuxInputs)
    def lock(self, request: requests.LockMuxInputs) -> str:
        """Lock inputs by hand; what they had commanded ends as with any lock."""
        names = [self.known(name) for name in request.inputs] or list(self.core.inputs)
        if request.seconds is not None and not 0 < request.seconds < MOST:  # false for NaN, too
            raise Refused("a lock takes a finite time above 0 s")
        self.core.lock(names, math.inf if request.seconds is None else self.now + request.seconds, self.now)
        self.orders.keep(requests.LockMuxInputs(self.name, tuple(names), request.seconds))
        self.send(self.core.tick(self.now))
        self.changed()
        limit = "until they are unlocked" if request.seconds is None else f"for {request.seconds:g} s"
        return self.log(f"locked by hand {limit}: {', '.join(names)}")

    @answers(RestMuxInputs)
    def rest(self, request: RestMuxInputs) -> str:
        """Have inputs come to rest once, as before a restart; nobody knows what they have sent meanwhile."""
        self.core.rest(request.inputs, self.now)
        self.settle()
        return self.log(f"{' and '.join(request.inputs)} must come to rest once, as before the restart")

    @answers(requests.UnlockMuxInputs)
    def unlock(self, request: requests.UnlockMuxInputs) -> str:
        """End what was locked by hand; an input that still commands motion must come to rest once."""
        names = [self.known(name) for name in request.inputs] or list(self.core.locks.by_hand)
        if not (locked := [name for name in names if name in self.core.locks.by_hand]):
            raise Refused("nothing is locked by hand")
        self.core.unlock(locked, self.now)
        self.settle()
        resting = [name for name in locked if name in self.core.waiting]
        rest = f"; {' and '.join(resting)} must come to rest once before it moves anything" if resting else ""
        return self.log(f"unlocked: {', '.join(locked)}{rest}")

    def on_select(self, request: MuxSelect.Request) -> MuxSelect.Response:
        """Select an input by its name or topic, as `topic_tools` does."""
        before = self.core.arbiter.selected
        done = self.does(lambda: self.select(requests.SelectMuxInput(self.name, request.topic)))
        return MuxSelect.Response(prev_topic=self.topics.get(before or "", ""), success=done)

    def on_add(self, request: MuxAdd.Request) -> MuxAdd.Response:
        """Add a topic as an input."""
        order = requests.AddMuxInput(self.name, request.topic.strip("/"), request.topic)
        return MuxAdd.Response(success=self.does(lambda: self.add(order)))

    def on_delete(self, request: MuxDelete.Request) -> MuxDelete.Response:
        """Delete an input by its name or topic."""
        order = requests.DeleteMuxInput(self.name, request.topic)
        return MuxDelete.Response(success=self.does(lambda: self.delete(order)))

    def on_list(self, request: MuxList.Request) -> MuxList.Response:
        """Return the topics of all inputs."""
        return MuxList.Response(topics=tuple(self.topics.values()))

    def does(self, order: Callable[[], object]) -> bool:
        """Carry out an order; a refusal is logged, since nobody gets its reason as an answer."""
        try:
            order()
        except Refused as refusal:
            self.warn(str(refusal))
            return False
        return True

    # Inputs

    def add_input(self, request: requests.AddMuxInput) -> None:
        """Add an input by the rules of the section `muxes`.

        Raises:
            Refused: if it breaks one, or its topic is one of the mux itself; then nothing has changed.
        """
        name, topic = request.input, request.topic or f"{self.config.output}/{request.input}"
        if any(input_at(text, self.topics) is not None for text in (name, topic)):
            raise Refused(f"'{self.name}' already has the input '{name}'")
        if is_own(name) or name in self.config.locks:
            raise Refused(f"'{name}' cannot be the name of an input: '{self.name}' needs it itself")
        from rbxcompose.domains.muxes.core import source_of

        config = self.checked(request)
        self.context.listen(_input(name, topic, self.config, None))
        self.listening.add(name)
        self.core.add(name, source_of(config, self.config), self.now)
        self.topics[name] = topic

    def checked(self, request: requests.AddMuxInput) -> AddedInput:
        """Return what an input is to be.

        Raises:
            Refused: if the section `muxes` would not take it.
        """
        mode, priority, timeout = self.config.mode, request.priority, request.timeout
        if self.config.has_priorities and (priority is None or timeout is None):
            raise Refused("an input needs a priority and a timeout")
        if priority is not None and not self.config.has_priorities:
            raise Refused(f"a priority has no meaning in the mode '{mode}'")
        if timeout is None and mode != "select":
            raise Refused("an input needs a timeout")
        if timeout == 0 and self.config.profile not in TIMELESS:
            raise Refused("an input with the timeout 0 has no time at all")
        same = [name for name, source in self.core.inputs.items() if source.priority == priority]
        if same and self.config.profile == "default":
            raise Refused(f"'{same[0]}' already has the priority {priority}: give each input its own")
        topic = request.topic or None
        name = None if topic and request.input == topic.strip("/") else request.input  # topic_tools names by the topic
        try:
            return AddedInput(name=name, topic=topic, priority=priority or 0, timeout=timeout)
        except ValidationError as error:
            field = error.errors()[0]["loc"][0]
            value = request.input if field == "name" else getattr(request, str(field))
            raise Refused(f"'{value}' cannot be the {field} of an input: {NEEDED[str(field)]}") from error

    def known(self, text: str) -> str:
        """Return the input of this name or topic.

        Raises:
            Refused: if there is none.
        """
        if (name := input_at(text, self.topics)) is None:
            raise Refused(clauses(f"'{self.name}' has no input '{text}'", suggest(text, self.topics, "inputs")))
        return name

    def listen(self) -> None:
        """Subscribe to what counts: a lazy mux listens to the selected input alone."""
        chosen = self.core.arbiter.selected
        wanted = {name for name in self.topics if name == chosen or not self.config.lazy}
        for name in self.listening - wanted:
            self.context.mute(name)
        for name in wanted - self.listening:
            input_ = self.config.inputs.get(name)
            self.context.listen(_input(name, self.topics[name], self.config, input_.max_rate if input_ else None))
        self.listening = wanted

    # What it reports

    def changed(self) -> None:
        """Follow an order of a person, now and after a restart."""
        self.context.repeat(self.orders.all)
        self.listen()
        self.settle()

    def log(self, text: str) -> str:
        """Log what somebody ordered, and return it as the answer."""
        self.info(text)
        return text

    def settle(self) -> None:
        """Schedule the next deadline, and report changes in which source is let through and which are locked out."""
        deadline = self.core.next_deadline()
        if deadline is not None and not self.now <= self.wakes_at <= deadline:  # each message puts off the deadline
            self.wakes_at = deadline
            self.context.wake_at(deadline)
        active = "stop" if self.core.is_stopped else self.core.active
        locked, refused = self.core.locked_out(self.now), self.core.refused(self.now)
        text = self.account.why(self.now)
        if (text, active, locked) != self.reported:
            self.reported = text, active, locked
            level = Level.WARN if locked else Level.OK
            self.status(level, text, active=active or "none", locked_out=", ".join(locked) or "none")
            number = self.changes[-1].number + 1 if self.changes else 1
            self.changes.append(requests.MuxChange(number, self.now, text))
        if refused and not self.refused:
            self.warn(f"commands are blocked: {text}")
        self.refused = refused
        self.announce()
        self.note()

    def announce(self) -> None:
        """Publish who holds the output, if that has changed; in the profile of `topic_tools`, what is selected."""
        is_selection = self.config.profile == "topic_tools"
        name = self.core.arbiter.selected if is_selection else self.core.active
        text = NOBODY.get(self.config.profile, requests.NONE)
        if name is not None:
            text = self.topics[name] if is_selection else name
        if text != self.announced:
            self.announced = text
            self.bound[ANNOUNCED](String(data=text))

    def note(self) -> None:
        """Tell the supervisor what is locked by hand or must rest, and forget the orders of locks that have ended."""
        by_hand = self.core.locks.by_hand
        resting = (RestMuxInputs(tuple(sorted(self.core.waiting))),) if self.core.waiting else ()
        if self.orders.forget_locks(by_hand) or resting != self.orders.resting:
            self.orders.resting = resting
            self.context.repeat(self.orders.all)
        text = noted(by_hand.items())
        if text != self.noted:
            self.noted = text
            self.context.notify(ComponentNoted(self.name, text))


def _input(name: str, topic: str, config: MuxConfig, max_rate: float | None) -> In[Any]:
    message, qos = registry.message(config.message), config.quality  # who may command need not always do so
    return In(message, topic, qos=qos, is_open=True, max_rate=max_rate, may_be_silent=True).named(name)


def _services(output: str) -> dict[str, Port[Any]]:
    """Return the services of topic_tools; to select is also a skill of missions."""
    found: dict[str, Port[Any]] = {
        "select": Serves(MuxSelect, f"{output}/select", skill=f"select_{output.replace('/', '_')}"),
        "add": Serves(MuxAdd, f"{output}/add", skill=None),
        "delete": Serves(MuxDelete, f"{output}/delete", skill=None),
        "list": Serves(MuxList, f"{output}/list", skill=None),
    }
    return {name: port.named(name) for name, port in found.items()}
