"""The hosts of a lab: their disks, namespaces, networks and processes."""
