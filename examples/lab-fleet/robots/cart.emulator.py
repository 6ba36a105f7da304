"""The cart in the lab: replies to the requests of cart.yaml."""

from swarmctl.lab.emulators import Chassis, LineRobot, reply


class Cart(LineRobot):
    """Home-made cart."""

    refusal = b"!\r\n"

    def __init__(self):
        super().__init__(Chassis(wheel_separation=0.3, metres_per_count=0.0005, counter_bits=32))

    def answer(self, line):
        match line.split(","):
            case ["B"]:
                return reply("b", "cart", 1)
            case ["S", left, right]:
                self.chassis.drive(int(left) / 1000, int(right) / 1000)
                return reply("s")
            case ["P"]:
                return reply("p", self.chassis.left.count, self.chassis.right.count)
            case ["U"]:
                return reply("u", 0, 0)
        return self.refusal
