"""ROS 2 messages, services and actions: definitions, classes, type hashes and the CDR codec.

Each package of `interfaces/` is a module here, such as `rbxcompose.msgs.geometry_msgs`, without a file of its own.
"""

import sys

from rbxcompose.msgs.registry import PACKAGES

globals().update(PACKAGES)
sys.modules.update({module.__name__: module for module in PACKAGES.values()})
