// The messages that rosserial's node_handle.h and the rover below need, as its make_libraries.py would generate them.
#ifndef MESSAGES_H
#define MESSAGES_H
#include <stdint.h>
#include <string.h>

#include "ros/msg.h"
#include "ros/time.h"

struct Writer {
  unsigned char *at;
  void number(uint64_t value, int bytes) {
    for (int i = 0; i < bytes; i++) *at++ = value >> (8 * i);
  }
  void text(const char *value) {
    uint32_t length = strlen(value);
    number(length, 4);
    memcpy(at, value, length);
    at += length;
  }
};

struct Reader {
  unsigned char *at;
  uint64_t number(int bytes) {
    uint64_t value = 0;
    for (int i = 0; i < bytes; i++) value |= (uint64_t)*at++ << (8 * i);
    return value;
  }
};

namespace std_msgs {
class Time : public ros::Msg {
 public:
  ros::Time data;
  int serialize(unsigned char *out) const override {
    Writer writer{out};
    writer.number(data.sec, 4);
    writer.number(data.nsec, 4);
    return 8;
  }
  int deserialize(unsigned char *in) override {
    Reader reader{in};
    data.sec = reader.number(4);
    data.nsec = reader.number(4);
    return 8;
  }
  const char *getType() override { return "std_msgs/Time"; }
  const char *getMD5() override { return "cd7166c74c552c311fbcc2fe5a7bc289"; }
};

class Int32 : public ros::Msg {
 public:
  int32_t data = 0;
  int serialize(unsigned char *out) const override {
    Writer writer{out};
    writer.number((uint32_t)data, 4);
    return 4;
  }
  int deserialize(unsigned char *in) override {
    Reader reader{in};
    data = (int32_t)reader.number(4);
    return 4;
  }
  const char *getType() override { return "std_msgs/Int32"; }
  const char *getMD5() override { return "da5909fbe378aeaf85e547e830cc1bb7"; }
};
}  // namespace std_msgs

namespace geometry_msgs {
class Twist : public ros::Msg {
 public:
  double values[6] = {};
  int serialize(unsigned char *out) const override {
    memcpy(out, values, sizeof values);
    return sizeof values;
  }
  int deserialize(unsigned char *in) override {
    memcpy(values, in, sizeof values);
    return sizeof values;
  }
  const char *getType() override { return "geometry_msgs/Twist"; }
  const char *getMD5() override { return "9f195f881246fdfa2798d1d3eebca84a"; }
};
}  // namespace geometry_msgs

namespace rosserial_msgs {
class TopicInfo : public ros::Msg {
 public:
  enum { ID_PUBLISHER = 0, ID_SUBSCRIBER = 1, ID_SERVICE_SERVER = 2, ID_SERVICE_CLIENT = 4 };
  enum { ID_PARAMETER_REQUEST = 6, ID_LOG = 7, ID_TIME = 10, ID_TX_STOP = 11 };
  uint16_t topic_id = 0;
  const char *topic_name = "", *message_type = "", *md5sum = "";
  int32_t buffer_size = 0;
  int serialize(unsigned char *out) const override {
    Writer writer{out};
    writer.number(topic_id, 2);
    writer.text(topic_name);
    writer.text(message_type);
    writer.text(md5sum);
    writer.number((uint32_t)buffer_size, 4);
    return writer.at - out;
  }
  int deserialize(unsigned char *) override { return 0; }
  const char *getType() override { return "rosserial_msgs/TopicInfo"; }
  const char *getMD5() override { return "0ad51f88fc44892f8c10684077646005"; }
};

class Log : public ros::Msg {
 public:
  enum { ROSDEBUG, INFO, WARN, ERROR, FATAL };
  uint8_t level = 0;
  const char *msg = "";
  int serialize(unsigned char *out) const override {
    Writer writer{out};
    writer.number(level, 1);
    writer.text(msg);
    return writer.at - out;
  }
  int deserialize(unsigned char *) override { return 0; }
  const char *getType() override { return "rosserial_msgs/Log"; }
  const char *getMD5() override { return "11abd731c25933261cd6183bd12d6295"; }
};

class RequestParamRequest : public ros::Msg {
 public:
  const char *name = "";
  int serialize(unsigned char *out) const override {
    Writer writer{out};
    writer.text(name);
    return writer.at - out;
  }
  int deserialize(unsigned char *) override { return 0; }
  const char *getType() override { return "rosserial_msgs/RequestParam"; }
  const char *getMD5() override { return ""; }
};

// Lists of at most four; a text points into the bytes that arrived, and ends where the next length began.
class RequestParamResponse : public ros::Msg {
 public:
  uint32_t ints_length = 0, floats_length = 0, strings_length = 0;
  int32_t ints[4];
  float floats[4];
  char *strings[4];
  int serialize(unsigned char *) const override { return 0; }
  int deserialize(unsigned char *in) override {
    Reader reader{in};
    ints_length = reader.number(4);
    for (uint32_t i = 0; i < ints_length; i++) ints[i] = reader.number(4);
    floats_length = reader.number(4);
    for (uint32_t i = 0; i < floats_length; i++) {
      uint32_t bits = reader.number(4);
      memcpy(&floats[i], &bits, 4);
    }
    strings_length = reader.number(4);
    for (uint32_t i = 0; i < strings_length; i++) {
      uint32_t length = reader.number(4);
      strings[i] = (char *)reader.at - 1;
      memmove(strings[i], reader.at, length);
      strings[i][length] = 0;
      reader.at += length;
    }
    return reader.at - in;
  }
  const char *getType() override { return "rosserial_msgs/RequestParam"; }
  const char *getMD5() override { return ""; }
};
}  // namespace rosserial_msgs
#endif
