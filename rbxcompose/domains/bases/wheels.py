"""Bases on two wheels: velocities of the base and of its wheels within limits, and where the base is."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import astuple, replace

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Pose2, Transform3, Velocity2
from rbxcompose.domains.bases.driving import ABSURD
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import transform_message, twist_message
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

ROUNDING = 1e-12  # a smaller difference of velocities counts as none [m/s, rad/s]
UNKNOWN = 1e6  # variance of what wheels cannot measure: height, roll, pitch
PLANAR = (0, 1, 5)  # x, y, and the turn about z, of the six that a covariance has
KEPT = 0.05, 0.1  # [m], [rad] of motion after which a place is kept again for a restart
KEPT_AT_REST = 0.001, 0.005  # [m], [rad] after which it is when the base rests
PATIENCE = 0.5  # [s] for which a base that starts again reports no place unless it has the last one


class VelocityWindow:
    """Averages a velocity over the last `duration` [s]; between two steps it is a straight line.

    The acceleration of the mean is (v(t) - v(t - duration)) / duration. If that of v is at most a, the jerk is at most
    2 a / duration. A mean exceeds no limit of its values, and does not leave the line on which they are.
    """

    def __init__(self, duration: float) -> None:
        self.duration = duration
        self._steps: deque[tuple[float, Velocity2, Velocity2]] = deque()  # how long each took, from where to where
        self._last = AT_REST

    def add(self, velocity: Velocity2, dt: float) -> Velocity2:
        """Return the mean when the velocity has become `velocity` within `dt` [s]; before the first step it was 0."""
        before, self._last = self._last, velocity
        if self.duration <= 0.0:
            return velocity
        self._steps.append((dt, before, velocity))
        linear = angular = 0.0
        left, used = self.duration, 0
        for length, start, end in reversed(self._steps):
            if left <= 0.0:
                break
            used += 1
            part = min(length, left)
            middle = 1.0 - part / length / 2.0  # the mean of the last part of a straight line
            linear += part * (start.linear + (end.linear - start.linear) * middle)
            angular += part * (start.angular + (end.angular - start.angular) * middle)
            left -= part
        while len(self._steps) > used:
            self._steps.popleft()
        return Velocity2(linear / self.duration, angular / self.duration)


@dataclass(frozen=True, slots=True)
class WheelGeometry:
    """Wheels and what is measured of them. ValueError if it cannot be."""

    wheel_distance: float
    """Between the points where the wheels touch the ground [m]."""
    metres_per_unit: float
    """Way of a wheel for each unit of its position [m/rad or m/tick]."""
    counts: float | None = None
    """Positions start again at 0 after this much [rad or ticks]; None if they go on."""

    def __post_init__(self) -> None:
        for value in (self.wheel_distance, self.metres_per_unit):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"distances and radii must be positive and finite, not {value}")

    def wheels(self, velocity: Velocity2) -> WheelSpeeds:
        """Return the speeds of the wheels [units/s] that move the base at `velocity`."""
        half = velocity.angular * self.wheel_distance / 2.0
        scale = self.metres_per_unit
        return WheelSpeeds((velocity.linear - half) / scale, (velocity.linear + half) / scale)

    def fastest(self, velocity: Velocity2) -> float:
        """Return the speed of the faster wheel [units/s] at a velocity of the base."""
        wheels = self.wheels(velocity)
        return max(abs(wheels.left), abs(wheels.right))

    def velocity(self, wheels: WheelSpeeds) -> Velocity2:
        """Return the velocity of the base whose wheels turn at these speeds [units/s] and do not slip."""
        left, right = wheels.left * self.metres_per_unit, wheels.right * self.metres_per_unit
        return Velocity2((left + right) / 2.0, (right - left) / self.wheel_distance)

    def turned(self, new: float, old: float) -> float:
        """Return how far a wheel has turned from one position to another [units], the shorter way round."""
        counts = self.counts
        return new - old if counts is None else (new - old + counts / 2) % counts - counts / 2


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Of the left and the right wheel, in units of their positions per second: [rad/s] or [ticks/s]."""

    left: float = 0.0
    right: float = 0.0


