"""Compiles a system: reads its file, compiles its robots, places their components, and checks the whole."""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbxcompose import __version__
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Span, kind, needed, one_compile
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.composition.layers import chosen_profiles
from rbxcompose.compiler.composition.overlay import SET, compose, settled
from rbxcompose.compiler.model.robot import NOTHING, Outside, Robot, RobotComponent
from rbxcompose.compiler.model.robot import resolve as absolute
from rbxcompose.compiler.model.skills import served_skills
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.certificates import NO_SECURITY
from rbxcompose.compiler.systems.model import (
    PORTS,
    HostOffer,
    PlacedRobot,
    System,
    Wishes,
    hosts_called,
    labels_of,
    next_port,
    place,
)
from rbxcompose.compiler.systems.neighbours import (
    PLACE_IN_WORLD,
    ROBOTS_IN_WORLD,
    ports_of,
    with_free_ports,
    with_others,
)
from rbxcompose.compiler.systems.rules import UNKNOWN_HOST, system_findings
from rbxcompose.compiler.systems.share import shared_name
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.files import PREFIX, PROFILE, find, resolve, shown_name
from rbxcompose.manifest.fill import fill, names_of
from rbxcompose.manifest.reader import Texts
from rbxcompose.manifest.section import SYSTEM, help_with_names
from rbxcompose.manifest.system_file import LINKS, PROFILES, SECTIONS, SystemFile, SystemRobotModel
from rbxcompose.manifest.tree import MappingNode, SequenceNode, entries_of, key_span, text_at, value_span, without
from rbxcompose.manifest.validate import MISSING_KEY, WRONG_TYPE, label_of, validate
from rbxcompose.missions.sources import SkillWay
from rbxcompose.sdk.capabilities import ConnectedBy
from rbxcompose.sdk.ports import Serves

NOTHING_TO_PLACE = kind("RBX6101", is_fixable=True)
SAME_NAME = kind("RBX6131")
BROKEN_ROBOT = kind("RBX6102")


def served_outside(components: Mapping[str, RobotComponent], robot: str, names: Mapping[str, str]) -> Outside:
    """Return the services and actions of a robot as others have them; `names` are those that they have for its own.

    A goal of another robot cannot be held, only cancelled and sent again, and takes a part of that robot.
    """
    ends = [end for component in components.values() for end in component.ends if end.topic in names]
    services = {names[end.topic]: end.type_name for end in ends if isinstance(end.port, Serves)}
    sources = [skill for skill in served_skills(components) if skill.topic in names and skill.way is not SkillWay.TOPIC]
    skills = [
        replace(
            source,
            topic=names[source.topic],
            skill=replace(
                source.skill,
                name=f"{robot}/{source.skill.name}",
                pausable=False,
                claims=source.skill.claims and f"{robot}/{source.skill.claims}",
            ),
        )
        for source in sources
    ]
    return Outside(frozenset(names.values()), services, tuple(skills))


def joined(parts: Iterable[Outside]) -> Outside:
    """Return all of it."""
    every = list(parts)
    return Outside(
        frozenset(name for part in every for name in part.names),
        {name: type_ for part in every for name, type_ in part.services.items()},
        tuple(skill for part in every for skill in part.skills),
    )


_APART = 1000  # from the port of a robot's links to that of what it shares


def compile_system(
    path: str,
    *,
    environment: Mapping[str, str],
    real: bool = False,
    profiles: Sequence[str] = (),
    unsaved: Mapping[Path, str] = MappingProxyType({}),
    tries_profiles: bool = False,
) -> System:
    """Compile the file of a system with these of its profiles; report all its mistakes, and those of its robots.

    `unsaved` are texts from an editor, by the real path of the file that each replaces. With `tries_profiles`, each
    profile is tried as well if none was chosen.
    """
    out = _compiled_system(path, environment, real, profiles, unsaved)
    for name in out.known_profiles if tries_profiles and not profiles else ():
        tried = _compiled_system(path, environment, real, [name], unsaved)
        out.report.extend(out.report.new_among(tried.report))
        out.sources.update(tried.sources)
    return out


