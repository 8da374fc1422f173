"""The section `msgs`: a robot's own message types, and the mistakes in their texts."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.commands.main import main
from rbxcompose.compiler.message_texts import Examination, TypeText
from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.schema.documents import installed_schema, schema_with
from rbxcompose.compiler.systems.bundle import bundle_of
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.runtime.supervision.plan_change import changes
from rbxcompose.testing.bench import Bench, SystemBench
from rbxcompose.tools.exporting.viewers import heard
from rbxcompose.tools.inspection.plan_text import plan_text
from rbxcompose.tools.lsp.project import Project as Editor
from tests.conftest import ROOT
from tests.loops import for_all
from tests.parts.project import Project
from tests.third_party.places import put, see

ROBOT = """
msgs:
  own: msgs
components:
  width: {type: threshold, topic: grasp, message: my_msgs/Grasp, field: width, warn_below: 0.1}
"""
GRASP = "# A grasp.\nuint8 KIND=1\nstd_msgs/Header header\nfloat64 width\nFinger[] fingers\n"
FILES = {
    "robots/one/msgs/my_msgs/msg/Grasp.msg": GRASP,
    "robots/one/msgs/my_msgs/msg/Finger.msg": "bool touches\n",
    "robots/one/msgs/my_msgs/srv/Open.srv": "Grasp grasp\n---\nbool ok\n",
}
SHUT = {"robots/one/msgs/my_msgs/srv/Shut.srv": "float64 force\n---\nbool success\nstring message\n"}
ONE = ROBOT + "  hand: {type: program, command: [hand], serves: {shut: my_msgs/Shut}}\n"
GO = "rbx: 1\nkind: Mission\nname: go\n"


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    yield
    registry.choose({})


def plan_of(project: Project, robot: str = ROBOT, files: dict[str, str] = FILES) -> Plan:
    plan = project.check(robot, files=files).compilation.plan
    assert plan, project.text
    return plan


def test_its_types_are_known_to_configurations_and_travel_with_the_plan(tmp_path: Path) -> None:
    plan = plan_of(Project(tmp_path))
    assert sorted(plan.messages) == ["my_msgs/msg/Finger", "my_msgs/msg/Grasp", "my_msgs/srv/Open"]
    text = dump(plan)
    registry.choose({})
    assert load(text) == plan
    assert registry.service("my_msgs/Open").Request.FIELDS == {"grasp": "my_msgs/msg/Grasp"}


def test_its_files_are_those_that_the_robot_was_compiled_from(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT, files=FILES)
    assert project.checked
    names = {Path(name).name for name in project.checked.compilation.sources}
    assert names == {"robot.yaml", "Grasp.msg", "Finger.msg", "Open.srv"}


def test_a_field_that_the_type_lacks_is_found(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT.replace("width, warn", "widht, warn"), files=FILES)
    assert "did you mean 'width'?" in project.text


@pytest.mark.parametrize("name", ["my_msgs/Gripper", "my_msgs/Grsp"])
def test_an_unknown_type_is_found_as_any_other(tmp_path: Path, name: str) -> None:
    project = Project(tmp_path)
    project.check(ROBOT.replace("my_msgs/Grasp", name), files=FILES)
    assert f"there is no message type '{name}'" in project.text


@for_all(
    "file, text, found",
    [
        ("my_msgs/msg/Finger.msg", "bool a\n  bool  # nothing\n", "RBX3026 Finger.msg:2:3"),
        ("my_msgs/msg/Finger.msg", "bool a\nbool a\n", "RBX3026 Finger.msg:2:1"),
        ("my_msgs/msg/Finger.msg", "uint8 A=256\n", "RBX3026 Finger.msg:1:1"),
        ("my_msgs/msg/Finger.msg", "bool a__b\n", "RBX3026 Finger.msg:1:1"),
        ("my_msgs/msg/Finger.msg", "wstring a\n", "RBX3026 Finger.msg:1:1"),
        ("my_msgs/msg/Finger.msg", "uint8[9999999] a\n", "RBX3026 Finger.msg:1:1"),
        ("my_msgs/msg/Finger.msg", "bool a\n---\n", "RBX3026 Finger.msg:1:1"),
        ("my_msgs/msg/Finger.msg", "bool a\nFingr b\n", "RBX3027 Finger.msg:2:1"),
        ("my_msgs/msg/Finger.msg", "my_msgs/srv/Open b\n", "RBX3027 Finger.msg:1:1"),
        ("my_msgs/msg/Finger.msg", "Grasp grasp\n", "RBX3028 Grasp.msg:5:1"),
        ("my_msgs/msg/Finger.msg", "Finger[] inside\n", "RBX3028 Finger.msg:1:1"),
        ("my_msgs/srv/Open.srv", "bool a\n", "RBX3026 Open.srv:1:1"),
        ("my_msgs/action/Go.action", "---\n---\nFoo x\n", "RBX3027 Go.action:3:1"),
        ("my_msgs/msg/small.msg", "bool a\n", "RBX3026 small.msg:1:1"),
        ("my_msgs/msg/Two_Words.msg", "bool a\n", "RBX3026 Two_Words.msg:1:1"),
        ("my_msgs/msg/None.msg", "bool a\n", "RBX3026 None.msg:1:1"),
        ("std_msgs/msg/String.msg", "int32 data\n", "RBX3029 String.msg:1:1"),
        ("Upper/msg/A.msg", "bool a\n", "RBX1322 robot.yaml:6:8"),
        ("class/msg/A.msg", "bool a\n", "RBX1322 robot.yaml:6:8"),
        ("poses/msg/A.msg", "bool a\n", "RBX1322 robot.yaml:6:8"),
    ],
)
def test_a_mistake_is_told_at_its_line_and_once(tmp_path: Path, file: str, text: str, found: str) -> None:
    project = Project(tmp_path)
    project.check(ROBOT, files={**FILES, f"robots/one/msgs/{file}": text})
    told = [(one.code, one.span) for one in project.findings]
    assert [f"{code} {Path(span.file).name}:{span.line}:{span.column}" for code, span in told if span] == [found]


@pytest.mark.parametrize(
    ("folder", "found"),
    [("nothing", "RBX1301"), ("../../parts", "RBX1322"), ("../../..", "RBX1306"), ("a" * 300, "RBX1301")],
)
def test_a_folder_without_messages_is_found(tmp_path: Path, folder: str, found: str) -> None:
    project = Project(tmp_path / "project")
    project.check(f'msgs: {{own: "{folder}"}}\ncomponents: {{}}', files={"parts/a.txt": "", "missions/x": ""})
    assert [one.code for one in project.findings] == [found]


def test_a_text_that_cannot_be_read_is_not_unknown_where_it_is_used(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT, files={**FILES, "robots/one/msgs/my_msgs/msg/Finger.msg": "#" * 200_000})
    assert [finding.code for finding in project.findings] == ["RBX1103"], project.text


def test_a_link_to_a_text_outside_the_project_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "Secret.msg").write_text("bool a\n")
    folder = tmp_path / "project/robots/one/msgs/my_msgs/msg"
    folder.mkdir(parents=True)
    (folder / "Secret.msg").symlink_to(tmp_path / "Secret.msg")
    project = Project(tmp_path / "project")
    project.check("msgs: {own: msgs}\ncomponents: {}")
    assert [one.code for one in project.findings] == ["RBX1306"]


def test_two_folders_with_packages_of_one_name_are_found(tmp_path: Path) -> None:
    project = Project(tmp_path)
    other = {"missions/msgs/my_msgs/msg/Ball.msg": "bool a\n"}
    project.check(ROBOT.replace("own: msgs", "own: msgs\n  other: ../../missions/msgs"), files={**FILES, **other})
    assert [(one.code, len(one.related)) for one in project.findings] == [("RBX1322", 1)]


def test_a_standard_type_may_be_there_once_more(tmp_path: Path) -> None:
    project = Project(tmp_path)
    more = {
        "robots/one/msgs/std_msgs/msg/String.msg": "string data\n",
        "robots/one/msgs/std_msgs/msg/New.msg": "Bool a\n",
    }
    plan = plan_of(project, files={**FILES, **more})
    assert [name for name in plan.messages if name.startswith("std_msgs/")] == ["std_msgs/msg/New"]
    assert registry.message("std_msgs/New").FIELDS == {"a": "std_msgs/msg/Bool"}


def test_a_part_brings_its_types_however_often_it_is_included(tmp_path: Path) -> None:
    project = Project(tmp_path)
    part = """
