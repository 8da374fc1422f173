"""A name is found in all files of a project and renamed there; what cannot be right is refused with the reason."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.plan.dump import dump
from rbxcompose.manifest.section import ROBOT
from rbxcompose.tools.lsp.mentions import (
    ManifestMentions,
    Mention,
    MissionMentions,
    SymbolIndex,
    TrialMentions,
    symbol_index_references,
)
from rbxcompose.tools.lsp.project_files import ProjectFiles, Symbol
from rbxcompose.tools.lsp.rename import CannotRenameError, Renamed, compiler, prepare, rename
from tests.conftest import ROOT
from tests.soak import Soak

SOME = ("turtlebot", "patroller", "rooms", "rover", "twins")
RARE = ("box_robot",)  # it has many profiles, each with another body
FRESH = "zqjxw"  # letters of which some makes a new name out of any other
_WORD = re.compile(r"[\w.]+")


class Names:
    """The names of a project, asked about by the text around them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        robots = self._files().of_kind(ROBOT)  # without findings, also in their profiles
        self.before = {path: compile_robot(str(path), environment={}) for path in robots}
        self.plans = {path: dump(made.plan) for path, made in self.before.items() if made.plan}
        self.after: dict[tuple[Path, int], Compilation] = {}
        self.index = SymbolIndex(self._files(), lambda path: self.before[path].robot)

    def _files(self) -> ProjectFiles:
        return ProjectFiles(self.folder / "robots/turtlebot/robot.yaml", lambda path: path.read_text(encoding="utf-8"))

    def made_of(self, robot: Path) -> set[Path]:
        """Return the files of a robot, its parts and its missions."""
        within = {*self.index.files.within(robot)}
        return within | {mission for one in within for _, mission in self.index.files.missions(one)}

    def compiled(self, robot: Path, texts: Mapping[Path, str]) -> Compilation:
        """Return a robot with other texts; it is compiled once for each that changes it."""
        beside = {path for path in self.index.files.all if path.parent == robot.parent}
        own, text_of = self.made_of(robot) | beside, self.index.files.text
        if all(text_of(path) == text for path, text in texts.items() if path in own):
            return self.before[robot]
        key = robot, hash(tuple(sorted(texts.items())))
        if key not in self.after:
            self.after[key] = compiler({}, {})(robot, texts)
        return self.after[key]

    def at(self, file: str, words: str) -> tuple[Path, int, int]:
        """Return the position of the bar in some words of a file."""
        path = (self.folder / file).resolve()
        before, _, after = words.partition("|")
        text = self.index.files.text(path)
        assert before + after in text
        return path, *self.index.files.places(path).position(text.index(before + after) + len(before))

    def rename(self, file: str, words: str, new: str) -> Renamed:
        return rename(self.index, *self.at(file, words), new, self.compiled)

    def refusal(self, file: str, words: str, new: str = "other") -> str:
        with pytest.raises(CannotRenameError) as told:
            self.rename(file, words, new)
        return str(told.value)

    def lines(self, made: Renamed) -> dict[str, list[str]]:
        """Return the lines that a rename changed, by file."""
        found = {}
        for path, changes in made.changes.items():
            lines = made.texts[path].split("\n")
            numbers = sorted({change.start[0] for change in changes})
            found[path.relative_to(self.folder).as_posix()] = [lines[number].strip() for number in numbers]
        return found


def copied(folder: Path, *robots: str) -> Path:
    """Copy some robots into a folder, with the missions that they have and the tests of those."""
    for robot in robots:
        shutil.copytree(ROOT / f"robots/{robot}", folder / f"robots/{robot}")
    written = "".join(path.read_text(encoding="utf-8") for path in folder.glob("robots/*/*.yaml"))
    for name in dict.fromkeys(re.findall(r"missions/(\w+)\.yaml", written)):
        for file in (f"missions/{name}.yaml", f"missions/tests/{name}.test.yaml"):
            if (ROOT / file).exists():
                (folder / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / file, folder / file)
    return folder


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory, soak: Soak) -> Names:
    """The project without its robots that have an arm: each of those takes as long as all of these."""
    folder = copied(tmp_path_factory.mktemp("project"), *SOME, *(RARE if soak.is_on else ()))
    shutil.copytree(ROOT / "parts", folder / "parts")
    for path in folder.glob("robots/*/*.yaml"):
        path.write_text(path.read_text(encoding="utf-8").replace("rbx:parts/", "../../parts/"), encoding="utf-8")
    return Names(folder)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    return copied(tmp_path, "turtlebot")


