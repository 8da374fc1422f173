"""Where a simulated robot is in its map: its simulator knows."""

from __future__ import annotations

import numpy as np

from rbxcompose import sdk
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.frames import BASE, ODOM, odom_in_map
from rbxcompose.domains.worlds.poses import pose_in
from rbxcompose.domains.worlds.world import MAP_FRAME
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage


class FakeLocalisationConfig(sdk.Config):
    """It has no settings."""


@sdk.component("fake_localisation")
class FakeLocalisation(sdk.Component[FakeLocalisationConfig]):
    """Publishes where `odom` is in `map` by the true pose of a simulated base, however wrong its odometry is.

    Example:
        localisation: {type: fake_localisation}
    """

    made_by = "The section `navigation` runs it."
    rate = 20.0
    tf = sdk.Out(TFMessage, "/tf")
    estimate = sdk.Out(geometry.PoseWithCovarianceStamped, "amcl_pose", qos="latched")
    truth = sdk.In(Odometry, "ground_truth")
    odometry = sdk.Looks(source=BASE, target=ODOM)

    @classmethod
    def capabilities(cls, config: FakeLocalisationConfig) -> tuple[sdk.Capability, ...]:
        """Declare the frame that it places."""
        return (sdk.WritesFrame("tf", sdk.Setting(MAP_FRAME), sdk.Setting(ODOM)),)

    def configure(self) -> None:
        """Know nothing yet."""
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
        self.tf(odom_in_map(self.correction, self.stamp))
        if self.estimate.is_wanted:
            pose = geometry.PoseWithCovariance(truth.pose.pose, np.zeros(36))
            self.estimate(geometry.PoseWithCovarianceStamped(Header(truth.header.stamp, MAP_FRAME), pose))
