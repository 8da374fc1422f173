"""Backs a base off from what its bumpers and cliff sensors feel, and holds it while a wheel has no ground."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from enum import Enum, auto
from typing import Annotated, Any

from pydantic import Field, model_validator

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.poses import twist_message
from rbxcompose.msgs.rbxcompose_msgs import Switches
from rbxcompose.msgs.std_msgs import Empty

NEVER = -math.inf
ASIDE = 0.1  # sine above which a switch is at one side of the robot, and not ahead of it
CORNER = 3.0  # [s] after a manoeuvre within which another one turns the same way, so that corners are left


class SafetyControllerConfig(sdk.Config):
    """What it listens to, and how it backs off."""

    enabled: Annotated[bool, sdk.Live()] = True
    """Whether it acts at all; not, for example, while the robot pushes itself into its dock."""
    evades: list[TopicName] = ["bumper", "cliff"]
    """Topics with switches from which it backs off and turns away."""
    holds: list[TopicName] = ["wheel_drop"]
    """Topics with switches at which it stands still until they are off again."""
    heartbeat: TopicName | None = None
    """Where it tells again and again that it works: a lock of the mux, which holds all others back if it does not."""
    pause: Annotated[sdk.Time, sdk.Live()] = Field(0.2, ge=0)
    """How long it stands before it backs off, so that others can note what was there."""
    back_speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.1, ge=0)
    """How fast it backs off; with 0 it stands until somebody has moved it."""
    back_time: Annotated[sdk.Time, sdk.Live()] = Field(1.0, ge=0)
    """How long it goes on backing off after nothing is felt any more."""
    longest: Annotated[sdk.Time, sdk.Live()] = Field(3.0, gt=0)
    """How long it backs off at most; then it stands until nothing is felt any more, since it does not see behind."""
    turn: Annotated[sdk.Angle, sdk.Live()] = Field(math.radians(60), ge=0, le=math.pi)
    """How far it turns away then."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(45), gt=0)
    """How fast it turns away."""
    settle: Annotated[sdk.Time, sdk.Live()] = Field(1.0, ge=0)
    """How long it stands still after the last switch of `holds` is off again."""
    silence: Annotated[sdk.Time, sdk.Live()] = Field(0.5, gt=0)
    """A sensor that was not heard for so long is broken: the base stands still."""

    @model_validator(mode="after")
    def _listens(self) -> SafetyControllerConfig:
        topics = [*self.evades, *self.holds]
        if not topics or len(set(topics)) < len(topics):
            raise ValueError("it needs topics in 'evades' or 'holds', each once")
        return self


class SafetyPhase(Enum):
    """What it does about what it feels."""

    WATCH = auto()
    """Nothing: others command the base."""
    PAUSE = auto()
    """It has just felt something, and stops."""
    BACK = auto()
    """It backs off."""
    STUCK = auto()
    """It has backed off for the longest time, still feels something, and stands still until that is over."""
    TURN = auto()
    """It turns away."""


