"""The keys of a program: what runs, where, in which namespace, and with what beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from swarmctl.field_types import (
    NO_VARS,
    EnvironmentKey,
    FilePath,
    HostName,
    Model,
    Name,
    Namespace,
    PackageName,
    Parameter,
    RobotName,
    SelectedHost,
    SelectedRobot,
    VariableName,
)
from swarmctl.named_secret import Secret
from swarmctl.robot_types.ros_launchable import Device, RosLaunchable, Service, Topic, Words
from swarmctl.spec.install_model import Install
from swarmctl.text_patterns import matching
from swarmctl.units import Unit

Megabytes = Annotated[int, Field(le=16 << 20), Unit("MB")]  # systemd ignores a limit beyond 64 bits
#: What a program can be, in the order in which one is taken where a spec gives several.
Kind = Literal["use", "launch", "executable", "command", "container"]

#: When a program runs.
Lifecycle = Literal["service", "oneshot", "trial", "interactive"]

#: An image by its digest, or by its ID if it is in no registry: a tag may be another image tomorrow.
Image = Annotated[str, matching(
    r"^([a-z0-9][A-Za-z0-9._:/-]*@)?sha256:[0-9a-f]{64}$",
    "pin the image by its digest, NAME@sha256:..., as `podman images --digests` shows it", max_length=255,
    examples=["docker.io/library/ros@sha256:" + "5" * 64],
)]  # fmt: skip
Volume = Annotated[str, matching(
    r"^/[A-Za-z0-9._/+=@,~-]*:/[A-Za-z0-9._/+=@,~-]+(:ro|:rw)?$",
    "write the place on the host and in the container, like /home/robot/maps:/maps:ro", max_length=1000,
    examples=["/home/robot/maps:/maps:ro"],
)]  # fmt: skip
#: Tags of the two forms of a file; brackets mark a step that is in no file.
COPY, TEMPLATE = "[copy]", "[template]"


class Template(Model):
    """A file that is made for each host, with the values of the spec."""

    template: FilePath = Field(
        description="A Jinja template beside the spec; docs/programs.md has what it can use."
    )


def _file_form(value: Any) -> str:
    return TEMPLATE if isinstance(value, (dict, Template)) else COPY


ProgramFile = Annotated[
    Annotated[FilePath, Tag(COPY)] | Annotated[Template, Tag(TEMPLATE)], Discriminator(_file_form)
]


#: The name of a file in the folder of a program's secrets.
SecretFile = Annotated[str, matching(
    r"^[A-Za-z0-9_][A-Za-z0-9_.+-]{0,99}$",
    "the file's name alone, of letters, digits and _ . + -; its folder is `{secrets}` in the command",
    examples=["key.pem"], max_length=100,
)]  # fmt: skip


class ProgramSecrets(Model):
    """The secrets that a program gets; their values are in no spec and in no release."""

    env: dict[EnvironmentKey, Secret] = Field(
        default_factory=dict,
        examples=[{"TOKEN": {"secret": "cloud-token"}}],
        description="Environment variables with a secret each.",
    )
    files: dict[SecretFile, Secret] = Field(
        default_factory=dict,
        examples=[{"key.pem": {"secret": "cloud-key"}}],
        description="Files with a secret each, by name; their folder is {secrets} in its command and "
        "arguments, and $SWARM_SECRETS.",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The secrets by name, each once."""
        return tuple(dict.fromkeys(one.secret for one in (*self.env.values(), *self.files.values())))


NO_SECRETS = ProgramSecrets()


class Container(Model):
    """A container on the host's network. The engine pulls the image if it is missing."""

    image: Image = Field(
        description="The image, pinned by its digest: NAME@sha256:...; one that is in no registry by its ID: "
        "sha256:..."
    )
    engine: Literal["podman", "docker"] = Field("podman", description="What runs it.")
    command: Words = Field(
        (),
        examples=[["rosrun", "map_server", "map_saver"]],
        description="The command, if not the image's own.",
    )
    devices: tuple[Device, ...] = Field((), description="Devices of the host that it may use.")
    volumes: tuple[Volume, ...] = Field(
        (), description="Folders and files of the host in it, as HOST:CONTAINER or HOST:CONTAINER:ro."
    )
    privileged: bool = Field(False, description="Whether it has every right of root on the host.")