@dataclass(frozen=True, slots=True)
class BaseLimits:
    """Limits of a base, all above 0."""

    speed: float = 0.5
    """[m/s], forwards and backwards."""
    turn_rate: float = math.radians(90)
    """[rad/s]."""
    acceleration: float = 1.0
    """Speeding up and braking [m/s^2]."""
    turn_acceleration: float = 3.0
    """[rad/s^2]."""
    jerk: float | None = None
    """[m/s^3]; None is none."""
    turn_jerk: float | None = None
    """[rad/s^3]; None is none."""

    def __post_init__(self) -> None:
        if not all(value > 0.0 for value in astuple(self) if value is not None):
            raise ValueError("limits of a base are above 0")

    def of_wheels(self, geometry: WheelGeometry, acceleration: float) -> BaseLimits:
        """Return these limits, tightened so that no wheel accelerates by more than `acceleration` [units/s^2]."""
        needed = geometry.fastest(Velocity2(self.acceleration, self.turn_acceleration))
        part = min(1.0, acceleration / needed)
        return replace(self, acceleration=self.acceleration * part, turn_acceleration=self.turn_acceleration * part)

    @property
    def smoothing(self) -> float:
        """Over how long velocities are averaged [s], so that the jerk is kept: see `VelocityWindow`."""
        pairs = ((self.acceleration, self.jerk), (self.turn_acceleration, self.turn_jerk))
        return max((2.0 * acceleration / jerk for acceleration, jerk in pairs if jerk is not None), default=0.0)


class TwistLimiter:
    """Leads the velocity of a base towards a target within its limits.

    What is too much is scaled as a whole: forwards and turning keep their ratio, and so does the curvature of the path
    from rest to a velocity and back to rest.
    """

    def __init__(self, limits: BaseLimits) -> None:
        self.limits = limits
        self.rest()

    def rest(self) -> None:
        """Start again from rest."""
        self.velocity = AT_REST
        self._ramp = AT_REST  # the velocity before it is averaged
        self._window = VelocityWindow(self.limits.smoothing)

    def within(self, velocity: Velocity2) -> Velocity2:
        """Return a velocity scaled to the limits of speed and turn rate."""
        return _scaled(velocity, min(1.0, 1.0 / max(self.excess(velocity), 1.0)))

    def excess(self, velocity: Velocity2) -> float:
        """Return how many times too fast a velocity is."""
        return max(abs(velocity.linear) / self.limits.speed, abs(velocity.angular) / self.limits.turn_rate)

    def step(self, target: Velocity2, dt: float) -> Velocity2:
        """Return the velocity after `dt` [s] towards `target`."""
        wanted = self.within(target)
        change = Velocity2(wanted.linear - self._ramp.linear, wanted.angular - self._ramp.angular)
        needed = max(
            abs(change.linear) / self.limits.acceleration, abs(change.angular) / self.limits.turn_acceleration
        )  # [s]
        if needed <= dt + ROUNDING:
            self._ramp = wanted
        else:
            part = _scaled(change, dt / needed)
            self._ramp = Velocity2(self._ramp.linear + part.linear, self._ramp.angular + part.angular)
        self.velocity = self._window.add(self._ramp, dt)
        return self.velocity


