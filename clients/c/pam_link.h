/* Written by clients/c/generate.py from clients/link.json. */
#ifndef PAM_LINK_H
#define PAM_LINK_H

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

#define PAM_LINK_VERSION 6
#define PAM_SCHEMA_HASH UINT64_C(0xe7388c4fe54219e0)

#define PAM_INFO 1 /* unit → pam_device_info */
#define PAM_STATUS 2 /* unit → pam_status */
#define PAM_ARM 3 /* pam_session → pam_status */
#define PAM_START 4 /* pam_start → pam_status */
#define PAM_STOP 5 /* unit → pam_status */
#define PAM_DISARM 6 /* unit → pam_status */
#define PAM_SET_POINT 7 /* pam_set_point_order → pam_status */
#define PAM_REFERENCE 8 /* pam_reference_order → pam_status */
#define PAM_REFERENCE_POINTS 9 /* pam_reference_points → u16 */
#define PAM_TELEMETRY 10 /* pam_telemetry_rate → pam_telemetry_rate */
#define PAM_FAULTS 11 /* unit → pam_faults */
#define PAM_PAST_FAULT 12 /* pam_past_fault → pam_fault_report */
#define PAM_CLEAR_FAULT 13 /* unit → pam_status */
#define PAM_SETTINGS 14 /* unit → pam_settings */
#define PAM_SET_SETTINGS 15 /* pam_settings → pam_settings */
#define PAM_TABLE_BEGIN 16 /* pam_table_begin → unit */
#define PAM_TABLE_PIECE 17 /* pam_table_piece → u32 */
#define PAM_TABLE_COMMIT 18 /* unit → pam_table_info */
#define PAM_TABLE_READ 19 /* pam_table_read → pam_table_piece */
#define PAM_TABLE_ROLLBACK 20 /* pam_roll_back → pam_table_info */
#define PAM_EVALUATE 21 /* pam_evaluate → pam_evaluated */
#define PAM_TRACE_ARM 22 /* pam_trace_arm → pam_trace_info */
#define PAM_TRACE_INFO 23 /* unit → pam_trace_info */
#define PAM_TRACE_READ 24 /* pam_trace_read → pam_trace_piece */
#define PAM_FORGET_MEMORY 25 /* pam_forget_memory → unit */
#define PAM_RESTART 26 /* unit → unit */
#define PAM_KEEP_ALIVE 27 /* pam_session → unit */
#define PAM_HEALTH 28 /* pam_health_read → pam_health_sums */
#define PAM_SIGNALS 29 /* pam_signals_read → pam_mean_signals */
#define PAM_BOARD_SETTINGS 30 /* unit → pam_settings */
#define PAM_UPDATE 31 /* unit → pam_update_status */
#define PAM_UPDATE_BEGIN 32 /* pam_update_begin → pam_update_status */
#define PAM_UPDATE_PIECE 33 /* pam_update_piece → u32 */
#define PAM_UPDATE_COMMIT 34 /* unit → pam_update_status */
#define PAM_UPDATE_CONFIRM 35 /* unit → pam_update_status */
#define PAM_UPDATE_REVERT 36 /* unit → pam_update_status */
#define PAM_TOPIC_TELEMETRY 128 /* pam_telemetry */
#define PAM_TOPIC_EVENT 129 /* pam_event */

typedef struct { uint32_t length; uint32_t crc; uint32_t generation; bool has_previous; } pam_table_info;
static inline void pam_write_table_info(pam_writer *w, const pam_table_info *m) {
  pam_put_varint(w, (*m).length);
  pam_put_varint(w, (*m).crc);
  pam_put_varint(w, (*m).generation);
  pam_put_bool(w, (*m).has_previous);
}
static inline void pam_read_table_info(pam_reader *r, pam_table_info *m) {
  (*m).length = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).crc = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).generation = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).has_previous = pam_get_bool(r);
}

typedef enum { PAM_STARTED_BY_POWER = 0, PAM_STARTED_BY_REQUEST = 1, PAM_STARTED_BY_WATCHDOG = 2, PAM_STARTED_BY_BROWN_OUT = 3 } pam_started_by;
static inline void pam_write_started_by(pam_writer *w, const pam_started_by *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_started_by(pam_reader *r, pam_started_by *m) {
  *m = (pam_started_by)pam_get_varint(r, 3);
}

typedef struct { uint32_t ticks_per_s; uint8_t muscles; uint32_t table_capacity; uint32_t trace_capacity; uint32_t reference_capacity; bool has_tables[2]; pam_table_info tables[2]; pam_started_by started_by; } pam_device_info;
static inline void pam_write_device_info(pam_writer *w, const pam_device_info *m) {
  pam_put_varint(w, (*m).ticks_per_s);
  pam_put_u8(w, (*m).muscles);
  pam_put_varint(w, (*m).table_capacity);
  pam_put_varint(w, (*m).trace_capacity);
  pam_put_varint(w, (*m).reference_capacity);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  pam_put_bool(w, (*m).has_tables[i0]);
  if ((*m).has_tables[i0]) {
  pam_write_table_info(w, &(*m).tables[i0]);
  }
  }
  pam_write_started_by(w, &(*m).started_by);
}
static inline void pam_read_device_info(pam_reader *r, pam_device_info *m) {
  (*m).ticks_per_s = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).muscles = pam_get_u8(r);
  (*m).table_capacity = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).trace_capacity = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).reference_capacity = (uint32_t)pam_get_varint(r, UINT32_MAX);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  (*m).has_tables[i0] = pam_get_bool(r);
  if ((*m).has_tables[i0]) {
  pam_read_table_info(r, &(*m).tables[i0]);
  }
  }
  pam_read_started_by(r, &(*m).started_by);
}

typedef enum { PAM_STATE_DISARMED = 0, PAM_STATE_ARMED = 1, PAM_STATE_RUNNING = 2, PAM_STATE_FAULT = 3 } pam_state;
static inline void pam_write_state(pam_writer *w, const pam_state *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_state(pam_reader *r, pam_state *m) {
  *m = (pam_state)pam_get_varint(r, 3);
}

typedef enum { PAM_MODE_VENT = 0, PAM_MODE_PRESSURE = 1, PAM_MODE_FORCE = 2, PAM_MODE_STROKE = 3, PAM_MODE_PAIR = 4 } pam_mode;
static inline void pam_write_mode(pam_writer *w, const pam_mode *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_mode(pam_reader *r, pam_mode *m) {
  *m = (pam_mode)pam_get_varint(r, 4);
}

typedef enum { PAM_FAULT_SENSOR_RANGE = 0, PAM_FAULT_SENSOR_STUCK = 1, PAM_FAULT_SENSOR_NOISY = 2, PAM_FAULT_SENSORS_DISAGREE = 3, PAM_FAULT_SENSORS_SILENT = 4, PAM_FAULT_PRESSURE_NOT_RISING = 5, PAM_FAULT_PRESSURE_NOT_FALLING = 6, PAM_FAULT_OVER_PRESSURE = 7, PAM_FAULT_OVER_STROKE = 8, PAM_FAULT_OVER_SPEED = 9, PAM_FAULT_OVER_FORCE = 10, PAM_FAULT_SET_POINT_SILENCE = 11, PAM_FAULT_LOOP_OVERRUN = 12, PAM_FAULT_TABLE_MISSING = 13, PAM_FAULT_TABLE_INVALID = 14, PAM_FAULT_BROWN_OUT = 15, PAM_FAULT_WATCHDOG = 16, PAM_FAULT_NOT_A_NUMBER = 17, PAM_FAULT_HOST_SILENCE = 18, PAM_FAULT_SETTINGS_INVALID = 19, PAM_FAULT_NOT_VENTED = 20, PAM_FAULT_HOLD_ENDED = 21, PAM_FAULT_CLOCK_FAILED = 22, PAM_FAULT_VALVE_TEST = 23, PAM_FAULT_PRESSURE_SENSORS_DISAGREE = 24, PAM_FAULT_SUPPLY_PRESSURE_LOW = 25, PAM_FAULT_ENABLE_OPEN = 26 } pam_fault;
static inline void pam_write_fault(pam_writer *w, const pam_fault *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_fault(pam_reader *r, pam_fault *m) {
  *m = (pam_fault)pam_get_varint(r, 26);
}

typedef enum { PAM_TABLE_HEALTH_UNKNOWN = 0, PAM_TABLE_HEALTH_DESCRIBES = 1, PAM_TABLE_HEALTH_CHANGED = 2 } pam_table_health;
static inline void pam_write_table_health(pam_writer *w, const pam_table_health *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_table_health(pam_reader *r, pam_table_health *m) {
  *m = (pam_table_health)pam_get_varint(r, 2);
}

typedef struct { pam_state state; pam_mode mode; bool has_fault; pam_fault fault; uint64_t time_us; uint64_t ticks; uint32_t overruns; uint32_t frames_good; uint32_t frames_bad; uint32_t telemetry_dropped; uint32_t saturated_ticks; uint32_t line_errors; uint32_t bus_offs; pam_table_health tables[2]; } pam_status;
static inline void pam_write_status(pam_writer *w, const pam_status *m) {
  pam_write_state(w, &(*m).state);
  pam_write_mode(w, &(*m).mode);
  pam_put_bool(w, (*m).has_fault);
  if ((*m).has_fault) {
  pam_write_fault(w, &(*m).fault);
  }
  pam_put_varint(w, (*m).time_us);
  pam_put_varint(w, (*m).ticks);
  pam_put_varint(w, (*m).overruns);
  pam_put_varint(w, (*m).frames_good);
  pam_put_varint(w, (*m).frames_bad);
  pam_put_varint(w, (*m).telemetry_dropped);
  pam_put_varint(w, (*m).saturated_ticks);
  pam_put_varint(w, (*m).line_errors);
  pam_put_varint(w, (*m).bus_offs);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  pam_write_table_health(w, &(*m).tables[i0]);
  }
}
static inline void pam_read_status(pam_reader *r, pam_status *m) {
  pam_read_state(r, &(*m).state);
  pam_read_mode(r, &(*m).mode);
  (*m).has_fault = pam_get_bool(r);
  if ((*m).has_fault) {
  pam_read_fault(r, &(*m).fault);
  }
  (*m).time_us = (uint64_t)pam_get_varint(r, UINT64_MAX);
  (*m).ticks = (uint64_t)pam_get_varint(r, UINT64_MAX);
  (*m).overruns = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).frames_good = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).frames_bad = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).telemetry_dropped = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).saturated_ticks = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).line_errors = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).bus_offs = (uint32_t)pam_get_varint(r, UINT32_MAX);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  pam_read_table_health(r, &(*m).tables[i0]);
  }
}

