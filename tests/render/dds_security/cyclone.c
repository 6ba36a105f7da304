/* A participant of Cyclone DDS with the files of one enclave of SROS 2, as rmw_cyclonedds starts it.
     cyclone DOMAIN ENCLAVE_DIR [pub TOPIC | sub TOPIC]...     ENCLAVE_DIR "-": without security
   What it prints and does is described in fastdds.cpp. PLUGINS is the folder of libdds_security_*.so. */
#include <dds/dds.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MOST 128

typedef struct {
  uint32_t number;
} Sample;

static const uint32_t operations[] = {DDS_OP_ADR | DDS_OP_TYPE_4BY, offsetof(Sample, number), DDS_OP_RTS};
static const dds_topic_descriptor_t sample_type = {
    .m_size = sizeof(Sample),
    .m_align = sizeof(uint32_t),
    .m_flagset = DDS_TOPIC_FIXED_SIZE,
    .m_typename = "Sample",
    .m_nops = 2,
    .m_ops = operations,
    .m_meta = "",
};

static void set_plugin(dds_qos_t *qos, const char *kind, const char *file, const char *function) {
  char name[64], value[256];
  snprintf(name, sizeof name, "dds.sec.%s.library.path", kind);
  snprintf(value, sizeof value, "%s/libdds_security_%s.so", PLUGINS, file);
  dds_qset_prop(qos, name, value);
  snprintf(name, sizeof name, "dds.sec.%s.library.init", kind);
  snprintf(value, sizeof value, "init_%s", function);
  dds_qset_prop(qos, name, value);
  snprintf(name, sizeof name, "dds.sec.%s.library.finalize", kind);
  snprintf(value, sizeof value, "finalize_%s", function);
  dds_qset_prop(qos, name, value);
}

static dds_qos_t *qos_for(const char *enclave) {
  static const char *const files[][2] = {
      {"dds.sec.auth.identity_ca", "identity_ca.cert.pem"},
      {"dds.sec.auth.identity_certificate", "cert.pem"},
      {"dds.sec.auth.private_key", "key.pem"},
      {"dds.sec.access.permissions_ca", "permissions_ca.cert.pem"},
      {"dds.sec.access.governance", "governance.p7s"},
      {"dds.sec.access.permissions", "permissions.p7s"},
  };
  dds_qos_t *qos = dds_create_qos();
  if (!strcmp(enclave, "-")) return qos;
  set_plugin(qos, "auth", "auth", "authentication");
  set_plugin(qos, "access", "ac", "access_control");
  set_plugin(qos, "crypto", "crypto", "crypto");
  for (size_t at = 0; at < sizeof files / sizeof *files; at++) {
    char value[4096];
    snprintf(value, sizeof value, "file:%s/%s", enclave, files[at][1]);
    dds_qset_prop(qos, files[at][0], value);
  }
  return qos;
}

int main(int count, char **words) {
  dds_entity_t writers[MOST], readers[MOST];
  const char *topics[MOST];
  int written = 0, read = 0;
  if (count < 3 || count > MOST) return 2;
  setvbuf(stdout, NULL, _IOLBF, 0);
  dds_qos_t *qos = qos_for(words[2]);
  dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(words[1]), qos, NULL);
  dds_delete_qos(qos);
  printf("{\"participant\": %s}\n", participant > 0 ? "true" : "false");
  if (participant <= 0) return 1;
  for (int at = 3; at + 1 < count; at += 2) {
    dds_entity_t made = dds_create_topic(participant, &sample_type, words[at + 1], NULL, NULL);
    if (made > 0 && !strcmp(words[at], "pub")) {
      made = dds_create_writer(participant, made, NULL, NULL);
      if (made > 0) writers[written++] = made;
    } else if (made > 0) {
      made = dds_create_reader(participant, made, NULL, NULL);
      topics[read] = words[at + 1];
      if (made > 0) readers[read++] = made;
    }
    printf("{\"%s\": \"%s\", \"created\": %s}\n", words[at], words[at + 1], made > 0 ? "true" : "false");
  }
  puts("{\"ready\": true}");
  struct pollfd input = {STDIN_FILENO, POLLIN, 0};
  for (Sample sample = {0}; poll(&input, 1, 100) == 0; sample.number++) {
    for (int at = 0; at < written; at++) dds_write(writers[at], &sample);
    for (int at = 0; at < read; at++) {
      Sample taken;
      void *place = &taken;
      dds_sample_info_t info;
      if (topics[at] && dds_take(readers[at], &place, &info, 1, 1) > 0 && info.valid_data) {
        printf("{\"received\": \"%s\"}\n", topics[at]);
        topics[at] = NULL;
      }
    }
  }
  dds_delete(participant);
}
