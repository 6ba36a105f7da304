"""A robot put to the test over its own line, by the very code that drives it on a host."""

import sys

from swarmctl import resources

#: What runs on hosts is no part of this package; here it is imported from where it is shipped.
for _folder in ("drivers", "shared"):
    if (_path := str(resources.templates() / _folder)) not in sys.path:
        sys.path.append(_path)