typedef struct { uint32_t id; } pam_session;
static inline void pam_write_session(pam_writer *w, const pam_session *m) {
  pam_put_varint(w, (*m).id);
}
static inline void pam_read_session(pam_reader *r, pam_session *m) {
  (*m).id = (uint32_t)pam_get_varint(r, UINT32_MAX);
}

typedef struct { pam_mode mode; pam_session session; } pam_start;
static inline void pam_write_start(pam_writer *w, const pam_start *m) {
  pam_write_mode(w, &(*m).mode);
  pam_write_session(w, &(*m).session);
}
static inline void pam_read_start(pam_reader *r, pam_start *m) {
  pam_read_mode(r, &(*m).mode);
  pam_read_session(r, &(*m).session);
}

enum { PAM_SET_POINT_PRESSURE = 0, PAM_SET_POINT_FORCE = 1, PAM_SET_POINT_STROKE = 2, PAM_SET_POINT_PAIR = 3 };
typedef struct { uint8_t kind; float pressure; float force; float stroke; struct { float angle_rad; float stiffness_nm_per_rad; } pair; } pam_set_point;
static inline void pam_write_set_point(pam_writer *w, const pam_set_point *m) {
  pam_put_varint(w, (*m).kind);
  switch ((*m).kind) {
  case PAM_SET_POINT_PRESSURE: {
  pam_put_f32(w, (*m).pressure);
  break; }
  case PAM_SET_POINT_FORCE: {
  pam_put_f32(w, (*m).force);
  break; }
  case PAM_SET_POINT_STROKE: {
  pam_put_f32(w, (*m).stroke);
  break; }
  case PAM_SET_POINT_PAIR: {
  pam_put_f32(w, (*m).pair.angle_rad);
  pam_put_f32(w, (*m).pair.stiffness_nm_per_rad);
  break; }
  default: break;
  }
}
static inline void pam_read_set_point(pam_reader *r, pam_set_point *m) {
  (*m).kind = (uint8_t)pam_get_varint(r, 3);
  switch ((*m).kind) {
  case PAM_SET_POINT_PRESSURE: {
  (*m).pressure = pam_get_f32(r);
  break; }
  case PAM_SET_POINT_FORCE: {
  (*m).force = pam_get_f32(r);
  break; }
  case PAM_SET_POINT_STROKE: {
  (*m).stroke = pam_get_f32(r);
  break; }
  case PAM_SET_POINT_PAIR: {
  (*m).pair.angle_rad = pam_get_f32(r);
  (*m).pair.stiffness_nm_per_rad = pam_get_f32(r);
  break; }
  default: break;
  }
}

typedef struct { pam_set_point set_point; pam_session session; } pam_set_point_order;
static inline void pam_write_set_point_order(pam_writer *w, const pam_set_point_order *m) {
  pam_write_set_point(w, &(*m).set_point);
  pam_write_session(w, &(*m).session);
}
static inline void pam_read_set_point_order(pam_reader *r, pam_set_point_order *m) {
  pam_read_set_point(r, &(*m).set_point);
  pam_read_session(r, &(*m).session);
}

enum { PAM_REFERENCE_SET_POINT = 0, PAM_REFERENCE_SINE = 1, PAM_REFERENCE_TRAPEZOID = 2, PAM_REFERENCE_CHIRP = 3, PAM_REFERENCE_TABLE = 4 };
typedef struct { uint8_t kind; struct { float mean; float amplitude; float frequency_hz; } sine; struct { float low; float high; float ramp_s; float hold_s; } trapezoid; struct { float mean; float amplitude; float from_hz; float to_hz; float duration_s; } chirp; struct { float step_s; bool repeat; } table; } pam_reference;
static inline void pam_write_reference(pam_writer *w, const pam_reference *m) {
  pam_put_varint(w, (*m).kind);
  switch ((*m).kind) {
  case PAM_REFERENCE_SINE: {
  pam_put_f32(w, (*m).sine.mean);
  pam_put_f32(w, (*m).sine.amplitude);
  pam_put_f32(w, (*m).sine.frequency_hz);
  break; }
  case PAM_REFERENCE_TRAPEZOID: {
  pam_put_f32(w, (*m).trapezoid.low);
  pam_put_f32(w, (*m).trapezoid.high);
  pam_put_f32(w, (*m).trapezoid.ramp_s);
  pam_put_f32(w, (*m).trapezoid.hold_s);
  break; }
  case PAM_REFERENCE_CHIRP: {
  pam_put_f32(w, (*m).chirp.mean);
  pam_put_f32(w, (*m).chirp.amplitude);
  pam_put_f32(w, (*m).chirp.from_hz);
  pam_put_f32(w, (*m).chirp.to_hz);
  pam_put_f32(w, (*m).chirp.duration_s);
  break; }
  case PAM_REFERENCE_TABLE: {
  pam_put_f32(w, (*m).table.step_s);
  pam_put_bool(w, (*m).table.repeat);
  break; }
  default: break;
  }
}
static inline void pam_read_reference(pam_reader *r, pam_reference *m) {
  (*m).kind = (uint8_t)pam_get_varint(r, 4);
  switch ((*m).kind) {
  case PAM_REFERENCE_SINE: {
  (*m).sine.mean = pam_get_f32(r);
  (*m).sine.amplitude = pam_get_f32(r);
  (*m).sine.frequency_hz = pam_get_f32(r);
  break; }
  case PAM_REFERENCE_TRAPEZOID: {
  (*m).trapezoid.low = pam_get_f32(r);
  (*m).trapezoid.high = pam_get_f32(r);
  (*m).trapezoid.ramp_s = pam_get_f32(r);
  (*m).trapezoid.hold_s = pam_get_f32(r);
  break; }
  case PAM_REFERENCE_CHIRP: {
  (*m).chirp.mean = pam_get_f32(r);
  (*m).chirp.amplitude = pam_get_f32(r);
  (*m).chirp.from_hz = pam_get_f32(r);
  (*m).chirp.to_hz = pam_get_f32(r);
  (*m).chirp.duration_s = pam_get_f32(r);
  break; }
  case PAM_REFERENCE_TABLE: {
  (*m).table.step_s = pam_get_f32(r);
  (*m).table.repeat = pam_get_bool(r);
  break; }
  default: break;
  }
}

typedef struct { pam_reference reference; pam_session session; } pam_reference_order;
static inline void pam_write_reference_order(pam_writer *w, const pam_reference_order *m) {
  pam_write_reference(w, &(*m).reference);
  pam_write_session(w, &(*m).session);
}
static inline void pam_read_reference_order(pam_reader *r, pam_reference_order *m) {
  pam_read_reference(r, &(*m).reference);
  pam_read_session(r, &(*m).session);
}