class SafetyCore:
    """Decides, from switches around the robot, whether to command its base, and what.

    It `evades` what some kinds of switches feel: it stops, backs off, turns away from the side on which they are, and
    lets others command again. It never backs off for longer than `longest` at a time, however sensors flicker. It
    stands still while a switch of another kind is on (`holds`, such as dropped wheels), or while any kind is silent.
    `settings` may be replaced at any time. All times are robot time [s].
    """

    def __init__(self, settings: SafetyControllerConfig) -> None:
        self.settings = settings
        self.evades, self.holds = tuple(settings.evades), tuple(settings.holds)
        self.phase = SafetyPhase.WATCH
        self._on: dict[str, Mapping[str, float]] = {kind: {} for kind in (*self.evades, *self.holds)}
        self._heard = dict.fromkeys(self._on, NEVER)
        self._since = self._until = NEVER  # when the phase began, and when it ends if nothing is felt
        self._held_until = NEVER
        self._ended = NEVER  # when the last manoeuvre ended
        self._drives = -1.0  # backwards, forwards, or not at all
        self._turns, self._is_aside = 1.0, False  # to the left or right, and whether a switch at a side has decided it

    @property
    def felt(self) -> dict[str, float]:
        """Return what is to be evaded: names of switches, such as `left bumper`, with their angles [rad]."""
        return {f"{name} {kind}": angle for kind in self.evades for name, angle in self._on[kind].items()}

    @property
    def held(self) -> list[str]:
        """Return the switches that hold the robot, such as `left wheel_drop`."""
        return [f"{name} {kind}" for kind in self.holds for name in self._on[kind]]

    def silent(self, now: float) -> list[str]:
        """Return the kinds that are silent, or were never heard."""
        return [kind for kind, heard in self._heard.items() if now - heard > self.settings.silence]

    def feel(self, kind: str, on: Mapping[str, float], now: float) -> None:
        """Take which switches of a kind are on, with their angles around the robot [rad]."""
        self._on[kind], self._heard[kind] = dict(on), now

    def distrust(self, kind: str) -> None:
        """Count a kind as silent until it is heard again: what came cannot be read."""
        self._heard[kind] = NEVER

    def forget(self, now: float) -> None:
        """End what it does, and count all silence anew: a stop held the robot, or robot time stood still."""
        self.phase, self._held_until = SafetyPhase.WATCH, NEVER
        self._heard = {kind: NEVER if heard == NEVER else now for kind, heard in self._heard.items()}

    def command(self, now: float) -> Velocity2 | None:
        """Return what the base must do now, or None while others may command it."""
        if self.held:
            self._held_until = now + self.settings.settle
        if self.silent(now) or self.held or now < self._held_until:
            self.phase = SafetyPhase.WATCH
            return AT_REST
        self._proceed(self.felt.values(), now)
        match self.phase:
            case SafetyPhase.WATCH:
                return None
            case SafetyPhase.BACK:
                return Velocity2(self._drives * self.settings.back_speed)
            case SafetyPhase.TURN:
                return Velocity2(angular=self._turns * self.settings.turn_rate)
            case _:
                return AT_REST

    def _proceed(self, angles: Collection[float], now: float) -> None:
        """Go on to the phase that is due."""
        settings, phase = self.settings, self.phase
        if angles:
            if phase in (SafetyPhase.WATCH, SafetyPhase.TURN):
                self._is_aside = now - self._ended < CORNER if phase is SafetyPhase.WATCH else True
                self._enter(SafetyPhase.PAUSE, now, settings.pause)
            self._look_around(angles)
        if self.phase is SafetyPhase.PAUSE and now >= self._until:
            self._enter(SafetyPhase.BACK, now, settings.back_time)
        if self.phase is SafetyPhase.BACK:
            if angles:
                self._until = now + settings.back_time
            if now - self._since >= settings.longest:
                self._enter(SafetyPhase.STUCK, now, 0.0)
            elif not angles and now >= self._until:
                self._turn_away(now)
        if self.phase is SafetyPhase.STUCK and not angles:
            self._turn_away(now)
        if self.phase is SafetyPhase.TURN and now >= self._until:
            self.phase, self._ended = SafetyPhase.WATCH, now

    def _enter(self, phase: SafetyPhase, now: float, duration: float) -> None:
        self.phase, self._since, self._until = phase, now, now + duration

    def _turn_away(self, now: float) -> None:
        self._enter(SafetyPhase.TURN, now, self.settings.turn / self.settings.turn_rate)

    def _look_around(self, angles: Collection[float]) -> None:
        """Decide how to drive away, not at all from both ends, and to which side to turn.

        It turns away from the first switch that is not straight ahead or behind, else as the last time.
        """
        is_ahead, is_behind = (any(sign * math.cos(angle) >= 0 for angle in angles) for sign in (1, -1))
        self._drives = float(is_behind - is_ahead)
        aside = sum(map(math.sin, angles))
        if not self._is_aside and abs(aside) > ASIDE:
            self._turns, self._is_aside = -math.copysign(1.0, aside), True


DOES = {
    SafetyPhase.PAUSE: "stops",
    SafetyPhase.BACK: "backs off",
    SafetyPhase.STUCK: "cannot get away, and waits for somebody",
    SafetyPhase.TURN: "turns away",
}


