"""Where a simulated robot is in its map: its simulator knows."""

from __future__ import annotations

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.localiser import BASE, ODOM, Localiser
from rbxcompose.domains.worlds.sensors import TRUTH_REMEDY
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import pose_in
from rbxcompose.msgs.stamps import to_nanoseconds


class FakeLocalisationConfig(sdk.Config):
    """It has no settings."""


@sdk.component("fake_localisation")
class FakeLocalisation(Localiser[FakeLocalisationConfig]):
    """Publishes where `odom` is in `map` by the true pose of a simulated base, however wrong its odometry is.

    Example:
        localisation: {type: fake_localisation}
    """

    made_by = "The section `navigation` runs it."
    rate = 20.0
    truth = sdk.In(Odometry, "ground_truth", remedy=TRUTH_REMEDY)
    odometry = sdk.Looks(source=BASE, target=ODOM)

    def configure(self) -> None:
        """Know nothing yet."""
        super().configure()
        self.correction = Pose2()  # of `odom` in `map`

    def step(self, dt: float) -> None:
        """Compare the newest true pose with the odometry of its time."""
        if (truth := self.truth.value) is None:
            return
        try:
            odometry = self.odometry.transform(at=to_nanoseconds(truth.header.stamp) or None).to_pose2()
        except LookupError:
            return  # diagnostics of transforms say so
        self.correction = pose_in(truth.pose.pose).compose(odometry.inverse())
        self.place(self.correction)
        if self.estimate.is_wanted:
            self.publish_pose(pose_in(truth.pose.pose), np.zeros((3, 3)), truth.header.stamp)
