"""Compiles a system: reads its file, compiles its robots, places their components, and checks what crosses."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rbxcompose import __version__
from rbxcompose.compiler import Compilation, compile_robot
from rbxcompose.findings import Finding
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.files import find, resolve, shown_name
from rbxcompose.manifest.fill import fill
from rbxcompose.manifest.fill_names import names_of
from rbxcompose.manifest.library import PREFIX
from rbxcompose.manifest.section import SYSTEM
from rbxcompose.manifest.system_file import LINKS, SECTIONS, SystemFile, SystemRobotModel
from rbxcompose.manifest.tree import MappingNode, ScalarNode, key_span, value_span
from rbxcompose.manifest.validate import MISSING_KEY, validate
from rbxcompose.plan.model import Plan
from rbxcompose.sdk.capabilities import OpensPort
from rbxcompose.systems import codes
from rbxcompose.systems.certificates import NO_SECURITY
from rbxcompose.systems.model import PlacedRobot, System
from rbxcompose.systems.placement import HostOffer, Wishes, hosts_called, place
from rbxcompose.systems.rules import system_findings


def compile_system(path: str, *, environment: Mapping[str, str], real: bool = False) -> System:
    """Compile the file of a system and report all its mistakes, and those of its robots."""
    out = System()
    file = find(path)
    if isinstance(file, Finding):
        out.report.add(file)
        return out
    documents = Documents(out.report, out.sources)
    root = documents.read(file, SYSTEM)
    if root is None:
        return out
    out.root = root = documents.meant(SystemFile, root)
    documents.check(SystemFile, root)
    out.root = root = fill(root, names_of(_text(root, "name"), not real, environment), out.report)
    out.path, out.name, out.security = file, _text(root, "name"), _text(root, "security") or NO_SECURITY
    sections = {key: _section(key, model, out) for key, model in SECTIONS.items()}
    if sections["hosts"] is None or sections["robots"] is None:
        return out
    out.hosts = sections["hosts"]
    if "links" in root:
        out.links = validate(LINKS["links"], root.entries["links"].value, ("links",), out.report) or {}
    for name_, model in sections["robots"].items():
        if (robot := _placed_robot(name_, model, out, environment, real)) is not None:
            out.robots[name_] = robot
    if len(out.robots) == len(sections["robots"]):
        out.report.extend(system_findings(out))
    return out


def _text(root: MappingNode, key: str) -> str:
    value = root.get(key)
    return value.text if isinstance(value, ScalarNode) else ""


def _section(key: str, model: Any, out: System) -> Any:
    node = out.root.get(key)
    if not isinstance(node, MappingNode) or not node.entries:
        span = key_span(out.root, (key,)) if key in out.root else out.root.span
        what = "the machines" if key == "hosts" else "the robots and where they run"
        out.report.add(MISSING_KEY.at(span, f"a system needs '{key}': {what}"))
        return None
    return validate(model, node, (key,), out.report)


def _placed_robot(
    name: str, model: SystemRobotModel, out: System, environment: Mapping[str, str], real: bool
) -> PlacedRobot | None:
    """Return a robot with its placement; None after findings."""
    compilation = _compiled(name, model, out, environment, real)
    robot, plan = (compilation.robot, compilation.plan) if compilation else (None, None)
    if compilation is None or robot is None or plan is None:
        return None
    plan = replace(plan, robot=name)
    names = [one.name for one in plan.instances]
    parts = {key: part.components for key, part in robot.manifest.parts.items()}
    problems = list(_wrong_wishes(name, model, out, {*names, *parts}))
    out.report.extend(problems)
    if problems:
        return None
    devices = {one.name: {opens.port.value} for one, opens in robot.declared(OpensPort)}
    facts = {key: HostOffer(frozenset(host.labels), frozenset(host.devices)) for key, host in out.hosts.items()}
    placed = place(names, facts, Wishes(model.on, model.place), parts, devices)
    return PlacedRobot(name, model, robot, plan, placed, _link_port(model, plan, out), _version(compilation))


def _compiled(
    name: str, model: SystemRobotModel, out: System, environment: Mapping[str, str], real: bool
) -> Compilation | None:
    span = value_span(out.root, ("robots", name, "robot"))
    writer = out.path or Path()
    file = model.robot if model.robot.startswith(PREFIX) else resolve(model.robot, writer, span)
    if isinstance(file, Finding):
        out.report.add(file)
        return None
    shown = file if isinstance(file, str) else shown_name(file)
    profiles = [model.profile] if model.profile else []
    compilation = compile_robot(shown, profiles=profiles, real=real, environment=environment)
    out.sources.update(compilation.sources)
    known = {(one.code, one.span, one.message) for one in out.report}
    out.report.extend(one for one in compilation.report if (one.code, one.span, one.message) not in known)
    if compilation.plan is None:
        message = f"the robot '{shown}' has errors, so the system cannot run it"
        out.report.add(codes.BROKEN_ROBOT.at(span, message, help="see the findings of the robot"))
    return compilation


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
            yield codes.UNKNOWN_HOST.misspelt(span, message, called, [*out.hosts, *sorted(labels)], "hosts")
    for key in model.place:
        if key not in known:
            span = key_span(out.root, ("robots", name, "place", key))
            message = f"the robot '{name}' has neither a component nor a part '{key}'"
            yield codes.NOTHING_TO_PLACE.misspelt(span, message, key, sorted(known), "its components and parts")


def _link_port(model: SystemRobotModel, plan: Plan, out: System) -> int:
    """Return the port of the robot's links: its own, or the next one that no robot before it has."""
    if model.link_port is not None:
        return model.link_port
    taken = {one.link_port for one in out.robots.values()}
    ports: Iterable[int] = (*range(plan.bus.port, 65536), *range(1024, plan.bus.port))
    return next(port for port in ports if port not in taken)


def _version(compilation: Compilation) -> str:
    """Return what all hosts of a robot must have in common: the version of rbxcompose, and the texts of its files."""
    texts = sorted(hashlib.sha256(text.encode()).hexdigest() for text in compilation.sources.values())
    return f"{__version__} {hashlib.sha256(''.join(texts).encode()).hexdigest()[:16]}"
