"""Pictures of missions: trees and machines as text, Mermaid, DOT and HTML."""

from __future__ import annotations

import json
from html.parser import HTMLParser

import pytest

from rbxcompose.commands.console import NotDoneError
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.program.program import RobotNames
from rbxcompose.missions.view.picture import MissionPicture, picture_from_data, picture_of, picture_to_data
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.inspection.mission_text import mission_dot, mission_lines, mission_mermaid, mission_text
from rbxcompose.tools.inspection.pages import mission_html
from tests.executive.fake_robot import program_of
from tests.inspection.pictures import undrawn

CORNERS = """
about: The four corners.
do:
  for: corner
  in: [corner, dock]
  do:
    go_to: $corner
    timeout: 10 s
"""
TOUR = """
name: tour
about: A machine with a tree in it, and an <interrupt>.
data:
  round: 0
interrupts:
  low:
    when: $battery < 50 %
    do: recharge
machine:
  start: drive
  states:
    drive:
      do:
        parallel:
          work:
            use: corners
          monitor:
            wait_for: $battery < 60 %
        succeed_when: any
      attempts: 3
      next:
        success: count
        failure: failed
    count:
      do:
        - set:
            round: $round + 1
        - if: $round > 1
          then:
            say: "enough: <b>"
          else:
            name: rest
            wait: 2 s
      next:
        success: finished
        failure: drive
"""
STATUSES = [RUNNING, SUCCESS, SUCCESS, RUNNING, FAILURE, SKIPPED, IDLE]
FORMATS = {"txt": mission_text, "mermaid": mission_mermaid, "dot": mission_dot, "html": mission_html}


def tour() -> MissionPicture:
    return picture_of(program_of(TOUR), RobotNames(missions={"corners": program_of(CORNERS)}))


@pytest.mark.parametrize("ending", FORMATS)
def test_a_picture_is_as_it_was(ending: str, golden: Golden) -> None:
    golden.check(f"mission.{ending}", undrawn(FORMATS[ending](tour())))


@pytest.mark.parametrize("ending", ["txt", "mermaid", "dot"])
def test_it_shows_how_each_node_stands(ending: str, golden: Golden) -> None:
    statuses = (STATUSES * 4)[: tour().count]
    golden.check(f"mission_live.{ending}", FORMATS[ending](tour(), statuses))


def test_each_node_is_drawn_once() -> None:
    numbers = [one.number for root in tour().roots for one in root.all() if one.number is not None]
    assert sorted(numbers) == list(range(tour().count))


@pytest.mark.parametrize(
    ("text", "shown"), [("$round of <b>4</b>", "$round of <b>4</b>"), ("many words " * 9, f"{'many words ' * 5}ma...")]
)
def test_a_line_for_the_log_is_shown_with_its_text_shortened_if_it_is_long(text: str, shown: str) -> None:
    picture = picture_of(program_of(f'data: {{round: 0}}\ndo: {{log: "{text}"}}'), RobotNames())
    assert picture.main.title == f"log {shown}"


def test_each_hook_is_shown_by_its_name() -> None:
    program = program_of("do: {wait: 1 s, on_failure: {log: no}, on_halt: {log: halted}, timeout: 3 s}")
    assert picture_of(program, RobotNames()).main.notes == ("on failure", "on halt", "timeout 3 s")


def test_a_picture_passes_through_json() -> None:
    assert picture_from_data(json.loads(json.dumps(picture_to_data(tour())))) == tour()


def test_no_line_is_wider_than_the_terminal() -> None:
    assert max(map(len, mission_lines(tour(), STATUSES, width=30))) <= 30


class Tags(HTMLParser):
    """Counts tags that are open, and notes what the page would load."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.loads: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.loads += [str(value) for name, value in attrs if name in ("src", "href")]
        if tag not in ("meta",):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.loads += [str(value) for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_well_formed_and_loads_nothing() -> None:
    tags = Tags()
    tags.feed(mission_html(tour(), STATUSES))
    assert (tags.loads, tags.open) == ([], [])
    assert "<b>enough" not in mission_html(tour()).replace('<b class="', "")


def machine(count: int) -> MissionPicture:
    """Return the picture of a machine whose states each lead to the next and to another one."""
    rows = "".join(
        f"    s{n}: {{do: {{go_to: dock}}, next: {{success: s{(n + 1) % count}, failure: s{7 * n % count}}}}}\n"
        for n in range(count)
    )
    return picture_of(program_of(f"name: web\nmachine:\n  start: s0\n  states:\n{rows}"), RobotNames())


def test_a_machine_that_nobody_could_follow_is_not_laid_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.tools.inspection.pages.lay_out", None)
    with pytest.raises(NotDoneError, match="mission 'web' has too many transitions for a picture") as caught:
        mission_html(machine(200))
    assert caught.value.finding.code == "RBX9014"
    assert "s199" in mission_text(machine(200))
    assert "s199" in mission_dot(machine(200))


def test_a_machine_of_30_states_is_laid_out() -> None:
    assert "s29" in mission_html(machine(30))
