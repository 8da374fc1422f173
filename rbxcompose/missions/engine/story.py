"""The story of a mission: one line of text per event, and how often each skill ended with each result."""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import assert_never

from rbxcompose.base.levels import LOG_LEVELS, Level
from rbxcompose.base.units import format_number
from rbxcompose.missions.engine import events
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.program.program import RESTART

RESULTS = {"success": Level.OK, "halted": Level.OK, "failure": Level.WARN}


class MissionStory:
    """Tells the story of one mission.

    `heading` returns the number and the sentence by which people know a node: `1.2 Go to dock`; empty if it has none.
    """

    def __init__(self, mission: str, heading: Callable[[int], str] = lambda node: "") -> None:
        self._mission, self._heading = mission, heading
        self._named: set[int] = set()  # nodes that were told by their sentence before their skill was started
        self._labels: dict[int, str] = {}  # what each leaf did last: `go_to corner_1`
        self._results: dict[str, Counter[str]] = {}

    def renumber(self, nodes: Mapping[int, int]) -> None:
        """Take other numbers for leaves, since the mission has changed."""
        self._labels = {nodes[leaf]: label for leaf, label in self._labels.items() if leaf in nodes}
        self._named = {nodes[number] for number in self._named if number in nodes}

    def line(self, event: events.MissionEvent) -> tuple[Level, str]:
        """Return how bad an event is, and its line, which is empty if other events say the same."""
        match event:
            case events.SkillStarted(leaf=leaf, text=text):
                self._labels[leaf] = text
                return Level.OK, text if leaf in self._named else _told(self._heading(leaf), text)
            case events.SkillEnded(leaf=leaf, skill=skill, result=result, duration=duration, message=message):
                self._results.setdefault(skill, Counter())[result] += 1
                text = f"{self._labels.get(leaf, skill)}: {result} ({format_number(round(duration, 1))} s)"
                return RESULTS.get(result, Level.OK), _with(text, message)
            case events.InterruptStarted(name=name, condition=condition, shown=shown):
                values = ", ".join(f"{name} {value}" for name, value in shown.items())
                return Level.OK, f"interrupt {name}: {condition}" + (f" ({values})" if values else "")
            case events.InterruptEnded(name=name, afterwards=afterwards, back_to=leaves, restarted=restarted):
                back = " and ".join(self._labels[leaf] for leaf in leaves if leaf in self._labels)
                return Level.OK, f"interrupt {name} done" + _afterwards(afterwards, back, restarted)
            case events.NodeStarted(node=node, name=name, is_state=is_state):
                self._named.add(node)
                return Level.OK, self._heading(node) or (f"state {name}" if is_state else f"{name} begins")
            case events.NodeEnded(name=name, result=result, is_state=is_state):
                return Level.OK, "" if is_state else f"{name}: {result}"
            case events.BranchEnded(name=name, result=result):
                return Level.OK, f"branch {name}: {result}"
            case events.Transition(state=state, outcome=outcome, to=to):
                return Level.OK, f"{state}: {outcome}, on to {to}"
            case events.Published(topic=topic, fields=fields):
                return Level.OK, f"published on {topic}: {show(None, fields)}"
            case events.Logged(level=level, text=text):
                return LOG_LEVELS[level], text
            case events.Reported(place=place, message=message):
                return Level.WARN, f"{place}: {message}"
            case events.Stopped(node=node, place=place, text=name, after=after):
                text = self._heading(node) or name
                return Level.OK, f"stopped at {place}, {f'after {text}: {after}' if after else f'before {text}'}"
            case events.Intervened(text=text):
                return Level.WARN, f"by hand: {text}; the run cannot be reproduced without this"
            case events.MissionEnded(result=result):
                text = f"mission {self._mission}: {result}"
                otherwise = Level.WARN if event.doubt else Level.OK
                return Level.ERROR if result == "failure" else otherwise, _with(text, event.words)
        assert_never(event)

    def skills(self) -> str:
        """Return how often each skill had each result: `go_to 12 (11 success, 1 failure), recharge 1 (1 success)`."""
        counted = []
        for skill, results in self._results.items():
            each = ", ".join(f"{results[result]} {result}" for result in sorted(results, key=_usual_first))
            counted.append(f"{skill} {results.total()} ({each})")
        return ", ".join(counted)


def _told(heading: str, text: str) -> str:
    """Return the sentence of a step, and the step itself if it says more, as what a name stands for now."""
    if not heading:
        return text
    words = _plain(heading.partition(" ")[2])  # perhaps with a name, or with what the step is to the one around it
    return heading if f": {words}".endswith(f": {_plain(text)}") else f"{heading}: {text}"


def _plain(text: str) -> str:
    return text.replace("_", " ").replace("'", "").casefold()


def _usual_first(result: str) -> tuple[int, str]:
    usual = list(RESULTS)
    return (usual.index(result) if result in usual else len(usual), result)


def _afterwards(afterwards: str, back: str, restarted: str) -> str:
    if afterwards == RESTART:
        return f", {restarted or 'the mission'} starts again"
    return f", back to {back}" if back else ""


def _with(text: str, message: str) -> str:
    return f"{text}: {message}" if message else text