@sdk.component("safety_controller")
class SafetyController(sdk.Component[SafetyControllerConfig]):
    """Backs off where a bumper is pressed or the floor ends, and stands while a wheel hangs or a sensor is silent.

    It commands only then: give it the highest input of the mux of the base.

    Example:
        protection: {type: safety_controller, turn: 90 deg, connect: {cmd_vel: cmd_vel/safety}}
    """

    rate = 20.0
    cmd_vel = sdk.Out(Twist, "cmd_vel", qos="command")

    @classmethod
    def ports(cls, config: SafetyControllerConfig) -> dict[str, sdk.Port[Any]]:
        """Return an input for each topic of switches, and where it tells that it works."""
        found: dict[str, sdk.Port[Any]] = {
            port_of(topic): sdk.In(Switches, topic) for topic in (*config.evades, *config.holds)
        }
        if config.heartbeat is not None:
            found["heartbeat"] = sdk.Out(Empty, config.heartbeat, qos="command", rate=cls.rate)
        return super().ports(config) | {name: port.named(name) for name, port in found.items()}

    @classmethod
    def capabilities(cls, config: SafetyControllerConfig) -> tuple[sdk.Capability, ...]:
        """Declare how fast it moves the base."""
        speed, rate = sdk.Setting(config.back_speed, "back_speed"), sdk.Setting(config.turn_rate, "turn_rate")
        return (sdk.CommandsMotion("cmd_vel", speed, rate, protects=True),)

    def configure(self) -> None:
        """Have heard nothing yet."""
        config = self.config
        self.core = SafetyCore(config)
        self.topics = {port_of(topic): topic for topic in (*config.evades, *config.holds)}
        self.has_commanded = False
        self.misses_since = math.inf  # when a silence counts as a fault: sensors may begin a little later [s]
        self.reported: tuple[Level, str] | None = None

    def reconfigure(self, old: SafetyControllerConfig) -> None:
        """Apply the new settings from now on."""
        self.core.settings = self.config
        if not self.config.enabled:
            self.core.forget(self.now)

    def received(self, port: str, message: Switches) -> None:
        """Take which switches are on, and react at once."""
        names, angles, states = message.name, message.angle, message.is_on
        if not (len(names) == len(angles) == len(states) and np.isfinite(angles).all()):
            self.core.distrust(self.topics[port])
            self.act()
            raise sdk.Refused("each switch has a name, a finite angle and whether it is on")
        on = {name: angle for name, angle, is_on in zip(names, angles.tolist(), states, strict=True) if is_on}
        self.core.feel(self.topics[port], on, self.now)
        if on or self.core.phase is not SafetyPhase.WATCH:
            self.act()

    def step(self, dt: float) -> None:
        """Command the base, if something is felt or a sensor is silent, and tell that it works."""
        self.act()
        if self.config.heartbeat is not None:
            self.bound["heartbeat"](Empty())

    def act(self) -> None:
        """Command the base for now; the last command is a stop."""
        if self.context.is_stopped:
            return
        wanted = self.core.command(self.now) if self.config.enabled else None
        if wanted is not None or self.has_commanded:
            velocity = wanted or Velocity2()
            self.cmd_vel(twist_message(velocity))
        self.has_commanded = wanted is not None
        self.report()

    def start(self) -> None:
        """Expect all sensors from now on."""
        self.misses_since = min(self.misses_since, self.now + self.core.settings.silence)

    def stop(self) -> None:
        """Start over after `release`."""
        self.core.forget(self.now)

    def go_on(self) -> None:
        """Count the silence anew: robot time stood still."""
        self.core.forget(self.now)

    def report(self) -> None:
        """Report what it does, if that has changed."""
        silent, held, phase = self.core.silent(self.now), self.core.held, self.core.phase
        if not silent:
            self.misses_since = -math.inf
        if not self.config.enabled:
            level, text = Level.WARN, "is off: nothing keeps the robot from bumping and falling"
        elif silent:
            level = Level.ERROR if self.now > self.misses_since else Level.OK
            text = f"holds the base: {' and '.join(silent)} {'is' if len(silent) == 1 else 'are'} silent"
        elif held:
            level, text = Level.ERROR, f"holds the base: {' and '.join(held)}"
        elif phase is SafetyPhase.WATCH:
            level, text = Level.OK, "holds the base for a moment" if self.has_commanded else "nothing is felt"
        else:
            felt = " and ".join(self.core.felt)
            level = Level.ERROR if phase is SafetyPhase.STUCK else Level.WARN
            text = DOES[phase] + (f": {felt}" if felt else "")
        if (level, text) != self.reported:
            self.reported = level, text
            self.status(level, text)
            if level is Level.ERROR:
                self.warn(text)


def port_of(topic: str) -> str:
    """Return the name of the input of a topic."""
    return topic.strip("/").replace("/", "_")
