"""Runs on a host with a master: what a node of ROS 1 gets from the files that roslaunch loads for it.

For files by their paths: the error of roslaunch in each launch file among them.
"""

import json
import sys
from pathlib import Path

import rosgraph
from roslaunch import config as launch_config
from roslaunch import substitution_args
from roslaunch.launch import ROSLaunchRunner

FILE, LAUNCH, PLACE = Path("/tmp/scan.yaml"), Path("/tmp/scan.launch"), "/k3/scan"
TEXT = f"""<launch><node pkg="a" type="b" name="scan" ns="k3"><rosparam file="{FILE}" /></node></launch>"""


def plain(value):
    """Numbers with a decimal point as text, which JSON does not round and which may be infinite."""
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, dict):
        return {"map": {key: plain(one) for key, one in value.items()}}
    return [plain(one) for one in value] if isinstance(value, list) else value


def read(master, text):
    FILE.write_text(text, "utf-8")
    if master.hasParam(PLACE):
        master.deleteParam(PLACE)
    try:
        config = launch_config.load_config_default([str(LAUNCH)], 11311, verbose=False)
        ROSLaunchRunner("id", config, None, None, None, None)._load_parameters()
    except Exception as error:  # noqa: BLE001  # each is a refusal
        return {"error": str(error)}
    return {"values": plain(master.getParam(PLACE) if master.hasParam(PLACE) else {})}


def load(files):
    for path, text in files.items():
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        Path(path).write_text(text, "utf-8")
        Path(path).chmod(0o755)
    substitution_args._rospack = None  # the packages that it has found before
    found = {}
    for path in files:
        if path.endswith(".launch"):
            try:
                launch_config.load_config_default([path], 11311, verbose=False)
            except Exception as error:  # noqa: BLE001  # each is a refusal
                found[path] = str(error)
    return found


launch_config.load_roscore = lambda *_, **__: None  # it runs programs, to set the version of ROS
LAUNCH.write_text(TEXT)
master = rosgraph.Master("/reader")
for line in sys.stdin:
    given = json.loads(line)
    print(json.dumps(load(given) if isinstance(given, dict) else read(master, given)), flush=True)