class WheelDrive:
    """Follows commands for the velocity of a base; without new ones it brakes within its limits."""

    def __init__(
        self, geometry: WheelGeometry, limits: BaseLimits, command_timeout: float = 0.5, wheel_speed: float = math.inf
    ) -> None:
        """`command_timeout` [s] is how long a command holds; 0 is for ever. `wheel_speed` limits wheels [units/s]."""
        self.geometry = geometry
        self.wheel_speed = wheel_speed
        self.limiter = TwistLimiter(limits)
        self.command_timeout = command_timeout
        self.clamped = 0  # commands that were scaled down to a limit
        self._target = AT_REST
        self._until = -math.inf
        self._braking = False

    @property
    def velocity(self) -> Velocity2:
        """The velocity that the wheels are to have now."""
        return self.limiter.velocity

    @property
    def at_rest(self) -> bool:
        """Return whether the wheels are to stand still."""
        return self.velocity == AT_REST

    @property
    def is_commanded(self) -> bool:
        """Return whether a command holds."""
        return self._until > -math.inf

    def command(self, velocity: Velocity2, now: float) -> str | None:
        """Accept the velocity to reach; return why it is refused, else None. While braking it is ignored."""
        excess = self.limiter.excess(velocity) if velocity.is_finite else math.inf
        if excess > ABSURD:
            return _refusal(velocity, excess)
        target = self._within_wheels(self.limiter.within(velocity))
        self.clamped += target != velocity
        if not self._braking:
            self._target = target
            self._until = now + self.command_timeout if self.command_timeout else math.inf
        return None

    def _within_wheels(self, velocity: Velocity2) -> Velocity2:
        """Return a velocity scaled to what the wheels can do."""
        fastest = self.geometry.fastest(velocity)
        return velocity if fastest <= self.wheel_speed else _scaled(velocity, self.wheel_speed / fastest)

    def forget(self) -> None:
        """Come to rest, and stay there until the next command."""
        self._until = -math.inf

    def rest(self) -> None:
        """Be at rest at once: the wheels are not driven any more."""
        self.forget()
        self.limiter.rest()

    def brake(self) -> None:
        """Come to rest and stay there, whatever is commanded, until `release`."""
        self._braking = True
        self.forget()

    def release(self) -> None:
        """Follow commands again; the base stays at rest until the next one."""
        self._braking = False

    def step(self, now: float, dt: float) -> WheelSpeeds:
        """Return the speeds of the wheels at `now`, `dt` [s] after the last ones.

        A command holds up to its deadline, not to the end of the step. ValueError if `dt` is not above 0.
        """
        if not (math.isfinite(dt) and dt > 0.0):
            raise ValueError(f"a step must be positive and finite, not {dt} s")
        driven = min(max(self._until - (now - dt), 0.0), dt)
        if driven > 0.0:
            self.limiter.step(self._target, driven)
        if driven < dt:
            self.forget()
            self.limiter.step(AT_REST, dt - driven)
        return self.geometry.wheels(self.velocity)


def _refusal(velocity: Velocity2, excess: float) -> str:
    command = f"{velocity.linear:g} m/s and {velocity.angular:g} rad/s"
    return f"{command} is {excess:.1f} times too fast" if velocity.is_finite else f"{command} is not a finite velocity"


def _scaled(velocity: Velocity2, factor: float) -> Velocity2:
    return Velocity2(velocity.linear * factor, velocity.angular * factor)


@dataclass(frozen=True, slots=True)
class OdometryPolicy:
    """How far odometry is trusted."""

    variance_per_metre: float = 1e-4
    """Of the way of a wheel, for each metre of it [m^2/m]."""
    greatest_speed: float = math.inf
    """A wheel that seems faster than this has jumped [m/s]: its way does not count."""
    resolution: float = 0.0
    """Way of a wheel for one tick of its reading [m]."""
    window: float = 0.0
    """Over how long velocities are averaged [s], since ticks make those between two readings rough."""
    stopping: float = math.inf
    """Way of a wheel until the base rests [m]. One that has gone further over a restart counts from elsewhere."""


@dataclass(frozen=True, slots=True)
class OdometryRecord:
    """Where a base and its wheels were, for an odometry that starts again; positions are [rad] or [ticks]."""

    pose: Pose2
    left: float
    right: float
    at: float
    """Robot time [s]."""
    covariance: tuple[float, ...]
    """Of x [m], y [m], heading [rad], row by row."""


