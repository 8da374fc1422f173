"""Distributions as an installation has them, and the plug-ins that are found in a folder of them."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from rbxcompose.base.plugins import GROUP, Plugins
from rbxcompose.compiler import check_runner as checking
from rbxcompose.sdk import registry

LAMP = Path(__file__).parent / "rbx_lamp"


def install(source: Path, work: Path) -> Path:
    """Install a distribution with pip, without a network, and return the folder that is to be on the path."""
    copy, site = work / source.name, work / "site"  # a build leaves files beside its source
    shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__"))
    words = ["install", "--quiet", "--no-index", "--no-deps", "--no-build-isolation", "--no-compile"]
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", *words, "--target", str(site), str(copy)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return site


def put(site: Path, distribution: str, points: Mapping[str, str], files: Mapping[str, str]) -> None:
    """Do what an installation of a distribution does: its modules and, beside them, its entry points."""
    info = site / f"{distribution.replace('-', '_')}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n", encoding="utf-8")
    lines = [f"[{GROUP}]", *(f"{name} = {module}" for name, module in points.items()), ""]
    (info / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")
    for name, text in files.items():
        (site / name).write_text(text, encoding="utf-8")


def see(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have this process find what is installed in `site`, until the test ends."""
    for name in registry.PLUGINS.shipped:  # what is imported below would be forgotten when the test ends
        registry.component_type(name)
    checking.all_checks()
    for module in site.glob("*.py"):
        monkeypatch.delitem(sys.modules, module.stem, raising=False)
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.setattr(registry, "PLUGINS", Plugins("component", "components"))
    monkeypatch.setattr(registry, "_TYPES", dict(registry._TYPES))
    monkeypatch.setattr(checking, "PLUGINS", Plugins("check", "checks"))
    monkeypatch.setattr(checking, "CHECKS", dict(checking.CHECKS))
