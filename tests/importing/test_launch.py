"""Launch files in three languages become components, and what they ask for beyond that is reported."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base import processes
from rbxcompose.commands import main as command
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.domains.programs.launch_files.evaluation import _KNOWN
from rbxcompose.domains.programs.launch_files.substitutions import UnknownValueError, evaluated, read_launch_text
from rbxcompose.testing.golden import Golden
from tests.importing.imports import EXAMPLES, Imported, import_files
from tests.loops import for_all
from tests.soak import rare

LANGUAGES = {"xml": "in_xml.launch.xml", "yaml": "in_yaml.launch.yaml", "python": "in_python.launch.py"}


@pytest.fixture(autouse=True)
def no_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


def launch(folder: Path, text: str, ending: str = "xml") -> Imported:
    path = folder / f"tried.launch.{ending}"
    path.write_text(text, encoding="utf-8")
    return import_files([path], program="launch")


def components(found: Imported) -> Any:
    return found.data["components"]


def without_comments(text: str) -> str:
    return re.sub(r" *#.*\n", "\n", text)


@pytest.mark.parametrize("name", [*LANGUAGES.values(), "strange.launch.xml", "strange_python.launch.py"])
def test_what_is_written_and_what_is_told(name: str, repository: Path, golden: Golden) -> None:
    found = import_files([EXAMPLES / "launch" / name], "cart", "launch")
    stem = name.partition(".")[0]
    golden.check(f"launch_{stem}.yaml", found.text)
    golden.check(f"launch_{stem}.txt", "\n".join(f"{one.span}: {one.code}: {one.message}" for one in found.report))


def test_the_same_robot_is_made_from_each_language() -> None:
    made = {import_files([EXAMPLES / "launch" / name], "cart", "launch").text for name in LANGUAGES.values()}
    assert len(made) == 3
    assert len({without_comments(text) for text in made}) == 1


WORDS = st.text("abcxyz_", min_size=1, max_size=6)
VALUES = st.one_of(
    st.booleans(), st.integers(-1000, 1000), st.floats(-1000, 1000).map(lambda one: round(one, 3)), WORDS
)
NODES = st.fixed_dictionaries(
    {"pkg": WORDS, "exec": WORDS},
    optional={
        "name": WORDS,
        "namespace": WORDS,
        "respawn": st.booleans(),
        "args": st.lists(WORDS, max_size=3).map(" ".join),
        "param": st.lists(st.fixed_dictionaries({"name": WORDS, "value": VALUES}), max_size=3),
        "remap": st.lists(st.fixed_dictionaries({"from": WORDS, "to": WORDS}), max_size=3),
        "env": st.lists(st.fixed_dictionaries({"name": WORDS, "value": WORDS}), max_size=2),
    },
)
GROUPS = st.lists(NODES.map(lambda node: {"node": node}), max_size=2).map(lambda nodes: {"group": nodes})
SPACES = WORDS.map(lambda name: {"push-ros-namespace": {"namespace": name}})
ACTIONS = st.lists(st.one_of(NODES.map(lambda node: {"node": node}), GROUPS, SPACES), max_size=4)


def xml(kind: str, data: Any) -> str:
    """Return an entity of YAML in XML."""
    if isinstance(data, list):
        return f"<{kind}>{''.join(xml(*pair) for item in data for pair in item.items())}</{kind}>"
    given = "".join(f" {name}={quoteattr(scalar(one))}" for name, one in data.items() if not isinstance(one, list))
    inner = "".join(xml(name, one) for name, many in data.items() if isinstance(many, list) for one in many)
    return f"<{kind}{given}>{inner}</{kind}>"


def scalar(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(ACTIONS)
def test_xml_and_yaml_say_the_same(tmp_path: Path, actions: list[Any]) -> None:
    in_yaml = launch(tmp_path, yaml.safe_dump({"launch": actions}, sort_keys=False), "yaml")
    in_xml = launch(tmp_path, xml("launch", actions))
    assert without_comments(in_yaml.text) == without_comments(in_xml.text)
    assert [one.code for one in in_yaml.report] == [one.code for one in in_xml.report]


KINDS = st.sampled_from([*_KNOWN, "composable_node", "item", "word", "choice", "log", "strange"])
GIVEN = st.sampled_from(sorted({name for kind in _KNOWN.values() for name in kind.attributes} - {"file"}))
PIECES = ("$(var a)", "$(var b c)", "$(eval 1 + 1)", "$(eval '", "$(env HOME)", "$(not true)", "$(", ")", "[1, x]",
          "{a: ", "true", "/a/b", "3.5", "-1", "'", "*a", "!!python/none", "2020-01-01", "\u202e", " ")  # fmt: skip
WRITTEN = st.lists(st.sampled_from(PIECES), max_size=3).map("".join)
ELEMENTS: st.SearchStrategy[Any] = st.recursive(
    st.tuples(KINDS, st.dictionaries(GIVEN, WRITTEN, max_size=5), st.just([])),
    lambda inner: st.tuples(KINDS, st.dictionaries(GIVEN, WRITTEN, max_size=5), st.lists(inner, max_size=4)),
    max_leaves=12,
)


def element(kind: str, given: dict[str, str], children: list[Any]) -> str:
    attributes = "".join(f" {name}={quoteattr(value)}" for name, value in given.items())
    return f"<{kind}{attributes}>{''.join(element(*child) for child in children)}</{kind}>"


@settings(max_examples=3 * settings().max_examples, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(ELEMENTS, max_size=5))
def test_whatever_a_launch_file_says_a_manifest_without_mistakes_of_yaml_or_a_finding_comes_of_it(
    tmp_path: Path, elements: list[Any]
) -> None:
    found = launch(tmp_path, element("launch", {}, elements))
    assert found.text or list(found.report)
    assert not found.text or components(found)
    assert all(one.span for one in found.report if one.code != "RBX2238")


def test_arguments_come_from_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cart.launch.xml").write_text(
        '<launch><arg name="port"/><node pkg="a" exec="b" args="$(var port)"/></launch>', encoding="utf-8"
    )
    assert command.main(["import", "launch", "cart.launch.xml"]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("error[") == 1, "what uses the argument is not reported once more"
    assert "write 'port:=VALUE' behind FILE" in captured.err
    assert command.main(["import", "launch", "cart.launch.xml", "port:=/dev/x"]) == 0
    captured = capsys.readouterr()
    assert "\nname: cart\n" in captured.out
    assert "arguments: [/dev/x]" in captured.out
    assert command.main(["import", "launch", "cart.launch.xml", "port:=1", "prot:=2"]) == 1
    assert "did you mean 'port'?" in capsys.readouterr().err


def test_names_that_a_robot_has_itself_and_that_ros_does_not_take_are_changed(tmp_path: Path) -> None:
    nodes = "".join(f'<node pkg="a" exec="b" name="{name}"/>' for name in ("mission", "start", "console", "Robot-Node"))
    found = launch(tmp_path, f'<launch>{nodes}<node pkg="a" exec="ros2" namespace="left-1"/></launch>')
    assert [(name, one.get("name")) for name, one in components(found).items()] == [
        ("mission_2", "mission"), ("start_2", "start"), ("console_2", "console"), ("robot_node", None), ("ros2_2", None)
    ]  # fmt: skip
    assert [code for code, _ in found.told if code == "RBX2230"] == ["RBX2230"] * 2, found.words
    assert not compiled(tmp_path, found.text).report.has_errors


def compiled(folder: Path, text: str) -> Compilation:
    (folder / "robot.yaml").write_text(text, encoding="utf-8")
    return compile_robot(str(folder), environment={})


def test_paths_lead_from_the_new_file_to_files_that_check_asks_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.yaml").write_text("/**: {ros__parameters: {a: 1}}\n", encoding="utf-8")
    text = '<node pkg="a" exec="b"><param from="p.yaml"/></node><executable cmd="true" cwd="."/>'
    Path("cart.launch.xml").write_text(f"<launch>{text}</launch>", encoding="utf-8")
    assert command.main(["import", "launch", "cart.launch.xml", "-o", "robots/cart"]) == 0
    made = yaml.safe_load(Path("robots/cart/robot.yaml").read_text(encoding="utf-8"))["components"]
    assert made["b"]["parameter_files"] == ["../../p.yaml"]
    assert made["true"]["folder"] == "../.."
    found = compile_robot("robots/cart", environment={})
    assert "p.yaml" in found.sources, "it travels with the robot"
    assert not found.report.has_errors
    Path("p.yaml").unlink()
    assert command.main(["check", "robots/cart"]) == 1
    assert "error[RBX1301]: 'p.yaml' does not exist\n  --> robots/cart/robot.yaml:" in capsys.readouterr().out


def test_packages_are_found_and_files_included_with_arguments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    share = tmp_path / "prefix/share/base_driver"
    (share / "launch").mkdir(parents=True)
    (share / "launch/base.launch.yaml").write_text(
        "launch:\n- arg: {name: port, default: none}\n- arg: {nmae: port}\n"
        "- node: {pkg: base_driver, exec: driver, args: $(var port) $(dirname)}\n"
    )
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path}/prefix")
    monkeypatch.chdir(tmp_path)
    text = (
        '<launch><group><push_ros_namespace namespace="left"/>'
        '<include file="$(find-pkg-share base_driver)/launch/base.launch.yaml"><arg name="port" value="7"/></include>'
        "</group></launch>"
    )
    found = launch(tmp_path, text)
    assert components(found)["driver"]["arguments"] == ["7", str(share / "launch")]
    assert components(found)["driver"]["namespace"] == "/left"
    assert command.main(["import", "launch", "tried.launch.xml"]) == 1
    assert "- arg: {nmae: port}" in capsys.readouterr().err, "findings show the text of an included file"


@for_all(
    "text, code",
    [
        ("<launch>", "RBX2001"),
        ("", "RBX2001"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><launch>&b;</launch>', "RBX2001"),
        ("<launch>" + "<group>" * 100 + "</group>" * 100 + "</launch>", "RBX1103"),
        ("<robot/>", "RBX2231"),
        ('<launch><include file="nowhere.xml"/></launch>', "RBX2256"),
        ('<launch><include file="tried.launch.xml"/></launch>', "RBX2256"),
        ("<launch><include/></launch>", "RBX1002"),
        ('<launch><node pkg="a" exec="b"/><nod/></launch>', "RBX2230"),
        ('<launch><node pkg="a" exec="$(var b"/></launch>', "RBX2254"),
        (f'<launch><node pkg="a" exec="{"$(var " * 50}b{")" * 50}"/></launch>', "RBX2254"),
        ('<launch><node pkg="a" exec="$(unheard of)"/></launch>', "RBX2254"),
        ('<launch><node pkg="a" exec="b" if="perhaps"/></launch>', "RBX2254"),
        ('<launch><node pkg="a" exec="b" args="\'"/></launch>', "RBX2254"),
        ('<launch><node pkg="a" exec="b" args="&#x202e;"/></launch>', "RBX2254"),
        ('<launch><node pkg="a" exec="b"><param name="c" value="[&amp;a [1], *a]"/></node></launch>', "RBX2254"),
        ('<launch><node pkg="a" exec="b"><param name="c" value=".inf"/></node></launch>', "RBX2254"),
        (f'<launch><node pkg="a" exec="b"><param name="c" value="{"[" * 1000}"/></node></launch>', "RBX2254"),
        (f'<launch><let name="a" value="{"x" * 40000}"/><let name="b" value="$(var a)$(var a)"/></launch>', "RBX2254"),
    ],
)
def test_a_mistake_is_a_finding_with_its_place(text: str, code: str, tmp_path: Path) -> None:
    found = launch(tmp_path, text)
    assert code in [one.code for one in found.report], found.words
    assert all(one.span is not None for one in found.report)


@pytest.mark.parametrize(
    "text",
    ["[]", "launch: 3", "launch: [3]", "launch: [{node: 3}]", "launch: [{a: 1, b: 2}]", "a: 1", "launch: [[[]]]"],
)
def test_yaml_that_is_no_launch_file_is_a_finding(text: str, tmp_path: Path) -> None:
    found = launch(tmp_path, text, "yaml")
    assert found.report.has_errors or list(found.report)
    assert found.text == ""


def test_includes_that_double_each_time_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.programs.launch_files.evaluation._MOST_ENTITIES", 1_000)
    for number in range(11):
        twice = f'<include file="{number + 1}.launch.xml"/>' * 2
        (tmp_path / f"{number}.launch.xml").write_text(f"<launch>{twice}</launch>")
    (tmp_path / "11.launch.xml").write_text("<launch/>")
    found = import_files([tmp_path / "0.launch.xml"], program="launch")
    assert [one.code for one in found.report] == ["RBX1103"]


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1 + 2 * 3", "7"),
        ("'a' == 'a' and not 2 > 3", "True"),
        ("'front' in ['front', 'rear']", "True"),
        ("1 if 'x' != 'y' else 2", "1"),
        ("false or 0.5", "0.5"),
        ("-2 < 3 <= 3", "True"),
    ],
)
def test_simple_expressions_have_their_value(expression: str, value: str) -> None:
    assert evaluated(expression) == value


WITHOUT_VALUE = [
    "__import__('os')",
    "9 ** 9 ** 9",
    "'a' * 10 ** 9",
    "[0] * 10 ** 9",
    "().__class__",
    "1 / 0",
    "f'{1}'",
    "a",
    "1 +",
    "(" * 500,
    "1 < 'a'",
    "'%0999999999d' % 1",
    "open('x')",
    "lambda: 1",
    "[x for x in (1, 2)]",
]


@for_all("expression", WITHOUT_VALUE)
def test_others_have_none(expression: str) -> None:
    with pytest.raises(UnknownValueError):
        evaluated(expression)


@given(st.text("$()'\" abc\\", max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        pieces = read_launch_text(text)
    except UnknownValueError:
        return
    assert "".join(one for one in pieces if isinstance(one, str)) == text.replace("\\$", "$") or "$(" in text


HEAD = "import os, sys\nfrom launch import LaunchDescription\nfrom launch.actions import *\n"
BAD = {
    "it runs for ever": ("while True: pass", "limits"),
    "it sleeps": ("import time\n    time.sleep(1000)", "limits"),
    "it takes all memory": ("x = bytearray(10 ** 10)", "memory"),
    "it grows": ("x = []\n    while True: x.append('a' * 10 ** 6)", "memory"),
    "it ends itself": ("sys.exit(3)", "ends the process"),
    "it ends at once": ("os._exit(0)", "limits"),
    "it kills itself": ("os.kill(os.getpid(), 9)", "os.kill"),
    "it raises": ("raise ValueError('no luck')", "no luck"),
    "it raises what cannot be shown": ("raise type('E', (Exception,), {'__str__': lambda self: 1})", "limits"),
    "it recurses": ("f = lambda: f()\n    f()", "deeper calls"),
    "it imports a stranger": ("import numpy", "'numpy'"),
    "it imports by another way": ("import importlib\n    importlib.import_module('numpy')", "read files"),
    "it runs a program": ("import subprocess\n    subprocess.run(['touch', 'pwned'])", "subprocess.Popen"),
    "it runs a shell": ("os.system('touch pwned')", "os.system"),
    "it forks": ("os.fork()", "os.fork"),
    "it writes": ("open('pwned', 'w')", "read files"),
    "it reads elsewhere": ("open('/etc/passwd').read()", "read files"),
    "it removes": ("os.remove(__file__)", "os.remove"),
    "it calls out": ("import socket\n    socket.socket().connect(('127.0.0.1', 9))", "socket"),
    "it takes a library of C": ("import ctypes", "'ctypes'"),
    "it reaches into us": ("sys.modules['rbxcompose.base.processes']", "KeyError"),
    "it returns nothing": ("return None", "no LaunchDescription"),
    "it returns strange things": ("return LaunchDescription([3])", "no action"),
    "it declares without end": ("return LaunchDescription(iter(lambda: LogInfo(msg='a'), 1))", "memory"),
    "it reads a package that is not there": (
        "from ament_index_python.packages import get_package_share_directory as f\n    open(f('base'))",
        "'$(find-pkg-share base)'",
    ),
    "it asks for what is not known": ("from launch.events import a\n    if a(): pass", "'a' is not known"),
}  # fmt: skip


LIKE_OTHERS = {
    "it grows",
    "it ends itself",
    "it kills itself",
    "it raises what cannot be shown",
    "it imports by another way",
    "it runs a shell",
    "it removes",
    "it forks",
    "it calls out",
    "it takes a library of C",
    "it returns strange things",
    "it declares without end",
    "it recurses",
    "it returns nothing",
    "it reads a package that is not there",
    "it runs for ever",
}
"""What takes long, or is refused by what refuses another one."""


@pytest.mark.parametrize("name", [*(name for name in BAD if name not in LIKE_OTHERS), *rare(*sorted(LIKE_OTHERS))])
def test_python_that_does_more_than_declare_is_a_finding(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rbxcompose.domains.programs.launch_files.entities._DEADLINE", 5.0)
    body, words = BAD[name]
    start = time.monotonic()
    found = launch(tmp_path, f"{HEAD}def generate_launch_description():\n    {body}\n", "py")
    assert time.monotonic() - start < 20
    assert [one.code for one in found.report] == ["RBX2257"], found.words
    [finding] = found.report
    assert words in finding.message
    assert os.listdir(tmp_path) == ["tried.launch.py"]


AROUND = """
    ours = sys._getframe(2).f_globals["fence"].__globals__
    ours["_may_open"] = lambda *_: True
    {}
