#!/usr/bin/env python3
"""Stands in for the driver of a robot in a lab: ``stand_in.py`` in the robot's namespace."""

from __future__ import annotations

import os
from pathlib import Path

from swarm_onboard.stand_in.topics import run

if __name__ == "__main__":
    run(Path(__file__).resolve().parent / "robots", Path(os.environ.get("ROS_HOME") or "."))