typedef struct { uint16_t offset; uint16_t points_count; float points[128]; pam_session session; } pam_reference_points;
static inline void pam_write_reference_points(pam_writer *w, const pam_reference_points *m) {
  pam_put_varint(w, (*m).offset);
  if ((*m).points_count > 128) w->failed = true;
  pam_put_varint(w, (*m).points_count);
  for (unsigned i0 = 0; i0 < (*m).points_count && !w->failed; i0++) {
  pam_put_f32(w, (*m).points[i0]);
  }
  pam_write_session(w, &(*m).session);
}
static inline void pam_read_reference_points(pam_reader *r, pam_reference_points *m) {
  (*m).offset = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).points_count = (uint16_t)pam_get_varint(r, 128);
  for (unsigned i0 = 0; i0 < (*m).points_count && !r->failed; i0++) {
  (*m).points[i0] = pam_get_f32(r);
  }
  pam_read_session(r, &(*m).session);
}

typedef struct { uint16_t every_ticks; } pam_telemetry_rate;
static inline void pam_write_telemetry_rate(pam_writer *w, const pam_telemetry_rate *m) {
  pam_put_varint(w, (*m).every_ticks);
}
static inline void pam_read_telemetry_rate(pam_reader *r, pam_telemetry_rate *m) {
  (*m).every_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
}

typedef enum { PAM_SIDE_AGONIST = 0, PAM_SIDE_ANTAGONIST = 1 } pam_side;
static inline void pam_write_side(pam_writer *w, const pam_side *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_side(pam_reader *r, pam_side *m) {
  *m = (pam_side)pam_get_varint(r, 1);
}

typedef enum { PAM_SENSOR_PRESSURE = 0, PAM_SENSOR_STROKE = 1, PAM_SENSOR_FORCE = 2 } pam_sensor;
static inline void pam_write_sensor(pam_writer *w, const pam_sensor *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_sensor(pam_reader *r, pam_sensor *m) {
  *m = (pam_sensor)pam_get_varint(r, 2);
}

typedef struct { float pressure_pa; float stroke_m; float force_n; float pressure_demand_pa; float command_pa; float model_n; } pam_side_sample;
static inline void pam_write_side_sample(pam_writer *w, const pam_side_sample *m) {
  pam_put_f32(w, (*m).pressure_pa);
  pam_put_f32(w, (*m).stroke_m);
  pam_put_f32(w, (*m).force_n);
  pam_put_f32(w, (*m).pressure_demand_pa);
  pam_put_f32(w, (*m).command_pa);
  pam_put_f32(w, (*m).model_n);
}
static inline void pam_read_side_sample(pam_reader *r, pam_side_sample *m) {
  (*m).pressure_pa = pam_get_f32(r);
  (*m).stroke_m = pam_get_f32(r);
  (*m).force_n = pam_get_f32(r);
  (*m).pressure_demand_pa = pam_get_f32(r);
  (*m).command_pa = pam_get_f32(r);
  (*m).model_n = pam_get_f32(r);
}

typedef struct { pam_fault fault; pam_side side; bool has_sensor; pam_sensor sensor; pam_state from; pam_mode mode; uint64_t time_us; float value; float limit; pam_side_sample last; } pam_fault_report;
static inline void pam_write_fault_report(pam_writer *w, const pam_fault_report *m) {
  pam_write_fault(w, &(*m).fault);
  pam_write_side(w, &(*m).side);
  pam_put_bool(w, (*m).has_sensor);
  if ((*m).has_sensor) {
  pam_write_sensor(w, &(*m).sensor);
  }
  pam_write_state(w, &(*m).from);
  pam_write_mode(w, &(*m).mode);
  pam_put_varint(w, (*m).time_us);
  pam_put_f32(w, (*m).value);
  pam_put_f32(w, (*m).limit);
  pam_write_side_sample(w, &(*m).last);
}
static inline void pam_read_fault_report(pam_reader *r, pam_fault_report *m) {
  pam_read_fault(r, &(*m).fault);
  pam_read_side(r, &(*m).side);
  (*m).has_sensor = pam_get_bool(r);
  if ((*m).has_sensor) {
  pam_read_sensor(r, &(*m).sensor);
  }
  pam_read_state(r, &(*m).from);
  pam_read_mode(r, &(*m).mode);
  (*m).time_us = (uint64_t)pam_get_varint(r, UINT64_MAX);
  (*m).value = pam_get_f32(r);
  (*m).limit = pam_get_f32(r);
  pam_read_side_sample(r, &(*m).last);
}

typedef struct { bool has_latched; pam_fault_report latched; uint16_t counts[27]; } pam_faults;
static inline void pam_write_faults(pam_writer *w, const pam_faults *m) {
  pam_put_bool(w, (*m).has_latched);
  if ((*m).has_latched) {
  pam_write_fault_report(w, &(*m).latched);
  }
  for (unsigned i0 = 0; i0 < 27; i0++) {
  pam_put_varint(w, (*m).counts[i0]);
  }
}
static inline void pam_read_faults(pam_reader *r, pam_faults *m) {
  (*m).has_latched = pam_get_bool(r);
  if ((*m).has_latched) {
  pam_read_fault_report(r, &(*m).latched);
  }
  for (unsigned i0 = 0; i0 < 27; i0++) {
  (*m).counts[i0] = (uint16_t)pam_get_varint(r, UINT16_MAX);
  }
}

typedef struct { uint8_t back; } pam_past_fault;
static inline void pam_write_past_fault(pam_writer *w, const pam_past_fault *m) {
  pam_put_u8(w, (*m).back);
}
static inline void pam_read_past_fault(pam_reader *r, pam_past_fault *m) {
  (*m).back = pam_get_u8(r);
}

typedef enum { PAM_FEED_FORWARD_TABLE = 0, PAM_FEED_FORWARD_GAYLORD = 1, PAM_FEED_FORWARD_OFF = 2 } pam_feed_forward;
static inline void pam_write_feed_forward(pam_writer *w, const pam_feed_forward *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_feed_forward(pam_reader *r, pam_feed_forward *m) {
  *m = (pam_feed_forward)pam_get_varint(r, 2);
}

typedef struct { float proportional_pa_per_n; float integral_pa_per_n_s; float trim_limit_pa; } pam_force_loop;
static inline void pam_write_force_loop(pam_writer *w, const pam_force_loop *m) {
  pam_put_f32(w, (*m).proportional_pa_per_n);
  pam_put_f32(w, (*m).integral_pa_per_n_s);
  pam_put_f32(w, (*m).trim_limit_pa);
}
static inline void pam_read_force_loop(pam_reader *r, pam_force_loop *m) {
  (*m).proportional_pa_per_n = pam_get_f32(r);
  (*m).integral_pa_per_n_s = pam_get_f32(r);
  (*m).trim_limit_pa = pam_get_f32(r);
}

typedef struct { float proportional_n_per_m; float integral_n_per_m_s; float damping_n_s_per_m; float load_n; float load_stiffness_n_per_m; float force_limit_n; } pam_stroke_loop;
static inline void pam_write_stroke_loop(pam_writer *w, const pam_stroke_loop *m) {
  pam_put_f32(w, (*m).proportional_n_per_m);
  pam_put_f32(w, (*m).integral_n_per_m_s);
  pam_put_f32(w, (*m).damping_n_s_per_m);
  pam_put_f32(w, (*m).load_n);
  pam_put_f32(w, (*m).load_stiffness_n_per_m);
  pam_put_f32(w, (*m).force_limit_n);
}
static inline void pam_read_stroke_loop(pam_reader *r, pam_stroke_loop *m) {
  (*m).proportional_n_per_m = pam_get_f32(r);
  (*m).integral_n_per_m_s = pam_get_f32(r);
  (*m).damping_n_s_per_m = pam_get_f32(r);
  (*m).load_n = pam_get_f32(r);
  (*m).load_stiffness_n_per_m = pam_get_f32(r);
  (*m).force_limit_n = pam_get_f32(r);
}

typedef struct { float radius_m; float rest_stroke_m; float proportional_nm_per_rad; float integral_nm_per_rad_s; float damping_nm_s_per_rad; float torque_limit_nm; } pam_joint;
static inline void pam_write_joint(pam_writer *w, const pam_joint *m) {
  pam_put_f32(w, (*m).radius_m);
  pam_put_f32(w, (*m).rest_stroke_m);
  pam_put_f32(w, (*m).proportional_nm_per_rad);
  pam_put_f32(w, (*m).integral_nm_per_rad_s);
  pam_put_f32(w, (*m).damping_nm_s_per_rad);
  pam_put_f32(w, (*m).torque_limit_nm);
}
static inline void pam_read_joint(pam_reader *r, pam_joint *m) {
  (*m).radius_m = pam_get_f32(r);
  (*m).rest_stroke_m = pam_get_f32(r);
  (*m).proportional_nm_per_rad = pam_get_f32(r);
  (*m).integral_nm_per_rad_s = pam_get_f32(r);
  (*m).damping_nm_s_per_rad = pam_get_f32(r);
  (*m).torque_limit_nm = pam_get_f32(r);
}

typedef struct { float gain; float offset_pa; float lag_s; float line_s; float rate_pa_per_s; float deadband_pa; float command_max_pa; float lead; } pam_regulator;
static inline void pam_write_regulator(pam_writer *w, const pam_regulator *m) {
  pam_put_f32(w, (*m).gain);
  pam_put_f32(w, (*m).offset_pa);
  pam_put_f32(w, (*m).lag_s);
  pam_put_f32(w, (*m).line_s);
  pam_put_f32(w, (*m).rate_pa_per_s);
  pam_put_f32(w, (*m).deadband_pa);
  pam_put_f32(w, (*m).command_max_pa);
  pam_put_f32(w, (*m).lead);
}
static inline void pam_read_regulator(pam_reader *r, pam_regulator *m) {
  (*m).gain = pam_get_f32(r);
  (*m).offset_pa = pam_get_f32(r);
  (*m).lag_s = pam_get_f32(r);
  (*m).line_s = pam_get_f32(r);
  (*m).rate_pa_per_s = pam_get_f32(r);
  (*m).deadband_pa = pam_get_f32(r);
  (*m).command_max_pa = pam_get_f32(r);
  (*m).lead = pam_get_f32(r);
}

typedef struct { float pressure_pa; float stroke_min_m; float stroke_max_m; float speed_m_per_s; float force_n; float slew_pa_per_s; } pam_limits;
static inline void pam_write_limits(pam_writer *w, const pam_limits *m) {
  pam_put_f32(w, (*m).pressure_pa);
  pam_put_f32(w, (*m).stroke_min_m);
  pam_put_f32(w, (*m).stroke_max_m);
  pam_put_f32(w, (*m).speed_m_per_s);
  pam_put_f32(w, (*m).force_n);
  pam_put_f32(w, (*m).slew_pa_per_s);
}
static inline void pam_read_limits(pam_reader *r, pam_limits *m) {
  (*m).pressure_pa = pam_get_f32(r);
  (*m).stroke_min_m = pam_get_f32(r);
  (*m).stroke_max_m = pam_get_f32(r);
  (*m).speed_m_per_s = pam_get_f32(r);
  (*m).force_n = pam_get_f32(r);
  (*m).slew_pa_per_s = pam_get_f32(r);
}

typedef struct { bool fitted; float low; float high; float jump; uint16_t stuck_ticks; } pam_sensor_watch;
static inline void pam_write_sensor_watch(pam_writer *w, const pam_sensor_watch *m) {
  pam_put_bool(w, (*m).fitted);
  pam_put_f32(w, (*m).low);
  pam_put_f32(w, (*m).high);
  pam_put_f32(w, (*m).jump);
  pam_put_varint(w, (*m).stuck_ticks);
}
static inline void pam_read_sensor_watch(pam_reader *r, pam_sensor_watch *m) {
  (*m).fitted = pam_get_bool(r);
  (*m).low = pam_get_f32(r);
  (*m).high = pam_get_f32(r);
  (*m).jump = pam_get_f32(r);
  (*m).stuck_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
}

typedef struct { uint16_t debounce_ticks; uint16_t noisy_jumps; float disagree_n; uint16_t disagree_ticks; float follow_pa; uint16_t follow_ticks; uint32_t silence_ticks; uint32_t host_silence_ticks; bool autonomous; uint16_t overrun_ticks; uint32_t hold_ticks; float vented_pa; uint32_t vent_ticks; float valve_test_pa; uint32_t armed_silence_ticks; float second_pressure_pa; float supply_low_pa; bool enable_input; } pam_watch;
static inline void pam_write_watch(pam_writer *w, const pam_watch *m) {
  pam_put_varint(w, (*m).debounce_ticks);
  pam_put_varint(w, (*m).noisy_jumps);
  pam_put_f32(w, (*m).disagree_n);
  pam_put_varint(w, (*m).disagree_ticks);
  pam_put_f32(w, (*m).follow_pa);
  pam_put_varint(w, (*m).follow_ticks);
  pam_put_varint(w, (*m).silence_ticks);
  pam_put_varint(w, (*m).host_silence_ticks);
  pam_put_bool(w, (*m).autonomous);
  pam_put_varint(w, (*m).overrun_ticks);
  pam_put_varint(w, (*m).hold_ticks);
  pam_put_f32(w, (*m).vented_pa);
  pam_put_varint(w, (*m).vent_ticks);
  pam_put_f32(w, (*m).valve_test_pa);
  pam_put_varint(w, (*m).armed_silence_ticks);
  pam_put_f32(w, (*m).second_pressure_pa);
  pam_put_f32(w, (*m).supply_low_pa);
  pam_put_bool(w, (*m).enable_input);
}
static inline void pam_read_watch(pam_reader *r, pam_watch *m) {
  (*m).debounce_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).noisy_jumps = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).disagree_n = pam_get_f32(r);
  (*m).disagree_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).follow_pa = pam_get_f32(r);
  (*m).follow_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).silence_ticks = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).host_silence_ticks = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).autonomous = pam_get_bool(r);
  (*m).overrun_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).hold_ticks = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).vented_pa = pam_get_f32(r);
  (*m).vent_ticks = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).valve_test_pa = pam_get_f32(r);
  (*m).armed_silence_ticks = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).second_pressure_pa = pam_get_f32(r);
  (*m).supply_low_pa = pam_get_f32(r);
  (*m).enable_input = pam_get_bool(r);
}

