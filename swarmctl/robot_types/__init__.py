"""One robot: its geometry, its line protocol, its sensors and its settings, as frozen models. Pure."""
