// One participant of an enclave, with the security plugins of Fast DDS as rmw_fastrtps sets them.
//
// usage: peer ENCLAVE_FOLDER|none DOMAIN pub|sub TOPIC SECONDS
//
// It publishes or subscribes for some seconds and prints the outcome as one word, the last of:
// refused (its own permissions forbid it), unmatched, matched, received.

#include <chrono>
#include <cstring>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

// Eight bytes after the CDR header: enough to see that a sample arrives.
class Bytes : public TopicDataType
{
public:
  Bytes()
  {
    setName("disc_sim::Bytes");
    m_typeSize = 12;
    m_isGetKeyDefined = false;
  }
  bool serialize(void * data, SerializedPayload_t * payload) override
  {
    const unsigned char head[4] = {0, 1, 0, 0};
    std::memcpy(payload->data, head, 4);
    std::memcpy(payload->data + 4, data, 8);
    payload->length = 12;
    return true;
  }
  bool deserialize(SerializedPayload_t * payload, void * data) override
  {
    if (payload->length < 12) {
      return false;
    }
    std::memcpy(data, payload->data + 4, 8);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void *) override
  {
    return [] {return 12u;};
  }
  void * createData() override {return new char[8]();}
  void deleteData(void * data) override {delete[] static_cast<char *>(data);}
  bool getKey(void *, InstanceHandle_t *, bool) override {return false;}
};

static void secure(DomainParticipantQos & qos, const std::string & folder)
{
  auto set = [&qos](const std::string & name, const std::string & value) {
      qos.properties().properties().emplace_back(name, value);
    };
  const std::string file = "file://" + folder + "/";
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  set("dds.sec.auth.builtin.PKI-DH.identity_ca", file + "identity_ca.cert.pem");
  set("dds.sec.auth.builtin.PKI-DH.identity_certificate", file + "cert.pem");
  set("dds.sec.auth.builtin.PKI-DH.private_key", file + "key.pem");
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  set("dds.sec.access.builtin.Access-Permissions.permissions_ca", file + "permissions_ca.cert.pem");
  set("dds.sec.access.builtin.Access-Permissions.governance", file + "governance.p7s");
  set("dds.sec.access.builtin.Access-Permissions.permissions", file + "permissions.p7s");
}

int main(int count, char ** words)
{
  if (count != 6) {
    std::cerr << "usage: peer ENCLAVE_FOLDER|none DOMAIN pub|sub TOPIC SECONDS" << std::endl;
    return 2;
  }
  const bool publishes = std::string(words[3]) == "pub";
  DomainParticipantQos qos;
  // No shared memory: other versions of Fast DDS on this machine use the same segments.
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(
    std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
  if (std::string(words[1]) != "none") {
    secure(qos, words[1]);
  }
  auto factory = DomainParticipantFactory::get_instance();
  auto participant = factory->create_participant(std::stoi(words[2]), qos);
  if (participant == nullptr) {
    std::cout << "refused" << std::endl;
    return 0;
  }
  TypeSupport type(new Bytes());
  type.register_type(participant);
  auto topic = participant->create_topic(words[4], type.get_type_name(), TOPIC_QOS_DEFAULT);
  auto publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  DataWriter * writer = nullptr;
  DataReader * reader = nullptr;
  if (publishes) {
    writer = publisher->create_datawriter(topic, DATAWRITER_QOS_DEFAULT);
  } else {
    DataReaderQos reliable = DATAREADER_QOS_DEFAULT;
    reliable.reliability().kind = RELIABLE_RELIABILITY_QOS;
    reader = subscriber->create_datareader(topic, reliable);
  }
  if (writer == nullptr && reader == nullptr) {
    std::cout << "refused" << std::endl;
    return 0;
  }
  const char * outcome = "unmatched";
  char data[8] = {};
  const auto end = std::chrono::steady_clock::now() +
    std::chrono::duration<double>(std::stod(words[5]));
  while (std::chrono::steady_clock::now() < end) {
    if (writer != nullptr) {
      PublicationMatchedStatus status;
      writer->get_publication_matched_status(status);
      outcome = status.total_count > 0 ? "matched" : outcome;
      writer->write(data);
    } else {
      SubscriptionMatchedStatus status;
      reader->get_subscription_matched_status(status);
      SampleInfo info;
      if (reader->take_next_sample(data, &info) == ReturnCode_t::RETCODE_OK) {
        outcome = "received";
      } else if (status.total_count > 0 && outcome[0] == 'u') {
        outcome = "matched";
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::cout << outcome << std::endl;
  participant->delete_contained_entities();
  factory->delete_participant(participant);
  return 0;
}