typedef struct { float at_zero; float per_unit; float filter_s; } pam_sensor_scale;
static inline void pam_write_sensor_scale(pam_writer *w, const pam_sensor_scale *m) {
  pam_put_f32(w, (*m).at_zero);
  pam_put_f32(w, (*m).per_unit);
  pam_put_f32(w, (*m).filter_s);
}
static inline void pam_read_sensor_scale(pam_reader *r, pam_sensor_scale *m) {
  (*m).at_zero = pam_get_f32(r);
  (*m).per_unit = pam_get_f32(r);
  (*m).filter_s = pam_get_f32(r);
}

typedef struct { pam_sensor_scale pressure; pam_sensor_scale stroke; pam_sensor_scale force; pam_sensor_scale second_pressure; pam_sensor_scale supply; } pam_scales;
static inline void pam_write_scales(pam_writer *w, const pam_scales *m) {
  pam_write_sensor_scale(w, &(*m).pressure);
  pam_write_sensor_scale(w, &(*m).stroke);
  pam_write_sensor_scale(w, &(*m).force);
  pam_write_sensor_scale(w, &(*m).second_pressure);
  pam_write_sensor_scale(w, &(*m).supply);
}
static inline void pam_read_scales(pam_reader *r, pam_scales *m) {
  pam_read_sensor_scale(r, &(*m).pressure);
  pam_read_sensor_scale(r, &(*m).stroke);
  pam_read_sensor_scale(r, &(*m).force);
  pam_read_sensor_scale(r, &(*m).second_pressure);
  pam_read_sensor_scale(r, &(*m).supply);
}

typedef struct { float low; float full_pa; } pam_command_output;
static inline void pam_write_command_output(pam_writer *w, const pam_command_output *m) {
  pam_put_f32(w, (*m).low);
  pam_put_f32(w, (*m).full_pa);
}
static inline void pam_read_command_output(pam_reader *r, pam_command_output *m) {
  (*m).low = pam_get_f32(r);
  (*m).full_pa = pam_get_f32(r);
}

typedef struct { uint16_t period_ticks; float supply_pa; float fill_pa_per_s; float vent_pa_per_s; float dead_s; float least_s; float apart_s; float band_pa; } pam_valve_pair;
static inline void pam_write_valve_pair(pam_writer *w, const pam_valve_pair *m) {
  pam_put_varint(w, (*m).period_ticks);
  pam_put_f32(w, (*m).supply_pa);
  pam_put_f32(w, (*m).fill_pa_per_s);
  pam_put_f32(w, (*m).vent_pa_per_s);
  pam_put_f32(w, (*m).dead_s);
  pam_put_f32(w, (*m).least_s);
  pam_put_f32(w, (*m).apart_s);
  pam_put_f32(w, (*m).band_pa);
}
static inline void pam_read_valve_pair(pam_reader *r, pam_valve_pair *m) {
  (*m).period_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).supply_pa = pam_get_f32(r);
  (*m).fill_pa_per_s = pam_get_f32(r);
  (*m).vent_pa_per_s = pam_get_f32(r);
  (*m).dead_s = pam_get_f32(r);
  (*m).least_s = pam_get_f32(r);
  (*m).apart_s = pam_get_f32(r);
  (*m).band_pa = pam_get_f32(r);
}

typedef struct { uint8_t address; uint16_t kbit_per_s; } pam_can_line;
static inline void pam_write_can_line(pam_writer *w, const pam_can_line *m) {
  pam_put_u8(w, (*m).address);
  pam_put_varint(w, (*m).kbit_per_s);
}
static inline void pam_read_can_line(pam_reader *r, pam_can_line *m) {
  (*m).address = pam_get_u8(r);
  (*m).kbit_per_s = (uint16_t)pam_get_varint(r, UINT16_MAX);
}