msgs: {own: hand_msgs}
components:
  grip: {type: topic_monitor, topic: grip, message: hand_msgs/Grip, rate: 1 Hz}
"""
    robot = "include: {left: ../../parts/hand.yaml, right: ../../parts/hand.yaml}\ncomponents: {}"
    project.check(robot, {"hand": part}, files={"parts/hand_msgs/msg/Grip.msg": "float64 force\n"})
    assert not project.findings, project.text
    assert project.manifest.messages == {"hand_msgs/msg/Grip": "float64 force\n"}


def test_a_robot_that_runs_cannot_change_its_types(tmp_path: Path) -> None:
    project = Project(tmp_path)
    before = plan_of(project)
    after = plan_of(project, files={**FILES, "robots/one/msgs/my_msgs/msg/Finger.msg": "bool feels\n"})
    assert "messages.my_msgs/msg/Finger" in changes(before, after).impossible[0]
    assert not changes(before, before).impossible


def test_benches_of_robots_with_different_types_of_one_name_do_not_mix(tmp_path: Path) -> None:
    one = plan_of(Project(tmp_path / "a"))
    grasp = FILES | {"robots/one/msgs/my_msgs/msg/Grasp.msg": "string name\nfloat32 width\n"}
    other = plan_of(Project(tmp_path / "b"), files=grasp)
    benches = [Bench(plan=plan) for plan in (one, other, one)]
    for bench, plan in zip(benches, (one, other, one), strict=True):
        registry.choose(plan.messages)
        statuses = bench.statuses("width")
        bench.publish("grasp", registry.message("my_msgs/Grasp")(width=0.0))  # type: ignore[call-arg]
        bench.advance(2.0)
        assert statuses[-1].level == 1


def test_an_editor_has_the_types_of_the_robot_that_it_asks_about(tmp_path: Path) -> None:
    files = []
    for name, text in (("a", "float64 width\n"), ("b", "float64 depth\n")):
        folder = tmp_path / name
        (folder / "msgs/my_msgs/msg").mkdir(parents=True)
        (folder / "msgs/my_msgs/msg/Grasp.msg").write_text(text)
        (folder / "robot.yaml").write_text(
            f"rbx: 1\nkind: Robot\nname: {name}\nmsgs: {{own: msgs}}\ncomponents: {{}}\n"
        )
        files.append(folder.resolve() / "robot.yaml")
    editor = Editor({})
    for file in files:
        assert not any(editor.change(file, file.read_text()).values())
    for file, field in zip(files, ("width", "depth"), strict=True):
        assert editor.robot_of(file)
        assert list(registry.message("my_msgs/Grasp").FIELDS) == [field]
    written = files[0].parent / "msgs/my_msgs/msg/Grasp.msg"
    assert [one.code for one in editor.change(written, "float64 Width\n")[written]] == ["RBX3026"]
    assert not editor.change(written, "float64 height\n")[written]


WORDS = (
    "bool",
    "Foo",
    "Bar",
    "std_msgs/Header",
    "string<=3",
    "[3]",
    "[<=2]",
    "[",
    "x",
    "y",
    "=",
    "A",
    "1",
    "#",
    '"',
    "---",
    "\n",
    " ",
)


@given(st.dictionaries(st.sampled_from(["Foo", "Bar", "x"]), st.lists(st.sampled_from(WORDS)).map("".join)))
def test_whatever_the_texts_are_what_is_left_of_them_can_be_used(texts: dict[str, str]) -> None:
    examined = Examination({f"toy/msg/{name}": TypeText(f"{name}.msg", text) for name, text in texts.items()})
    with registry.choosing(examined.texts):
        for name in examined.texts:
            message = registry.message(name)
            assert decode(message, encode(message())) == message()
            assert message.HASH


@pytest.mark.parametrize("line", ["what", "Foo foo", "Bar bar%d", "bool same", "uint8 A%d=256"])
def test_a_text_with_thousands_of_mistakes_takes_no_time(line: str) -> None:
    text = "".join(f"{line % number if '%' in line else line}\n" for number in range(2_500))
    examined = Examination({"toy/msg/Bar": TypeText("Bar.msg", text)})
    assert examined.findings
    assert examined.texts["toy/msg/Bar"] == ""


def test_messages_may_be_deep_but_not_too_deep() -> None:
    texts = {
        f"toy/msg/M{depth}": TypeText("M", f"M{depth + 1}[2] m\n" if depth < 400 else "bool x\n")
        for depth in range(401)
    }
    examined = Examination(texts)
    assert {one.code for one in examined.findings} == {"RBX3026"}
    with registry.choosing(examined.texts):
        registry.message("toy/msg/M0")()


PART = """
rbx: 1
kind: Part
name: hand
msgs: {own: one/msgs}
components:
  gripper: {type: toy_gripper}
