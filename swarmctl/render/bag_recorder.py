"""The command of a middleware that records topics in bags. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.render.topic_tool import in_release
from swarmctl.resources import HostModule, onboard

# What `rosbag record` runs: it has no option for `--min-space`, below whose 1 GB nothing would be recorded.
_RECORD = (
    "import os, sys; from roslib.packages import find_node; path = find_node('rosbag', 'record')[0]; "
    "os.execv(path, [path, *sys.argv[1:]])"
)


@dataclass(frozen=True)
class BagRecorder:
    """The recorder ``package`` (the ROS package, and its Python module), and the module of a host that looks
    at the graph: ``published(graph)`` of a ``swarm_onboard.agent.recording_messages.Graph`` returns topics.
    """

    package: str
    graph: HostModule

    def command(self, swarm: str, host: str, megabytes: int) -> tuple[str, ...]:
        """Returns the command to which topics are added; a bag of ``megabytes`` is followed by a new one.

        The limits of free space are those of ``swarm_onboard.agent.recorder``.
        """
        words = (
            *("python3", "-c", _RECORD, "--quiet", "--lz4", "--min-space=1M"),
            "--chunksize=64",  # KB that a power cut loses; usually 768
            *("--split", f"--size={megabytes}", "-o", host),
        )
        script = f'topics=("$@"); set --; {in_release(swarm, self.package, words)} "${{topics[@]}}"'
        return ("bash", "-c", script, "record")


ROSBAG = BagRecorder("rosbag", HostModule("swarm_onboard.ros1_probe.published", onboard().parent))
