/* A security key without hardware, as a library for SecurityKeyProvider: what it does is in security_key.py.
 *
 * Interface: PROTOCOL.u2f and sk-api.h of OpenSSH 9, version 0x000a0000 of the interface. SWARM_SECURITY_KEY
 * is the command that signs; it prints bytes in hexadecimal. */

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VERSION = 0x000a0000, FAILED = -1, HANDLE = 4, KEY = 32, SIGNATURE = 64, PRESENT = 1 };

struct option;
struct resident_key;

struct enrolled {
    uint8_t flags;
    uint8_t *public_key;
    size_t public_key_len;
    uint8_t *key_handle;
    size_t key_handle_len;
    uint8_t *signature;
    size_t signature_len;
    uint8_t *attestation;
    size_t attestation_len;
    uint8_t *authdata;
    size_t authdata_len;
};

struct signed_data {
    uint8_t flags;
    uint32_t counter;
    uint8_t *r;
    size_t r_len;
    uint8_t *s;
    size_t s_len;
};

/* The `length` bytes that the command prints for these arguments; NULL if it prints fewer. */
static uint8_t *answer(const char *arguments, size_t length) {
    const char *program = getenv("SWARM_SECURITY_KEY");
    size_t capacity = strlen(program ? program : "") + strlen(arguments) + 2;
    char *command = malloc(capacity);
    uint8_t *found = malloc(length);
    if (!program || !command || !found)
        return NULL;
    snprintf(command, capacity, "%s %s", program, arguments);
    FILE *output = popen(command, "r");
    size_t read = 0;
    for (unsigned byte; output && read < length && fscanf(output, "%2x", &byte) == 1; read++)
        found[read] = (uint8_t)byte;
    if (output)
        pclose(output);
    free(command);
    return read == length ? found : NULL;
}

uint32_t sk_api_version(void) { return VERSION; }

int sk_enroll(uint32_t algorithm, const uint8_t *challenge, size_t challenge_len, const char *application,
              uint8_t flags, const char *pin, struct option **options, struct enrolled **response) {
    struct enrolled *made = calloc(1, sizeof *made);
    if (!made || !(made->public_key = answer("enroll", KEY)))
        return FAILED;
    made->flags = flags;
    made->public_key_len = KEY;
    made->key_handle = (uint8_t *)strdup("test");
    made->key_handle_len = HANDLE;
    *response = made;
    return 0;
}

int sk_sign(uint32_t algorithm, const uint8_t *data, size_t length, const char *application,
            const uint8_t *key_handle, size_t key_handle_len, uint8_t flags, const char *pin,
            struct option **options, struct signed_data **response) {
    struct signed_data *made = calloc(1, sizeof *made);
    char *arguments = malloc(strlen(application) + 2 * length + 32);
    if (!made || !arguments)
        return FAILED;
    char *end = arguments + sprintf(arguments, "sign %s ", application);
    for (size_t at = 0; at < length; at++)
        end += sprintf(end, "%02x", data[at]);
    made->r = answer(arguments, SIGNATURE);
    free(arguments);
    if (!made->r)
        return FAILED;
    made->r_len = SIGNATURE;
    made->flags = PRESENT;
    made->counter = 1;
    *response = made;
    return 0;
}

int sk_load_resident_keys(const char *pin, struct option **options, struct resident_key ***keys, size_t *count) {
    return FAILED;
}
