/* Frames of the link, as in docs/src/link.md: COBS(kind, number, sequence, body, CRC-32) and a zero byte. Nothing is allocated. Needs
   C99; floats are those of IEEE 754. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { PAM_REQUEST = 0, PAM_RESPONSE = 1, PAM_REFUSAL_FRAME = 2, PAM_TOPIC = 3 };
#define PAM_HELLO 0
#define PAM_LONGEST_BODY 512
/* Longest frame on the line: header, body, checksum, and one byte for each 254 of them, and the zero. */
#define PAM_LONGEST_FRAME (4 + PAM_LONGEST_BODY + 4 + 4 + 1)

/* Bytes on their way out. */
typedef struct { uint8_t *at; size_t length, room; bool failed; } pam_writer;
/* Bytes on their way in. */
typedef struct { const uint8_t *at; size_t length, place; bool failed; } pam_reader;

static inline void pam_put_u8(pam_writer *w, uint8_t byte) {
  if (w->length >= w->room) w->failed = true;
  else w->at[w->length++] = byte;
}
static inline void pam_put_i8(pam_writer *w, int8_t number) { pam_put_u8(w, (uint8_t)number); }
static inline void pam_put_bool(pam_writer *w, bool value) { pam_put_u8(w, value ? 1 : 0); }
static inline void pam_put_varint(pam_writer *w, uint64_t number) {
  while (number > 127) {
    pam_put_u8(w, (uint8_t)(number & 127) | 128);
    number >>= 7;
  }
  pam_put_u8(w, (uint8_t)number);
}
static inline void pam_put_f32(pam_writer *w, float value) {
  uint32_t bits;
  memcpy(&bits, &value, 4);
  for (int n = 0; n < 4; n++) pam_put_u8(w, (uint8_t)(bits >> 8 * n));
}
static inline uint8_t pam_get_u8(pam_reader *r) {
  if (r->place >= r->length) {
    r->failed = true;
    return 0;
  }
  return r->at[r->place++];
}
static inline int8_t pam_get_i8(pam_reader *r) { return (int8_t)pam_get_u8(r); }
static inline bool pam_get_bool(pam_reader *r) { return pam_get_u8(r) != 0; }
/* A number of at most this; a larger one is none of this type. */
static inline uint64_t pam_get_varint(pam_reader *r, uint64_t most) {
  uint64_t number = 0;
  for (int shift = 0; shift < 70; shift += 7) {
    uint8_t byte = pam_get_u8(r);
    if (shift < 64) number |= (uint64_t)(byte & 127) << shift;
    if (byte < 128) {
      if (number <= most) return number;
      break;
    }
  }
  r->failed = true;
  return 0;
}
static inline float pam_get_f32(pam_reader *r) {
  uint32_t bits = 0;
  float value;
  for (int n = 0; n < 4; n++) bits |= (uint32_t)pam_get_u8(r) << 8 * n;
  memcpy(&value, &bits, 4);
  return value;
}
/* Whether a message was read, all of it and nothing more. */
static inline bool pam_is_whole(const pam_reader *r) { return !r->failed && r->place == r->length; }

static inline uint32_t pam_crc32(const uint8_t *bytes, size_t length) {
  uint32_t sum = UINT32_MAX;
  for (size_t n = 0; n < length; n++) {
    sum ^= bytes[n];
    for (int bit = 0; bit < 8; bit++) sum = sum & 1 ? sum >> 1 ^ UINT32_C(0xEDB88320) : sum >> 1;
  }
  return ~sum;
}

/* Writes a frame; gives its length on the line, 0 where it does not fit. `out` of PAM_LONGEST_FRAME bytes always suffices. */
static inline size_t pam_frame(uint8_t kind, uint8_t number, uint16_t sequence, const uint8_t *body, size_t length, uint8_t *out,
                               size_t room) {
  uint8_t raw[4 + PAM_LONGEST_BODY + 4];
  if (length > PAM_LONGEST_BODY) return 0;
  raw[0] = kind;
  raw[1] = number;
  raw[2] = (uint8_t)sequence;
  raw[3] = (uint8_t)(sequence >> 8);
  if (length) memcpy(raw + 4, body, length);
  uint32_t sum = pam_crc32(raw, 4 + length);
  for (int n = 0; n < 4; n++) raw[4 + length + (size_t)n] = (uint8_t)(sum >> 8 * n);
  pam_writer w = {out, 0, room, false};
  size_t code = 0;
  pam_put_u8(&w, 1);
  for (size_t n = 0; n < length + 8 && !w.failed; n++) {
    if (raw[n]) {
      pam_put_u8(&w, raw[n]);
      out[code]++;
    }
    if (!w.failed && (!raw[n] || out[code] == 255)) {
      code = w.length;
      pam_put_u8(&w, 1);
    }
  }
  pam_put_u8(&w, 0);
  return w.failed ? 0 : w.length;
}

/* Takes the bytes between two zeros of the line apart, in their own place. Gives the body, or NULL where the checksum is wrong. */
static inline const uint8_t *pam_unframe(uint8_t *bytes, size_t length, uint8_t *kind, uint8_t *number, uint16_t *sequence,
                                         size_t *body_length) {
  size_t to = 0;
  for (size_t at = 0; at < length;) {
    uint8_t code = bytes[at];
    if (code == 0 || at + code > length) return NULL;
    memmove(bytes + to, bytes + at + 1, (size_t)code - 1);
    to += (size_t)code - 1;
    at += code;
    if (code < 255 && at < length) bytes[to++] = 0;
  }
  if (to < 8) return NULL;
  uint32_t sum = 0;
  for (int n = 0; n < 4; n++) sum |= (uint32_t)bytes[to - 4 + (size_t)n] << 8 * n;
  if (pam_crc32(bytes, to - 4) != sum) return NULL;
  *kind = bytes[0];
  *number = bytes[1];
  *sequence = (uint16_t)(bytes[2] | bytes[3] << 8);
  *body_length = to - 8;
  return bytes + 4;
}
