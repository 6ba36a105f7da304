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
    "^[A-Za-z_][A-Za-z0-9_]*$": "environment variables are letters, digits and _, no digit first",
    "^[A-Za-z0-9][A-Za-z0-9_-]*$": "ROS packages are letters, digits, _ and hyphens, a letter or digit first",
    "^[A-Za-z0-9_][A-Za-z0-9_.+-]*$": (
        "the file's name alone, of letters, digits and _ . + -; roslaunch searches the folders of the "
        "package for it"
    ),
    "^[A-Za-z0-9_][A-Za-z0-9_.+-]*(/[A-Za-z0-9_][A-Za-z0-9_.+-]*)*$": (
        "the path of the file within the package's folder `launch`, of letters, digits and _ . + -"
    ),
    "^(/[A-Za-z0-9_][A-Za-z0-9._-]*)+$": "write the whole path of the folder, like /home/robot/catkin_ws",
    r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$": "text on one line, without control characters",
    r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$": "text without control characters, "
    "line ends and tabs excepted",
    "^[a-z][a-z0-9.-]{0,30}$": "robot types are lower-case letters, digits, dots and hyphens, a letter first",
    "^[a-z][a-z0-9_]{0,30}$": "lower-case letters, digits and _, a letter first, 31 at most",
    "^[A-Za-z][A-Za-z0-9_]{0,30}$": "letters, digits and _, a letter first, 31 at most",
    "^[A-Z][A-Za-z0-9_]{0,60}$": "a class name such as `BeetleCodec`: letters, digits and _, a capital first",
    "^[A-Za-z/%0-9^*-]{1,16}$": "a unit such as `m/s` or `deg` (letters, digits, / % ^ * -), 16 at most",
    r"^[\x20-\x7e]{1,80}$": "a request is 1 to 80 printable ASCII characters, such as `S,{left},{right}`",
    r"^[!-+\--~]{1,16}$": "1 to 16 printable ASCII characters without blanks and commas, such as `s`",
    "^[A-Z]{2,8}[0-9]{3}$": "a rule id has the form SET001; `swarmctl rules` lists them",
    "^[0-9a-fA-F]{4}$": "four hexadecimal digits, in quotes",
    "^[A-Za-z~/][A-Za-z0-9_/]*$": "a ROS name has letters, digits, _ and /, a letter first",
    "^[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*$": "write a message type as package/Type, "
    "like geometry_msgs/Twist",
}
