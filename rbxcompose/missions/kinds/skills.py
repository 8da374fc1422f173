"""Steps that ask something of the robot and wait for the answer: its skills, and those with a word of their own.

`call`: call a service and wait for its response.
`set_parameter`: change a setting of a component while the robot runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Self

from rbxcompose.base.config import RUNNING, SERVICE
from rbxcompose.base.expressions.values import is_named_pose
from rbxcompose.base.units import written_unit
from rbxcompose.manifest.tree import MappingNode, SequenceNode, TreeNode
from rbxcompose.missions import sdk
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.program.registry import SKILL
from rbxcompose.msgs import registry


class RequestStep(sdk.LeafStep):
    """A leaf that waits for an answer, which is its result."""

    __slots__ = ()
    waits = True
    has_result = True
    lasts = None
    only_asks = False


class SkillTask(sdk.Leaf):
    """A leaf that runs a skill of the robot."""

    __slots__ = ("arguments", "claims", "getters", "is_restartable", "skill", "started", "written")
    saved = (*sdk.Leaf.saved, "arguments", "started")
    fresh = ("arguments",)
    reported = ("started",)

    def __init__(self, site: sdk.Site, step: SkillStep) -> None:
        super().__init__(site)
        self.skill = site.engine.robot.skills[step.skill]
        self.claims, self.is_restartable = self.skill.claims, self.skill.restartable
        self.written = {argument.name or self.skill.main: argument for argument in step.arguments}
        self.getters: Mapping[str, sdk.Getter] = {
            name: sdk.getter(argument.value, self.skill.arguments[name]) for name, argument in self.written.items()
        }
        self.arguments: dict[str, sdk.Value] = {}
        self.started = 0.0  # [s] of robot time

    def begin(self) -> int:
        """Compute the arguments and start the skill."""
        self.arguments = {name: get(self) for name, get in self.getters.items()}
        return self.ask()

    def ask(self) -> int:
        """Start the skill; this happens again after a pause."""
        self.started = self.engine.now
        text = f"{self.skill.name} {', '.join(self._shown())}".rstrip()
        self.engine.say(sdk.SkillStarted(self.number, self.skill.name, self.arguments, text))
        return self.request(lambda: self.engine.world.start(self.number, self.skill.name, self.arguments))

    def _shown(self) -> Iterator[str]:
        """Yield the arguments as they were written, where that is no expression, and else their values."""
        for name, value in self.arguments.items():
            argument = self.written[name]
            if isinstance(argument.value, sdk.ScalarNode) and written_unit(argument.value.text) is None:
                text = value.name if is_named_pose(value) else show(self.skill.arguments[name], value)
            else:
                text = _written(argument.value)
            yield f"{argument.name} {text}".lstrip()

    def ended(self, result: sdk.Result) -> None:
        """Take the result from the world."""
        super().ended(result)
        message = self.engine.reasons[self.number] if self.status == sdk.FAILURE else result.message
        self.say_ended(self.outcome or sdk.NAMES[self.status], message)

    def judged(self, result: sdk.Result) -> tuple[int, str, str]:
        """Return what the outcome counts as; an undeclared one is a failure."""
        outcome = result.outcome
        if outcome in ("", sdk.SUCCEEDS, sdk.FAILS):
            return super().judged(result)
        if outcome not in self.skill.outcomes:
            message = f"the skill '{self.skill.name}' ended with an outcome that it does not declare: '{outcome}'"
            self.engine.say(sdk.Reported(self.place, message))
            return sdk.FAILURE, "", message
        status = sdk.SUCCESS if self.skill.outcomes[outcome] == sdk.SUCCEEDS else sdk.FAILURE
        return status, outcome, result.message or outcome

    def suspend(self, from_start: bool) -> bool:
        """Hold the skill if it can pause and will continue, else stop it."""
        if self.is_asked and self.skill.pausable and not self._starts_over():
            if not self.is_held:
                self.is_held = True
                self.engine.world.pause(self.number)
            return False
        return super().suspend(from_start)

    def _starts_over(self) -> bool:
        nodes = self.engine.program.nodes
        return any(target.number <= self.number < nodes[target.number].end for target in self.engine.restarting)

    def stop(self) -> None:
        """Stop the skill in the world."""
        if self.is_asked:
            self.say_ended("halted", self.engine.because)
        super().stop()

    def say_ended(self, result: str, message: str) -> None:
        """Report how it ended and how long it took."""
        self.engine.say(sdk.SkillEnded(self.number, self.skill.name, result, self.engine.now - self.started, message))


@sdk.kind(SKILL, SkillTask, is_inner=True)
@sdk.dataclass(frozen=True, slots=True)
class SkillStep(RequestStep):
    """A skill by its name, with its arguments."""

    skill: str = field()
    arguments: tuple[sdk.WrittenArgument, ...] = field()

    @classmethod
    def read(cls, reader: sdk.NodeReader) -> Self:
        """Read the arguments."""
        return cls(reader.key, reader.arguments())

    @property
    def word(self) -> str:
        """Return the name of the skill."""
        return self.skill

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes that the robot declares."""
        skill = endings.robot.skills.get(self.skill)
        return sdk.Outcomes(named=skill.outcomes) if skill else sdk.ANY

    def possibilities(
        self, node: sdk.MissionNode, nodes: tuple[sdk.MissionNode, ...], robot: sdk.RobotNames
    ) -> Iterator[sdk.Possibility]:
        """Yield its outcomes."""
        if self.skill in robot.skills:
            for outcome in (sdk.SUCCEEDS, sdk.FAILS, *robot.skills[self.skill].outcomes):
                yield sdk.Possibility(node.span, f"{node.path}: {outcome}", sdk.ended(node.number, outcome))

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say its name and its arguments, the main one first."""
        skill = robot.skills.get(self.skill)
        types = skill.arguments if skill else {}
        main = skill.main if skill else ""
        given = ((one.name, one.value, types.get(one.name or main, sdk.UNKNOWN)) for one in self.arguments)
        words = (f"{sdk.spoken(name)} {sdk.argument_in_words(value, wanted)}".strip() for name, value, wanted in given)
        return f"{sdk.spoken(self.skill)} {', '.join(words)}".strip()

    def text(self, node: sdk.MissionNode) -> str:
        """Return its arguments."""
        return ", ".join(f"{argument.name} {_written(argument.value)}".strip() for argument in self.arguments)


def _written(value: TreeNode) -> str:
    match value:
        case sdk.ScalarNode():
            return value.text
        case SequenceNode():
            return ", ".join(map(_written, value.items))
        case MappingNode():
            return ", ".join(f"{key} {_written(entry.value)}" for key, entry in value.entries.items())


class CallTask(sdk.Leaf):
    """Sends a request to the world, and returns its response."""

    __slots__ = ("message",)

    def __init__(self, site: sdk.Site, step: CallStep) -> None:
        super().__init__(site)
        self.message = step.message

    def begin(self) -> int:
        """Send the request."""
        return self.ask()

    def ask(self) -> int:
        """Send the request."""
        service = self.message.target.text
        request = registry.service(self.engine.robot.services[service]).Request
        fields = sdk.fields_of(self.message, request, self)
        return self.request(lambda: self.engine.world.call(self.number, service, fields))


@sdk.kind("call", CallTask)
@sdk.dataclass(frozen=True, slots=True)
class CallStep(RequestStep):
    """Call a service of the robot; a response with `success: false` is a failure.

    Example:
        do:
          call: set_battery_level
          request: 100
          timeout: 2 s
    """

    message: sdk.MessageTemplate = sdk.message("request", SERVICE)
    request = sdk.contents("The fields of the request; a single value stands for the only field.")

    may_end = sdk.ends(sdk.ANY)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the service."""
        return f"Call {self.message.target.text}"

    def text(self, node: sdk.MissionNode) -> str:
        """Return the service."""
        return self.message.target.text

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the request."""
        return sdk.NodeEffects(called=self.message)


_ENCODED = {  # the number of `rcl_interfaces/ParameterType` and the field of the value, by the type of a setting
    sdk.TypeKind.FLAG: (1, "bool_value"),
    sdk.TypeKind.COUNT: (2, "integer_value"),
    sdk.TypeKind.QUANTITY: (3, "double_value"),
    sdk.TypeKind.TEXT: (4, "string_value"),
    sdk.TypeKind.CHOICE: (4, "string_value"),
}


class SetParameterTask(sdk.Leaf):
    """Computes the value, sends it to the component, and waits until that has it."""

    __slots__ = ("get", "setting", "value", "wanted")
    saved = (*sdk.Leaf.saved, "value")

    def __init__(self, site: sdk.Site, step: SetParameterStep) -> None:
        super().__init__(site)
        self.setting = step.setting
        self.wanted: sdk.Type = self.engine.robot.settings[self.setting.component.text][self.setting.parameter.text]
        self.get = sdk.getter(step.arguments[0].value, self.wanted)
        self.value: sdk.Value = 0.0

    def begin(self) -> int:
        """Compute the value and send it."""
        self.value = self.get(self)
        return self.ask()

    def ask(self) -> int:
        """Send the value; this happens again after a pause."""
        number, key = _ENCODED[self.wanted.kind]
        parameter = {"name": self.setting.parameter.text, "value": {"type": number, key: self.value}}
        fields: dict[str, sdk.Value] = {"parameters": [parameter], "by": f"mission {self.run.program.name}"}
        return self.request(lambda: self.engine.world.call(self.number, self.setting.service, fields))


@sdk.kind("set_parameter", SetParameterTask)
@sdk.dataclass(frozen=True, slots=True)
class SetParameterStep(RequestStep):
    """Change a setting of a component that may change while the robot runs; it fails if the component refuses.

    Example:
        do:
          set_parameter: {component: battery, parameter: runtime, value: 30 s}
    """

    given: tuple[sdk.ScalarNode, ...] = sdk.record(
        "a map with 'component', 'parameter' and 'value'",
        component=sdk.new_name("the name of a component", "The component.", names=RUNNING),
        parameter=sdk.word("the name of a setting", "One of its settings that may change while it runs."),
        value=sdk.value("a value", "The new value, of the type of the setting."),
    )

    has_result = False

    @property
    def setting(self) -> sdk.WrittenSetting:
        """Return the setting."""
        return sdk.WrittenSetting(*self.given[:2])

    @property
    def arguments(self) -> tuple[sdk.WrittenArgument, ...]:
        """Return the value."""
        return (sdk.WrittenArgument("value", self.given[2], self.given[2].span),)

    may_end = sdk.ends(sdk.ANY)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the setting, and its new value."""
        return f"Set {self.setting.path} to {sdk.argument_in_words(self.given[2])}"

    def text(self, node: sdk.MissionNode) -> str:
        """Return the setting and its value."""
        return f"{self.setting.path} {self.given[2].text}".strip()

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the setting."""
        return sdk.NodeEffects(setting=self.setting)
