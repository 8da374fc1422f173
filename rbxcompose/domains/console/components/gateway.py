"""The gateway: serves the console's page and rosbridge to browsers and clients."""

from __future__ import annotations

import asyncio
import json
import math
import os
import socket
import subprocess
import sys
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Iterable, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from functools import cached_property, partial
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Annotated, Any, Literal

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.config import AngularSpeed, Config, Speed
from rbxcompose.base.findings import Severity
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Refused
from rbxcompose.bus.actions import ActionServer, ServedGoal
from rbxcompose.bus.graph import Graph, GraphEnd, GraphName
from rbxcompose.bus.names import data_key, resolve
from rbxcompose.bus.services import ServedRequest
from rbxcompose.bus.tokens import SPACE
from rbxcompose.bus.topics import Publisher
from rbxcompose.bus.transport import Closable
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.guest import NAME, Guest
from rbxcompose.commands.lookup import place_of
from rbxcompose.domains.console import protocol
from rbxcompose.domains.console.access import LOCAL_NAMES, Door, Role, network_names, own_secret, role_of, secret_path
from rbxcompose.domains.console.editor_process import EditorProcess
from rbxcompose.domains.console.feeds import KEPT, TopicRates, findings, tail
from rbxcompose.domains.console.foxglove_server import FoxgloveServer, RobotAccess
from rbxcompose.domains.console.lease import DriveLimits
from rbxcompose.domains.console.models import MESHES, CandidateModels, ServedFile, ServedModel
from rbxcompose.domains.console.rosapi import BusView
from rbxcompose.domains.console.video import BOUNDARY, IMAGES, Picture, Streams, list_page, part, viewer_page, wanted
from rbxcompose.missions.view.tested import read_tested
from rbxcompose.msgs.sensor_arrays import WrongPictureError
from rbxcompose.msgs.types import Action, Message, Service
from rbxcompose.runtime.control import NoAnswerError, ask_as_data
from rbxcompose.runtime.folder import FINDINGS, BrokenStateError, RobotFolder, all_folders
from rbxcompose.runtime.log import NAME as LOG
from rbxcompose.runtime.process_group.group import stop_key
from rbxcompose.sdk import (
    Capability,
    Component,
    ComponentNoted,
    NeedsExtra,
    Qos,
    Replaceable,
    Setting,
    TaskStatus,
    component,
)
from rbxcompose.sdk.bound import Ended, Outcome, Reply, SentGoal
from rbxcompose.sdk.capabilities import ServesPage
from rbxcompose.sdk.ports import BULK

if TYPE_CHECKING:
    from starlette.requests import HTTPConnection, Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

    Answering = Callable[[Request], Awaitable[Response]]

STATIC = Path(__file__).parents[1] / "static"  # the built page
MOST_CLIENTS = 64
MOST_CONNECTIONS = 256  # at once: descriptors for all else, such as a stop, are left
MOST_STRANGERS = 8  # clients that have not said yet who they are
PACKAGES = ("PIL", "cbor2", "segno", "starlette", "uvicorn", "websockets")
SOCKETS = ("/", "/rosbridge")  # where WebSockets are taken
_PAUSE = 0.1  # [s] between two looks for the robot's own state
_LOOKS = 100
_PATIENCE = 5.0  # [s] for the server of an action to be found
_AGAIN = 2.0  # [s] between two tries to get the port
_ASKED = 0.5  # [s] for another robot to say what it serves
_PING = 5.0  # [s] until a client that does not read counts as gone
_FAREWELL = 1  # [s] for clients to let go
_GOODBYE = 3.0  # [s] to wait for the thread to end
_STOPPED = 1.0  # [s] for all processes to answer to a stop over the bus
_SHY = 5.0  # [s] for a client to say who it is, or what it wants
_AT_ONCE = 4  # requests that the robot is asked: it answers one after the other
_REFUSALS = 10.0  # [s] between two notes of refused tokens
_RENEWALS = 1.0  # [s] between two looks for renewed tokens
_SAVING = 30.0  # [s] for a save
_TRYING = 90.0  # [s] for a dry run, and for the tests of a mission
_LONG = ("test", "try", "robot/")
_LONGEST_LOGIN = 4096  # [bytes]
_MOST_WAITING = 65536  # [bytes] of requests behind one that is being answered
_COOKIE_AGE = 365 * 24 * 3600  # [s]
_POLICY = "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; object-src 'none'"
_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
)
_LOCKED = {"message": "this needs a link with a token"}
_DESCRIBE = {"type": "robot.DescribeRobot"}
_SHOWN = 60  # characters of a name that is wrong
_NOT_BUILT = Path(__file__).parents[1] / "not_built.html"


class GatewayConfig(Config):
    """What the page shows."""

    robot: str
    """The name of the robot."""
    about: str = ""
    """What it is for."""
    port: int = 8080
    """TCP port."""
    listen: Literal["local", "lan"] = "local"
    """Who may open it."""
    origins: tuple[str, ...] = ()
    """Pages of other servers that may talk to it."""
    guard: dict[str, str] = {}
    """Least roles by patterns of names of topics, services and actions."""
    pages: tuple[str, ...] = ()
    """The pages that there are, in this order; all if it is empty."""
    first_page: str = "drive"
    """The page that is shown first."""
    drive_topic: str = ""
    """Where velocities go, by its full name; empty if people cannot drive."""
    drive_type: str = ""
    """The type of that topic."""
    drive_aliases: tuple[str, ...] = ()
    """Other topics on the way to the base."""
    camera: str = ""
    """The topic of the pictures that drivers see, by its full name; empty if there is none."""
    max_speed: Speed = math.inf
    """The fastest that is let through."""
    max_turn_rate: AngularSpeed = math.inf
    """The fastest turn that is let through."""
    foxglove: int = 0
    """TCP port for Foxglove on this machine; 0 for none."""
    fleet: dict[str, str] = {}
    """Where the pages of the robots of its system are: `ADDRESS:PORT`, without an address on the same host."""
    values: dict[str, dict[str, str]] = {}
    """The values of the manifest: topic, type and field of each, and the unit of the number in the message."""
    places: Annotated[dict[str, dict[str, Any]], Replaceable()] = {}
    """The places of the manifest: `x` and `y` [m], `heading` [rad] and `colour` of each."""
    urdf: str = ""
    """Text of the URDF; empty if the robot has no body."""
    meshes: dict[str, str] = {}
    """The mesh files that exist, by their names in the URDF."""

    @property
    def drive(self) -> DriveLimits | None:
        """Return how people drive; None if they cannot."""
        if not self.drive_topic:
            return None
        aliases = frozenset(self.drive_aliases)
        return DriveLimits(self.drive_topic, self.drive_type, self.max_speed, self.max_turn_rate, aliases)