@one_compile()
def _compiled_system(
    path: str, environment: Mapping[str, str], real: bool, profiles: Sequence[str], unsaved: Mapping[Path, str]
) -> System:
    out = System(profiles=tuple(profiles), sources=Texts(unsaved))
    file = find(path)
    if isinstance(file, Finding):
        out.report.add(file)
        return out
    documents = Documents(out.report, out.sources)
    root = documents.read(file, SYSTEM)
    if root is None:
        return out
    out.root = root = documents.meant(SystemFile, root)
    out.root = root = documents.placed(SystemFile, root, {**SECTIONS, **LINKS})
    documents.check(SystemFile, root)
    root, overlays = _with_profiles(root, out, documents)
    out.root = root = fill(root, names_of(text_at(root.get("name")), not real, environment), out.report)
    out.path, out.name, out.security = file, text_at(root.get("name")), text_at(root.get("security")) or NO_SECURITY
    sections = {key: _section(key, model, out, overlays) for key, model in SECTIONS.items()}
    if sections["hosts"] is None or sections["robots"] is None:
        return out
    out.hosts = sections["hosts"]
    if "links" in root:
        out.links = validate(LINKS["links"], root.entries["links"].value, ("links",), out.report) or {}
    members = list(_members(sections["robots"], out))
    out.labels = {member.name: labels_of(member.name, member.entry, member.model) for member in members}
    members = in_one_world(members, out, real=real)
    seen: dict[str, _Member] = {}
    for member in members:
        if (other := seen.setdefault(member.name, member)) is not member:
            span = key_span(out.root, ("robots", max(member.entry, other.entry, key=len)))
            message = f"'{other.entry}' and '{member.entry}' both make a robot '{member.name}'"
            out.report.add(SAME_NAME.at(span, message, help="give one of them another name"))
    compiling = _Compiling(out, environment, real, unsaved)
    compiling.outside = joined(compiling.given(one) for one in members)
    for member in members:
        if (robot := _placed_robot(member, out, compiling)) is not None:
            out.robots[member.name] = robot
    with_others(out.robots)
    out.needed |= needed()
    if len(out.robots) == len(members):
        out.report.extend(system_findings(out))
    return out


@dataclass(frozen=True, slots=True)
class _Member:
    """A robot of a system: its name, its key in the file, and what stands there."""

    name: str
    entry: str
    model: SystemRobotModel
    world: str = ""  # what `--set world=` gives it; empty if it is not in the system's world


def in_one_world(members: Sequence[_Member], out: System, *, real: bool) -> list[_Member]:
    """Return the robots of a system, those with a `spawn` in its world, where they tell each other where they are."""
    there = [member.name for member in members if member.model.spawn]
    file = text_at(out.root.get("world"))
    for entry in dict.fromkeys(member.entry for member in members if member.model.spawn and not file):
        span = value_span(out.root, ("robots", entry, "spawn"))
        out.report.add(MISSING_KEY.at(span, "a robot with a 'spawn' needs a 'world' of the system"))
    if real or not file:
        return list(members)
    path = resolve(file, out.path or Path(), value_span(out.root, ("world",)))
    if isinstance(path, Finding):
        out.report.add(path)
        return list(members)
    return [_put_there(member, str(path), there) if member.model.spawn else member for member in members]


def _put_there(member: _Member, file: str, robots: Sequence[str]) -> _Member:
    spawn, name = member.model.spawn[0], member.name
    world = json.dumps({"file": file, "spawn": spawn, "robot": name, "robots": robots})
    topic = ROBOTS_IN_WORLD if name == robots[0] else PLACE_IN_WORLD
    share = (*member.model.share, topic) if len(robots) > 1 else member.model.share
    return replace(member, model=member.model.model_copy(update={"share": share}), world=world)


def _members(robots: Mapping[str, SystemRobotModel], out: System) -> Iterator[_Member]:
    """Yield each robot; those of several instances take the hosts of a label in turn."""
    facts = {key: HostOffer(frozenset(host.labels)) for key, host in out.hosts.items()}

    def turned(called: str, number: int) -> str:
        found = hosts_called(called, facts)
        return found[number % len(found)] if found else called

    for entry, model in robots.items():
        if model.instances == 1:
            yield _Member(entry, entry, model)
            continue
        for number in range(model.instances):
            own = {
                "on": turned(model.on, number) if model.on else None,
                "spawn": model.spawn and (model.spawn[number % len(model.spawn)],),
                "place": {key: turned(called, number) for key, called in model.place.items()},
                "link_port": model.link_port + number if model.link_port else None,
                "share_port": model.share_port + number if model.share_port else None,
            }
            yield _Member(f"{entry}_{number + 1}", entry, model.model_copy(update=own))