"""


@pytest.mark.parametrize("line", ["open('pwned', 'w')", *rare("open('/etc/passwd').read()", "os.listdir('/etc')")])
def test_the_kernel_refuses_files_to_what_gets_around_the_fence_of_python(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if processes._LIBC.syscall(processes._CREATE_RULESET, None, 0, 1) < 1:
        pytest.skip("this kernel has no Landlock")
    monkeypatch.chdir(tmp_path)
    found = launch(tmp_path, f"{HEAD}def generate_launch_description():{AROUND.format(line)}", "py")
    assert "Permission denied" in found.words
    assert os.listdir(tmp_path) == ["tried.launch.py"]


def test_what_python_prints_goes_nowhere(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    body = "    for _ in range(100): os.write(1, b'x' * 10 ** 6), print('y' * 10 ** 6, file=sys.stderr)\n"
    body += "    return LaunchDescription([ExecuteProcess(cmd=['true'])])\n"
    found = launch(tmp_path, f"{HEAD}def generate_launch_description():\n{body}", "py")
    assert components(found) == {"true": {"type": "program", "command": ["true"]}}
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("text", ["x = 1", *rare("(", "raise SystemExit", "import numpy\n", "\0", "a = 1 / 0")])
def test_python_that_is_no_launch_file_is_a_finding(text: str, tmp_path: Path) -> None:
    found = launch(tmp_path, text, "py")
    assert found.report.has_errors
    assert found.text == ""


def test_the_place_of_an_error_is_its_line(tmp_path: Path) -> None:
    found = launch(tmp_path, f"{HEAD}\ndef generate_launch_description():\n    x = 1\n    x.y\n", "py")
    assert found.told == [("RBX2257", 7)]


IN_PACKAGE = """
from ament_index_python.packages import get_package_share_directory
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    own = get_package_share_directory("own")
    other = FindPackageShare("other").find("other")
    missing = os.path.join(get_package_share_directory("missing"), "a.yaml")
    text = open(os.path.join(own, "words.txt")).read()
    return LaunchDescription(
        [
            Node(package="own", executable="a", arguments=[other, text]),
            Node(package="own", executable="b", parameters=[missing, {"c": 1}]),
        ]
    )
