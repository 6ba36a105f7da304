"""What the text patterns of the models allow, in words: an error message never shows a regular expression."""

from __future__ import annotations

from collections.abc import Mapping

NAME = "^[a-z][a-z0-9-]{0,30}$"
ADAPTER = "^hci[0-9]{1,2}$"

PATTERN_TEXTS: Mapping[str, str] = {
    NAME: "names are lower-case letters, digits and hyphens, a letter first, 31 at most",
    "^[A-Za-z_][A-Za-z0-9_.-]{0,31}$": "accounts are letters, digits and _ . -, a letter or _ first",
    ADAPTER: "adapters are called hci0, hci1, ...",
    "^[A-Za-z0-9:._/+=@,#&()-]([A-Za-z0-9:._/+=@,#&() -]{0,62}[A-Za-z0-9:._/+=@,#&()-])?$": (
        "letters, digits, blanks within and : . _ / + = @ , # & ( ) - only, 64 at most, "
        "as `udevadm info -a` shows it"
    ),
    "^[a-z0-9][a-z0-9.+-]{1,100}$": "a Debian package has lower-case letters, digits and . + -, like htop",
    "^[A-Za-z0-9][A-Za-z0-9._+-]{0,100}$": "a name as package.xml has it: letters, digits and . _ + -",
    "^[A-Za-z0-9][A-Za-z0-9._-]{0,100}(==[A-Za-z0-9][A-Za-z0-9.+!_-]{0,60})?$": (
        "a Python package is a name, or a name and an exact version: `numpy` or `numpy==1.24.4`"
    ),
    "^[A-Za-z_][A-Za-z0-9_]*$": "environment variables are letters, digits and _, no digit first",
    "^[A-Za-z0-9][A-Za-z0-9_-]*$": "ROS packages are letters, digits, _ and hyphens, a letter or digit first",
    "^[A-Za-z0-9_][A-Za-z0-9_.+-]*$": (
        "the file's name alone, of letters, digits and _ . + -; roslaunch searches the folders of the "
        "package for it"
    ),
    "^[A-Za-z0-9_][A-Za-z0-9_.+-]{0,99}$": (
        "the file's name alone, of letters, digits and _ . + -; its folder is `{secrets}` in the command"
    ),
    "^[A-Za-z0-9_][A-Za-z0-9_.+-]*(/[A-Za-z0-9_][A-Za-z0-9_.+-]*)*$": (
        "the path of the file within the package's folder `launch`, of letters, digits and _ . + -"
    ),
    r"^(\./)?[A-Za-z0-9_][A-Za-z0-9._+-]*(/[A-Za-z0-9_][A-Za-z0-9._+-]*)*$": (
        "the path of a folder below that of the spec, like ./src/nav"
    ),
    "^(/[A-Za-z0-9_][A-Za-z0-9._-]*)+$": "write the whole path of the folder, like /home/robot/catkin_ws",
    r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$": "text on one line, without control characters",
    r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$": "text without control characters, "
    "line ends and tabs excepted",
    "^[a-z][a-z0-9.-]{0,30}$": "robot types are lower-case letters, digits, dots and hyphens, a letter first",
    "^[a-z][a-z0-9_]{0,30}$": "lower-case letters, digits and _, a letter first, 31 at most",
    "^[A-Za-z][A-Za-z0-9_]{0,30}$": "letters, digits and _, a letter first, 31 at most",
    r"^[A-Za-z{][A-Za-z0-9_/{}.-]*$": (
        "a frame is letters, digits and _ / . -, a letter first, or has placeholders, like {frame}/odom"
    ),
    "^[A-Z][A-Za-z0-9_]{0,60}$": "a class name such as `BeetleCodec`: letters, digits and _, a capital first",
    "^[A-Za-z/%0-9^*-]{1,16}$": "a unit such as `m/s` or `deg` (letters, digits, / % ^ * -), 16 at most",
    r"^[\x20-\x7e]{1,80}$": "a request is 1 to 80 printable ASCII characters, such as `S,{left},{right}`",
    r"^[!-+\--~]{1,16}$": "1 to 16 printable ASCII characters without blanks and commas, such as `s`",
    r"^(?:\t| +|[ ]*[!-*,/:-@\[-`{-~]{1,4}[ ]*)$": (
        "a tab, blanks, or up to four signs such as `;` or `: `, without letters, digits and + - ."
    ),
    r"^[0-9]{1,3}-[0-9]{1,3}(\.[0-9]{1,3}){0,6}$": (
        "a USB port is a bus and the ports on the way, like 1-1.3, as `udevadm info -a` shows it as KERNELS"
    ),
    "^[A-Z]{2,8}[0-9]{3}$": "a rule id has the form SET001; `swarmctl rules` lists them",
    "^[0-9a-fA-F]{4}$": "four hexadecimal digits, in quotes",
    "^[A-Za-z~/][A-Za-z0-9_/]*$": "a ROS name has letters, digits, _ and /, a letter first",
    "^([a-z0-9][A-Za-z0-9._:/-]*@)?sha256:[0-9a-f]{64}$": (
        "pin the image by its digest, NAME@sha256:..., as `podman images --digests` shows it"
    ),
    "^/dev/[A-Za-z0-9._/+=@,~-]+$": "write the path of a device, like /dev/video0",
    "^/[A-Za-z0-9._/+=@,~-]*:/[A-Za-z0-9._/+=@,~-]+(:ro|:rw)?$": (
        "write the place on the host and in the container, like /home/robot/maps:/maps:ro"
    ),
    "^[A-Za-z0-9_][A-Za-z0-9_.+-]*(?:/[A-Za-z0-9_][A-Za-z0-9_.+-]*)*$": (
        "a path within that folder, of letters, digits and _ . + -, like config/slam.yaml"
    ),
    "^[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*$": (
        "a namespace is names of letters, digits and _ with slashes between them, like k3/arm"
    ),
    "^[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*$": "write a message type as package/Type, "
    "like geometry_msgs/Twist",
}
