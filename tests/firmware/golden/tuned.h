// How this robot is wired, shaped and tuned, in SI units. Written by swarmctl from the swarm's spec: change it there.
#pragma once

#include <avr/pgmspace.h>
#include <stdint.h>

namespace config {

// The serial line, and its protocol.
constexpr uint32_t baud = 57600;
constexpr char command_topic[] PROGMEM = "cmd_vel";
constexpr char left_ticks_topic[] PROGMEM = "lwheel";
constexpr char right_ticks_topic[] PROGMEM = "rwheel";
constexpr float ticks_rate = 10.0f;

// Pins of the Arduino UNO. An encoder needs an external interrupt (2, 3), an enable pin PWM (5, 6, 9, 10, 11).
constexpr uint8_t left_encoder = 2;
constexpr uint8_t left_enable = 9;
constexpr uint8_t left_forward = 7;
constexpr uint8_t left_backward = 8;
constexpr uint8_t right_encoder = 3;
constexpr uint8_t right_enable = 6;
constexpr uint8_t right_forward = 11;
constexpr uint8_t right_backward = 12;

// The robot's shape, how fast its wheels may run on the ground, and how soon.
constexpr float wheel_radius = 0.03315f;
constexpr float wheel_separation = 0.134f;
constexpr uint16_t pulses_per_turn = 20;
constexpr float wheel_speed_max = 0.5f;
constexpr float acceleration_max = 1.0f;

// The motors: where they begin to turn (of 255), and the speed on the ground that all of it gives.
constexpr float left_pwm_min = 72.5f;
constexpr float right_pwm_min = 60.0f;
constexpr float left_full_speed = 0.6f;
constexpr float right_full_speed = 0.6f;
constexpr bool brake = false;  // stop with shorted motors, or let them coast

// The PI loops: steps of PWM per rad/s, and per rad.
constexpr float control_period = 0.02f;  // whole ms, as the clock counts them
constexpr float kp = 6.0f;
constexpr float ki = 40.0f;

// Without a command for this long the robot stops.
constexpr float dead_man = 0.4f;

}  // namespace config
