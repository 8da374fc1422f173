"""`set_parameter`: change a setting of a component while the robot runs."""

from __future__ import annotations

from rbxcompose.base.config import RUNNING
from rbxcompose.missions import sdk

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
        self.status, self.is_asked = sdk.RUNNING, True
        try:
            self.engine.world.call(self.number, self.setting.service, fields)
        except Exception:
            self.is_asked = False
            raise
        return sdk.RUNNING


@sdk.kind("set_parameter", SetParameterTask)
@sdk.dataclass(frozen=True, slots=True)
class SetParameterStep(sdk.LeafStep):
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

    waits = True
    has_result = False
    lasts = None
    only_asks = False

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