typedef struct { pam_feed_forward feed_forward; pam_force_loop force_loop; pam_stroke_loop stroke_loop; pam_joint joint; pam_regulator regulator; pam_limits limits; pam_sensor_watch pressure; pam_sensor_watch stroke; pam_sensor_watch force; pam_watch watch; uint32_t hold_on; float motion_band_m; float pressure_band_pa; pam_scales scales; pam_command_output command; pam_valve_pair valves; pam_can_line can; } pam_settings;
static inline void pam_write_settings(pam_writer *w, const pam_settings *m) {
  pam_write_feed_forward(w, &(*m).feed_forward);
  pam_write_force_loop(w, &(*m).force_loop);
  pam_write_stroke_loop(w, &(*m).stroke_loop);
  pam_write_joint(w, &(*m).joint);
  pam_write_regulator(w, &(*m).regulator);
  pam_write_limits(w, &(*m).limits);
  pam_write_sensor_watch(w, &(*m).pressure);
  pam_write_sensor_watch(w, &(*m).stroke);
  pam_write_sensor_watch(w, &(*m).force);
  pam_write_watch(w, &(*m).watch);
  pam_put_varint(w, (*m).hold_on);
  pam_put_f32(w, (*m).motion_band_m);
  pam_put_f32(w, (*m).pressure_band_pa);
  pam_write_scales(w, &(*m).scales);
  pam_write_command_output(w, &(*m).command);
  pam_write_valve_pair(w, &(*m).valves);
  pam_write_can_line(w, &(*m).can);
}
static inline void pam_read_settings(pam_reader *r, pam_settings *m) {
  pam_read_feed_forward(r, &(*m).feed_forward);
  pam_read_force_loop(r, &(*m).force_loop);
  pam_read_stroke_loop(r, &(*m).stroke_loop);
  pam_read_joint(r, &(*m).joint);
  pam_read_regulator(r, &(*m).regulator);
  pam_read_limits(r, &(*m).limits);
  pam_read_sensor_watch(r, &(*m).pressure);
  pam_read_sensor_watch(r, &(*m).stroke);
  pam_read_sensor_watch(r, &(*m).force);
  pam_read_watch(r, &(*m).watch);
  (*m).hold_on = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).motion_band_m = pam_get_f32(r);
  (*m).pressure_band_pa = pam_get_f32(r);
  pam_read_scales(r, &(*m).scales);
  pam_read_command_output(r, &(*m).command);
  pam_read_valve_pair(r, &(*m).valves);
  pam_read_can_line(r, &(*m).can);
}

typedef struct { pam_side side; uint32_t length; uint32_t crc; } pam_table_begin;
static inline void pam_write_table_begin(pam_writer *w, const pam_table_begin *m) {
  pam_write_side(w, &(*m).side);
  pam_put_varint(w, (*m).length);
  pam_put_varint(w, (*m).crc);
}
static inline void pam_read_table_begin(pam_reader *r, pam_table_begin *m) {
  pam_read_side(r, &(*m).side);
  (*m).length = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).crc = (uint32_t)pam_get_varint(r, UINT32_MAX);
}

typedef struct { uint32_t offset; uint16_t bytes_count; uint8_t bytes[256]; } pam_table_piece;
static inline void pam_write_table_piece(pam_writer *w, const pam_table_piece *m) {
  pam_put_varint(w, (*m).offset);
  if ((*m).bytes_count > 256) w->failed = true;
  pam_put_varint(w, (*m).bytes_count);
  for (unsigned i0 = 0; i0 < (*m).bytes_count && !w->failed; i0++) {
  pam_put_u8(w, (*m).bytes[i0]);
  }
}
static inline void pam_read_table_piece(pam_reader *r, pam_table_piece *m) {
  (*m).offset = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).bytes_count = (uint16_t)pam_get_varint(r, 256);
  for (unsigned i0 = 0; i0 < (*m).bytes_count && !r->failed; i0++) {
  (*m).bytes[i0] = pam_get_u8(r);
  }
}

typedef struct { pam_side side; uint32_t offset; } pam_table_read;
static inline void pam_write_table_read(pam_writer *w, const pam_table_read *m) {
  pam_write_side(w, &(*m).side);
  pam_put_varint(w, (*m).offset);
}
static inline void pam_read_table_read(pam_reader *r, pam_table_read *m) {
  pam_read_side(r, &(*m).side);
  (*m).offset = (uint32_t)pam_get_varint(r, UINT32_MAX);
}

typedef struct { pam_side side; uint32_t generation; } pam_roll_back;
static inline void pam_write_roll_back(pam_writer *w, const pam_roll_back *m) {
  pam_write_side(w, &(*m).side);
  pam_put_varint(w, (*m).generation);
}
static inline void pam_read_roll_back(pam_reader *r, pam_roll_back *m) {
  pam_read_side(r, &(*m).side);
  (*m).generation = (uint32_t)pam_get_varint(r, UINT32_MAX);
}

typedef struct { float pressure_pa; float stroke_m; } pam_point;
static inline void pam_write_point(pam_writer *w, const pam_point *m) {
  pam_put_f32(w, (*m).pressure_pa);
  pam_put_f32(w, (*m).stroke_m);
}
static inline void pam_read_point(pam_reader *r, pam_point *m) {
  (*m).pressure_pa = pam_get_f32(r);
  (*m).stroke_m = pam_get_f32(r);
}

typedef struct { pam_side side; int8_t direction; uint16_t points_count; pam_point points[64]; } pam_evaluate;
static inline void pam_write_evaluate(pam_writer *w, const pam_evaluate *m) {
  pam_write_side(w, &(*m).side);
  pam_put_i8(w, (*m).direction);
  if ((*m).points_count > 64) w->failed = true;
  pam_put_varint(w, (*m).points_count);
  for (unsigned i0 = 0; i0 < (*m).points_count && !w->failed; i0++) {
  pam_write_point(w, &(*m).points[i0]);
  }
}
static inline void pam_read_evaluate(pam_reader *r, pam_evaluate *m) {
  pam_read_side(r, &(*m).side);
  (*m).direction = pam_get_i8(r);
  (*m).points_count = (uint16_t)pam_get_varint(r, 64);
  for (unsigned i0 = 0; i0 < (*m).points_count && !r->failed; i0++) {
  pam_read_point(r, &(*m).points[i0]);
  }
}

typedef struct { float force_n; float pressure_pa; } pam_value;
static inline void pam_write_value(pam_writer *w, const pam_value *m) {
  pam_put_f32(w, (*m).force_n);
  pam_put_f32(w, (*m).pressure_pa);
}
static inline void pam_read_value(pam_reader *r, pam_value *m) {
  (*m).force_n = pam_get_f32(r);
  (*m).pressure_pa = pam_get_f32(r);
}

typedef struct { uint16_t values_count; pam_value values[64]; } pam_evaluated;
static inline void pam_write_evaluated(pam_writer *w, const pam_evaluated *m) {
  if ((*m).values_count > 64) w->failed = true;
  pam_put_varint(w, (*m).values_count);
  for (unsigned i0 = 0; i0 < (*m).values_count && !w->failed; i0++) {
  pam_write_value(w, &(*m).values[i0]);
  }
}
static inline void pam_read_evaluated(pam_reader *r, pam_evaluated *m) {
  (*m).values_count = (uint16_t)pam_get_varint(r, 64);
  for (unsigned i0 = 0; i0 < (*m).values_count && !r->failed; i0++) {
  pam_read_value(r, &(*m).values[i0]);
  }
}

