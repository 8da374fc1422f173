"""Log records: one event of the robot's story, as data and as one line of JSON."""

from __future__ import annotations

import json
from collections.abc import Callable

from rbxcompose.dataclass import dataclass
from rbxcompose.levels import Level


@dataclass(frozen=True, slots=True)
class Record:
    """What `source` (an instance, or `robot` for the whole) reported at robot time `time` [s].

    It holds no wall-clock time and no process id, so that a stepped run writes the same bytes each time.
    `detail` is for the log file only, such as a traceback.
    """

    time: float
    level: Level
    source: str
    text: str
    detail: str = ""

    def to_json(self) -> str:
        """Return the record as one line, without a newline."""
        fields: dict[str, object] = {
            "t": round(self.time, 6),
            "level": self.level.name,
            "source": self.source,
            "text": self.text,
        }
        if self.detail:
            fields["detail"] = self.detail
        return json.dumps(fields, ensure_ascii=False)

    @classmethod
    def from_json(cls, line: str) -> Record:
        """Read what `to_json` wrote.

        Raises:
            ValueError: if the line is torn or is no record.
        """
        fields = json.loads(line)
        try:
            return cls(
                float(fields["t"]), Level[fields["level"]], fields["source"], fields["text"], fields.get("detail", "")
            )
        except (KeyError, TypeError) as error:
            raise ValueError(f"not a log record: {line!r}") from error


WriteRecord = Callable[[Record], None]
