"""`set_parameter`: change a setting of a component while the robot runs."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.expressions.values import Value
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.engine.leaf import Leaf
from rbxcompose.missions.engine.task import Site
from rbxcompose.missions.language.asked import WrittenArgument
from rbxcompose.missions.language.fields import new_name, record, value, word
from rbxcompose.missions.language.written import getter
from rbxcompose.missions.program.answers import NodeEffects, WrittenSetting
from rbxcompose.missions.program.families import LeafStep, ends
from rbxcompose.missions.program.outcomes import ANY, RUNNING
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.missions.program.registry import kind

_ENCODED = {  # the number of `rcl_interfaces/ParameterType` and the field of the value, by the type of a setting
    TypeKind.FLAG: (1, "bool_value"),
    TypeKind.COUNT: (2, "integer_value"),
    TypeKind.QUANTITY: (3, "double_value"),
    TypeKind.TEXT: (4, "string_value"),
    TypeKind.CHOICE: (4, "string_value"),
}


class SetParameterTask(Leaf):
    """Computes the value, sends it to the component, and waits until that has it."""

    __slots__ = ("get", "setting", "value", "wanted")
    saved = (*Leaf.saved, "value")

    def __init__(self, site: Site, step: SetParameterStep) -> None:
        super().__init__(site)
        self.setting = step.setting
        self.wanted: Type = self.engine.robot.settings[self.setting.component.text][self.setting.parameter.text]
        self.get = getter(step.arguments[0].value, self.wanted)
        self.value: Value = 0.0

    def begin(self) -> int:
        """Compute the value and send it."""
        self.value = self.get(self)
        return self.ask()

    def ask(self) -> int:
        """Send the value; this happens again after a pause."""
        number, key = _ENCODED[self.wanted.kind]
        parameter = {"name": self.setting.parameter.text, "value": {"type": number, key: self.value}}
        fields: dict[str, Value] = {"parameters": [parameter], "by": f"mission {self.run.program.name}"}
        self.status, self.is_asked = RUNNING, True
        try:
            self.engine.world.call(self.number, self.setting.service, fields)
        except Exception:
            self.is_asked = False
            raise
        return RUNNING


@kind("set_parameter", SetParameterTask)
@dataclass(frozen=True, slots=True)
class SetParameterStep(LeafStep):
    """Change a setting of a component that may change while the robot runs; it fails if the component refuses.

    Example:
        do:
          set_parameter: {component: battery, parameter: runtime, value: 30 s}
    """

    given: tuple[ScalarNode, ...] = record(
        "a map with 'component', 'parameter' and 'value'",
        component=new_name("the name of a component", "The component."),
        parameter=word("the name of a setting", "One of its settings that may change while it runs."),
        value=value("a value", "The new value, of the type of the setting."),
    )

    waits = True
    has_result = False
    lasts = None
    only_asks = False

    @property
    def setting(self) -> WrittenSetting:
        """Return the setting."""
        return WrittenSetting(*self.given[:2])

    @property
    def arguments(self) -> tuple[WrittenArgument, ...]:
        """Return the value."""
        return (WrittenArgument("value", self.given[2], self.given[2].span),)

    may_end = ends(ANY)

    def text(self, node: MissionNode) -> str:
        """Return the setting and its value."""
        return f"{self.setting.path} {self.given[2].text}".strip()

    @property
    def effects(self) -> NodeEffects:
        """Return the setting."""
        return NodeEffects(setting=self.setting)