class WheelOdometry:
    """Adds up exact arcs between readings: rolling wheels whose speeds keep their ratio lose nothing.

    The covariance of (x, y, heading) grows as in Siegwart and Nourbakhsh, Introduction to Autonomous Mobile Robots,
    section 5.2.4: with the way of each wheel, both independent of each other.
    """

    def __init__(self, geometry: WheelGeometry, policy: OdometryPolicy, pose: Pose2 | None = None) -> None:
        self.geometry, self.policy = geometry, policy
        self.pose = pose or Pose2()
        self.velocity = AT_REST
        self.covariance: Array = np.zeros((3, 3))  # of x [m], y [m], heading [rad]
        self.velocity_covariance: Array = np.zeros((2, 2))  # of linear [m/s], angular [rad/s]
        self._last: tuple[float, float, float] | None = None  # left, right, time
        self._ways = (0.0, 0.0)  # of the wheels so far [m]
        self._past: deque[tuple[float, float, float]] = deque()  # time and ways, over the window
        self._furthest = math.inf  # way of a wheel since the last reading, above which it counts from elsewhere [m]

    @property
    def record(self) -> OdometryRecord | None:
        """Return where it is; None before the first reading."""
        if self._last is None:
            return None
        return OdometryRecord(self.pose, *self._last, tuple(self.covariance.ravel().tolist()))

    def go_on_from(self, record: OdometryRecord) -> None:
        """Be where a base was before a restart, moved by what its wheels have turned since."""
        self.pose, self._last = record.pose, (record.left, record.right, record.at)
        self.covariance = np.array(record.covariance).reshape(3, 3)
        self._past = deque([(record.at, *self._ways)])
        self._furthest = self.policy.stopping

    def lose_wheels(self) -> None:
        """Stay here until the next reading: encoders have started again, and count from elsewhere."""
        self.velocity, self._last = AT_REST, None
        self._past.clear()

    def update(self, left: float, right: float, now: float) -> str | None:
        """Take in positions of the wheels [rad or ticks] at `now` [s]; return why they do not count, else None.

        The first ones are where it starts; those of the same moment, or of an earlier one, do not count.
        """
        if not (math.isfinite(left) and math.isfinite(right) and math.isfinite(now)):
            return f"the wheels are at {left} and {right}, at {now} s: not finite"
        before = self._last
        if before is not None and now <= before[2]:
            return f"a reading of {now:.3f} s came after one of {before[2]:.3f} s"
        self._last = (left, right, now)
        if before is None:
            self._past.append((now, *self._ways))
            return None
        dt = now - before[2]
        turned = self.geometry.turned
        wheels = WheelSpeeds(turned(left, before[0]) / dt, turned(right, before[1]) / dt)
        way = max(abs(wheels.left), abs(wheels.right)) * self.geometry.metres_per_unit * dt
        furthest, self._furthest = self._furthest, math.inf
        if way > furthest:
            spread = np.array((0.5, 0.5, 1.0 / self.geometry.wheel_distance)) * furthest
            self.covariance = self.covariance + np.diag(spread**2)
            return f"a wheel counts from elsewhere since a restart: its way within {dt:.1f} s is not known"
        speed = way / max(dt, self.policy.window)  # readings come late at times, and the next one soon after
        if speed > self.policy.greatest_speed:
            return f"a wheel has jumped: it would have moved at {speed:.3g} m/s"
        self._move(wheels, dt)
        self._average(now)
        return None

    def _move(self, wheels: WheelSpeeds, dt: float) -> None:
        velocity, scale = self.geometry.velocity(wheels), self.geometry.metres_per_unit * dt
        left, right = wheels.left * scale, wheels.right * scale
        self._ways = self._ways[0] + left, self._ways[1] + right
        self._spread(left, right, self.pose.heading + velocity.angular * dt / 2.0)
        self.pose = self.pose.moved(velocity, dt)

    def _average(self, now: float) -> None:
        """Take the velocity from the ways over the window, at least from the last two readings."""
        past = self._past
        past.append((now, *self._ways))
        while len(past) > 2 and past[1][0] <= now - self.policy.window:
            past.popleft()
        time, left, right = past[0]
        span, distance = now - time, self.geometry.wheel_distance
        ways = self._ways[0] - left, self._ways[1] - right
        self.velocity = Velocity2((ways[0] + ways[1]) / 2.0 / span, (ways[1] - ways[0]) / distance / span)
        by_wheels = np.array([[0.5, 0.5], [-1.0 / distance, 1.0 / distance]]) / span
        rounding = self.policy.resolution**2 / 6.0  # of two readings
        noise = np.diag([self.policy.variance_per_metre * abs(way) + rounding for way in ways])
        self.velocity_covariance = by_wheels @ noise @ by_wheels.T

    def _spread(self, left: float, right: float, direction: float) -> None:
        """Carry the covariance along, and add that of the ways of both wheels [m]."""
        distance = self.geometry.wheel_distance
        way, cos, sin = (left + right) / 2.0, math.cos(direction), math.sin(direction)
        by_pose = np.array([[1.0, 0.0, -way * sin], [0.0, 1.0, way * cos], [0.0, 0.0, 1.0]])
        turned = way / (2.0 * distance)
        by_wheels = np.array(
            [
                [cos / 2.0 + turned * sin, cos / 2.0 - turned * sin],
                [sin / 2.0 - turned * cos, sin / 2.0 + turned * cos],
                [-1.0 / distance, 1.0 / distance],
            ]
        )
        noise = self.policy.variance_per_metre * np.diag([abs(left), abs(right)])
        self.covariance = by_pose @ self.covariance @ by_pose.T + by_wheels @ noise @ by_wheels.T


