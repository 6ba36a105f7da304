// A participant of Fast DDS with the files of one enclave of SROS 2, as rmw_fastrtps starts it.
//   fastdds DOMAIN ENCLAVE_DIR [pub TOPIC | sub TOPIC]...     ENCLAVE_DIR "-": without security
// Prints a line of JSON for itself, and for each writer and reader whether it was created. Then it writes on each
// topic every 100 ms and prints the first sample that each reader gets, until its standard input is closed.
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

struct SampleType : TopicDataType {
  SampleType() {
    setName("Sample");
    m_typeSize = 8;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const unsigned char little_endian[] = {0, 1, 0, 0};
    memcpy(payload->data, little_endian, 4);
    memcpy(payload->data + 4, data, 4);
    payload->length = 8;
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    memcpy(data, payload->data + 4, 4);
    return payload->length == 8;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 8u; };
  }
  void* createData() override { return new uint32_t(0); }
  void deleteData(void* data) override { delete static_cast<uint32_t*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

static DomainParticipantQos qos_for(const std::string& enclave) {
  DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
  // Shared memory would reach participants in other network namespaces.
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(
      std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
  if (enclave == "-") return qos;
  auto& properties = qos.properties().properties();
  const std::string auth = "dds.sec.auth.builtin.PKI-DH.";
  const std::string access = "dds.sec.access.builtin.Access-Permissions.", file = "file://" + enclave + "/";
  properties.emplace_back("dds.sec.auth.plugin", "builtin.PKI-DH");
  properties.emplace_back("dds.sec.access.plugin", "builtin.Access-Permissions");
  properties.emplace_back("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  properties.emplace_back(auth + "identity_ca", file + "identity_ca.cert.pem");
  properties.emplace_back(auth + "identity_certificate", file + "cert.pem");
  properties.emplace_back(auth + "private_key", file + "key.pem");
  properties.emplace_back(access + "permissions_ca", file + "permissions_ca.cert.pem");
  properties.emplace_back(access + "governance", file + "governance.p7s");
  properties.emplace_back(access + "permissions", file + "permissions.p7s");
  return qos;
}

int main(int count, char** words) {
  if (count < 3) return 2;
  setvbuf(stdout, nullptr, _IOLBF, 0);
  Log::ClearConsumers();
  Log::RegisterConsumer(std::make_unique<StdoutErrConsumer>());
  auto* factory = DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant(atoi(words[1]), qos_for(words[2]));
  printf("{\"participant\": %s}\n", participant ? "true" : "false");
  if (!participant) return 1;
  TypeSupport(new SampleType).register_type(participant);
  auto* publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  std::vector<DataWriter*> writers;
  std::vector<DataReader*> readers;
  for (int at = 3; at + 1 < count; at += 2) {
    TopicDescription* found = participant->lookup_topicdescription(words[at + 1]);
    Topic* topic = found ? static_cast<Topic*>(found)
                         : participant->create_topic(words[at + 1], "Sample", TOPIC_QOS_DEFAULT);
    bool created;
    if (!strcmp(words[at], "pub")) {
      auto* writer = topic ? publisher->create_datawriter(topic, DATAWRITER_QOS_DEFAULT) : nullptr;
      if ((created = writer)) writers.push_back(writer);
    } else {
      auto* reader = topic ? subscriber->create_datareader(topic, DATAREADER_QOS_DEFAULT) : nullptr;
      if ((created = reader)) readers.push_back(reader);
    }
    printf("{\"%s\": \"%s\", \"created\": %s}\n", words[at], words[at + 1], created ? "true" : "false");
  }
  puts("{\"ready\": true}");
  uint32_t number = 0, sample;
  SampleInfo info;
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; poll(&input, 1, 100) == 0; ++number) {
    for (auto* writer : writers) writer->write(&number);
    for (auto*& reader : readers) {
      if (reader && reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK && info.valid_data) {
        printf("{\"received\": \"%s\"}\n", reader->get_topicdescription()->get_name().c_str());
        reader = nullptr;
      }
    }
  }
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}