typedef enum { PAM_VARIABLE_PRESSURE = 0, PAM_VARIABLE_STROKE = 1, PAM_VARIABLE_FORCE = 2, PAM_VARIABLE_SPEED = 3, PAM_VARIABLE_DIRECTION = 4, PAM_VARIABLE_SETPOINT = 5, PAM_VARIABLE_FORCE_DEMAND = 6, PAM_VARIABLE_FEED_FORWARD = 7, PAM_VARIABLE_TRIM = 8, PAM_VARIABLE_PRESSURE_DEMAND = 9, PAM_VARIABLE_COMMAND = 10, PAM_VARIABLE_MODEL_PRESSURE = 11, PAM_VARIABLE_MODEL_FORCE = 12, PAM_VARIABLE_STATE = 13, PAM_VARIABLE_STEP_TIME = 14, PAM_VARIABLE_SECOND_PRESSURE = 15, PAM_VARIABLE_SECOND_STROKE = 16, PAM_VARIABLE_SECOND_FORCE = 17, PAM_VARIABLE_SECOND_COMMAND = 18 } pam_variable;
static inline void pam_write_variable(pam_writer *w, const pam_variable *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_variable(pam_reader *r, pam_variable *m) {
  *m = (pam_variable)pam_get_varint(r, 18);
}

typedef enum { PAM_TRIGGER_NOW = 0, PAM_TRIGGER_START = 1, PAM_TRIGGER_UNTIL_FAULT = 2 } pam_trigger;
static inline void pam_write_trigger(pam_writer *w, const pam_trigger *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_trigger(pam_reader *r, pam_trigger *m) {
  *m = (pam_trigger)pam_get_varint(r, 2);
}

typedef struct { uint16_t variables_count; pam_variable variables[256]; uint16_t every_ticks; pam_trigger trigger; } pam_trace_arm;
static inline void pam_write_trace_arm(pam_writer *w, const pam_trace_arm *m) {
  if ((*m).variables_count > 256) w->failed = true;
  pam_put_varint(w, (*m).variables_count);
  for (unsigned i0 = 0; i0 < (*m).variables_count && !w->failed; i0++) {
  pam_write_variable(w, &(*m).variables[i0]);
  }
  pam_put_varint(w, (*m).every_ticks);
  pam_write_trigger(w, &(*m).trigger);
}
static inline void pam_read_trace_arm(pam_reader *r, pam_trace_arm *m) {
  (*m).variables_count = (uint16_t)pam_get_varint(r, 256);
  for (unsigned i0 = 0; i0 < (*m).variables_count && !r->failed; i0++) {
  pam_read_variable(r, &(*m).variables[i0]);
  }
  (*m).every_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  pam_read_trigger(r, &(*m).trigger);
}

typedef struct { bool complete; uint32_t records; uint64_t first_tick; uint16_t every_ticks; uint16_t variables_count; pam_variable variables[256]; } pam_trace_info;
static inline void pam_write_trace_info(pam_writer *w, const pam_trace_info *m) {
  pam_put_bool(w, (*m).complete);
  pam_put_varint(w, (*m).records);
  pam_put_varint(w, (*m).first_tick);
  pam_put_varint(w, (*m).every_ticks);
  if ((*m).variables_count > 256) w->failed = true;
  pam_put_varint(w, (*m).variables_count);
  for (unsigned i0 = 0; i0 < (*m).variables_count && !w->failed; i0++) {
  pam_write_variable(w, &(*m).variables[i0]);
  }
}
static inline void pam_read_trace_info(pam_reader *r, pam_trace_info *m) {
  (*m).complete = pam_get_bool(r);
  (*m).records = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).first_tick = (uint64_t)pam_get_varint(r, UINT64_MAX);
  (*m).every_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).variables_count = (uint16_t)pam_get_varint(r, 256);
  for (unsigned i0 = 0; i0 < (*m).variables_count && !r->failed; i0++) {
  pam_read_variable(r, &(*m).variables[i0]);
  }
}

typedef struct { uint32_t record; } pam_trace_read;
static inline void pam_write_trace_read(pam_writer *w, const pam_trace_read *m) {
  pam_put_varint(w, (*m).record);
}
static inline void pam_read_trace_read(pam_reader *r, pam_trace_read *m) {
  (*m).record = (uint32_t)pam_get_varint(r, UINT32_MAX);
}

typedef struct { uint16_t values_count; float values[128]; } pam_trace_piece;
static inline void pam_write_trace_piece(pam_writer *w, const pam_trace_piece *m) {
  if ((*m).values_count > 128) w->failed = true;
  pam_put_varint(w, (*m).values_count);
  for (unsigned i0 = 0; i0 < (*m).values_count && !w->failed; i0++) {
  pam_put_f32(w, (*m).values[i0]);
  }
}
static inline void pam_read_trace_piece(pam_reader *r, pam_trace_piece *m) {
  (*m).values_count = (uint16_t)pam_get_varint(r, 128);
  for (unsigned i0 = 0; i0 < (*m).values_count && !r->failed; i0++) {
  (*m).values[i0] = pam_get_f32(r);
  }
}

typedef struct { pam_side side; } pam_forget_memory;
static inline void pam_write_forget_memory(pam_writer *w, const pam_forget_memory *m) {
  pam_write_side(w, &(*m).side);
}
static inline void pam_read_forget_memory(pam_reader *r, pam_forget_memory *m) {
  pam_read_side(r, &(*m).side);
}

typedef struct { pam_side side; } pam_health_read;
static inline void pam_write_health_read(pam_writer *w, const pam_health_read *m) {
  pam_write_side(w, &(*m).side);
}
static inline void pam_read_health_read(pam_reader *r, pam_health_read *m) {
  pam_read_side(r, &(*m).side);
}

typedef enum { PAM_SHAPE_FORCE_OFFSET = 0, PAM_SHAPE_FORCE_GAIN = 1, PAM_SHAPE_PRESSURE_GAIN = 2, PAM_SHAPE_CROSS_TALK = 3, PAM_SHAPE_PRESSURE_OFFSET = 4, PAM_SHAPE_LENGTH = 5, PAM_SHAPE_COMPLIANCE = 6, PAM_SHAPE_FRICTION = 7, PAM_SHAPE_LAG = 8, PAM_SHAPE_DRIFT = 9 } pam_shape;
static inline void pam_write_shape(pam_writer *w, const pam_shape *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_shape(pam_reader *r, pam_shape *m) {
  *m = (pam_shape)pam_get_varint(r, 9);
}

typedef struct { pam_table_health table; pam_shape suspect; float excess; float tolerance; uint32_t blocks; float weight; uint16_t block_ticks; uint16_t window_blocks; float force_n; float pressure_pa; float stroke_m; uint16_t sums_count; float sums[128]; uint16_t lagged_count; float lagged[128]; } pam_health_sums;
static inline void pam_write_health_sums(pam_writer *w, const pam_health_sums *m) {
  pam_write_table_health(w, &(*m).table);
  pam_write_shape(w, &(*m).suspect);
  pam_put_f32(w, (*m).excess);
  pam_put_f32(w, (*m).tolerance);
  pam_put_varint(w, (*m).blocks);
  pam_put_f32(w, (*m).weight);
  pam_put_varint(w, (*m).block_ticks);
  pam_put_varint(w, (*m).window_blocks);
  pam_put_f32(w, (*m).force_n);
  pam_put_f32(w, (*m).pressure_pa);
  pam_put_f32(w, (*m).stroke_m);
  if ((*m).sums_count > 128) w->failed = true;
  pam_put_varint(w, (*m).sums_count);
  for (unsigned i0 = 0; i0 < (*m).sums_count && !w->failed; i0++) {
  pam_put_f32(w, (*m).sums[i0]);
  }
  if ((*m).lagged_count > 128) w->failed = true;
  pam_put_varint(w, (*m).lagged_count);
  for (unsigned i0 = 0; i0 < (*m).lagged_count && !w->failed; i0++) {
  pam_put_f32(w, (*m).lagged[i0]);
  }
}
static inline void pam_read_health_sums(pam_reader *r, pam_health_sums *m) {
  pam_read_table_health(r, &(*m).table);
  pam_read_shape(r, &(*m).suspect);
  (*m).excess = pam_get_f32(r);
  (*m).tolerance = pam_get_f32(r);
  (*m).blocks = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).weight = pam_get_f32(r);
  (*m).block_ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).window_blocks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).force_n = pam_get_f32(r);
  (*m).pressure_pa = pam_get_f32(r);
  (*m).stroke_m = pam_get_f32(r);
  (*m).sums_count = (uint16_t)pam_get_varint(r, 128);
  for (unsigned i0 = 0; i0 < (*m).sums_count && !r->failed; i0++) {
  (*m).sums[i0] = pam_get_f32(r);
  }
  (*m).lagged_count = (uint16_t)pam_get_varint(r, 128);
  for (unsigned i0 = 0; i0 < (*m).lagged_count && !r->failed; i0++) {
  (*m).lagged[i0] = pam_get_f32(r);
  }
}

typedef struct { pam_side side; } pam_signals_read;
static inline void pam_write_signals_read(pam_writer *w, const pam_signals_read *m) {
  pam_write_side(w, &(*m).side);
}
static inline void pam_read_signals_read(pam_reader *r, pam_signals_read *m) {
  pam_read_side(r, &(*m).side);
}

typedef struct { float pressure; float stroke; float force; bool has_second_pressure; float second_pressure; } pam_signals;
static inline void pam_write_signals(pam_writer *w, const pam_signals *m) {
  pam_put_f32(w, (*m).pressure);
  pam_put_f32(w, (*m).stroke);
  pam_put_f32(w, (*m).force);
  pam_put_bool(w, (*m).has_second_pressure);
  if ((*m).has_second_pressure) {
  pam_put_f32(w, (*m).second_pressure);
  }
}
static inline void pam_read_signals(pam_reader *r, pam_signals *m) {
  (*m).pressure = pam_get_f32(r);
  (*m).stroke = pam_get_f32(r);
  (*m).force = pam_get_f32(r);
  (*m).has_second_pressure = pam_get_bool(r);
  if ((*m).has_second_pressure) {
  (*m).second_pressure = pam_get_f32(r);
  }
}

