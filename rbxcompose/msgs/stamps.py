"""Times in messages: `builtin_interfaces` from and to nanoseconds and seconds."""

from rbxcompose.msgs.builtin_interfaces import Duration, Time

NANOSECONDS = 1_000_000_000
LONGEST = 2.0**31 - 1  # [s] that a duration can hold


def to_time(nanoseconds: int) -> Time:
    """Return a stamp [ns] as a message."""
    sec, nanosec = divmod(nanoseconds, NANOSECONDS)
    return Time(sec=sec, nanosec=nanosec)


def to_nanoseconds(time: Time) -> int:
    """Return a stamp from a message in [ns]."""
    return time.sec * NANOSECONDS + time.nanosec


def to_duration(seconds: float) -> Duration:
    """Return a duration [s] as a message."""
    sec, nanosec = divmod(round(seconds * NANOSECONDS), NANOSECONDS)
    return Duration(sec=sec, nanosec=nanosec)


def to_seconds(duration: Duration) -> float:
    """Return a duration from a message in [s]."""
    return duration.sec + duration.nanosec / NANOSECONDS