@component("gateway")
class Gateway(Component[GatewayConfig]):
    """Serves the console, and rosbridge, to browsers and clients.

    Example:
        gateway: {type: gateway, robot: turtlebot}
    """

    made_by = "The section `console` runs it."
    process = "gateway"
    rate = 10.0

    @classmethod
    def capabilities(cls, config: GatewayConfig) -> tuple[Capability, ...]:
        """Declare the page, and what it needs."""
        needed = (NeedsExtra(Setting(package), Setting("console")) for package in PACKAGES)
        page = ServesPage(
            Setting(config.port, "port"),
            Setting(config.listen, "listen"),
            Setting(config.drive_topic, "drive_topic"),
            Setting(config.fleet, "fleet"),
            Setting(config.camera, "camera"),
            Setting(config.foxglove, "foxglove"),
        )
        foxglove = (NeedsExtra(Setting("foxglove"), Setting("foxglove")),) if config.foxglove else ()
        return (page, *needed, *foxglove)

    def configure(self) -> None:
        """Serve nothing yet: the robot must be known from outside first."""
        self.server: GatewayThread | None = None
        self.noted: str | None = None
        self.at_end.callback(self.close)

    def activate(self) -> None:
        """Take the port, unless robot time is stepped: browsers live in real time."""
        self.add_diagnostic("clients", self._report)
        if type(self.context.clock) is not SteppedClock:
            self.server = GatewayThread(self.config)
            self.note(*self.server.status)

    def reconfigure(self, old: GatewayConfig) -> None:
        """Show other places, also to who has the page open."""
        if self.server is not None:
            self.server.follow(self.config)

    def start(self) -> None:
        """Serve; who has come before has waited."""
        if self.server is not None:
            self.server.start()

    def close(self) -> None:
        """Let all clients go, and free the port."""
        if self.server is not None:
            self.server.close()
            self.server = None

    def step(self, dt: float) -> None:
        """Write what visitors did into the log, soon, so that it stands near its effects."""
        while self.server is not None and not self.server.said.empty():
            self.warn(self.server.said.get())
        while self.server is not None and not self.server.done.empty():
            self.info(self.server.done.get())
        if self.server is not None:
            self.note(*self.server.status)

    def note(self, level: Level, words: str) -> None:
        """Let people and their tools see why there is no page, or that there is again."""
        text = words if level is Level.ERROR else ""
        if text != self.noted:
            self.noted = text
            self.context.notify(ComponentNoted(self.name, text))

    def _report(self, now: float) -> TaskStatus:
        if self.server is None:
            return TaskStatus(Level.OK, "serves nobody on a stepped clock")
        if self.server.status[0] is Level.OK and (trouble := self.server.trouble):
            return TaskStatus(Level.WARN, trouble)
        return TaskStatus(*self.server.status)


class GatewayThread:
    """A thread with an event loop: the web server, and a guest on the robot's bus."""

    def __init__(self, config: GatewayConfig) -> None:
        self.said: SimpleQueue[str] = SimpleQueue()  # warnings for the log
        self.done: SimpleQueue[str] = SimpleQueue()  # what visitors did
        self.status: tuple[Level, str] = (Level.OK, "starts")
        self._config = config
        self._thread = threading.Thread(target=self._run, name="gateway", daemon=True)
        self._is_closed = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop = asyncio.Event()
        self._over: asyncio.Task[bool] | None = None
        self._session: GatewaySession | None = None
        self._listener = self._at_port()

    @property
    def trouble(self) -> str:
        """Return what it does not serve beside the page."""
        return self._session.trouble if self._session is not None else ""

    def follow(self, config: GatewayConfig) -> None:
        """Show what another configuration says; it differs in what is live."""
        self._config = config
        if self._session is not None and self._loop is not None:
            with suppress(RuntimeError):  # it has ended by itself
                self._loop.call_soon_threadsafe(self._session.follow, config)

    def start(self) -> None:
        """Begin to serve."""
        self._thread.start()

    def close(self) -> None:
        """End the thread; who drove is stopped."""
        self._is_closed.set()
        if self._loop is not None:
            with suppress(RuntimeError):  # it has ended by itself
                self._loop.call_soon_threadsafe(self._stop.set)
        if self._thread.ident is not None:
            self._thread.join(_GOODBYE)
        if self._listener is not None:
            self._listener.close()

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except Exception as error:  # whatever a library raises: the robot goes on without a console
            self._complain(f"{type(error).__name__}: {error}")

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        if self._is_closed.is_set():
            return
        while self._listener is None:
            if await self._is_over(_AGAIN):
                return
            self._listener = self._at_port()
        if (folder := await self._own_folder()) is None:
            return
        with Guest(place_of(folder), stays=True) as guest:
            try:
                session = GatewaySession(self._config, folder, guest, self.done.put, self.said.put)
            except OSError as error:
                self._complain(f"{secret_path()}: {error.strerror}")
                return
            whom = "the network" if self._config.listen == "lan" else "this machine"
            self.status = (Level.OK, f"serves {whom} at port {self._config.port}")
            self._session = session
            try:
                await session.serve(self._listener, self._stop)
            finally:
                session.close()

    async def _own_folder(self) -> RobotFolder | None:
        """Return the folder of the robot that this process belongs to, as soon as its state names the process."""
        for _ in range(_LOOKS):
            for folder in all_folders():
                try:
                    state = folder.read_state()
                    if state and state.router and any(each.pid == os.getpid() for each in state.processes.values()):
                        place_of(folder)
                        return folder
                except (BrokenStateError, NotDoneError):
                    continue  # it is just being written
            if await self._is_over(_PAUSE):
                return None
        self._complain("the robot's own state cannot be found")
        return None

    def _at_port(self) -> socket.socket | None:
        """Return a socket at the port; None while another program has it."""
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(("" if self._config.listen == "lan" else LOCAL_NAMES[0], self._config.port))
            listener.listen()
        except OSError as error:
            listener.close()
            if self.status[0] is not Level.ERROR:
                port = self._config.port
                self._complain(f"port {port}: {error.strerror}{_holder(port)}; write another: 'console: {{port: N}}'")
            return None
        return listener

    async def _is_over(self, seconds: float) -> bool:
        """Wait, and return whether the thread is to end."""
        self._over = self._over or asyncio.create_task(self._stop.wait())
        await asyncio.wait({self._over}, timeout=seconds)
        return self._over.done()

    def _complain(self, why: str) -> None:
        self.status = (Level.ERROR, f"has no page: {why}")
        self.said.put(self.status[1])


