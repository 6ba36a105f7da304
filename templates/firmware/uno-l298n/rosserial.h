// The device's side of rosserial (protocol 2): two Int32 publishers and one Twist subscriber, without buffers to send from.
#pragma once

#include <avr/pgmspace.h>
#include <stdint.h>

#include "frame.h"

class RosserialClient {
 public:
  // rosserial's own numbering: subscribers from 100, publishers after four numbers for subscribers.
  static constexpr uint16_t command = 100;
  static constexpr uint16_t left_ticks = 104;
  static constexpr uint16_t right_ticks = 105;

  // Executes a command: metres and radians per second.
  using Obey = void (*)(float v, float omega);

  explicit RosserialClient(Obey obey) : obey_(obey) {}

  // Reads what has arrived and sends what is due; call it in every cycle of the main loop.
  void spin(uint32_t now);

  // True if the host has received the topics and still answers. Only then its commands are executed.
  bool connected() const { return connected_; }

  // Reports the firmware; also without a request, when the board starts: a host that is connected then knows
  // that it has to ask for the topics anew.
  void introduce();

  // Logs a problem; `text` is in flash.
  void complain(PGM_P text) { log(level_error, text); }

  // Nothing is sent without a connection, or between the announcements of the topics.
  void publish(uint16_t id, int32_t value);

 private:
  enum class Announcing : uint8_t { kTime, kLeft, kRight, kCommand, kVersion, kNothing };

  static constexpr uint8_t level_info = 1;
  static constexpr uint8_t level_error = 3;

  void log(uint8_t level, PGM_P text);
  void dispatch(uint32_t now);
  void announce(uint32_t now);
  void ask_time(uint32_t now);
  void topic(uint16_t role, uint16_t id, PGM_P name, PGM_P type, PGM_P md5);

  void begin(uint16_t id, uint16_t length);
  void put(uint8_t byte);
  void put32(uint32_t value);
  void put_text(PGM_P text);
  void end();

  Obey obey_;
  FrameReader reader_;
  Announcing announcing_ = Announcing::kNothing;
  bool connected_ = false;
  uint8_t sum_ = 0;
  uint32_t asked_ = 0;     // ms, the last time request
  uint32_t answered_ = 0;  // ms, the last reply to one
};
