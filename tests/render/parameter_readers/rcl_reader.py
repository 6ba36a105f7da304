"""Runs on a host: what a node of ROS 2 gets from the parameter files that come in, as JSON, a line each."""

import json
import sys
from pathlib import Path

import rclpy
from rclpy.node import Node

NODE, NAMESPACE, FILE = "scan", "/k3", "/tmp/scan.yaml"
OWN = {"use_sim_time", "start_type_description_service"}  # parameters of every node


def plain(value):
    """Numbers with a decimal point as text, which JSON does not round and which may be infinite."""
    if isinstance(value, float):
        return {"float": value.hex()}
    return (
        [plain(one) for one in value]
        if isinstance(value, (list, tuple)) or hasattr(value, "tolist")
        else value
    )


def read(context, given):
    files = given if isinstance(given, dict) else {FILE: given}
    for path, text in files.items():
        Path(path).write_text(text, "utf-8")
    words = [word for path in files for word in ("--params-file", path)]
    try:
        node = Node(
            NODE,
            namespace=NAMESPACE,
            context=context,
            cli_args=["--ros-args", *words],
            start_parameter_services=False,
            enable_rosout=False,
            automatically_declare_parameters_from_overrides=True,
        )
    except Exception as error:  # noqa: BLE001  # each is a refusal
        return {"error": str(error)}
    values = {
        name: plain(one.value) for name, one in node.get_parameters_by_prefix("").items() if name not in OWN
    }
    node.destroy_node()
    return {"values": values}


context = rclpy.Context()
rclpy.init(context=context)
for line in sys.stdin:
    print(json.dumps(read(context, json.loads(line))), flush=True)
