"""What a mission may ask of a lighthouse, beside blinking."""

from __future__ import annotations

import re

from rbxcompose.sdk import Activity, skill

CHARACTER = re.compile(r"Fl(?:\((\d{1,2})\))? (\d{1,3})s")
COOLING = 0.5  # [s] after each flash


@skill("read_character", outcomes={"unreadable": "failure"})
def read_character(text: str) -> dict[str, float] | str:
    """Read the character of a light as charts have it: `Fl(3) 10s` is three flashes every 10 s."""
    found = CHARACTER.fullmatch(text)
    return {"flashes": int(found[1] or 1), "period": float(found[2])} if found else "unreadable"


@skill("cool_down", claims="lamp", pausable=True)
class CoolDown(Activity):
    """Wait until the lamp has cooled after so many flashes."""

    def start(self, flashes: int) -> None:
        """Take the time from the first step on."""
        self.left = COOLING * flashes  # [s]
        self.until: float | None = None  # [s] of robot time, while it is not held

    def step(self, now: float) -> bool | None:
        """Be done when the time has passed."""
        if self.until is None:
            self.until = now + self.left
        return True if now >= self.until else None

    def pause(self, now: float) -> None:
        """Keep what is left; the next step goes on from there."""
        if self.until is not None:
            self.left, self.until = self.until - now, None
