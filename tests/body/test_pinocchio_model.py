"""Bodies in Pinocchio: joints by their names in `q`, and frames by the names of links."""

from __future__ import annotations

import pytest

from rbxcompose.domains.body.pinocchio_model import PinocchioModel
from tests.body.kinematics import description_of

CART = """<robot name="cart">
  <link name="base"/> <link name="wheel"/> <link name="caster"/> <link name="balloon"/> <link name="finger"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 0 2"/></joint>
  <joint name="slip" type="planar">
    <origin xyz="1 2 3"/><parent link="base"/><child link="caster"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="rise" type="floating"><origin rpy="0 0 1"/><parent link="base"/><child link="balloon"/></joint>
  <joint name="bend" type="revolute">
    <parent link="wheel"/><child link="finger"/><axis xyz="1 0 0"/>
    <mimic joint="turn" multiplier="0.5"/><limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
</robot>
"""


def test_a_turning_joint_is_two_entries_of_q_and_its_follower_one() -> None:
    model = PinocchioModel(description_of(CART))
    q = model.q({"turn": 0.4})
    assert q[model.places["turn"] :][:2] == pytest.approx([0.921061, 0.389418], abs=1e-6)
    assert q[model.places["bend"]] == 0.2
    assert {"turn", "bend"} == set(model.places)


def test_planar_and_floating_joints_stay_where_their_origins_are() -> None:
    description = description_of(CART)
    at = {"turn": 0.4, "slip": 9.0, "rise": 9.0}
    model = PinocchioModel(description)
    for link, pose in description.body.poses(at).items():
        found = model.pose(link, at)
        assert found.translation == pytest.approx(pose.translation, abs=1e-9), link
        assert found.rotation == pytest.approx(pose.rotation, abs=1e-9), link
