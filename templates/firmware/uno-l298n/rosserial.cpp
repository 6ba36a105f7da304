#include "rosserial.h"

#include <Arduino.h>

#include "config.h"
#include "float64.h"
#include "version.h"

namespace {
// Ids of the protocol's own frames.
constexpr uint16_t id_publisher = 0;  // request of the host for the topics
constexpr uint16_t id_subscriber = 1;
constexpr uint16_t id_log = 7;
constexpr uint16_t id_time = 10;
constexpr uint16_t id_tx_stop = 11;

constexpr uint32_t ask_every = 2500;    // ms between time requests
constexpr uint32_t lost_after = 11000;  // ms without an answer to one
constexpr uint32_t sends = 128;         // bytes of payload that we announce for what we publish

constexpr char int32_type[] PROGMEM = "std_msgs/Int32";
constexpr char int32_md5[] PROGMEM = "da5909fbe378aeaf85e547e830cc1bb7";
constexpr char twist_type[] PROGMEM = "geometry_msgs/Twist";
constexpr char twist_md5[] PROGMEM = "9f195f881246fdfa2798d1d3eebca84a";
constexpr uint8_t twist_length = 48;
constexpr uint8_t linear_x = 0;    // where they stand in a Twist
constexpr uint8_t angular_z = 40;

constexpr char version_text[] PROGMEM = "swarmctl firmware " FIRMWARE_DIGEST;
}  // namespace

void RosserialClient::spin(uint32_t now) {
  for (int waiting = Serial.available(); waiting > 0; --waiting) {
    if (reader_.take(static_cast<uint8_t>(Serial.read()), now)) dispatch(now);
  }
  announce(now);
  if (!connected_) return;
  if (now - answered_ > lost_after) {
    connected_ = false;
  } else if (now - asked_ > ask_every) {
    ask_time(now);
  }
}

void RosserialClient::dispatch(uint32_t now) {
  switch (reader_.id()) {
    case id_publisher:
      if (reader_.length() == 0) announcing_ = Announcing::kTime;
      break;
    case id_time:  // the pulses carry no time of day: the answer shows that the host is there
      answered_ = now;
      break;
    case id_tx_stop:
      announcing_ = Announcing::kNothing;
      connected_ = false;
      break;
    case command:
      if (connected_ && reader_.length() == twist_length) {
        obey_(read_float64(reader_.payload() + linear_x), read_float64(reader_.payload() + angular_z));
      }
      break;
  }
}

// One frame per cycle, after the frame before was sent: the main loop never waits long, and keeps receiving.
void RosserialClient::announce(uint32_t now) {
  if (announcing_ == Announcing::kNothing) return;
  if (Serial.availableForWrite() < SERIAL_TX_BUFFER_SIZE - 1) return;
  switch (announcing_) {
    case Announcing::kTime:
      ask_time(now);
      answered_ = now;
      break;
    case Announcing::kLeft:
      topic(id_publisher, left_ticks, config::left_ticks_topic, int32_type, int32_md5);
      break;
    case Announcing::kRight:
      topic(id_publisher, right_ticks, config::right_ticks_topic, int32_type, int32_md5);
      break;
    case Announcing::kCommand:
      topic(id_subscriber, command, config::command_topic, twist_type, twist_md5);
      break;
    default:
      introduce();
      connected_ = true;
  }
  announcing_ = static_cast<Announcing>(static_cast<uint8_t>(announcing_) + 1);
}

void RosserialClient::publish(uint16_t id, int32_t value) {
  if (!connected_ || announcing_ != Announcing::kNothing) return;
  begin(id, 4);
  put32(static_cast<uint32_t>(value));
  end();
}

void RosserialClient::introduce() { log(level_info, version_text); }

void RosserialClient::log(uint8_t level, PGM_P text) {
  begin(id_log, static_cast<uint16_t>(1 + 4 + strlen_P(text)));
  put(level);
  put_text(text);
  end();
}

void RosserialClient::ask_time(uint32_t now) {
  asked_ = now;
  begin(id_time, 8);
  put32(0);  // s
  put32(0);  // ns
  end();
}

void RosserialClient::topic(uint16_t role, uint16_t id, PGM_P name, PGM_P type, PGM_P md5) {
  begin(role, static_cast<uint16_t>(2 + 3 * 4 + strlen_P(name) + strlen_P(type) + strlen_P(md5) + 4));
  put(static_cast<uint8_t>(id));
  put(static_cast<uint8_t>(id >> 8));
  put_text(name);
  put_text(type);
  put_text(md5);
  put32(role == id_publisher ? sends : FrameReader::capacity);
  end();
}

void RosserialClient::begin(uint16_t id, uint16_t length) {
  put(0xff);
  put(0xfe);
  sum_ = 0;
  put(static_cast<uint8_t>(length));
  put(static_cast<uint8_t>(length >> 8));
  end();  // the length has a check of its own
  sum_ = 0;
  put(static_cast<uint8_t>(id));
  put(static_cast<uint8_t>(id >> 8));
}

void RosserialClient::put(uint8_t byte) {
  sum_ += byte;
  Serial.write(byte);
}

void RosserialClient::put32(uint32_t value) {
  for (uint8_t shift = 0; shift < 32; shift += 8) put(static_cast<uint8_t>(value >> shift));
}

void RosserialClient::put_text(PGM_P text) {
  put32(strlen_P(text));
  while (const uint8_t byte = pgm_read_byte(text++)) put(byte);
}

void RosserialClient::end() { put(static_cast<uint8_t>(0xff - sum_)); }