"""


def test_a_package_is_found_in_its_workspace_and_without_one_only_what_needs_it_is_left_out(tmp_path: Path) -> None:
    for package in ("own", "other"):
        (tmp_path / package / "launch").mkdir(parents=True)
        (tmp_path / package / "package.xml").write_text("<package/>")
    (tmp_path / "own/words.txt").write_text("hello")
    found = launch(tmp_path / "own/launch", HEAD + IN_PACKAGE, "py")
    assert components(found)["a"]["arguments"] == [str(tmp_path / "other"), "hello"]
    assert components(found)["b"]["parameters"] == {"c": 1}
    assert [one.code for one in found.report] == ["RBX2299", "RBX2254"]


def test_a_function_that_fails_leaves_the_rest(tmp_path: Path) -> None:
    rest = "    return LaunchDescription([OpaqueFunction(function=f), ExecuteProcess(cmd=['a'])])\n"
    found = launch(tmp_path, f"{HEAD}def f(context):\n    1 / 0\ndef generate_launch_description():\n{rest}", "py")
    assert found.told == [("RBX2257", 5)]
    assert [*components(found)] == ["a"]


def test_what_is_nested_in_files_that_are_nested_ends(tmp_path: Path) -> None:
    groups = "<group>" * 60
    for number in range(15):
        inner = f'<include file="{number + 1}.launch.xml"/>'
        text = f"<launch>{groups}{inner}{groups.replace('<', '</')}</launch>"
        (tmp_path / f"{number}.launch.xml").write_text(text)
    found = import_files([tmp_path / "0.launch.xml"], program="launch")
    assert [one.code for one in found.report] == ["RBX1103"]


def test_a_function_of_a_launch_file_sees_arguments_that_were_given(tmp_path: Path) -> None:
    path = tmp_path / "many.launch.py"
    path.write_text(
        f"{HEAD}from launch_ros.actions import Node\nfrom launch.substitutions import LaunchConfiguration\n"
        "def nodes(context):\n"
        "    count = int(LaunchConfiguration('count').perform(context))\n"
        "    return [Node(package='a', executable='b', name=f'b{n}') for n in range(count)]\n"
        "def generate_launch_description():\n"
        "    return LaunchDescription([DeclareLaunchArgument('count'), OpaqueFunction(function=nodes)])\n"
    )
    (tmp_path / "all.launch.xml").write_text(
        '<launch><include file="many.launch.py"><arg name="count" value="3"/></include></launch>'
    )
    found = import_files([tmp_path / "all.launch.xml"], program="launch")
    assert [*components(found)] == ["b0", "b1", "b2"]