Overlays = list[tuple[MappingNode, str]]  # profiles, each with its name for findings


def _with_profiles(root: MappingNode, out: System, documents: Documents) -> tuple[MappingNode, Overlays]:
    """Return a system changed by the profiles that were chosen, in the order of the command, and these."""
    there = root.get("profiles")
    own = without(root, "profiles")
    if there is not None and validate(PROFILES["profiles"], there, ("profiles",), out.report) is None:
        return own, []
    named = entries_of(there)
    out.known_profiles = tuple(named)
    overlays = [(node, f"profile '{name}'") for name, node in chosen_profiles(out.profiles, named, "system", documents)]
    return compose(settled(own, out.report), overlays, out.report) if overlays else own, overlays


def _section(key: str, model: Any, out: System, overlays: Overlays) -> Any:
    node = out.root.get(key)
    if not isinstance(node, MappingNode) or not node.entries:
        span = key_span(out.root, (key,)) if key in out.root else out.root.span
        if isinstance(node, SequenceNode) and node.items:
            message = f"'{key}' must be a map with a name for each entry"
            out.report.add(WRONG_TYPE.at(span, message, label=label_of(node), help=help_with_names(node)))
            return None
        what = "the machines" if key == "hosts" else "the robots and where they run"
        message = f"a system needs '{key}': {what}"
        for overlay, name in overlays:
            if key in overlay.entries:
                span, message = overlay.entries[key].key.span, f"{name} leaves no '{key}', which a system needs: {what}"
        out.report.add(MISSING_KEY.at(span, message))
        return None
    return validate(model, node, (key,), out.report)


@dataclass(slots=True)
class _Compiling:
    """Compiles robots, each file with each profile once; `outside` is what robots of the system share."""

    out: System
    environment: Mapping[str, str]
    real: bool
    unsaved: Mapping[Path, str]
    outside: Outside = NOTHING
    done: dict[tuple[str, str | None, str], Compilation] = field(default_factory=dict)
    alone: dict[tuple[str, str | None, str], Robot | None] = field(default_factory=dict)

    def given(self, member: _Member) -> Outside:
        """Return what a robot shares; one that others may call is compiled for that, without what they share."""
        model = member.model
        file = self._file(member.entry, model) if model.callers else None
        if not isinstance(file, str):
            return Outside(frozenset(shared_name(member.name, text) for text in model.share))
        key = file, model.profile, member.world
        if key not in self.alone:
            self.alone[key] = self._compile(*key, NOTHING).robot
        robot = self.alone[key]
        space = robot.manifest.bus.namespace or "" if robot else ""
        names = {absolute(text, space): shared_name(member.name, text) for text in model.share}
        return served_outside(robot.components if robot else {}, member.name, names)

    def _file(self, entry: str, model: SystemRobotModel) -> str | Finding:
        """Return the file of a robot as findings show it."""
        span = value_span(self.out.root, ("robots", entry, "robot"))
        if model.robot.startswith(PREFIX):
            return model.robot
        file = resolve(model.robot, self.out.path or Path(), span, may_be_robot=True)
        return file if isinstance(file, Finding) else shown_name(file)

    def _compile(self, file: str, profile: str | None, world: str, outside: Outside) -> Compilation:
        return compile_robot(
            file,
            profiles=[profile] if profile else [],
            sets=[f"world={world}"] if world else [],
            real=self.real,
            environment=self.environment,
            unsaved=self.unsaved,
            outside=outside,
        )

    def robot(self, member: _Member) -> Compilation | None:
        """Return a robot; None after a finding that there is no such file."""
        model, entry = member.model, member.entry
        out, span = self.out, value_span(self.out.root, ("robots", entry, "robot"))
        shown = self._file(entry, model)
        if isinstance(shown, Finding):
            out.report.add(shown)
            return None
        key = shown, model.profile, member.world
        if key not in self.done:
            places = {PROFILE: ("profile",), SET: ("spawn",)}
            places_there = {file: value_span(out.root, ("robots", entry, *keys)) for file, keys in places.items()}
            self.done[key] = self._compiled(*key, places_there)
        compilation = self.done[key]
        if compilation.plan is None:
            message = f"the robot '{shown}' has errors, so the system cannot run it"
            out.report.add(BROKEN_ROBOT.at(span, message, help="see the findings of the robot"))
        return compilation

    def _compiled(self, shown: str, profile: str | None, world: str, places: Mapping[str, Span]) -> Compilation:
        """Return a robot; what is wrong with what the system gives it is a finding at one of the `places`."""
        compilation = self._compile(shown, profile, world, self.outside)
        self.out.sources.update((file, text) for file, text in compilation.sources.items() if file not in places)
        self.out.needed |= compilation.needed
        moved = (
            replace(one, span=places[one.span.file]) if one.span is not None and one.span.file in places else one
            for one in compilation.report
        )
        self.out.report.extend(self.out.report.new_among(moved))
        return compilation


