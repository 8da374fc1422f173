"""Speech without a loudspeaker: it takes as long as the words would."""

from rbxcompose.sdk import Activity, skill

PER_WORD = 0.4  # [s] per word of unhurried speech


@skill("say", claims="voice", pausable=True)
class Say(Activity):
    """Say words. Without a component `voice` they are only logged, and take the time that speaking would take.

    Example:
        say: the kitchen is clean
    """

    def start(self, words: str) -> None:
        """Begin with the first word."""
        self.left = PER_WORD * len(words.split())  # [s]
        self.now: float | None = None  # [s] of the last step

    def step(self, now: float) -> bool | None:
        """Be done when all words have been said."""
        if self.now is not None:
            self.left -= now - self.now
        self.now = now
        return True if self.left <= 1e-9 else None

    def resume(self, now: float) -> None:
        """Do not count the pause."""
        self.now = now
