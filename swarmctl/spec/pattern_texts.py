"""What the text patterns of the models allow, in words: an error message never shows a regular expression."""

from __future__ import annotations

from collections.abc import Mapping

NAME = "^[a-z][a-z0-9-]{0,30}$"

PATTERN_TEXTS: Mapping[str, str] = {
    NAME: "names are lower-case letters, digits and hyphens, a letter first, 31 at most",
    "^[a-z_][a-z0-9_-]{0,31}$": "accounts are lower-case letters, digits, _ and hyphens, a letter or _ first",
    "^hci[0-9]{1,2}$": "adapters are called hci0, hci1, ...",
    "^[A-Za-z0-9:._-]{1,64}$": "letters, digits and : . _ - only, as `udevadm info -a` shows it",
    "^[A-Za-z_][A-Za-z0-9_]*$": "environment variables are letters, digits and _, no digit first",
    "^[a-z][a-z0-9_]*$": "ROS packages are lower-case letters, digits and _, a letter first",
    "^[A-Za-z0-9_][A-Za-z0-9_.-]*$": "a file name of letters, digits and _ . -",
    "^(/[A-Za-z0-9_][A-Za-z0-9._-]*)+$": "write the whole path of the folder, like /home/robot/catkin_ws",
    r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$": "text on one line, without control characters",
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
    "^[a-z][a-z0-9_]*/[A-Z][A-Za-z0-9]*$": "write a message type as package/Type, like geometry_msgs/Twist",
}
