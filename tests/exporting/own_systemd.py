"""A systemd of a test's own: process 1 of namespaces that it cannot leave, with this machine's files read-only."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Self

from tests.conftest import ROOT
from tests.systems.namespaces import NotPermittedError

INIT = "/lib/systemd/systemd"
TREE, FILES, UNITS = "/srv/tree", "/srv/files", "/srv/units"  # where it sees this repository, and the test's folder
PATIENCE = 20.0  # [s] for it to be up
TARGETS = ("sysinit", "basic", "network-online", "shutdown", "multi-user", "default")
_ENTER = """
set -e
echo $$ > "$1/cgroup.procs"
exec unshare --fork --kill-child --pid --mount --uts --ipc --net --cgroup sh -c "$2" sh "$3" "$4"
"""
_ROOT = f"""
set -e
mount -t tmpfs tmpfs "$2/root"
cd "$2/root"
mkdir upper work new
mount -t overlay -o lowerdir=/,upperdir=upper,workdir=work overlay new
cd new
mount -t proc proc proc
mount --bind proc/sys proc/sys
mount -o remount,bind,ro proc/sys
mount --rbind /dev dev
mount -t sysfs -o ro sys sys
mount -t cgroup2 cgroup sys/fs/cgroup
mkdir -p .{TREE} .{FILES} .{UNITS} old
mount --bind "$1" .{TREE}
mount --bind "$2" .{FILES}
mount -t tmpfs run run
mount -t tmpfs tmp tmp
for target in {" ".join(TARGETS)}; do printf '[Unit]\\nDefaultDependencies=no\\n' > .{UNITS}/$target.target; done
ip link set lo up
pivot_root . old
umount -l /old
exec env -i container=test PATH="$PATH" SYSTEMD_UNIT_PATH={UNITS} SYSTEMD_GENERATOR_PATH=/none {INIT} --system
"""


class OwnSystemd:
    """It knows no units but those that the test installs."""

    def __init__(self, folder: Path) -> None:
        """Start it.

        Raises:
            NotPermittedError: if it is not installed, or this user or kernel does not permit it.
        """
        missing = [name for name in ("unshare", "nsenter", "systemctl", "ip", INIT) if shutil.which(name) is None]
        if missing or os.geteuid() != 0:
            raise NotPermittedError(f"{missing[0]} is not installed" if missing else "only root may run a systemd")
        (folder / "root").mkdir()
        mounts = Path("/proc/mounts").read_text(encoding="utf-8").splitlines()
        unified = next((line.split()[1] for line in mounts if line.split()[2] == "cgroup2"), None)
        if unified is None:
            raise NotPermittedError("there are no control groups of version 2")
        self._group = Path(unified, f"rbx-test-{os.getpid()}")
        try:
            self._group.mkdir()
        except OSError as error:
            raise NotPermittedError(f"{self._group} cannot be made: {error.strerror}") from error
        words = ["sh", "-c", _ENTER, "sh", str(self._group), _ROOT, str(ROOT), str(folder)]
        self._process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + PATIENCE
        while not self._is_up():
            if self._process.poll() is not None or time.monotonic() > deadline:
                self.remove()
                raise NotPermittedError(f"systemd does not come up: {self._told}")
            time.sleep(0.1)

    def _is_up(self) -> bool:
        return self.run("systemctl", "is-system-running").stdout.strip() in ("running", "degraded")

    def _first(self) -> str:
        """Return the process that is number 1 in there, or nothing."""
        pid = self._process.pid
        with contextlib.suppress(OSError):  # it has ended
            return Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split(" ")[0]
        return ""

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command in there."""
        enter = ["nsenter", "-t", self._first() or "0", "-p", "-m", "-u", "-i", "-n", "-C", *words]
        return subprocess.run(enter, capture_output=True, text=True, check=False)

    def install(self, name: str, text: str) -> None:
        """Let it know a unit."""
        Path(f"/proc/{self._first()}/root{UNITS}", name).write_text(text, encoding="utf-8")
        self.run("systemctl", "daemon-reload")

    def property(self, unit: str, name: str) -> str:
        """Return what systemd knows of a unit."""
        return self.run("systemctl", "show", "--value", "-p", name, unit).stdout.strip()

    def remove(self) -> None:
        """End it and all that it has started."""
        self._process.kill()
        self._told = self._process.communicate()[1][-500:]
        deadline = time.monotonic() + PATIENCE
        for folder, _, _ in os.walk(self._group, topdown=False):
            while time.monotonic() < deadline:  # until the kernel has ended what was in it
                with contextlib.suppress(OSError):
                    Path(folder).rmdir()
                    break
                time.sleep(0.05)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.remove()
