"""As much of rosgraph as the driver node touches."""

from __future__ import annotations

import os


def get_master_uri() -> str:
    return os.environ["ROS_MASTER_URI"]
