"""The page of parameters in a real browser."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from rbxcompose.base.requests import Refused
from tests.console.browser import CHROMIUM
from tests.console.fake_gateway import CONFIG, FakeGateway
from tests.console.looks import PHONE, expect_fit, violations

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

EVENTS = "/parameter_events"


def descriptor(name: str, about: str, type_: int = 3, **more: Any) -> dict[str, Any]:
    plain = {"read_only": False, "additional_constraints": "", "floating_point_range": [], "integer_range": []}
    return {"name": name, "type": type_, "description": about} | plain | more


RUNTIME = descriptor(
    "runtime", "Time from full to empty. [s]", floating_point_range=[{"from_value": 0, "to_value": 100}]
)
WARN = descriptor("warn", "It warns below. [0 to 1]", floating_point_range=[{"from_value": 0, "to_value": 1}])
MODE = descriptor("mode", "Who gets through.", 4, additional_constraints="one of priority, select")
LAMP = descriptor("lamp", "Whether it is lit.", 1)
FIXED = descriptor("topic", "Where it goes.", 4, read_only=True)


def number(value: float) -> dict[str, Any]:
    return {"type": 3, "double_value": value}


def changed_elsewhere(runtime: float) -> dict[str, Any]:
    changed = [{"name": "runtime", "value": number(runtime)}]
    return {"node": "/battery", "changed_parameters": changed, "new_parameters": []}


class Battery:
    """A node with parameters, and what the manifest has."""

    def __init__(self, gateway: FakeGateway) -> None:
        self.gateway = gateway
        self.values: dict[str, dict[str, Any]] = {
            "runtime": number(45.0),
            "warn": number(0.5),
            "mode": {"type": 4, "string_value": "priority"},
            "lamp": {"type": 1, "bool_value": True},
            "topic": {"type": 4, "string_value": "x"},
        }
        self.manifest = dict(self.values)
        self.refusal = ""
        self.seen: str | None = None  # the hash that is right, if the files are others than those of the dry run
        descriptors = [RUNTIME, WARN, MODE, LAMP, FIXED]
        gateway.answers |= {
            "/rosapi/services": lambda _: {"services": ["/battery/describe_parameters", "/lamp"]},
            "/battery/list_parameters": lambda _: {"result": {"names": list(self.values)}},
            "/battery/describe_parameters": lambda _: {"descriptors": descriptors},
            "/battery/get_parameters": lambda _: {"values": list(self.values.values())},
            "/battery/set_parameters": self.set,
            "/console/save": self.save,
        }

    def set(self, request: dict[str, Any]) -> dict[str, Any]:
        (change,) = request["parameters"]
        if not self.refusal:
            self.values[change["name"]] = change["value"]
        return {"results": [{"successful": not self.refusal, "reason": self.refusal}]}

    def save(self, request: dict[str, Any]) -> dict[str, Any]:
        changed = [name for name, value in self.values.items() if value != self.manifest[name]]
        saved = [
            {"component": "battery", "name": name, "old": next(reversed(self.manifest[name].values())), "new": 0}
            for name in changed
        ]
        told = str(len(saved)) if self.seen is None else self.seen
        if not request["dry_run"]:
            if request["hash"] != told:
                message = "nothing is saved: the files or the values have changed since they were shown"
                return {"success": False, "message": message, "answer": None}
            self.manifest = dict(self.values)
        places = [f"robot.yaml:{30 + turn}:14" for turn in range(len(saved))]
        lines = ["@@ robot.yaml @@", *(line for name in changed for line in (f"-  {name}: old", f"+  {name}: new"))]
        return {
            "success": True,
            "message": "",
            "answer": {"saved": saved, "places": places, "difference": lines, "hash": str(len(saved))},
        }


@pytest.fixture
def battery(gateway: FakeGateway) -> Battery:
    return Battery(gateway)


def test_a_slider_changes_a_parameter_and_save_keeps_it(open_page: Callable[..., Page], battery: Battery) -> None:
    page = open_page(page_name="parameters")
    runtime = page.get_by_label("Runtime", exact=True)
    expect(runtime).to_have_value("45")
    slider = page.get_by_label("Runtime, slider")
    slider.focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    expect(runtime).to_have_value("50")
    expect(page.get_by_text("not saved; the manifest has 45 s")).to_be_visible()
    expect(page.get_by_text("as in the manifest").first).to_be_visible()
    page.get_by_role("button", name="Save 1").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_label("added")).to_have_text("+  runtime: new")
    assert violations(page) == []
    dialog.get_by_role("button", name="Not now").click()
    expect(page.get_by_text("Not saved.")).to_be_visible()
    assert battery.manifest["runtime"] == number(45.0)
    page.get_by_role("button", name="Save 1").click()
    page.get_by_role("dialog").get_by_role("button", name="Write it").click()
    expect(page.get_by_text("battery runtime: robot.yaml:30:14")).to_be_visible()
    expect(page.get_by_role("button", name="Saved")).to_be_disabled()
    assert battery.manifest["runtime"] == number(50)
    assert len(battery.gateway.calls("/battery/set_parameters")) <= 5


@pytest.mark.soak
def test_what_changed_after_it_was_shown_is_not_written(open_page: Callable[..., Page], battery: Battery) -> None:
    page = open_page(page_name="parameters")
    page.get_by_label("Runtime", exact=True).fill("60")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Save 1").click()
    battery.seen = "another one"
    page.get_by_role("dialog").get_by_role("button", name="Write it").click()
    expect(page.get_by_text("have changed since they were shown")).to_be_visible()
    assert battery.manifest["runtime"] == number(45.0)


@pytest.mark.soak
def test_limits_stand_beside_the_field(open_page: Callable[..., Page], battery: Battery) -> None:
    page = open_page(page_name="parameters")
    expect(page.get_by_text("Time from full to empty. 0 s to 100 s")).to_be_visible()


@pytest.mark.soak  # which control a kind has needs no browser
def test_each_kind_has_its_control_and_what_is_fixed_has_none(open_page: Callable[..., Page], battery: Battery) -> None:
    page = open_page(page_name="parameters")
    expect(page.get_by_label("Warn", exact=True)).to_have_value("50")
    page.get_by_label("Mode").select_option("select")
    page.get_by_label("Lamp").uncheck()
    page.get_by_label("Warn", exact=True).fill("20")
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Save 3")).to_be_enabled()
    assert battery.values["mode"]["string_value"] == "select"
    assert battery.values["lamp"]["bool_value"] is False
    assert battery.values["warn"] == number(0.2)
    expect(page.get_by_text("Where it goes")).to_be_hidden()
    assert violations(page) == []


def test_what_is_wrong_or_refused_is_said_at_its_place(open_page: Callable[..., Page], battery: Battery) -> None:
    page = open_page(page_name="parameters")
    runtime = page.get_by_label("Runtime", exact=True)
    runtime.fill("200")
    page.keyboard.press("Enter")
    expect(page.get_by_text("At most 100 s.")).to_be_visible()
    expect(runtime).to_have_value("45")
    runtime.fill("50")
    page.keyboard.press("Enter")
    expect(page.get_by_text("At most 100 s.")).to_be_hidden()
    expect(page.get_by_role("button", name="Save 1")).to_be_enabled()
    page.goto(page.url.replace("#parameters", "#map"))
    page.goto(page.url.replace("#map", "#parameters"))
    page.get_by_role("button", name="Undo").click()
    expect(runtime).to_have_value("45")
    expect(page.get_by_role("button", name="Undo")).to_be_disabled()
    page.wait_for_timeout(300)
    battery.refusal = "the charger takes longer than that"
    runtime.fill("1")
    page.keyboard.press("Enter")
    expect(page.get_by_text("the charger takes longer than that")).to_be_visible()
    expect(page.get_by_role("button", name="Undo")).to_be_disabled()
    expect(runtime).to_have_value("45")
    assert battery.values["runtime"] == number(45.0)
    battery.gateway.say(EVENTS, changed_elsewhere(70.0))  # the field has the focus, and nothing is typed
    expect(runtime).to_have_value("70")
    runtime.press("End")
    page.keyboard.type("1")
    battery.gateway.say(EVENTS, changed_elsewhere(80.0))
    expect(page.get_by_label("Runtime, slider")).to_have_value("80")
    expect(runtime).to_have_value("701")
    page.keyboard.press("Backspace")
    page.keyboard.press("Tab")
    expect(runtime).to_have_value("80")


def test_where_parameters_cannot_be_asked_for_or_changed_it_is_said(
    open_page: Callable[..., Page], battery: Battery
) -> None:
    def refuse(_: dict[str, Any]) -> dict[str, Any]:
        raise Refused("this needs the role 'configure'; yours is 'operate'")

    battery.gateway.config = {**CONFIG, "role": "operate"}
    nodes = {"services": ["/arm/describe_parameters", "/battery/describe_parameters"]}
    battery.gateway.answers |= {"/rosapi/services": lambda _: nodes, "/arm/list_parameters": refuse}
    page = open_page(page_name="parameters")
    expect(page.get_by_label("Runtime", exact=True)).to_have_value("45")
    expect(page.get_by_label("Runtime", exact=True)).to_be_disabled()
    expect(page.get_by_text("Changing them needs the link of the role configure.")).to_be_visible()
    arm = page.get_by_label("arm", exact=True)
    expect(arm).to_have_text("ArmIts parameters are unknown: this needs the role 'configure'; yours is 'operate'.")
    page.get_by_label("Find a parameter").fill("runtime")
    expect(arm).to_be_hidden()
    assert battery.gateway.calls("/console/save") == []


@pytest.mark.soak
def test_a_change_is_taken_back_and_changes_of_others_appear(open_page: Callable[..., Page], battery: Battery) -> None:
    page = open_page(page_name="parameters")
    runtime = page.get_by_label("Runtime", exact=True)
    runtime.fill("60")
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Save 1")).to_be_enabled()
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_role("button", name="Saved")).to_be_visible()
    assert battery.values["runtime"] == number(45.0)
    page.get_by_label("Mode").focus()
    expect(runtime).to_have_value("45")
    page.wait_for_timeout(300)  # a value of this page counts as on its way for a while
    battery.gateway.say(EVENTS, changed_elsewhere(70.0))
    expect(runtime).to_have_value("70")


@pytest.mark.soak  # as the Drive page does, of the same parts
def test_it_fits_a_phone(open_page: Callable[..., Page], battery: Battery) -> None:
    page = open_page(page_name="parameters", viewport=PHONE, has_touch=True)
    expect(page.get_by_label("Runtime", exact=True)).to_be_visible()
    page.get_by_label("Find a parameter").fill("warn")
    expect(page.get_by_label("Runtime", exact=True)).to_be_hidden()
    expect_fit(page)


@pytest.mark.soak
def test_a_robot_without_parameters_says_so(open_page: Callable[..., Page], gateway: FakeGateway) -> None:
    gateway.answers["/rosapi/services"] = lambda _: {"services": []}
    page = open_page(page_name="parameters")
    expect(page.get_by_text("no parameters that may change")).to_be_visible()