def _holder(port: int) -> str:
    """Return which robot of this user serves its page at a port, in words; empty if none does."""
    for folder in all_folders():
        with suppress(BrokenStateError, NoAnswerError, Refused):
            state = folder.read_state()
            serving = (
                {each.name for each in state.components if each.state == "active" and not each.note} if state else ()
            )
            for each in ask_as_data(folder, _DESCRIBE, timeout=_ASKED) if serving else ():
                pages = each["capabilities"].get("ServesPage", ())
                if each["name"] in serving and any(page["port"] == port for page in pages):
                    return f" by robot '{folder.path.name}'"
    return ""


class LiveGraph:
    """What is on the bus, followed by the tokens of all ends."""

    def __init__(self, guest: Guest) -> None:
        self._keys: set[str] = set()
        self.changed: Callable[[], None] = lambda: None
        transport = guest.transport
        self._watched = transport.watch(
            f"{SPACE}/{guest.domain}/**",
            lambda key, is_there: transport.wake(NAME, partial(self._change, key, is_there=is_there)),
        )

    def close(self) -> None:
        """Follow no more."""
        self._watched.close()

    def _change(self, key: str, *, is_there: bool) -> None:
        (self._keys.add if is_there else self._keys.discard)(key)
        for known in ("_graph", "view"):
            self.__dict__.pop(known, None)
        self.changed()

    @cached_property
    def _graph(self) -> Graph:
        return Graph.of(self._keys)

    @cached_property
    def view(self) -> BusView:
        """Return what is there now."""
        graph = self._graph
        return BusView(
            topics=_types(graph.topics),
            services=_types(service for service in graph.services if service.givers),
            actions=_types(action for action in graph.actions if action.givers),
            nodes=[node for node in graph.nodes if not node.startswith("/_")],
            publishers={topic.name: sorted({end.node for end in topic.givers}) for topic in graph.topics},
            subscribers={topic.name: sorted({end.node for end in topic.takers}) for topic in graph.topics},
            servers={service.name: sorted({end.node for end in service.givers}) for service in graph.services},
            latched={topic.name for topic in graph.topics if any(map(_is_latched, topic.givers))},
        )

    def key(self, topic: str, domain: int) -> str:
        """Return the key on which the messages of a topic are published, in the type that most know."""
        found = next(one for one in self._graph.topics if one.name == topic)
        kind = found.kinds[0]
        return data_key(domain, topic, kind.type, kind.hash)


def _types(names: Iterable[GraphName]) -> dict[str, str]:
    return {found.name: found.types[0] for found in names if not found.is_hidden}


def _is_latched(end: GraphEnd) -> bool:
    return end.qos is not None and end.qos.is_transient_local


class _Unsent:
    """A goal whose server is not known yet."""

    is_cancelled = False

    def cancel(self) -> None:
        """Do not send it."""
        self.is_cancelled = True


def words_of(failure: Mapping[str, Any]) -> str:
    """Return what a command says is wrong in JSON, with the help of what it has found first."""
    helps = (found["help"] for found in failure["findings"] if found["severity"] == Severity.ERROR)
    return ": ".join(filter(None, (failure["error"], next(helps, ""))))


def _address(request: HTTPConnection) -> str:
    """Return where a request comes from."""
    return request.client.host if request.client else "?"


def _file(request: Request, file: ServedFile | None) -> Response:
    """Return a file of the robot's body, unless the browser has it already."""
    from starlette.responses import JSONResponse, Response

    if file is None:
        return JSONResponse({"message": "the robot's body has no such file"}, 404)
    headers = {"etag": file.tag, "cache-control": "no-cache"}
    if file.tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(file.content, media_type=file.kind, headers=headers)


