"""Where the real ROS 2 is."""

from pathlib import Path

import pytest

ENVIRONMENT = Path(__file__).parents[2] / ".ros2"


@pytest.fixture(scope="session")
def ros2_python() -> Path:
    """Return the Python that has rclpy."""
    if not (ENVIRONMENT / ".made").exists():
        pytest.skip("needs a ROS 2: make ros2")
    return ENVIRONMENT / "bin/python"
