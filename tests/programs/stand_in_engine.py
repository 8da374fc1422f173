"""A stand-in for Docker, at the level of processes: a daemon has the containers, a client runs and removes them.

The client of `run` passes signals on and ends with the exit code of the container; when it is killed, the container
goes on. The folder `STAND_IN` has the daemon's socket, a file for each container, and the words of the last `run`.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType
from typing import Any

FOLDER = Path(os.environ.get("STAND_IN", "."))
WITH_VALUE = {"--name", "--network", "--pull", "--stop-signal", "--memory", "--cpus", "--cpuset-cpus", "--ulimit"}
WITH_VALUE |= {"--device", "--mount", "--env"}


class Daemon:
    """Has the containers."""

    def __init__(self) -> None:
        self.containers: dict[str, subprocess.Popen[bytes]] = {}
        self.starting = threading.Lock()  # what has said its first word can be removed

    def serve(self) -> None:
        """Serve clients until it is killed."""
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(str(FOLDER / "socket"))
            server.listen()
            sys.stdout.write("ready\n")
            sys.stdout.flush()
            while True:
                client, _ = server.accept()
                threading.Thread(target=self.answer, args=(client,), daemon=True).start()

    def answer(self, client: socket.socket) -> None:
        data, files, *_ = socket.recv_fds(client, 65536, 1)
        asked = json.loads(data)
        code = self.run(client, files, **asked) if "command" in asked else self.remove(asked["name"])
        try:
            client.sendall(f"{code}\n".encode())
        except OSError:
            return  # the client was killed

    def run(self, client: socket.socket, files: list[int], name: str, command: list[str], environment: Any) -> int:
        if name in self.containers:
            return 125
        (output,) = files
        (file := FOLDER / f"container_{name}").touch()
        with self.starting:
            made = self.containers[name] = subprocess.Popen(
                command, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True
            )
        os.close(output)
        threading.Thread(target=self.pass_on, args=(client, made), daemon=True).start()
        code = made.wait()
        del self.containers[name]
        file.unlink()
        return code if code >= 0 else 128 - code

    def pass_on(self, client: socket.socket, container: subprocess.Popen[bytes]) -> None:
        while number := client.recv(1):
            container.send_signal(number[0])

    def remove(self, name: str) -> int:
        with self.starting:
            container = self.containers.get(name)
        if container is None:
            return 1
        os.killpg(container.pid, signal.SIGKILL)
        container.wait()
        return 0


def ask(files: list[int], **content: Any) -> int:
    """Ask the daemon; return the exit code that it answers."""
    with socket.socket(socket.AF_UNIX) as daemon:
        daemon.connect(str(FOLDER / "socket"))

        def pass_on(number: int, frame: FrameType | None) -> None:
            daemon.sendall(bytes([number]))

        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, pass_on)
        socket.send_fds(daemon, [json.dumps(content).encode()], files)  # what it runs may be asked to end at once
        return int(daemon.makefile().readline())


def run(words: list[str]) -> int:
    (FOLDER / "words").write_text(json.dumps(words), encoding="utf-8")
    options: list[tuple[str, str]] = []
    while words[0].startswith("--"):
        option = words.pop(0)
        options.append((option, words.pop(0) if option in WITH_VALUE else ""))
    _image, *command = words
    given = [value.partition("=") for option, value in options if option == "--env"]
    environment = {name: value if equals else os.environ[name] for name, equals, value in given}
    environment["PATH"] = os.environ["PATH"]
    return ask([1], name=dict(options)["--name"], command=command, environment=environment)


def main() -> int:
    match sys.argv[1:]:
        case ["daemon"]:
            Daemon().serve()
        case ["version"] if not (FOLDER / "socket").exists():
            sys.stderr.write("Client: 1\nCannot connect to the Docker daemon. Is the docker daemon running?\n")
            return 1
        case ["version"]:
            return 0
        case ["image", "inspect", image]:
            return 0 if image == "example" else 1
        case ["run", *words]:
            return run(words)
        case ["rm", "--force", name]:
            return ask([], name=name)
    return 64


if __name__ == "__main__":
    sys.exit(main())