def _placed_robot(member: _Member, out: System, compiling: _Compiling) -> PlacedRobot | None:
    """Return a robot with its placement; None after findings."""
    name, entry, model = member.name, member.entry, member.model
    compilation = compiling.robot(member)
    robot, plan = (compilation.robot, compilation.plan) if compilation else (None, None)
    if compilation is None or robot is None or plan is None:
        return None
    taken = {other.plan.bus.port for other in out.robots.values()}
    bus = replace(plan.bus, port=next_port(plan.bus.port, taken))
    plan, link_port = replace(plan, robot=name, bus=bus), _link_port(model, plan, out)
    plan = with_free_ports(plan, {port for robot in out.robots.values() for port in ports_of(robot.plan)})
    names = [instance.name for instance in plan.instances]
    parts = {key: part.components for key, part in robot.manifest.parts.items()}
    problems = list(_wrong_wishes(entry, model, out, {*names, *parts}))
    out.report.extend(problems)
    if problems:
        return None
    ports = robot.declared(ConnectedBy)
    devices = {component.name: {connected.name} for component, connected in ports}
    facts = {
        key: HostOffer(frozenset(host.labels), frozenset(port.name for _, port in ports if port.is_among(host.devices)))
        for key, host in out.hosts.items()
    }
    placed = place(names, facts, Wishes(model.on, model.place), parts, devices)
    share_port = model.share_port or (link_port + _APART) % PORTS or _APART
    version = _version(compilation, out)
    return PlacedRobot(name, entry, model, robot, plan, placed, link_port, share_port, version)


def _wrong_wishes(name: str, model: SystemRobotModel, out: System, known: Iterable[str]) -> Iterator[Finding]:
    """Yield a finding for each wish that names a host, component or part that does not exist."""
    labels = {label for host in out.hosts.values() for label in host.labels}
    facts = {key: HostOffer(frozenset(host.labels)) for key, host in out.hosts.items()}
    on = {("on",): model.on} if model.on else {}
    placed = {("place", key): called for key, called in model.place.items()}
    for keys, called in [*on.items(), *placed.items()]:
        if not hosts_called(called, facts):
            span = value_span(out.root, ("robots", name, *keys))
            message = f"'{called}' is neither a host of this system nor a label of one"
            yield UNKNOWN_HOST.misspelt(span, message, called, [*out.hosts, *sorted(labels)], "hosts")
    for key in model.place:
        if key not in known:
            span = key_span(out.root, ("robots", name, "place", key))
            message = f"the robot '{name}' has neither a component nor a part '{key}'"
            yield NOTHING_TO_PLACE.misspelt(span, message, key, sorted(known), "its components and parts")


def _link_port(model: SystemRobotModel, plan: Plan, out: System) -> int:
    """Return the port of the robot's links: its own, or the next one that no robot before it has."""
    if model.link_port is not None:
        return model.link_port
    taken = {robot.link_port for robot in out.robots.values()}
    return next_port(plan.bus.port, taken)


def _version(compilation: Compilation, out: System) -> str:
    """Return what all hosts of a robot must have in common: the version of rbxcompose, and the texts of its files."""
    chosen = " ".join(out.profiles).encode()
    texts = sorted(hashlib.sha256(text.encode()).hexdigest() for text in compilation.sources.values())
    return f"{__version__} {hashlib.sha256(''.join(texts).encode() + chosen).hexdigest()[:16]}"
