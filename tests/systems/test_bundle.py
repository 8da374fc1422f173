"""What travels to the hosts of a system: all that its robots need of the project, where their manifests look for it."""

from __future__ import annotations

import io
import subprocess
import tarfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from rbxcompose.compiler.systems.bundle import BundledFile, archive_of, digest_of, files_of
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.tools.exporting import shares

MAP = "image: room.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
URDF = '<robot name="one"><link name="base_link"><visual><geometry><mesh filename="meshes/{}.stl"/></geometry></visual>'
STL = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"
)
ROBOT = """
rbx: 1
kind: Robot
name: one
world: ../../worlds/room.yaml
body: {urdf: one.urdf}
include: {lamp: ../../parts/lamp.yaml}
components:
  run: {type: program, command: [./run.sh, -x, ../../../common/extra.py], folder: bin, files: [data, ../one/more.txt]}
  detector: {type: container, image: detector, mounts: {/models: models, /log: {folder: log, writable: true}}}
  node: {type: ros2_node, package: a, executable: b, parameter_files: [params.yaml]}
  voice: {type: voice, voice: amy.onnx}
"""
NEEDED = {
    "robots/one/robot.yaml": ROBOT,
    "robots/one/one.urdf": f"{URDF.format('head')}</link></robot>",
    "robots/one/meshes/head.stl": STL,
    "robots/one/bin/run.sh": "#!/bin/sh\n",
    "robots/one/data/below/a b.txt": "a",
    "robots/one/more.txt": "more",
    "robots/one/models/m.onnx": "m",
    "robots/one/params.yaml": "{}",
    "robots/one/amy.onnx": "amy",
    "robots/one/amy.onnx.json": "{}",
    "common/extra.py": "",
    "parts/lamp.yaml": "rbx: 1\nkind: Part\nname: lamp\ncomponents: {cpu: {type: cpu_monitor}}\n",
    "worlds/room.yaml": "rbx: 1\nkind: World\nname: room\nmap: room_map.yaml\n",
    "worlds/room_map.yaml": MAP,
    "worlds/room.pgm": "P2 2 2 255 255 255 255 255\n",
}
OTHERS = (
    "robots/one/meshes/tail.stl",
    "robots/one/data/.cache/x",
    "robots/one/log/1.txt",
    "secrets/token",
    "notes.txt",
)
SYSTEM = "rbx: 1\nkind: System\nname: all\nhosts: {{here: {{}}}}\nrobots: {{one: {{robot: {}}}}}\n"


def project(folder: Path, robot: str = "../robots/one/robot.yaml") -> Path:
    """Write a project; return its system's file."""
    for name, text in {**NEEDED, **dict.fromkeys(OTHERS, ""), "systems/all.yaml": SYSTEM.format(robot)}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "robots/one/bin/run.sh").chmod(0o700)
    return folder / "systems/all.yaml"


def unpack(files: Mapping[str, BundledFile], folder: Path) -> None:
    """Unpack the archive as hosts do."""
    folder.mkdir()
    subprocess.run(["tar", "-xf", "-", "-C", folder], input=archive_of(files), check=True)


def compiled(file: Path) -> System:
    system = compile_system(str(file), environment={})
    assert [finding.message for finding in system.report if finding.severity == "error"] == []
    return system


def test_all_files_travel_that_manifests_name_and_scripts_stay_executable(tmp_path: Path) -> None:
    name, files = files_of(compiled(project(tmp_path)))
    assert name == "systems/all.yaml"
    assert files.keys() == {*NEEDED, name}
    assert [path for path, one in files.items() if one.mode == 0o755] == ["robots/one/bin/run.sh"]
    with tarfile.open(fileobj=io.BytesIO(archive_of(files))) as archive:
        assert archive.getmember("robots/one/bin/run.sh").mode == 0o755
    unpack(files, tmp_path / "there")
    assert compiled(tmp_path / "there" / name).robots.keys() == {"one"}
    (tmp_path / "robots/one/bin/run.sh").chmod(0o600)
    assert digest_of(files_of(compiled(tmp_path / name))[1]) != digest_of(files)
    made = shares.kubernetes_manifests([], system="all", file=name, files=files, image="i")
    assert "robots..one..bin..run.sh" in made["files.yaml"]


def test_what_a_link_leads_to_is_where_manifests_look_for_it(tmp_path: Path) -> None:
    file = project(tmp_path, "../robots/link/robot.yaml")
    (tmp_path / "robots/link").symlink_to("../other/robot")
    (tmp_path / "robots/one").rename(tmp_path / "robots/moved")
    (tmp_path / "other").mkdir()
    (tmp_path / "robots/moved").rename(tmp_path / "other/robot")
    text = ROBOT.replace("../one/more.txt", "more.txt")
    (tmp_path / "other/robot/robot.yaml").write_text(text, encoding="utf-8")
    name, files = files_of(compiled(file))
    there = {f"robots/link/{path.removeprefix('robots/one/')}" for path in NEEDED if path.startswith("robots/one/")}
    assert there <= files.keys()
    with tarfile.open(fileobj=io.BytesIO(archive_of(files))) as archive:
        assert not any(member.issym() for member in archive)
    unpack(files, tmp_path / "there")
    assert compiled(tmp_path / "there" / name).robots.keys() == {"one"}


def test_a_link_never_leads_out_of_the_project_or_to_a_secret(tmp_path: Path) -> None:
    file = project(tmp_path / "project", "../robots/link/../robot.yaml")
    (tmp_path / "outside.txt").write_text("")
    (tmp_path / "project/robots/one/data/out").symlink_to("../../../../outside.txt")
    (tmp_path / "project/robots/one/data/token").symlink_to("../../../secrets/token")
    (tmp_path / "project/robots/link").symlink_to("one/bin")
    with pytest.raises(ValueError, match=r"'../../.*' passes a link, behind which it leaves"):
        files_of(compiled(file))
    file.write_text(SYSTEM.format("../robots/one/robot.yaml"), encoding="utf-8")
    assert files_of(compiled(file))[1].keys() == {*NEEDED, "systems/all.yaml"}


def test_a_file_that_cannot_travel_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system = compiled(project(tmp_path))
    monkeypatch.setattr("rbxcompose.compiler.systems.bundle.LARGEST", 300)
    with pytest.raises(ValueError, match=r"its files have more than"):
        files_of(system)
