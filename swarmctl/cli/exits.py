"""Exit codes, the same for every verb."""

OK = 0
ERROR = 1  # the spec is wrong, or swarmctl could not do what it was asked
CHANGES = 2  # plan --detailed-exitcode: there is something to do
HOSTS_FAILED = 3
HOSTS_UNREACHABLE = 4  # some could not be reached, none failed
UNHEALTHY = 5
USAGE = 64
INTERRUPTED = 130