typedef struct { uint16_t ticks; pam_signals mean; bool has_supply; float supply; bool enabled; } pam_mean_signals;
static inline void pam_write_mean_signals(pam_writer *w, const pam_mean_signals *m) {
  pam_put_varint(w, (*m).ticks);
  pam_write_signals(w, &(*m).mean);
  pam_put_bool(w, (*m).has_supply);
  if ((*m).has_supply) {
  pam_put_f32(w, (*m).supply);
  }
  pam_put_bool(w, (*m).enabled);
}
static inline void pam_read_mean_signals(pam_reader *r, pam_mean_signals *m) {
  (*m).ticks = (uint16_t)pam_get_varint(r, UINT16_MAX);
  pam_read_signals(r, &(*m).mean);
  (*m).has_supply = pam_get_bool(r);
  if ((*m).has_supply) {
  (*m).supply = pam_get_f32(r);
  }
  (*m).enabled = pam_get_bool(r);
}

typedef struct { uint16_t release[3]; uint32_t length; uint32_t crc; uint32_t order; bool confirmed; } pam_installed;
static inline void pam_write_installed(pam_writer *w, const pam_installed *m) {
  for (unsigned i0 = 0; i0 < 3; i0++) {
  pam_put_varint(w, (*m).release[i0]);
  }
  pam_put_varint(w, (*m).length);
  pam_put_varint(w, (*m).crc);
  pam_put_varint(w, (*m).order);
  pam_put_bool(w, (*m).confirmed);
}
static inline void pam_read_installed(pam_reader *r, pam_installed *m) {
  for (unsigned i0 = 0; i0 < 3; i0++) {
  (*m).release[i0] = (uint16_t)pam_get_varint(r, UINT16_MAX);
  }
  (*m).length = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).crc = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).order = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).confirmed = pam_get_bool(r);
}

typedef struct { uint8_t running; uint32_t addresses[2]; uint32_t capacity; bool has_slots[2]; pam_installed slots[2]; } pam_update_status;
static inline void pam_write_update_status(pam_writer *w, const pam_update_status *m) {
  pam_put_u8(w, (*m).running);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  pam_put_varint(w, (*m).addresses[i0]);
  }
  pam_put_varint(w, (*m).capacity);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  pam_put_bool(w, (*m).has_slots[i0]);
  if ((*m).has_slots[i0]) {
  pam_write_installed(w, &(*m).slots[i0]);
  }
  }
}
static inline void pam_read_update_status(pam_reader *r, pam_update_status *m) {
  (*m).running = pam_get_u8(r);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  (*m).addresses[i0] = (uint32_t)pam_get_varint(r, UINT32_MAX);
  }
  (*m).capacity = (uint32_t)pam_get_varint(r, UINT32_MAX);
  for (unsigned i0 = 0; i0 < 2; i0++) {
  (*m).has_slots[i0] = pam_get_bool(r);
  if ((*m).has_slots[i0]) {
  pam_read_installed(r, &(*m).slots[i0]);
  }
  }
}

typedef struct { uint16_t header_count; uint8_t header[256]; } pam_update_begin;
static inline void pam_write_update_begin(pam_writer *w, const pam_update_begin *m) {
  if ((*m).header_count > 256) w->failed = true;
  pam_put_varint(w, (*m).header_count);
  for (unsigned i0 = 0; i0 < (*m).header_count && !w->failed; i0++) {
  pam_put_u8(w, (*m).header[i0]);
  }
}
static inline void pam_read_update_begin(pam_reader *r, pam_update_begin *m) {
  (*m).header_count = (uint16_t)pam_get_varint(r, 256);
  for (unsigned i0 = 0; i0 < (*m).header_count && !r->failed; i0++) {
  (*m).header[i0] = pam_get_u8(r);
  }
}

typedef struct { uint32_t offset; uint16_t bytes_count; uint8_t bytes[256]; } pam_update_piece;
static inline void pam_write_update_piece(pam_writer *w, const pam_update_piece *m) {
  pam_put_varint(w, (*m).offset);
  if ((*m).bytes_count > 256) w->failed = true;
  pam_put_varint(w, (*m).bytes_count);
  for (unsigned i0 = 0; i0 < (*m).bytes_count && !w->failed; i0++) {
  pam_put_u8(w, (*m).bytes[i0]);
  }
}
static inline void pam_read_update_piece(pam_reader *r, pam_update_piece *m) {
  (*m).offset = (uint32_t)pam_get_varint(r, UINT32_MAX);
  (*m).bytes_count = (uint16_t)pam_get_varint(r, 256);
  for (unsigned i0 = 0; i0 < (*m).bytes_count && !r->failed; i0++) {
  (*m).bytes[i0] = pam_get_u8(r);
  }
}

typedef struct { uint64_t time_us; uint64_t tick; pam_state state; pam_mode mode; float setpoint; float setpoint_second; uint16_t sides_count; pam_side_sample sides[21]; } pam_telemetry;
static inline void pam_write_telemetry(pam_writer *w, const pam_telemetry *m) {
  pam_put_varint(w, (*m).time_us);
  pam_put_varint(w, (*m).tick);
  pam_write_state(w, &(*m).state);
  pam_write_mode(w, &(*m).mode);
  pam_put_f32(w, (*m).setpoint);
  pam_put_f32(w, (*m).setpoint_second);
  if ((*m).sides_count > 21) w->failed = true;
  pam_put_varint(w, (*m).sides_count);
  for (unsigned i0 = 0; i0 < (*m).sides_count && !w->failed; i0++) {
  pam_write_side_sample(w, &(*m).sides[i0]);
  }
}
static inline void pam_read_telemetry(pam_reader *r, pam_telemetry *m) {
  (*m).time_us = (uint64_t)pam_get_varint(r, UINT64_MAX);
  (*m).tick = (uint64_t)pam_get_varint(r, UINT64_MAX);
  pam_read_state(r, &(*m).state);
  pam_read_mode(r, &(*m).mode);
  (*m).setpoint = pam_get_f32(r);
  (*m).setpoint_second = pam_get_f32(r);
  (*m).sides_count = (uint16_t)pam_get_varint(r, 21);
  for (unsigned i0 = 0; i0 < (*m).sides_count && !r->failed; i0++) {
  pam_read_side_sample(r, &(*m).sides[i0]);
  }
}

enum { PAM_EVENT_FAULT = 0, PAM_EVENT_STATE = 1, PAM_EVENT_TRACE_FULL = 2 };
typedef struct { uint8_t kind; pam_fault_report fault; pam_state state; } pam_event;
static inline void pam_write_event(pam_writer *w, const pam_event *m) {
  pam_put_varint(w, (*m).kind);
  switch ((*m).kind) {
  case PAM_EVENT_FAULT: {
  pam_write_fault_report(w, &(*m).fault);
  break; }
  case PAM_EVENT_STATE: {
  pam_write_state(w, &(*m).state);
  break; }
  default: break;
  }
}
static inline void pam_read_event(pam_reader *r, pam_event *m) {
  (*m).kind = (uint8_t)pam_get_varint(r, 2);
  switch ((*m).kind) {
  case PAM_EVENT_FAULT: {
  pam_read_fault_report(r, &(*m).fault);
  break; }
  case PAM_EVENT_STATE: {
  pam_read_state(r, &(*m).state);
  break; }
  default: break;
  }
}

