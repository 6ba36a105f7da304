"""From text to a typed spec with positions, or to diagnostics that say where it is wrong. Pure."""