def test_the_names_of_a_part_are_found_behind_the_names_of_its_instances(shipped: Names) -> None:
    found = symbol_index_references(
        shipped.index, *shipped.at("parts/battery.yaml", "values:\n  |level:"), with_definitions=True
    )
    places = [f"{reference.file.relative_to(shipped.folder).as_posix()}:{reference.start}" for reference in found]
    assert sum(place.startswith("missions/haul.yaml") for place in places) == 2  # $drive_level and $lift_level
    assert sum(place.startswith("parts/battery.yaml") for place in places) == 2
    others = symbol_index_references(
        shipped.index, *shipped.at("parts/battery.yaml", "values:\n  |level:"), with_definitions=False
    )
    assert len(others) == len(found) - 1


def test_an_instance_is_renamed_in_all_names_that_begin_with_it(shipped: Names) -> None:
    made = shipped.rename("robots/twins/robot.yaml", "  |lift:\n", "hoist")
    assert shipped.lines(made) == {
        "missions/haul.yaml": ["when: $hoist_level < $low"],
        "robots/twins/robot.yaml": ["hoist:", "hoist_battery:"],
    }


def test_a_place_is_renamed_in_all_robots_that_share_a_mission(shipped: Names) -> None:
    found = shipped.lines(shipped.rename("missions/patrol.yaml", "[corner_1, corner|_2", "far"))
    assert {"robots/turtlebot/robot.yaml", "robots/patroller/robot.yaml"} <= found.keys()
    assert found["missions/patrol.yaml"] == ["in: [corner_1, far, corner_3, corner_4]"]
    assert "robots/rover/robot.yaml" not in found  # it has places of these names, but none of these missions
    assert "missions/tests/patrol.test.yaml" in found


def test_a_place_is_renamed_where_data_are_made_of_places_but_not_in_texts(shipped: Names) -> None:
    found = shipped.lines(shipped.rename("robots/rooms/robot.yaml", "  |kitchen: {", "galley"))
    assert found["missions/clean_house.yaml"] == ["galley:"]
    assert found["missions/clean_house_machine.yaml"] == ["go_to: galley"]  # its state and its text stay


def test_an_argument_is_renamed_in_its_part_and_where_it_is_given(shipped: Names) -> None:
    found = shipped.lines(shipped.rename("parts/battery.yaml", "${args.|runtime}", "lasts"))
    assert found["parts/battery.yaml"] == ["lasts:", "runtime: ${args.lasts}"]
    assert found["robots/twins/robot.yaml"] == ["lasts: 60 s", "lasts: 90 s", "lasts: 45 s"]
    assert found["robots/rooms/robot.yaml"] == ["lasts: ${args.runtime}"]


def test_a_state_a_loop_and_an_input_are_renamed_where_they_are_meant(shipped: Names) -> None:
    machine = "missions/patrol_machine.yaml"
    assert shipped.lines(shipped.rename(machine, "    |dock:\n", "home")) == {
        machine: ["low: home", "home:"],
        "missions/tests/patrol_machine.test.yaml": ["- home"],
    }
    room = shipped.lines(shipped.rename("missions/clean_house.yaml", "restart: |room", "place"))
    assert room["missions/clean_house.yaml"][:2] == [
        "restart: place                   # drive back to the room before the next chore",
        "for: place",
    ]
    given = shipped.lines(shipped.rename("missions/patrol.yaml", "repeat: $|rounds", "turns"))
    assert given["missions/tests/patrol.test.yaml"] == ["turns: 1"]


