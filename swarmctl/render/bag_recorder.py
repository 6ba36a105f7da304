"""The command of a middleware that records topics in bags. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from swarm_onboard.agent.recorder import CODE
from swarm_onboard.ros2_recorder import record

from swarmctl.render.topic_tool import in_release
from swarmctl.resources import HostModule, onboard

# What `rosbag record` runs: it has no option for `--min-space`, below whose 1 GB nothing would be recorded.
_RECORD = (
    "import os, sys; from roslib.packages import find_node; path = find_node('rosbag', 'record')[0]; "
    "os.execv(path, [path, *sys.argv[1:]])"
)
_RECORD_2 = (
    f"import os, sys; sys.path.insert(0, os.environ[{CODE!r}]); from {record.__name__} import main; main()"
)


@dataclass(frozen=True)
class BagRecorder:
    """The program ``words``, the ROS package and Python module that it needs, and the module of a host that
    looks at the graph: ``published(request)`` of a
    ``swarm_onboard.agent.recording_messages.RecordRequest`` returns the hosts that publish each topic.
    """

    package: str
    graph: HostModule
    words: tuple[str, ...]

    def command(self, swarm: str, host: str, megabytes: int) -> tuple[str, ...]:
        """Returns the command to which topics are added; a bag of ``megabytes`` is followed by a new one.

        The limits of free space are those of ``swarm_onboard.agent.recorder``.
        """
        words = (*self.words, f"--size={megabytes}", "-o", host)
        script = f'topics=("$@"); set --; {in_release(swarm, self.package, words)} "${{topics[@]}}"'
        return ("bash", "-c", script, "record")


ROSBAG = BagRecorder(
    "rosbag",
    HostModule("swarm_onboard.ros1_probe.published", onboard().parent),
    (
        *("python3", "-c", _RECORD, "--quiet", "--lz4", "--min-space=1M", "--split"),
        "--chunksize=64",  # KB that a power cut loses; usually 768
    ),
)
MCAP = BagRecorder("rclpy", HostModule(record.__name__, onboard().parent), ("python3", "-c", _RECORD_2))
