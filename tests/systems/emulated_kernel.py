"""A kernel that is not that of this machine, for what the latter lacks: QEMU emulates a machine for it.

It needs `qemu-system-x86_64` and a packaged kernel with modules, such as that of Debian's `linux-image-amd64`;
`RBXCOMPOSE_TEST_KERNEL` may name the folder that such a package was unpacked to.
"""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.systems.namespaces import NotPermittedError

EMULATOR = "qemu-system-x86_64"
APPEND = "console=ttyS0 panic=-1 quiet rdinit=/init"


def program(name: str) -> str:
    """Return the path of a program of this machine.

    Raises:
        NotPermittedError: if it is not installed.
    """
    if (path := shutil.which(name)) is None:
        raise NotPermittedError(f"{name} is not installed")
    return os.path.realpath(path)


def emulator(folder: Path, init: str, programs: Iterable[str], modules: Iterable[str], memory: str) -> list[str]:
    """Return the words that start a machine; it runs the script `init`, which has these programs and modules.

    Raises:
        NotPermittedError: if there is no emulator or no kernel.
    """
    words = [program(EMULATOR), "-accel", "tcg,thread=multi", "-m", memory, "-display", "none", "-no-reboot"]
    kernel, known = _kernel()
    inserted = "".join(f"insmod /modules/{name}.ko\n" for name in modules)
    text = f"#!/bin/sh\nmkdir -p /proc /dev /sys\nmount -t proc proc /proc\nmount -t sysfs sys /sys\n{inserted}{init}"
    files = [(f"modules/{name}.ko", known[name]) for name in modules]
    files += [pair for name in ("sh", "mkdir", "mount", "insmod", *programs) for pair in _with_libraries(name)]
    image = folder / "initramfs"
    image.write_bytes(_archive([("init", text.encode()), *((path, one.read_bytes()) for path, one in files)]))
    return [*words, "-kernel", str(kernel), "-initrd", str(image), "-append", APPEND]


def _kernel() -> tuple[Path, dict[str, Path]]:
    """Return the newest kernel, and its modules by name."""
    root = Path(os.environ.get("RBXCOMPOSE_TEST_KERNEL", "/"))
    for kernel in sorted(root.glob("boot/vmlinuz-*"), reverse=True):
        modules = root / "lib/modules" / kernel.name.removeprefix("vmlinuz-")
        if found := {path.name.removesuffix(".ko"): path for path in modules.rglob("*.ko")}:
            return kernel, found
    raise NotPermittedError(f"there is no kernel with modules below {root}: see RBXCOMPOSE_TEST_KERNEL")


def _with_libraries(name: str) -> Iterator[tuple[str, Path]]:
    """Yield a program and its libraries, by their paths in the machine."""
    path = program(name)
    yield f"bin/{name}", Path(path)
    for word in subprocess.check_output(["ldd", path], text=True).split():
        if word.startswith("/"):
            yield word.lstrip("/"), Path(word)


def _archive(files: Iterable[tuple[str, bytes]]) -> bytes:
    """Return an archive of programs as the kernel unpacks it at its start: "newc" of cpio(5)."""
    found, made = bytearray(), set[str]()

    def add(path: str, contents: bytes, mode: int) -> None:
        if path not in made:
            made.add(path)
            fields = [len(made), mode, 0, 0, 1, 0, len(contents), 0, 0, 0, 0, len(path) + 1, 0]
            found.extend(b"070701" + b"".join(b"%08x" % field for field in fields) + path.encode() + b"\0")
            found.extend(bytes(-len(found) % 4) + contents)
            found.extend(bytes(-len(found) % 4))

    for path, contents in files:
        for parent in reversed(Path(path).parents[:-1]):
            add(str(parent), b"", stat.S_IFDIR | 0o755)
        add(path, contents, stat.S_IFREG | 0o755)
    add("TRAILER!!!", b"", 0)
    return bytes(found)