@pytest.mark.parametrize(
    ("file", "words", "new", "reason"),
    [
        ("missions/patrol.yaml", "- |recharge", "load", "names from plug-ins, such as types and skills"),
        ("robots/turtlebot/robot.yaml", "type: |charger", "load", "names from plug-ins, such as types and skills"),
        ("missions/patrol.yaml", "|repeat: $", "load", "words of the language"),
        ("missions/patrol.yaml", "a corner that |cannot", "load", "there is no name"),
        ("robots/turtlebot/robot.yaml", "  |cmd_vel:", "load", "is a topic"),
        ("robots/turtlebot/robot.yaml", "  |dock: {", "Home", "write 'home'"),
        ("robots/turtlebot/robot.yaml", "  |dock: {", "9", "names start with a lower-case letter"),
        ("robots/turtlebot/robot.yaml", "  |dock: {", "corner_1", "'corner_1' is taken"),
        ("missions/patrol.yaml", "$|low", "battery", "then `check` would say"),
        ("missions/patrol_machine.yaml", "    |count:\n", "finished", "a state cannot be named 'finished'"),
        pytest.param(
            *("robots/box_robot/robot.yaml", "  |base: ..", "chassis", "then `check` would say"), marks=pytest.mark.soak
        ),
    ],
)
def test_what_cannot_be_right_is_refused_with_the_reason(
    shipped: Names, file: str, words: str, new: str, reason: str
) -> None:
    assert reason in shipped.refusal(file, words, new)


def test_what_the_library_brings_is_refused(tmp_path: Path) -> None:
    names = Names(copied(tmp_path, "rooms", "turtlebot"))
    assert "does not belong to this project" in names.refusal("robots/rooms/robot.yaml", "battery_|battery.")
    assert names.lines(names.rename("robots/rooms/robot.yaml", "values:\n  |battery:", "charge"))


def test_a_name_of_several_meanings_and_a_folded_text_are_refused(project: Path) -> None:
    mission = project / "missions/patrol.yaml"
    text = mission.read_text(encoding="utf-8")
    mission.write_text(text.replace("afterwards: continue", "afterwards: {restart: corner}") + "      name: corner\n")
    assert "several meanings (item, node)" in Names(project).refusal("missions/patrol.yaml", "for: |corner")
    folded = 'when: "$battery < \\\n      $\\x6cow"'
    mission.write_text(text.replace("when: $battery < $low", folded))
    assert "folded or has escapes" in Names(project).refusal("missions/patrol.yaml", "  |low:\n")


def test_comments_quotes_and_line_ends_stay(project: Path) -> None:
    mission = project / "missions/patrol.yaml"
    text = mission.read_text(encoding="utf-8").replace("$battery < $low", '"$battery < $low"  # not below low')
    mission.write_text(text + "# low\n", encoding="utf-8")
    made = Names(project).rename("missions/patrol.yaml", "  |low:\n", "least")
    new = made.texts[mission]
    assert new == text.replace("  low:\n", "  least:\n").replace("< $low", "< $least") + "# low\n"


def test_an_overlay_a_local_part_and_its_patterns_follow(project: Path) -> None:
    robot, overlay = project / "robots/turtlebot/robot.yaml", project / "robots/turtlebot/slow.yaml"
    part = project / "parts/lamp.yaml"
    part.parent.mkdir()
    part.write_text(
        "rbx: 1\nkind: Part\nname: lamp\ncomponents:\n  cell: {type: battery_sim, runtime: 9 s}\n"
        "values:\n  left: cell.battery_level\nprovides:\n  values: [left]\n"
    )
    text = robot.read_text(encoding="utf-8").replace("match: [base,", "match: [front_*, base,")
    included = "include:\n  front:\n    part: ../../parts/lamp.yaml\n    connect: {battery_level: lamp}\n\ncomponents:"
    robot.write_text(text.replace("\ncomponents:", f"\n{included}", 1), encoding="utf-8")
    header = "rbx: 1\nkind: Overlay\nname: slow\n"
    overlay.write_text(f"{header}components:\n  go_to:\n    speed: ${{args.speed / 2}}\n  front_cell: {{warn: 40 %}}\n")
    names = Names(project)
    file = "robots/turtlebot/slow.yaml"
    assert names.lines(names.rename("robots/turtlebot/robot.yaml", "  |go_to:\n", "drive"))[file] == ["drive:"]
    assert names.lines(names.rename(file, "${args.|speed", "pace"))[file] == ["speed: ${args.pace / 2}"]
    assert names.lines(names.rename("parts/lamp.yaml", "  |cell: {", "battery"))[file] == [
        "front_battery: {warn: 40 %}"
    ]
    assert names.lines(names.rename("parts/lamp.yaml", "[|left]", "rest"))["parts/lamp.yaml"] == [
        "rest: cell.battery_level",
        "values: [rest]",
    ]
    found = names.lines(names.rename("robots/turtlebot/robot.yaml", "  |front:\n", "rear"))
    assert found["robots/turtlebot/robot.yaml"] == ["match: [rear_*, base, go_to, cmd_vel]", "rear:"][::-1]
    assert found[file] == ["rear_cell: {warn: 40 %}"]