"""
PLUGIN = '''
from rbxcompose.msgs.my_msgs import Grasp, Open
from rbxcompose.sdk import Component, Config, In, Out, Serves, component


class GripperConfig(Config):
    """Nothing."""


@component("toy_gripper")
class Gripper(Component[GripperConfig]):
    """Grips.

    Example:
        gripper: {type: toy_gripper}
    """

    wanted = In(Grasp, "wanted")
    done = Out(Grasp, "grasp")

    def activate(self) -> None:
        """Say hello."""
        self.done(Open.Request(Grasp(width=0.5)).grasp)
'''


def test_a_component_of_another_package_imports_them_also_in_a_part(tmp_path: Path) -> None:
    for name, text in {
        "lib/toy_gripper.py": PLUGIN,
        "lib/toy_gripper-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: toy-gripper\nVersion: 1.0\n",
        "lib/toy_gripper-1.0.dist-info/entry_points.txt": "[rbxcompose.plugins]\ncomponent.toy_gripper = toy_gripper\n",
        "robots/one/robot.yaml": "rbx: 1\nkind: Robot\nname: one\ninclude: {hand: ../hand.yaml}\ncomponents: {}\n",
        "robots/hand.yaml": PART,
        **FILES,
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}/lib:{ROOT}", "XDG_RUNTIME_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "rbxcompose", "up", "robots/one", "--rate", "max", "--for", "1s"]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=15
    )
    assert done.returncode == 0, done.stderr + done.stdout
    assert "error" not in done.stderr + done.stdout


@pytest.mark.parametrize("in_editor", [True, False])
def test_a_type_that_imports_them_is_in_the_schema_of_their_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], in_editor: bool
) -> None:
    put(
        tmp_path / "lib",
        "toy-squeezer",
        {"component.toy_squeezer": "toy_squeezer"},
        {"toy_squeezer.py": PLUGIN.replace("toy_gripper", "toy_squeezer")},
    )
    see(tmp_path / "lib", monkeypatch)
    schema_with.cache_clear()
    robot = "rbx: 1\nkind: Robot\nname: one\nmsgs: {own: msgs}\ncomponents: {}\n"
    for name, text in {**FILES, "robots/one/robot.yaml": robot}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path / "lib")
    assert main(["schema", "robot"]) == 0
    printed, told = capsys.readouterr()
    assert "component_toy_squeezer" not in printed
    assert "warning[RBX9302]: the component 'toy_squeezer' of package 'toy-squeezer' cannot be used" in told
    assert "run this in the folder of that robot" in told
    file = tmp_path / "robots/one/robot.yaml"
    if in_editor:
        editor = Editor({})
        editor.change(file, robot)
        assert editor.robot_of(file)
        assert "component_toy_squeezer" in installed_schema("Robot")["$defs"]
        return
    monkeypatch.chdir(file.parent)
    assert main(["schema", "robot"]) == 0
    printed, told = capsys.readouterr()
    assert "component_toy_squeezer" in printed
    assert not told


MUXED = """
msgs: {own: msgs}
muxes:
  grasp: {inputs: {first: {priority: 1, timeout: 1 s}}}
