from typing import Any

class ROSHandler:
    shutdown: Any