class OdometryKeeper:
    """What the supervisor keeps of an odometry, for a base that starts again; until then that base reports no place."""

    def __init__(self, odometry: WheelOdometry, *, is_again: bool) -> None:
        self._odometry = odometry
        self.kept: OdometryRecord | None = None
        self._reports_from = math.inf if is_again else -math.inf

    def start(self, now: float) -> None:
        """Wait no longer than `PATIENCE` from `now` [s]: there may be nothing to recall."""
        self._reports_from = min(self._reports_from, now + PATIENCE)

    def may_report(self, now: float) -> bool:
        """Return whether the place can be reported at `now` [s]."""
        return now >= self._reports_from

    def recall(self, record: OdometryRecord) -> None:
        """Go on where the base was before it started again."""
        self.kept, self._reports_from = record, -math.inf
        self._odometry.go_on_from(record)

    def news(self, *, is_at_rest: bool) -> OdometryRecord | None:
        """Return where the base is, if it has moved so far that this is to be kept, else None."""
        record = self._odometry.record
        if record is not None and self.kept is not None:
            step, (way, turn) = self.kept.pose.inverse().compose(record.pose), KEPT_AT_REST if is_at_rest else KEPT
            if math.hypot(step.x, step.y) <= way and abs(step.heading) <= turn:
                return None
        self.kept = record or self.kept
        return record


def odometry_message(known: WheelOdometry, header: Header, child: str) -> Odometry:
    """Return where a base is in the frame of `header`, and how its frame `child` moves."""
    place = _place(known)
    at = place.translation
    pose = geometry.Pose(position=geometry.Point(at.x, at.y, at.z), orientation=place.rotation)
    spread = np.zeros((3, 3))
    spread[np.ix_((0, 2), (0, 2))] = known.velocity_covariance  # a wheel does not slip sideways
    return Odometry(
        header=header,
        child_frame_id=child,
        pose=geometry.PoseWithCovariance(pose=pose, covariance=planar(known.covariance)),
        twist=geometry.TwistWithCovariance(twist=twist_message(known.velocity), covariance=planar(spread)),
    )


def odometry_transform(known: WheelOdometry, header: Header, child: str) -> TFMessage:
    """Return the same place as a transform."""
    link = geometry.TransformStamped(header=header, child_frame_id=child, transform=_place(known))
    return TFMessage(transforms=(link,))


def _place(known: WheelOdometry) -> geometry.Transform:
    return transform_message(Transform3.from_pose2(known.pose))


def planar(covariance: Array) -> Array:
    """Return the 36 numbers of a covariance of x, y and the turn about z; the others are unknown."""
    whole = np.diag([UNKNOWN] * 6)
    whole[np.ix_(PLANAR, PLANAR)] = covariance
    return whole.ravel()