class GatewaySession:
    """The web application, the bridge and the bus, all in one event loop."""

    def __init__(
        self,
        config: GatewayConfig,
        folder: RobotFolder,
        guest: Guest,
        note: Callable[[str], None],
        complain: Callable[[str], None],
    ) -> None:
        self._complain = complain
        self.config, self._folder, self._guest, self._note = config, folder, guest, note
        self._secret = own_secret() if config.listen == "lan" else None
        self._graph = LiveGraph(guest)
        guest.graph()  # a round trip, after which the tokens of all others are here, too
        guarded = {pattern: Role[role.upper()] for pattern, role in config.guard.items()}
        self._bridge = protocol.Bridge(lambda: self._graph.view, config.drive, guarded, self._role_of)
        self._bridge.show_config(self._shown_config())
        self._bus = guest.bus()
        self._streams = Streams(lambda topic: self._graph.view.topics.get(topic, ""), self._subscribe_to_images)
        self._ends: dict[tuple[type[object], str], Any] = {}  # publishers, subscriptions and clients, by name
        self._asked_of_clients: dict[int, ServedRequest[Any, Any]] = {}  # that have not answered
        self._goals_of_clients: dict[int, ServedGoal[Any, Any, Any]] = {}  # that clients carry out
        self._requests_so_far = 0
        self._goals: dict[int, SentGoal] = {}  # that have not ended
        self._wakes: dict[int, asyncio.Event] = {}  # by client
        self._unknown: set[int] = set()  # clients that did not say in time who they are
        self._refused = 0  # wrong tokens since the last note of one
        self._refusals_due = -math.inf  # when [s] the next may be noted
        self._loop = asyncio.get_running_loop()
        self._pump_timer: asyncio.TimerHandle | None = None
        self._lease_timer: asyncio.TimerHandle | None = None
        self._rates = TopicRates(partial(self._hear, Qos.STATE))
        self._rates_timer: asyncio.TimerHandle | None = None
        self._secret_timer: asyncio.TimerHandle | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._is_command: dict[str, bool] = dict.fromkeys((protocol.STOP["type"], protocol.RELEASE["type"]), True)
        self._is_command |= dict.fromkeys(("robot.RobotStatus", _DESCRIBE["type"]), False)
        self._foxglove: FoxgloveServer | None = None
        self.trouble = ""  # what is not served beside the page
        self._saving = asyncio.Lock()
        self._asking = asyncio.Semaphore(_AT_ONCE)
        self._stopping = ThreadPoolExecutor(2)  # so that a stop waits for nothing else
        self._candidates = CandidateModels()
        self._editor = EditorProcess(folder.path.name)
        self._trier = EditorProcess(folder.path.name, patience=_TRYING)  # so that nobody who types waits for it
        self._watches: dict[str, asyncio.Task[None]] = {}  # by window
        guest.scheduler.on_error = lambda owner, error: self._loop.call_exception_handler(
            {"message": str(error), "exception": error}
        )

    async def serve(self, listener: socket.socket, stop: asyncio.Event) -> None:
        """Serve until `stop`."""
        import uvicorn
        from h11 import DONE
        from uvicorn.protocols.http.h11_impl import H11Protocol

        class LimitedConnection(H11Protocol):
            """A connection that is let go if it is one too many, or sends no whole request in time."""

            def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
                super().connection_made(transport)
                if len(self.connections) > MOST_CONNECTIONS:
                    transport.abort()
                else:
                    self.loop.call_later(_SHY, self.close_if_idle)

            def data_received(self, data: bytes) -> None:
                super().data_received(data)
                if self.conn.their_state is DONE:  # more waits for its turn; only who reads on sees the client leave
                    if len(self.conn.trailing_data[0]) > _MOST_WAITING:
                        self.transport.abort()
                    else:
                        self.flow.resume_reading()

            def close_if_idle(self) -> None:
                asked: object = self.cycle  # None until there is a request, whatever uvicorn declares
                if asked is None and self in self.connections:  # else it is a WebSocket now
                    self.transport.abort()

        class Quiet(uvicorn.Server):
            """A server that sleeps until something happens; others wake ten times a second."""

            async def main_loop(self) -> None:
                await stop.wait()

        self._loop.add_reader(self._guest.fileno(), self._pump)
        if self._secret is not None:
            self._follow_secret()
        if self.config.foxglove:
            self._serve_foxglove(self.config.foxglove)
        self._pump()
        settings = uvicorn.Config(
            self._guarded(self._application()),
            log_config=None,
            log_level="warning",
            access_log=False,
            lifespan="off",
            http=LimitedConnection,
            ws="websockets-sansio",
            ws_max_size=2 * protocol.LARGEST,  # beyond that, the connection is closed
            ws_per_message_deflate=False,  # within a machine it costs more than it saves
            ws_ping_interval=_PING,
            ws_ping_timeout=_PING,
            timeout_graceful_shutdown=_FAREWELL,
            date_header=False,
            server_header=False,
        )
        await Quiet(settings).serve(sockets=[listener])

    def follow(self, config: GatewayConfig) -> None:
        """Show what another configuration says."""
        self.config = config
        self._bridge.show_config(self._shown_config())
        self._pump()

    def close(self) -> None:
        """Stop who drives, and leave the bus."""
        self._loop.remove_reader(self._guest.fileno())
        self._do(self._bridge.stop_driving(self._now, self._stamp))
        for timer in (self._pump_timer, self._lease_timer, self._rates_timer, self._secret_timer):
            if timer is not None:
                timer.cancel()
        for task in self._tasks:
            task.cancel()
        self._stopping.shutdown(wait=False)
        self._editor.close()
        self._trier.close()
        if self._foxglove is not None:
            self._foxglove.close()
        self._rates.rest()
        self._graph.close()

    @property
    def _now(self) -> float:
        return self._guest.clock.now()

    @property
    def _stamp(self) -> int:
        return self._guest.clock.stamp()

    # The web

    def _application(self) -> Any:
        from starlette.applications import Starlette
        from starlette.responses import HTMLResponse, JSONResponse
        from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
        from starlette.staticfiles import StaticFiles

        async def config(request: Request) -> Response:
            role = self._role(request).word
            return JSONResponse(self._shown_config() | {"role": role}, headers={"cache-control": "no-store"})

        async def log_in(request: Request) -> Response:
            if int(request.headers.get("content-length") or _LONGEST_LOGIN + 1) > _LONGEST_LOGIN:
                return JSONResponse({"message": "this is no token"}, 413)
            token = (await request.body()).decode("ascii", "replace").strip()
            role = self._role_of(token)
            if role is Role.NOBODY:
                self._note_refusal(_address(request))
                return JSONResponse({"message": "the token is wrong, or was renewed"}, 401)
            self._note(f"{_address(request)}: logs in to {role.word}")
            answer = JSONResponse({"role": role.word})
            answer.set_cookie(self._cookie, token, _COOKIE_AGE, httponly=True, samesite="strict")
            return answer

        async def not_built(request: Request) -> Response:
            return HTMLResponse(_NOT_BUILT.read_text(encoding="utf-8"))

        is_built = (STATIC / "index.html").exists()
        page: BaseRoute = Mount("/", StaticFiles(directory=STATIC, html=True)) if is_built else Route("/", not_built)
        sockets = [WebSocketRoute(path, self._talk) for path in SOCKETS]
        own = [Route("/console/config", self._for_viewers(config)), Route("/console/login", log_in, methods=["POST"])]
        return Starlette(routes=[*sockets, *own, *self._video(), *self._model(), page])

    def _model(self) -> list[Any]:
        """Return the addresses of the body and its meshes."""
        from starlette.routing import Route

        model = ServedModel(self.config.urdf, self.config.meshes)

        async def urdf(request: Request) -> Response:
            return _file(request, model.urdf)

        async def mesh(request: Request) -> Response:
            address = request.path_params["address"]
            found = await asyncio.to_thread(model.mesh, address)
            return _file(request, found or await asyncio.to_thread(self._candidates.mesh, address))

        routes = {"/console/model.urdf": urdf, f"{MESHES}{{address:path}}": mesh}
        return [Route(path, self._for_viewers(answer)) for path, answer in routes.items()]

    def _for_viewers(self, answer: Answering) -> Answering:
        """Return what answers only who may look."""
        from starlette.responses import JSONResponse

        async def guarded(request: Request) -> Response:
            return JSONResponse(_LOCKED, 401) if self._role(request) < Role.VIEW else await answer(request)

        return guarded

    def _video(self) -> list[Any]:
        """Return the pages of pictures, at the addresses of web_video_server."""
        from starlette.responses import HTMLResponse, PlainTextResponse, StreamingResponse
        from starlette.responses import Response as Answer
        from starlette.routing import Route

        def shown(show: Callable[[Request, Picture], Awaitable[Response]]) -> Answering:
            async def answer(request: Request) -> Response:
                try:
                    return await show(request, wanted(request.query_params))
                except WrongPictureError as error:
                    return PlainTextResponse(f"{error}\n", 404)

            return answer

        fresh = {"cache-control": "no-store"}

        def headers_alone(want: Picture, kind: str) -> Response:
            self._streams.type_of(want)
            return StreamingResponse((), media_type=kind, headers=fresh)  # without a length, which nobody knows

        async def stream(request: Request, want: Picture) -> Response:
            kind = f"multipart/x-mixed-replace;boundary={BOUNDARY}"
            if request.method == "HEAD":
                return headers_alone(want, kind)
            first, frames = await self._streams.begun(want)  # so that what is wrong has an answer of its own

            async def parts() -> AsyncIterator[bytes]:
                try:
                    yield part(first, want.mime)
                    with suppress(WrongPictureError):
                        async for frame in frames:
                            if self._role(request) is Role.NOBODY:
                                break
                            yield part(frame, want.mime)
                finally:
                    await frames.aclose()

            return StreamingResponse(parts(), media_type=kind, headers=fresh)

        async def snapshot(request: Request, want: Picture) -> Response:
            if request.method == "HEAD":
                return headers_alone(want, want.mime)
            return Answer(await self._streams.snapshot(want), media_type=want.mime, headers=fresh)

        async def viewer(request: Request, _: Picture) -> Response:
            return HTMLResponse(viewer_page(request.url.query))

        async def listed(request: Request) -> Response:
            return HTMLResponse(list_page(topic for topic, type_ in self._graph.view.topics.items() if type_ in IMAGES))

        pictures = {"/stream": stream, "/snapshot": snapshot, "/stream_viewer": viewer}
        routes = {"/streams": listed, **{path: shown(show) for path, show in pictures.items()}}
        return [Route(path, self._for_viewers(answer)) for path, answer in routes.items()]

    def _subscribe_to_images(
        self, topic: str, message: type[Message], then: Callable[[Any], None]
    ) -> Callable[[], None]:
        end = self._subscription(topic, message, Qos.BULK, then)
        self._pump()
        return partial(self._withdraw, end)

    @property
    def _cookie(self) -> str:
        return f"rbxcompose-{self.config.port}"  # cookies are for all ports of a host

    def _follow_secret(self) -> None:
        """Close all connections once the tokens are renewed, so that all show theirs again."""
        with suppress(OSError):  # `console` reports what is wrong with it; until then, the old tokens count
            if self._secret != (secret := own_secret()):
                self._secret = secret
                for number in self._wakes:
                    self._disconnect(number)
        self._secret_timer = self._loop.call_later(_RENEWALS, self._follow_secret)

    def _role_of(self, token: str) -> Role:
        return role_of(self._secret, self._folder.path.name, token) if self._secret else Role.CONFIGURE

    def _role(self, request: HTTPConnection) -> Role:
        """Return the role of who sends a request: all that this machine lets in may do everything."""
        if self._secret is None:
            return Role.CONFIGURE
        kind, _, bearer = request.headers.get("authorization", "").partition(" ")
        shown = (bearer.strip() if kind.lower() == "bearer" else "", request.cookies.get(self._cookie, ""))
        return max(map(self._role_of, filter(None, shown)), default=Role.NOBODY)

    def _shown_config(self) -> dict[str, object]:
        config, shown = self.config, None
        if (drive := config.drive) is not None:
            limits = {"max_speed": drive.max_speed, "max_turn_rate": drive.max_turn_rate}
            finite = {name: limit if math.isfinite(limit) else None for name, limit in limits.items()}
            shown = {"topic": drive.topic, "type": drive.type, **finite}
        about = {"robot": self._folder.path.name, "about": config.about, "first_page": config.first_page}
        lists = {"pages": config.pages, "values": config.values, "places": config.places, "fleet": config.fleet}
        return {**about, "drive": shown, "camera": config.camera, **lists, "stop": "/console/stop"}

    def _guarded(self, application: Any) -> Callable[..., Awaitable[None]]:
        """Return the application behind a door that pages of others do not pass."""
        is_lan, fleet = self._secret is not None, tuple(self.config.fleet.values())
        names = network_names() if is_lan else ()
        door = Door(self.config.port, is_lan, names, frozenset(self.config.origins), fleet)

        async def guarded(scope: MutableMapping[str, Any], receive: Any, send: Any) -> None:
            headers = dict(scope["headers"])
            host, origin = (headers.get(name, b"").decode("latin-1") for name in (b"host", b"origin"))
            is_known = door.lets_in(host, origin)
            if scope["type"] == "websocket":
                if is_known and scope["path"] in SOCKETS:
                    await application(scope, receive, send)
                else:
                    await receive()
                    await send({"type": "websocket.close", "code": 1008})
                return

            async def hardened(message: MutableMapping[str, Any]) -> None:
                if message["type"] == "http.response.start":
                    policy = f"{_POLICY}; connect-src {door.sources(host)}"
                    hardening = ((b"content-security-policy", policy.encode()), *_HEADERS)
                    message["headers"] = [*message.get("headers", ()), *hardening]
                await send(message)

            if is_known:
                await application(scope, receive, hardened)
            else:
                await hardened({"type": "http.response.start", "status": 403, "headers": []})
                await hardened({"type": "http.response.body", "body": b"the console answers its own pages only\n"})

        return guarded

    async def _talk(self, web_socket: WebSocket) -> None:
        """Serve one client until it leaves."""
        await web_socket.accept()
        role = self._role(web_socket)
        if len(self._bridge) >= MOST_CLIENTS or (role is Role.NOBODY and self._bridge.strangers >= MOST_STRANGERS):
            await web_socket.close(1013)
            return
        number = self._bridge.open(role, _address(web_socket))
        self._wakes[number] = asyncio.Event()
        shy = self._loop.call_later(_SHY, self._ask_who, number)
        sender = asyncio.create_task(self._send(web_socket, number))
        try:
            while (message := await web_socket.receive())["type"] == "websocket.receive":
                text = message.get("text")
                frame = text if text is not None else message.get("bytes") or b""
                if self._bridge.role(number) is Role.NOBODY and len(frame) > _LONGEST_LOGIN:
                    self._disconnect(number)  # it may say who it is, and nothing that takes time to read
                    continue
                self._do(self._bridge.receive(number, frame, self._now, self._stamp))
        finally:
            shy.cancel()
            sender.cancel()
            del self._wakes[number]
            self._unknown.discard(number)
            self._do(self._bridge.close(number, self._now, self._stamp))

    def _ask_who(self, number: int) -> None:
        """Let a client go that has no role after a while."""
        if self._bridge.role(number) is Role.NOBODY:
            self._disconnect(number)

    def _note_refusal(self, address: str) -> None:
        """Note that a token is wrong, but not each of thousands: they would wash out the log of who did what."""
        self._refused += 1
        if self._now >= self._refusals_due:
            again = f", and {self._refused - 1} more before" if self._refused > 1 else ""
            self._note(f"{address}: is refused: a wrong token{again}")
            self._refused, self._refusals_due = 0, self._now + _REFUSALS

    def _disconnect(self, number: int) -> None:
        """Close the connection of a client, as soon as its sender sees that."""
        self._unknown.add(number)
        self._wakes[number].set()

    async def _send(self, web_socket: WebSocket, number: int) -> None:
        """Send a client what is due for it; one that reads slowly holds up only itself."""
        wake = self._wakes[number]
        while not self._bridge.is_overrun(number) and number not in self._unknown:
            wake.clear()
            if (frame := self._bridge.next_frame(number, self._now)) is not None:
                await (web_socket.send_text(frame) if isinstance(frame, str) else web_socket.send_bytes(frame))
                continue
            pause = self._bridge.pause(number, self._now)
            timer = None if math.isinf(pause) else self._loop.call_later(pause, wake.set)
            await wake.wait()
            if timer is not None:
                timer.cancel()
        await web_socket.close(1008)

    # The bus

    def _do(self, requests: Sequence[protocol.BusRequest]) -> None:
        for request in requests:
            self._carry_out(request)
        self._pump()
        until = self._bridge.lease.until
        if self._lease_timer is None and math.isfinite(until):
            self._lease_timer = self._loop.call_later(max(0.0, until - self._now), self._look_at_lease)

    def _look_at_lease(self) -> None:
        self._lease_timer = None
        self._do(self._bridge.expire(self._now, self._stamp))

    def _pump(self) -> None:
        """Let the bus do what is due, wake the clients that it brought something, and plan when to look again."""
        while self._bridge.notes:
            self._note(self._bridge.notes.popleft())
        while self._bridge.refused:
            self._note_refusal(self._bridge.refused.popleft())
        due = self._guest.pump()
        if self._pump_timer is not None:
            self._pump_timer.cancel()
        later = partial(self._loop.call_later, callback=self._pump)
        self._pump_timer = None if due is None else later(max(0.0, due - self._now))
        while self._bridge.woken:
            if (wake := self._wakes.get(self._bridge.woken.pop())) is not None:
                wake.set()

    def _carry_out(self, request: protocol.BusRequest) -> None:
        match request:
            case protocol.Subscribe(topic, message):
                self._subscribe(topic, message)
            case protocol.Advertise(topic, message, is_latched):
                qos = Qos.COMMAND if topic == self.config.drive_topic else Qos.LATCHED if is_latched else Qos.STATE
                self._ends[protocol.Advertise, topic] = self._bus.publisher(NAME, topic, message, qos)
            case protocol.Withdraw(kind, name):
                self._withdraw(self._ends.pop((kind, name)))
            case protocol.Publish(topic, message):
                self._ends[protocol.Advertise, topic](message)
            case protocol.ServiceCall():
                self._call(request)
            case protocol.Serve(service, type_):
                self._serve(service, type_)
            case protocol.ServeAction(action, type_):
                self._serve_action(action, type_)
            case protocol.GoalFeedback(number, feedback):
                self._goals_of_clients[number].feedback(feedback)
            case protocol.GoalEnd():
                self._end_goal(request)
            case protocol.ServiceAnswer(number, response, error):
                asked = self._asked_of_clients.pop(number)
                asked.fail(error) if response is None else asked.reply(response)
            case protocol.SendGoal():
                self._send_goal(request)
            case protocol.CancelGoal(number):
                self._goals[number].cancel()
            case protocol.AskRobot(number):
                self._begin(self._pass_on(number, self._ask_robot, request))
            case protocol.CountMessages(number):
                self._loop.call_soon(self._count_messages, number)
            case protocol.TailLog(number, after):
                self._begin(self._pass_on(number, self._read_log, after))
            case protocol.ReadTested(number, mission):
                self._begin(self._pass_on(number, self._read_tested, mission))
            case protocol.EditMission(number, asked):
                self._begin(self._pass_on(number, self._edit_mission, asked))
            case protocol.SaveSettings(number):
                self._begin(self._pass_on(number, self._save, request))
            case protocol.Watch():
                self._stop_watching(request.window)
                self._watches[request.window] = self._begin(self._watch(request))
            case protocol.Unwatch(window):
                self._stop_watching(window)

    def _subscribe(self, topic: str, message: type[Message]) -> None:
        qos = Qos.LATCHED if topic in self._graph.view.latched else Qos.STATE
        end = self._subscription(
            topic, message, qos, lambda arrived: self._bridge.arrived(topic, arrived, self._now, self._stamp)
        )
        end.is_wanted = lambda: self._bridge.wants(topic, self._now)  # what comes too early is not decoded
        self._ends[protocol.Subscribe, topic] = end

    def _subscription(self, topic: str, message: type[Message], qos: Qos, then: Callable[[Any], None]) -> Any:
        return self._bus.subscribe(NAME, topic, message, qos, then, max_rate=math.inf, limits=BULK, may_be_silent=True)

    def _carry_out_further(self) -> None:
        """Do what something from the bus made necessary."""
        for request in self._bridge.take_requests():
            self._carry_out(request)

    def _begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    # Foxglove

    def _serve_foxglove(self, port: int) -> None:
        """Serve Foxglove beside the page, as soon as the port is free; the page is served all the same."""
        robot = RobotAccess(
            listen=self._listen_raw,
            is_latched=lambda topic: topic in self._graph.view.latched,
            publisher=self._publisher_soon,
            call=self._call_soon,
            full_name=resolve,
            refused=self._refused_to_foxglove,
        )
        try:
            self._foxglove = server = FoxgloveServer(robot, self._folder.path.name, port)
        except RuntimeError as error:
            if not self.trouble:
                self.trouble = f"Foxglove is not served: port {port}: {str(error).removeprefix('FoxgloveError: ')}"
                self._complain(self.trouble)
            self._loop.call_later(_AGAIN, self._serve_foxglove, port)
            return
        self.trouble = ""
        timer: asyncio.TimerHandle | None = None

        def offer() -> None:
            nonlocal timer
            timer = None
            server.offer(self._graph.view.topics, self._graph.view.services)

        def changed() -> None:
            nonlocal timer
            timer = timer or self._loop.call_later(_PAUSE, offer)

        self._graph.changed = changed
        offer()

    def _listen_raw(self, topic: str, take: Callable[[bytes], None]) -> Callable[[], None]:
        """Pass the bytes of a topic on, in the thread that brings them, first those that are latched."""
        return self._hear(Qos.LATCHED if topic in self._graph.view.latched else Qos.STATE, topic, take)

    def _hear(self, qos: Qos, topic: str, take: Callable[[bytes], None]) -> Callable[[], None]:
        key = self._graph.key(topic, self._guest.domain)
        end = self._guest.transport.subscribe(key, qos, lambda arrival: take(bytes(arrival.payload)))
        return end.close

    def _publisher_soon(self, topic: str) -> tuple[Callable[[Message], object], Callable[[], object]]:
        """Return what publishes on a topic, declared with the first message, and what withdraws that."""
        declared: list[Publisher[Any]] = []

        def publish(message: Message) -> None:
            if not declared:
                declared.append(self._bus.publisher(NAME, topic, type(message), Qos.STATE))
            declared[0](message)
            self._pump()

        def withdraw() -> None:
            while declared:
                self._withdraw(declared.pop())
            self._pump()

        soon = self._loop.call_soon_threadsafe
        return lambda message: soon(publish, message), lambda: soon(withdraw)

    def _call_soon(self, service: str, type_: type[Service[Any, Any]], request: Message) -> Future[Any]:
        future: Future[Any] = Future()

        def answered(reply: Reply[Any]) -> None:
            if reply.response is not None:
                future.set_result(reply.response)
            else:
                future.set_exception(RuntimeError(reply.error))

        def call() -> None:
            self._call(protocol.ServiceCall(0, service, type_, request, _PATIENCE), answered)
            self._pump()

        self._loop.call_soon_threadsafe(call)
        return future

    def _refused_to_foxglove(self, topic: str) -> str:
        drives = self.config.drive_topic, *self.config.drive_aliases
        return "people drive by the console, which knows who drives" if topic in drives else ""

    def _stop_watching(self, window: str) -> None:
        if (task := self._watches.pop(window, None)) is not None:
            task.cancel()

    def _withdraw(self, end: Closable) -> None:
        self._bus.withdraw(NAME, end)

    def _client_of(self, kind: type[object], name: str, type_: Any, make: Callable[[str, str, Any], Any]) -> Any:
        """Return the client of a service or an action; a new one if another type is served under its name now."""
        known, end = self._ends.get((kind, name), (None, None))
        if known is not type_:
            if end is not None:
                self._withdraw(end)
            end = make(NAME, name, type_)
            self._ends[kind, name] = type_, end
        return end

    def _call(self, request: protocol.ServiceCall, then: Callable[[Reply[Any]], None] | None = None) -> None:
        """Call a service as soon as its server is known to a client of it; the bridge takes the reply, or `then`."""
        caller = self._client_of(protocol.ServiceCall, request.service, request.type, self._bus.client)
        deadline = self._now + request.timeout

        def answered(reply: Reply[Any]) -> None:
            self._bridge.answered(request.number, reply.response, reply.error)
            self._carry_out_further()

        def call() -> None:
            caller(request.request, then or answered, timeout=max(_PAUSE, round(deadline - self._now, 2)))

        self._once(lambda: caller.is_available or self._now >= deadline, call)

    def _once(self, is_ready: Callable[[], bool], do: Callable[[], None]) -> None:
        """Do something as soon as it can be done."""
        if is_ready():
            do()
        else:
            self._guest.scheduler.at(self._now + _PAUSE / 10, NAME, partial(self._once, is_ready, do))

    def _serve(self, service: str, type_: type[Service[Any, Any]]) -> None:
        def requested(asked: ServedRequest[Any, Any]) -> None:
            self._requests_so_far += 1
            self._asked_of_clients[self._requests_so_far] = asked
            self._bridge.requested(service, self._requests_so_far, asked.message)
            self._carry_out_further()

        self._ends[protocol.Serve, service] = self._bus.serve_later(NAME, service, type_, requested)

    def _serve_action(self, action: str, type_: type[Action[Any, Any, Any]]) -> None:
        server: ActionServer[Any, Any, Any] = self._bus.serve_action(NAME, action, type_, lambda goal: "")

        def began() -> None:
            if server.current is not None:
                self._requests_so_far += 1
                self._goals_of_clients[self._requests_so_far] = server.current
                self._bridge.goal_came(action, self._requests_so_far, server.current.request)

        server.began, server.canceling = began, partial(self._bridge.goal_unwanted, action)
        self._ends[protocol.ServeAction, action] = server

    def _end_goal(self, end: protocol.GoalEnd) -> None:
        goal = self._goals_of_clients.pop(end.number)
        match end.outcome:
            case Outcome.SUCCEEDED:
                goal.succeeded(end.result)
            case Outcome.CANCELED:
                goal.canceled(end.result)
            case _:
                goal.aborted(end.reason, end.result)

    def _send_goal(self, request: protocol.SendGoal) -> None:
        """Send a goal as soon as the server of its action is known to a client of it."""
        number = request.number
        caller = self._client_of(protocol.SendGoal, request.action, request.type, self._bus.action_client)
        deadline = self._now + _PATIENCE
        unsent = self._goals[number] = _Unsent()

        def ended(end: Ended[Any]) -> None:
            del self._goals[number]
            self._bridge.ended(number, end)

        def send() -> None:
            if unsent.is_cancelled:
                ended(Ended(Outcome.CANCELED, message="canceled before it was sent"))
            elif caller.is_available:
                feedback = partial(self._bridge.fed_back, number) if request.wants_feedback else None
                self._goals[number] = caller(request.goal, ended, feedback)
            else:
                ended(Ended(Outcome.LOST, message=f"the server of '{request.action}' does not answer"))

        self._once(lambda: unsent.is_cancelled or caller.is_available or self._now > deadline, send)

    async def _pass_on(self, number: int, ask: Callable[[Any], Awaitable[tuple[Any, str]]], request: object) -> None:
        """Pass the answer to a request to the bridge, or the reason why there is none."""
        self._bridge.robot_answered(number, *await ask(request))
        self._pump()

    def _ask_robot(self, request: protocol.AskRobot) -> Awaitable[tuple[Any, str]]:
        """Send a request as the command line does."""
        if request.request is protocol.STOP:
            return self._stop(request.who)
        return self._asked(request.request, request.role, request.who)

    async def _stop(self, who: str) -> tuple[Any, str]:
        """Stop the robot, also if its supervisor is slow; return what it answers, or why it did not stop."""
        self._note(f"{who}: asks {protocol.STOP['type']}")
        answer, refusal = await self._answer(protocol.STOP, self._stopping)
        if refusal:
            ask = partial(self._guest.ask, stop_key(self._folder.path.name), _STOPPED)
            stopped = await self._loop.run_in_executor(self._stopping, ask)
            if names := ", ".join(sorted(name.decode() for name in stopped)):
                return f"the supervisor does not answer: stopped over the bus: {names}", ""
        return answer, refusal

    def _count_messages(self, number: int) -> None:
        """Answer with the rates since somebody asked last, and count on for a while."""
        self._bridge.robot_answered(number, self._rates.look(self._graph.view.topics, self._now))
        if self._rates_timer is not None:
            self._rates_timer.cancel()
        self._rates_timer = self._loop.call_later(KEPT, self._rates.rest)
        self._pump()

    async def _read_log(self, after: int) -> tuple[Any, str]:
        answer = await asyncio.to_thread(tail, self._folder.path / LOG, after)
        if after == 0:
            answer["findings"] = findings(self._folder.path / FINDINGS)
        return answer, ""

    async def _read_tested(self, mission: str) -> tuple[Any, str]:
        return await asyncio.to_thread(read_tested, self.config.robot, mission), ""

    async def _save(self, request: protocol.SaveSettings) -> tuple[Any, str]:
        """Save as the command line does, in a process of its own: it needs the whole compiler."""
        trial = ("--dry-run",) if request.is_trial else ("--only-as", request.seen) if request.seen else ()
        robot = ("--robot", self._folder.path.name)
        command = (sys.executable, "-m", "rbxcompose", "param", "save", "--json", *robot, *trial, *request.names)
        async with self._saving:
            run = partial(subprocess.run, command, capture_output=True, text=True, timeout=_SAVING, check=False)
            try:
                done = await asyncio.to_thread(run)
                answer = json.loads(done.stdout)
                return (answer, "") if done.returncode == 0 else (None, words_of(answer))
            except (subprocess.TimeoutExpired, ValueError) as error:
                return None, f"it was not saved: {type(error).__name__}"

    async def _edit_mission(self, request: Mapping[str, Any]) -> tuple[Any, str]:
        process = self._trier if request["do"].startswith(_LONG) else self._editor
        answer, refusal = await process.ask(request)
        if isinstance(answer, dict) and isinstance(model := answer.get("model"), dict):
            answer["model"] = await asyncio.to_thread(self._candidates.add, model["urdf"], model["meshes"])
        return answer, refusal

    async def _asked(
        self, request: Mapping[str, Any], role: Role, who: str = "", *, may_change: bool = True
    ) -> tuple[Any, str]:
        """Return the answer of the robot, or why there is none; ask in a thread: its supervisor may be slow."""
        name = request["type"]
        if name not in self._is_command:
            await self._learn_requests()
        if name not in self._is_command or (self._is_command[name] and not may_change):
            return None, f"there is no {'request' if may_change else 'query'} '{name[:_SHOWN]}'"
        if self._is_command[name]:
            if role < Role.OPERATE:
                return None, f"'{name}' needs the role '{Role.OPERATE.word}'"
            self._note(f"{who}: asks {name}")
        async with self._asking:
            return await self._answer(request)

    async def _answer(self, request: Mapping[str, Any], executor: Executor | None = None) -> tuple[Any, str]:
        try:
            return await self._loop.run_in_executor(executor, ask_as_data, self._folder, request), ""
        except (Refused, NoAnswerError) as error:
            return None, str(error) or "the supervisor does not answer"

    async def _learn_requests(self) -> None:
        """Ask which requests the components take: `apply` may have brought others."""
        described, _ = await self._answer(_DESCRIBE)
        for each in described or ():
            self._is_command |= each["requests"]

    async def _watch(self, watch: protocol.Watch) -> None:
        """Look at the robot again and again; nobody else looks."""
        while True:
            is_due = asyncio.Event()
            self._loop.call_later(watch.period, is_due.set)
            answer, refusal = await self._asked(watch.request, Role.VIEW, may_change=False)
            self._bridge.seen(watch.window, answer, self._now, refusal)
            self._pump()
            await is_due.wait()
