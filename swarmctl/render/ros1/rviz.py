"""RViz for the robots of one master: a display file, and the launch file that opens it. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from swarmctl.render.bundle import File
from swarmctl.render.quoting import render
from swarmctl.render.yaml_params import file_of, lines
from swarmctl.swarm.resolved import Robot

MAP = "map"
_ARROW = 0.1  # m
_WIDTH, _HEIGHT = 1200, 800  # pixels; without them RViz opens a window of some 400
_SHAPE = {"Shape": {"Value": "Arrow", "Shaft Length": _ARROW, "Head Length": _ARROW / 3}}
_DISPLAYS: Mapping[str, tuple[str, Mapping[str, Any]]] = {  # by message type: the display and its settings
    "nav_msgs/Odometry": ("Odometry", {"Keep": 100, **_SHAPE, "Covariance": {"Value": False}}),
    "sensor_msgs/LaserScan": ("LaserScan", {"Size (m)": 0.02, "Style": "Flat Squares"}),
    "geometry_msgs/PoseStamped": (
        "Pose",
        {"Shape": "Arrow", "Shaft Length": _ARROW, "Head Length": _ARROW / 3},
    ),
}


def files(robots: Sequence[Robot]) -> Iterator[File]:
    """Yields the files that show those of ``robots`` of which RViz can show something."""
    shown = [one for one in robots if any(_of(one))]
    if shown:
        described = [(one.namespace[1:], one.frame_prefix) for one in shown if one.is_described]
        text = file_of(*(lines(key, value) for key, value in displays(shown).items()))
        yield File("rviz/swarm.rviz", text, origin="robots")
        yield File("launch/view.launch", render("view.launch", described=described), origin="robots")


def displays(robots: Sequence[Robot]) -> dict[str, Any]:
    """Returns the content of an RViz display file: a group of displays for each robot.

    The fixed frame is `map` where a robot has a start pose, else the first robot's odometry frame.
    """
    started = any(robot.start is not None for robot in robots)
    shown: list[dict[str, Any]] = [
        {"Class": "rviz/Grid", "Name": "Grid", "Enabled": True, "Reference Frame": "<Fixed Frame>"},
        {"Class": "rviz/TF", "Name": "TF", "Enabled": True, "Marker Scale": 0.2, "Show Names": False},
        *(
            {"Class": "rviz/Group", "Name": one.name, "Enabled": True, "Displays": [*_of(one)]}
            for one in robots
        ),
    ]
    return {
        "Panels": [{"Class": f"rviz/{name}", "Name": name} for name in ("Displays", "Views")],
        "Visualization Manager": {
            "Class": "",
            "Displays": shown,
            "Enabled": True,
            "Global Options": {"Fixed Frame": MAP if started else robots[0].odom_frame, "Frame Rate": 30},
            "Name": "root",
            "Tools": [{"Class": "rviz/MoveCamera"}, {"Class": "rviz/Select"}, {"Class": "rviz/Measure"}],
            "Views": {"Current": {"Class": "rviz/TopDownOrtho", "Name": "Current View", "Scale": 200}},
        },
        "Window Geometry": {"Width": _WIDTH, "Height": _HEIGHT},
    }


def _of(robot: Robot) -> Iterator[dict[str, Any]]:
    """Yields the displays of a robot: its model, and one for each topic of a type that RViz shows."""
    if robot.is_described:
        yield {
            "Class": "rviz/RobotModel", "Name": "RobotModel", "Enabled": True,
            "Robot Description": f"{robot.namespace}/robot_description", "TF Prefix": robot.frame_prefix,
        }  # fmt: skip
    for topic in robot.topics:
        if topic.type in _DISPLAYS:
            kind, settings = _DISPLAYS[topic.type]
            name = robot.full_name(topic.name)
            yield {
                "Class": f"rviz/{kind}",
                "Name": topic.name,
                "Enabled": True,
                "Topic": name,
                **settings,
            }