typedef enum { PAM_FIELD_SET_POINT = 0, PAM_FIELD_REFERENCE = 1, PAM_FIELD_FORCE_LOOP = 2, PAM_FIELD_STROKE_LOOP = 3, PAM_FIELD_JOINT = 4, PAM_FIELD_REGULATOR = 5, PAM_FIELD_LIMITS = 6, PAM_FIELD_SENSOR_WATCH = 7, PAM_FIELD_WATCH = 8, PAM_FIELD_BANDS = 9, PAM_FIELD_RATE = 10, PAM_FIELD_SCALE = 11, PAM_FIELD_COMMAND = 12, PAM_FIELD_VALVES = 13, PAM_FIELD_CAN = 14 } pam_field;
static inline void pam_write_field(pam_writer *w, const pam_field *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_field(pam_reader *r, pam_field *m) {
  *m = (pam_field)pam_get_varint(r, 14);
}

enum { PAM_TABLE_FAULT_NOT_BEGUN = 0, PAM_TABLE_FAULT_GAP = 1, PAM_TABLE_FAULT_TOO_LONG = 2, PAM_TABLE_FAULT_INCOMPLETE = 3, PAM_TABLE_FAULT_CHECK = 4, PAM_TABLE_FAULT_VERSION = 5, PAM_TABLE_FAULT_MALFORMED = 6, PAM_TABLE_FAULT_NOT_FINITE = 7, PAM_TABLE_FAULT_NOT_ORDERED = 8, PAM_TABLE_FAULT_OUT_OF_RANGE = 9, PAM_TABLE_FAULT_UNKNOWN_EFFECT = 10 };
typedef struct { uint8_t kind; uint32_t gap; uint32_t too_long; uint32_t incomplete; struct { uint16_t found; uint16_t known; } version; } pam_table_fault;
static inline void pam_write_table_fault(pam_writer *w, const pam_table_fault *m) {
  pam_put_varint(w, (*m).kind);
  switch ((*m).kind) {
  case PAM_TABLE_FAULT_GAP: {
  pam_put_varint(w, (*m).gap);
  break; }
  case PAM_TABLE_FAULT_TOO_LONG: {
  pam_put_varint(w, (*m).too_long);
  break; }
  case PAM_TABLE_FAULT_INCOMPLETE: {
  pam_put_varint(w, (*m).incomplete);
  break; }
  case PAM_TABLE_FAULT_VERSION: {
  pam_put_varint(w, (*m).version.found);
  pam_put_varint(w, (*m).version.known);
  break; }
  default: break;
  }
}
static inline void pam_read_table_fault(pam_reader *r, pam_table_fault *m) {
  (*m).kind = (uint8_t)pam_get_varint(r, 10);
  switch ((*m).kind) {
  case PAM_TABLE_FAULT_GAP: {
  (*m).gap = (uint32_t)pam_get_varint(r, UINT32_MAX);
  break; }
  case PAM_TABLE_FAULT_TOO_LONG: {
  (*m).too_long = (uint32_t)pam_get_varint(r, UINT32_MAX);
  break; }
  case PAM_TABLE_FAULT_INCOMPLETE: {
  (*m).incomplete = (uint32_t)pam_get_varint(r, UINT32_MAX);
  break; }
  case PAM_TABLE_FAULT_VERSION: {
  (*m).version.found = (uint16_t)pam_get_varint(r, UINT16_MAX);
  (*m).version.known = (uint16_t)pam_get_varint(r, UINT16_MAX);
  break; }
  default: break;
  }
}

typedef enum { PAM_STORE_FAULT_MEDIUM = 0, PAM_STORE_FAULT_FULL = 1, PAM_STORE_FAULT_NO_PREVIOUS = 2, PAM_STORE_FAULT_VERIFY = 3 } pam_store_fault;
static inline void pam_write_store_fault(pam_writer *w, const pam_store_fault *m) {
  pam_put_varint(w, (uint64_t)*m);
}
static inline void pam_read_store_fault(pam_reader *r, pam_store_fault *m) {
  *m = (pam_store_fault)pam_get_varint(r, 3);
}

enum { PAM_UPDATE_FAULT_NOT_BEGUN = 0, PAM_UPDATE_FAULT_MALFORMED = 1, PAM_UPDATE_FAULT_BOARD = 2, PAM_UPDATE_FAULT_SLOT = 3, PAM_UPDATE_FAULT_TOO_LONG = 4, PAM_UPDATE_FAULT_SIGNATURE = 5, PAM_UPDATE_FAULT_GAP = 6, PAM_UPDATE_FAULT_DIGEST = 7, PAM_UPDATE_FAULT_MEDIUM = 8, PAM_UPDATE_FAULT_NO_OTHER = 9 };
typedef struct { uint8_t kind; uint32_t gap; } pam_update_fault;
static inline void pam_write_update_fault(pam_writer *w, const pam_update_fault *m) {
  pam_put_varint(w, (*m).kind);
  switch ((*m).kind) {
  case PAM_UPDATE_FAULT_GAP: {
  pam_put_varint(w, (*m).gap);
  break; }
  default: break;
  }
}
static inline void pam_read_update_fault(pam_reader *r, pam_update_fault *m) {
  (*m).kind = (uint8_t)pam_get_varint(r, 9);
  switch ((*m).kind) {
  case PAM_UPDATE_FAULT_GAP: {
  (*m).gap = (uint32_t)pam_get_varint(r, UINT32_MAX);
  break; }
  default: break;
  }
}

enum { PAM_REFUSAL_UNKNOWN_ENDPOINT = 0, PAM_REFUSAL_MALFORMED = 1, PAM_REFUSAL_WRONG_STATE = 2, PAM_REFUSAL_LATCHED = 3, PAM_REFUSAL_STILL_FAULTY = 4, PAM_REFUSAL_NO_TABLE = 5, PAM_REFUSAL_WRONG_MODE = 6, PAM_REFUSAL_VALUE = 7, PAM_REFUSAL_TABLE = 8, PAM_REFUSAL_STORE = 9, PAM_REFUSAL_RANGE = 10, PAM_REFUSAL_NOT_SUPPORTED = 11, PAM_REFUSAL_STIFFNESS = 12, PAM_REFUSAL_ANGLE = 13, PAM_REFUSAL_OTHER_SESSION = 14, PAM_REFUSAL_UPDATE = 15 };
typedef struct { uint8_t kind; pam_state wrong_state; pam_fault latched; pam_fault still_faulty; pam_side no_table; pam_mode wrong_mode; pam_field value; pam_table_fault table; pam_store_fault store; struct { float low_nm_per_rad; float high_nm_per_rad; } stiffness; struct { float low_rad; float high_rad; } angle; pam_update_fault update; } pam_refusal;
static inline void pam_write_refusal(pam_writer *w, const pam_refusal *m) {
  pam_put_varint(w, (*m).kind);
  switch ((*m).kind) {
  case PAM_REFUSAL_WRONG_STATE: {
  pam_write_state(w, &(*m).wrong_state);
  break; }
  case PAM_REFUSAL_LATCHED: {
  pam_write_fault(w, &(*m).latched);
  break; }
  case PAM_REFUSAL_STILL_FAULTY: {
  pam_write_fault(w, &(*m).still_faulty);
  break; }
  case PAM_REFUSAL_NO_TABLE: {
  pam_write_side(w, &(*m).no_table);
  break; }
  case PAM_REFUSAL_WRONG_MODE: {
  pam_write_mode(w, &(*m).wrong_mode);
  break; }
  case PAM_REFUSAL_VALUE: {
  pam_write_field(w, &(*m).value);
  break; }
  case PAM_REFUSAL_TABLE: {
  pam_write_table_fault(w, &(*m).table);
  break; }
  case PAM_REFUSAL_STORE: {
  pam_write_store_fault(w, &(*m).store);
  break; }
  case PAM_REFUSAL_STIFFNESS: {
  pam_put_f32(w, (*m).stiffness.low_nm_per_rad);
  pam_put_f32(w, (*m).stiffness.high_nm_per_rad);
  break; }
  case PAM_REFUSAL_ANGLE: {
  pam_put_f32(w, (*m).angle.low_rad);
  pam_put_f32(w, (*m).angle.high_rad);
  break; }
  case PAM_REFUSAL_UPDATE: {
  pam_write_update_fault(w, &(*m).update);
  break; }
  default: break;
  }
}
static inline void pam_read_refusal(pam_reader *r, pam_refusal *m) {
  (*m).kind = (uint8_t)pam_get_varint(r, 15);
  switch ((*m).kind) {
  case PAM_REFUSAL_WRONG_STATE: {
  pam_read_state(r, &(*m).wrong_state);
  break; }
  case PAM_REFUSAL_LATCHED: {
  pam_read_fault(r, &(*m).latched);
  break; }
  case PAM_REFUSAL_STILL_FAULTY: {
  pam_read_fault(r, &(*m).still_faulty);
  break; }
  case PAM_REFUSAL_NO_TABLE: {
  pam_read_side(r, &(*m).no_table);
  break; }
  case PAM_REFUSAL_WRONG_MODE: {
  pam_read_mode(r, &(*m).wrong_mode);
  break; }
  case PAM_REFUSAL_VALUE: {
  pam_read_field(r, &(*m).value);
  break; }
  case PAM_REFUSAL_TABLE: {
  pam_read_table_fault(r, &(*m).table);
  break; }
  case PAM_REFUSAL_STORE: {
  pam_read_store_fault(r, &(*m).store);
  break; }
  case PAM_REFUSAL_STIFFNESS: {
  (*m).stiffness.low_nm_per_rad = pam_get_f32(r);
  (*m).stiffness.high_nm_per_rad = pam_get_f32(r);
  break; }
  case PAM_REFUSAL_ANGLE: {
  (*m).angle.low_rad = pam_get_f32(r);
  (*m).angle.high_rad = pam_get_f32(r);
  break; }
  case PAM_REFUSAL_UPDATE: {
  pam_read_update_fault(r, &(*m).update);
  break; }
  default: break;
  }
}

#endif