components:
  width: {type: threshold, topic: grasp, message: my_msgs/Grasp, field: width, warn_below: 0.1}
"""


@pytest.mark.parametrize(("text", "is_same"), [("# Another comment.\n" + GRASP, True), ("float64 width\n", False)])
def test_robots_that_share_a_topic_must_have_the_same_definition(tmp_path: Path, text: str, is_same: bool) -> None:
    head = "rbx: 1\nkind: Robot\nname: "
    files = {
        **FILES,
        "robots/one/robot.yaml": f"{head}one\n{MUXED}",
        "robots/two/robot.yaml": f"{head}two\n{ROBOT.replace('topic: grasp', 'topic: /one/grasp')}",
        **{path.replace("one", "two"): written for path, written in FILES.items()},
        "robots/two/msgs/my_msgs/msg/Grasp.msg": text,
        "systems/both.yaml": "rbx: 1\nkind: System\nname: both\nhosts: {desk: {}}\nrobots:\n"
        "  one: {robot: ../robots/one/robot.yaml, share: [grasp]}\n  two: {robot: ../robots/two/robot.yaml}\n",
    }
    for name, written in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(written)
    system = compile_system(str(tmp_path / "systems/both.yaml"), environment={})
    errors = [finding for finding in system.report if finding.severity == "error"]
    assert [finding.code for finding in errors] == ([] if is_same else ["RBX6126"]), errors
    names = {path for path in bundle_of(system).archive.split(b"\0") if path.endswith(b".msg")}
    assert len(names) == 4
    if is_same:
        bench = SystemBench(system)
        registry.choose(bench.robots["two"].plan.messages)
        statuses = bench.robots["two"].statuses("width")
        registry.choose(bench.robots["one"].plan.messages)
        bench.robots["one"].publish("grasp/first", registry.message("my_msgs/Grasp")(width=0.0))  # type: ignore[call-arg]
        bench.advance(2.0)
        assert statuses[-1].level == 1


TWO = "components: {level: {type: threshold, topic: level, warn_below: 1}}\nmissions: {go: go.yaml}\n"
SYSTEM = """rbx: 1
kind: System
name: both
hosts: {desk: {}}
robots:
  one: {robot: ../robots/one/robot.yaml, share: [shut], callers: [two]}
  two: {robot: ../robots/two/robot.yaml}