def fresh(names: Names, old: str) -> str:
    """Return a name of the same length that is nowhere: columns are in plans, too."""
    texts = [names.index.files.text(path) for path in names.index.files.all]
    found = (f"{old[:-length]}{letter * length}" for length in (1, 2) for letter in FRESH)
    return next(new for new in found if len(new) == len(old) and not any(new in text for text in texts))


def check_renaming(names: Names, symbol: Symbol) -> None:
    """Check that a rename changes nothing but a name, and that renaming back restores each byte."""
    files, new = names.index.files, fresh(names, symbol.name)
    mention = next(
        (candidate for candidate in names.index.of(symbol) if candidate.is_definition), names.index.of(symbol)[0]
    )
    place = files.places(mention.file).position(mention.start)
    try:
        prepare(names.index, mention.file, *place)
        made = rename(names.index, mention.file, *place, new, names.compiled)
    except CannotRenameError as error:
        # All others can be renamed. What an instance brings is called after it, also where names are not followed.
        assert symbol.sort == "include" or "is a topic" in str(error) or "base_footprint" in str(error)  # noqa: PT017
        return
    for path, text in made.texts.items():
        assert text.replace(new, symbol.name) == files.text(path)
    for robot, before in names.before.items():
        if not names.made_of(robot).isdisjoint(made.texts):
            after = names.compiled(robot, made.texts)
            assert [finding.code for finding in after.report] == [finding.code for finding in before.report]
            assert after.plan is not None
            text = dump(after.plan).replace(new, symbol.name)
            assert sorted(_WORD.findall(text)) == sorted(_WORD.findall(names.plans[robot]))  # some order is theirs


@pytest.mark.timeout(200)  # a name that all robots have in common compiles all of them
def test_after_any_rename_a_robot_is_the_same_but_for_the_name(shipped: Names, soak: Soak) -> None:
    names = Names(ROOT) if soak.is_on else shipped
    symbols = sorted(names.index.symbols, key=str)

    @settings(
        max_examples=400 if soak.is_on else 1,
        derandomize=not soak.is_on,  # some names take a hundred times as long as others
        deadline=None,
        suppress_health_check=[HealthCheck.function_scoped_fixture],
    )
    @given(st.sampled_from(symbols))
    def holds(symbol: Symbol) -> None:
        check_renaming(names, symbol)

    holds()


@given(st.data())
def test_texts_that_are_being_typed_make_no_trouble(shipped: Names, data: st.DataObject) -> None:
    files = ("robots/turtlebot/robot.yaml", "missions/patrol_machine.yaml", "missions/tests/patrol.test.yaml")
    path = shipped.folder / data.draw(st.sampled_from(files))
    text = path.read_text(encoding="utf-8")
    cut, end = sorted((data.draw(st.integers(60, len(text))), data.draw(st.integers(60, len(text)))))
    typed = text[:cut] + data.draw(st.text("ab:-{}[]\"'$ \n#|>&*!?%@", max_size=4)) + text[end:]
    files_typed = ProjectFiles(
        path, lambda candidate: typed if candidate == path else candidate.read_text(encoding="utf-8")
    )
    made = MENTIONS.get(files_typed.kind(path))
    mentions = made(files_typed, path) if made else ()
    assert all(typed[mention.start : mention.end] == mention.symbol.name for mention in mentions if mention.start >= 0)


MENTIONS: dict[str, Callable[[ProjectFiles, Path], Iterable[Mention]]] = {
    "Robot": lambda files, path: ManifestMentions(files, path).all(),
    "Mission": lambda files, path: MissionMentions(files, path, {}).all(),
    "Test": lambda files, path: (
        TrialMentions(files, path, robot, {}).all() if (robot := files.file_named(path, "robot")) else ()
    ),
}