class Program(RosLaunchable):
    """A program of the swarm: one that swarmctl ships, a node of a package, a launch file, any command, or a
    container.
    """

    host: HostName | None = Field(None, description="The host it runs on.")
    robot: RobotName | None = Field(
        None,
        description="The robot in whose namespace it runs, on that robot's host unless `host` is given.",
    )
    hosts: tuple[SelectedHost, ...] = Field(
        (),
        description="Hosts, or selections of them: one program for each, named like `<program>-<host>`.",
    )
    robots: tuple[SelectedRobot, ...] = Field(
        (),
        description="Robots, or selections of them: one program for each, named like `<program>-<robot>`.",
    )
    needs: tuple[Name, ...] = Field(
        (),
        examples=[["kinect"]],
        description="What its host must have (`has` of hosts). Without `host` and `robot` it runs on the "
        "first host that has all of it.",
    )
    use: Name | None = Field(None, description="A program that swarmctl ships.", examples=["teleop-joy"])
    command: Annotated[Words, Field(min_length=1)] | None = Field(
        None,
        examples=[["rosbag", "record", "-a"]],
        description="Any command, as a list of words. No shell reads it; placeholders such as {host} are "
        "replaced.",
    )
    container: Container | None = Field(None, description="A container, run by podman or docker.")
    namespace: Namespace | None = Field(
        None, description="Its ROS namespace, without a slash in front; by default its robot's, or none."
    )
    files: dict[FilePath, ProgramFile] = Field(
        default_factory=dict,
        examples=[{"slam.yaml": "config/slam.yaml"}],
        description="Files beside the spec that its host gets, by their name there; the folder is {files} in "
        "its command and arguments, and $SWARM_FILES.",
    )
    secrets: ProgramSecrets = Field(
        default_factory=lambda: NO_SECRETS, description="Secrets as variables and files."
    )
    lifecycle: Lifecycle = Field(
        "service",
        description="A service runs for good, and is started again if it ends. A oneshot runs once, and "
        "`status` checks its exit code. One of a trial runs once in each trial of the experiments that name "
        "it. An interactive program is started by a person at a terminal.",
    )
    publishes: tuple[Topic, ...] = Field((), description="Topics it publishes.")
    subscribes: tuple[Topic, ...] = Field((), description="Topics it subscribes to.")
    provides: tuple[Service, ...] = Field(
        (),
        examples=[[{"name": "save_map", "type": "std_srvs/srv/Trigger"}]],
        description="Services and actions it provides; `status` checks them.",
    )
    calls: tuple[Service, ...] = Field((), description="Services and actions of others that it calls.")
    requires: tuple[PackageName, ...] = Field(
        (), description="ROS packages without which it cannot run.", examples=[["joy"]]
    )
    board: Name | None = Field(
        None,
        description="The microcontroller it speaks rosserial with; its topics are the sketch's.",
        examples=["arduino-uno"],
    )
    memory_mb: Annotated[Megabytes, Field(ge=1, examples=[300])] | None = Field(
        None, description="Memory it takes."
    )
    install: Install = Field(
        default_factory=Install, description="What `swarmctl prepare` installs on its host for it."
    )
    optional: bool = Field(False, description="Whether the swarm is complete without it.")
    vars: dict[VariableName, Parameter] = Field(
        default_factory=lambda: NO_VARS,
        description="Values of variables in this program; these win over its robot's and its host's.",
        examples=[{"rate": 10}],
    )

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """What it is; a valid program is exactly one thing."""
        found: dict[Kind, object] = {
            "use": self.use, "launch": self.launch, "executable": self.executable,
            "command": self.command, "container": self.container,
        }  # fmt: skip
        return tuple(kind for kind, value in found.items() if value is not None)

    @property
    def file_params(self) -> dict[str, str]:
        """The parameters that are loaded from a file beside the spec, `{file: PATH}`, with its path."""
        return {
            name: value["file"]
            for name, value in (self.params.items() if self.launch is None else ())
            if isinstance(value, Mapping) and set(value) == {"file"} and isinstance(value["file"], str)
        }

    @property
    def beside(self) -> tuple[str, ...]:
        """The paths of all files beside the spec that it gets."""
        own = [one.template if isinstance(one, Template) else one for one in self.files.values()]
        return tuple(dict.fromkeys((*own, *self.file_params.values())))

    @property
    def names_its_node(self) -> bool:
        """True if the name of its node is known: anything else than these names its nodes itself."""
        return self.kinds[:1] in ((), ("use",), ("executable",))