"""


@pytest.mark.parametrize(
    ("two", "step", "codes"),
    [
        (TWO, "wait: 1 s", []),
        (TWO, "one/shut: {force: 2}", ["RBX4102", "RBX6102"]),
        (TWO + "msgs: {own: ../one/msgs}\n", "one/shut: {force: 2}", []),
    ],
)
def test_each_robot_of_a_system_has_its_own_types(tmp_path: Path, two: str, step: str, codes: list[str]) -> None:
    for name, written in {
        **FILES,
        **SHUT,
        "robots/one/robot.yaml": f"rbx: 1\nkind: Robot\nname: one\n{ONE}",
        "robots/two/robot.yaml": f"rbx: 1\nkind: Robot\nname: two\n{two}",
        "robots/two/go.yaml": f"{GO}do: {{{step}}}\n",
        "systems/both.yaml": SYSTEM,
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(written)
    system = compile_system(str(tmp_path / "systems/both.yaml"), environment={})
    assert [finding.code for finding in system.report if finding.severity == "error"] == codes, system.report.findings
    one = system.robots["one"]
    assert {end.type for end in one.ends} >= {"my_msgs/msg/Grasp", "my_msgs/srv/Shut"}
    assert heard(one.plan)["/grasp"].type == "my_msgs/msg/Grasp"
    assert "/shut (my_msgs/srv/Shut)" in plan_text(one.plan)
