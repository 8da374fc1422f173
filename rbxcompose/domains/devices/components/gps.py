"""A receiver for satellite navigation."""

from __future__ import annotations

import math

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.levels import Level
from rbxcompose.domains.devices.nmea import (
    GroundVelocity,
    ImpossibleSentenceError,
    SatelliteFix,
    SatelliteReceiver,
    SentenceReader,
)
from rbxcompose.domains.devices.serial_sensor import SerialConfig, SerialSensor
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped, Vector3
from rbxcompose.msgs.sensor_msgs import NavSatFix, NavSatStatus
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

_SERVICES = {"GP": 1, "GL": 2, "GA": 8, "GN": 1 | 2}  # by talker, as NavSatStatus has them
_STATUS = {2: NavSatStatus.STATUS_SBAS_FIX, 4: NavSatStatus.STATUS_GBAS_FIX, 5: NavSatStatus.STATUS_GBAS_FIX}


class GpsConfig(SerialConfig):
    """Which receiver."""

    frame: str = "gps_link"
    """The frame of its antenna."""


@sdk.component("gps")
class Gps(SerialSensor[GpsConfig]):
    """Publishes what a receiver for GPS and other satellites says in NMEA 0183: its place, and how fast it moves.

    Without a fix, `fix` has the status NO_FIX and no numbers, and `vel` is silent; x is east, y is north.

    Example:
        gps: {type: gps, port: /dev/ttyACM0, baud: 9600, frame: gps_link}
    """

    what = "the receiver"
    fix = sdk.Out(NavSatFix, "fix")
    vel = sdk.Out(TwistStamped, "vel")

    def configure(self) -> None:
        """Know nothing yet."""
        super().configure()
        self.sentences, self.receiver = SentenceReader(self.faults), SatelliteReceiver()
        self.last: SatelliteFix | None = None

    def begin(self) -> None:
        """Know nothing: another receiver may be plugged in."""
        self.sentences.forget()
        self.receiver, self.last = SatelliteReceiver(), None

    def take(self, data: bytes) -> None:
        """Publish what whole sentences say."""
        for sentence in self.sentences.feed(data):
            self.understood()
            try:
                found = self.receiver.take(sentence)
            except ImpossibleSentenceError:
                self.faults["impossible sentences"] += 1
                continue
            if isinstance(found, SatelliteFix):
                self.last = found
                self.publish(found, sentence.name[:2])
            elif isinstance(found, GroundVelocity):
                twist = Twist(linear=Vector3(found.east, found.north))
                self.vel(TwistStamped(self.header(), twist))

    def publish(self, fix: SatelliteFix, talker: str) -> None:
        """Publish where the antenna is, or that this is not known."""
        status = _STATUS.get(fix.quality, NavSatStatus.STATUS_FIX) if fix.is_fix else NavSatStatus.STATUS_NO_FIX
        variances = np.diag([fix.variance, fix.variance, fix.vertical_variance]).ravel()
        known = NavSatFix.COVARIANCE_TYPE_APPROXIMATED if fix.is_fix else NavSatFix.COVARIANCE_TYPE_UNKNOWN
        self.fix(
            NavSatFix(
                self.header(),
                NavSatStatus(status, _SERVICES.get(talker, 0)),
                fix.latitude,
                fix.longitude,
                fix.altitude,
                variances if fix.is_fix else np.zeros(9),
                known,
            )
        )

    def header(self) -> Header:
        """Return the header of what is published now."""
        return Header(stamp=to_time(self.stamp), frame_id=self.config.frame)

    def state(self) -> tuple[Level, str]:
        """Return whether there is a fix."""
        if self.last is None:
            return Level.WARN, "the receiver has not said yet where it is: does it send GGA?"
        if not self.last.is_fix:
            return Level.WARN, "NO_FIX: the receiver does not know where it is"
        return Level.OK, f"a fix by {self.last.satellites} satellites"

    def values(self) -> dict[str, str]:
        """Return how good the fix is."""
        if self.last is None or not self.last.is_fix:
            return {}
        flat = {"dimensions": str(self.receiver.dimensions)} if self.receiver.dimensions else {}
        return {"quality": str(self.last.quality), "error": f"{math.sqrt(self.last.variance):.1f} m", **flat}
