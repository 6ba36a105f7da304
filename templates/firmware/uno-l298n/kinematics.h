// From the speed of the robot to the speeds of its wheels.
#pragma once

struct WheelSpeeds {
  float left;  // rad/s
  float right;
};

// The paper's equation 2, with r the wheel's RADIUS; lever is +d/2 for the right wheel and -d/2 for the left one.
constexpr float wheel_speed(float v, float omega, float lever, float radius) {
  return (v + omega * lever) / radius;
}

constexpr bool near(float a, float b) { return a - b < 1e-3f && b - a < 1e-3f; }

// Its numbers for the kit: 65 mm wheels, 130 mm apart.
static_assert(near(wheel_speed(0.2f, 0.0f, 0.065f, 0.0325f), 6.1538f), "0.2 m/s straight on");
static_assert(near(wheel_speed(0.1f, 1.0f, -0.065f, 0.0325f), 1.0769f), "left wheel of an arc to the left");
static_assert(near(wheel_speed(0.1f, 1.0f, 0.065f, 0.0325f), 5.0769f), "right wheel of an arc to the left");
static_assert(near(wheel_speed(0.0f, 1.0f, 0.065f, 0.0325f), 2.0f), "turning in place");

// Both wheels slowed down alike where one would exceed the limit: the curve stays the same.
// All zero for what is no speed of a robot: not a number, infinite, beyond anything that rolls.
WheelSpeeds wheel_speeds(float v, float omega);

// One control period on the way from one to the other, no faster than the acceleration allowed; both wheels arrive
// together. To a standstill the way is short: brakes wait for nobody.
WheelSpeeds approach(WheelSpeeds from, WheelSpeeds to);
