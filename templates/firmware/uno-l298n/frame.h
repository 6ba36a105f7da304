// One rosserial frame (protocol 2) out of a stream of bytes that may hold anything:
// ff fe | length, 2 bytes | its check | id, 2 bytes | payload | check of id and payload.
#pragma once

#include <stdint.h>

class FrameReader {
 public:
  static constexpr uint8_t capacity = 64;  // bytes of payload: a Twist has 48

  // Takes a byte that was there at `now` (ms). True if it completed a frame: see id, length, payload until the next call.
  bool take(uint8_t byte, uint32_t now);

  uint16_t id() const { return id_; }
  uint8_t length() const { return static_cast<uint8_t>(length_); }
  const uint8_t *payload() const { return payload_; }

 private:
  enum class State : uint8_t { kSync, kVersion, kLengthLow, kLengthHigh, kLengthCheck, kIdLow, kIdHigh, kPayload, kCheck };

  // Waits for the next frame, which the byte that spoiled this one may begin.
  void drop(uint8_t byte, uint32_t now);

  State state_ = State::kSync;
  uint8_t index_ = 0;
  uint8_t sum_ = 0;
  uint16_t length_ = 0;
  uint16_t id_ = 0;
  uint32_t started_ = 0;
  uint8_t payload_[capacity];
};
