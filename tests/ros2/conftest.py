"""Where the real ROS 2 is."""

from pathlib import Path

import pytest

PYTHON = Path(__file__).parents[2] / ".ros2/bin/python"


@pytest.fixture(scope="session")
def ros2_python() -> Path:
    """Return the Python that has rclpy."""
    if not PYTHON.exists():
        pytest.skip("needs a ROS 2: make ros2")
    return PYTHON
