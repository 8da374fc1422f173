"""The section `muxes`: which source controls an output."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated

from pydantic import Field

from rbxcompose.base.config import Config, Frequency, Name, Time
from rbxcompose.compiler.sections.components import ComponentEntry, components
from rbxcompose.domains.muxes.config import MODE_OF, HandoverLimits, MuxEnding, MuxMode, MuxProfile
from rbxcompose.manifest.fields import PortName, TopicName
from rbxcompose.manifest.registry import section, sections_in_use
from rbxcompose.manifest.section import ANY, ROBOT, Contents, Reading, Renames, SetScope, WantedComponent, Wiring
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, at
from rbxcompose.sdk.ports import Out
from rbxcompose.sdk.registry import component_type

MUX, OUTPUT = "mux", "output"
_BELOW_TOPIC = ("inputs", "locks")  # keys whose keys are topics below that of the mux
_TWIST = "geometry_msgs/msg/Twist"  # the type that a mux forwards if nothing declares one


class MuxInput(Config):
    """One source of a mux."""

    priority: int | None = None
    """The input with the highest priority wins. Only in the mode `priority`, which needs it."""
    timeout: Time | None = Field(None, ge=0)
    """The input counts as silent after this long without a message. Only the mode `select` can do without it."""
    source: PortName | None = Field(None, alias="from")
    """The component, or `component.port`, whose output this is; without it the input is open to the outside."""
    topic: TopicName | None = None
    """Its topic, if that is not `MUX/INPUT`."""
    zero_releases: bool = False
    """Whether its zero lets go of the output at once, as when somebody lets go of a joystick."""
    max_rate: Frequency | None = Field(None, gt=0)
    """Most messages from one publisher in another process; the rest is dropped and reported. Default: 1000 Hz."""


class MuxLock(Config):
    """A heartbeat that locks while it is silent, or a flag that locks while it is true."""

    priority: int | None = None
    """Inputs with a lower priority are locked. In the other modes, all are, and there are no priorities."""
    timeout: Time | None = Field(None, ge=0)
    """The lock engages after this long without a message. Only a flag can do without it."""
    topic: TopicName | None = None
    """The topic of a flag, `std_msgs/Bool`. Without it, the lock is a heartbeat, `std_msgs/Empty` at `MUX/LOCK`."""


class MuxModel(Config):
    """Lets one of several sources command an output."""

    topic: TopicName | None = None
    """What it commands, if that is not the topic of its name, such as `arm_controller/joint_trajectory`."""
    mode: MuxMode | None = None
    """Who gets through: the live input with the highest `priority`, the one that was selected, or who sent last."""
    profile: MuxProfile = "default"
    """Whose rules are followed to the letter: ours, or those of a program of ROS."""
    inputs: dict[Name, MuxInput] = Field(min_length=1)
    """Sources by name."""
    locks: dict[Name, MuxLock] = {}
    """Locks by name."""
    initial: Annotated[str, Field(pattern=r"^([a-z][a-z0-9_]*|__none)$")] | None = None
    """In the mode `select`: the input that is selected at the start, or `__none`. Default: the first one."""
    lazy: bool = False
    """In the mode `select`: whether it subscribes to the selected input alone."""
    on_idle: MuxEnding | None = None
    """What follows the last command when no input is live any more: a `stop`, `none`, or a stop after a `hold`."""
    on_lock: MuxEnding | None = None
    """What follows the last command of an input that gets locked."""
    handover: HandoverLimits | None = None
    """How fast velocities may grow after another input took over. Smaller ones, and stops, are never delayed."""
    zero_stops: bool | None = None
    """Whether a message of zeros is rest. Default: for velocities, and for what a base follows."""

    @property
    def works_by(self) -> MuxMode:
        """Return the mode, which may be left out."""
        return self.mode or MODE_OF[self.profile]

    @property
    def has_priorities(self) -> bool:
        """Return whether priorities count."""
        return self.works_by == "priority"

    @property
    def ranks(self) -> dict[str, int]:
        """Return the priorities of inputs, as far as they are known and count."""
        return _ranks(self.inputs) if self.has_priorities else {}

    @property
    def lock_ranks(self) -> dict[str, int]:
        """Return the priorities of locks, as far as they are known and count."""
        return _ranks(self.locks) if self.has_priorities else {}


class RankedInput(MuxInput):
    """An input where priorities count."""

    priority: int
    timeout: Time = Field(ge=0)


class TimedInput(MuxInput):
    """An input that lets go by itself."""

    timeout: Time = Field(ge=0)


class RankedLock(MuxLock):
    """A lock where priorities count."""

    priority: int


class PriorityMux(MuxModel):
    """The live input with the highest priority gets through."""

    inputs: dict[Name, RankedInput] = Field(min_length=1)  # type: ignore[assignment]
    locks: dict[Name, RankedLock] = {}  # type: ignore[assignment]


class LatestMux(MuxModel):
    """Who sent last gets through."""

    inputs: dict[Name, TimedInput] = Field(min_length=1)  # type: ignore[assignment]


_MODELS: dict[str, type[MuxModel]] = {"priority": PriorityMux, "latest": LatestMux}


def _model_of(node: TreeNode) -> type[MuxModel]:
    """Return what a mux must have in its mode; without a mode that exists, what all have."""
    mode = _word(node, "mode") or next(
        (MODE_OF[profile] for profile in MODE_OF if profile == _word(node, "profile")), "priority"
    )
    return _MODELS.get(mode, MuxModel)


def _word(node: TreeNode, key: str) -> str:
    value = at(node, (key,))
    return value.text if isinstance(value, ScalarNode) else ""


def _ranks(entries: Mapping[str, MuxInput | MuxLock]) -> dict[str, int]:
    return {name: entry.priority for name, entry in entries.items() if entry.priority is not None}


def _rename(renames: Renames, name: str, node: TreeNode) -> TreeNode:
    """Return a mux whose inputs and locks follow its renamed topics, and what it selects first with them."""
    if not isinstance(node, MappingNode):
        return node

    def renamed(text: str) -> str:
        return renames.topic(f"{name}/{text}").rpartition("/")[-1]

    changed = dict(node.entries)
    for key, entry in node.entries.items():
        if key in _BELOW_TOPIC:
            changed[key] = Entry(entry.key, renames.topics(entry.value, f"{name}/"))
        elif key == "initial":
            changed[key] = Entry(entry.key, renames.texts(entry.value, renamed))
        elif key == "topic":
            changed[key] = Entry(entry.key, renames.texts(entry.value, renames.topic))
    return MappingNode(changed, node.span, node.tag)


def _topics(name: str, node: TreeNode) -> Iterator[str]:
    yield name
    for key in _BELOW_TOPIC:
        named = at(node, (key,))
        yield from (f"{name}/{entry}" for entry in (named.entries if isinstance(named, MappingNode) else ()))


def _clash(names: Sequence[str]) -> tuple[str, str] | None:
    if len(names) < 2:
        return None
    mux, *_, name = names
    help_text = f"give one of them another topic: 'connect: {{{mux}/{name}: {mux}/ANOTHER_NAME}}'"
    return f"'{name}' of mux '{mux}'", help_text


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    for name, mux in contents.of(muxes).items():
        topic = mux.topic or name
        config: dict[str, object] = {
            "output": name,
            "message": wiring.message_of(topic) or _TWIST,
            "mode": mux.works_by,
            "profile": mux.profile,
            "inputs": {key: _set(each, "source") for key, each in mux.inputs.items()},
            "locks": {key: _set(each) for key, each in mux.locks.items()},
            **_set(mux, "inputs", "locks", "mode", "profile", "topic"),
        }
        if mux.zero_stops is None and wiring.drives(topic):
            config["zero_stops"] = True
        yield WantedComponent(name, MUX, config, ("muxes", name))


def _set(entry: Config, *left_out: str) -> dict[str, object]:
    """Return the fields of an entry that have a value, as data."""
    return entry.model_dump(exclude=set(left_out), exclude_none=True, exclude_unset=True)


def _connects(contents: Contents) -> dict[str, dict[str, str]]:
    """Return the topics of muxes whose names are others, and those that muxes give to the outputs they take."""
    found: dict[str, dict[str, str]] = {}
    for mux, one in contents.of(muxes).items():
        topic = one.topic or mux
        if one.topic is not None:
            found[mux] = {OUTPUT: one.topic}
        for name, source in one.inputs.items():
            component, _, port = (source.source or "").partition(".")
            if (written := contents.of(components).get(component)) is not None:
                outputs = _outputs(written, topic, port)
            else:
                brought = _brought(contents, component)
                outputs = [output for output, own in brought.items() if port == output or (not port and own == topic)]
            for output in outputs:
                found.setdefault(component, {})[output] = source.topic or f"{mux}/{name}"
    return found


def _brought(contents: Contents, component: str) -> Mapping[str, str]:
    """Return the outputs, with their topics, of a component that a section brings."""
    sections = (section for section in sections_in_use(ROBOT) if section.name in contents.root)
    return next((section.outputs[component] for section in sections if component in section.outputs), {})


def _outputs(entry: ComponentEntry, topic: str, port: str) -> list[str]:
    """Return the output that a mux takes: the named one, else the one on the mux's topic, else the only one."""
    if entry.config is None:
        return []
    ports = component_type(entry.type).ports(entry.config)
    outputs = {name: end.topic for name, end in ports.items() if isinstance(end, Out)}
    if port:
        return [port] if port in outputs else []
    on_topic = [name for name, own in outputs.items() if topic in (own, entry.options.connect.get(name))]
    return on_topic or (list(outputs) if len(outputs) == 1 else [])


@section(
    "muxes",
    MuxModel,
    order=50,
    names=MUX,
    runs=True,
    wires=True,
    entry="mux",
    scope=SetScope.KEYS,
    has_topics=True,
    shared=((), (ANY,), *((ANY, key) for key in _BELOW_TOPIC)),
    models=lambda node: (_model_of(node),),
    clash=_clash,
    rename=_rename,
    topics=_topics,
    components=_components,
    connects=_connects,
    details=lambda read: dict.fromkeys(read, MUX),
)
def muxes(reading: Reading[MuxModel]) -> dict[str, MuxModel]:
    """Which source may command, by topic: the live one with the highest priority, the selected one, or the latest.

    Example:
        muxes:
          cmd_vel:
            inputs:
              teleop:
                priority: 100
                timeout: 0.5 s
              navigation:
                from: go_to
                priority: 10
                timeout: 0.5 s
            locks:
              door:
                priority: 200
                timeout: 0.3 s
    """
    found = ((name, reading.readable(_model_of(entry.value), name, entry.value)) for name, entry in reading.named())
    return {name: read for name, read in found if read is not None}
