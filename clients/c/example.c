/* Follows a pressure for a second over TCP (POSIX) and prints what the controller says:

       cc -std=c99 -Wall -Wextra -o example clients/c/example.c && ./example 127.0.0.1 4321 150
*/
#define _POSIX_C_SOURCE 200112L
#include "pam_link.h"
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static int line;
static uint16_t sequence;

static void fail(const char *why) {
  fprintf(stderr, "example: %s\n", why);
  exit(1);
}

/* Sends a request; gives the length of the answer's body, which is put into `answer`. */
static size_t ask(uint8_t number, const pam_writer *request, uint8_t *answer) {
  uint8_t out[PAM_LONGEST_FRAME], in[PAM_LONGEST_FRAME];
  if (request && request->failed) fail("the request does not fit");
  sequence++;
  size_t length = pam_frame(PAM_REQUEST, number, sequence, request ? request->at : NULL, request ? request->length : 0, out, sizeof out);
  if (!length || write(line, out, length) != (ssize_t)length) fail("the line is broken");
  for (size_t held = 0;;) {
    uint8_t byte;
    if (read(line, &byte, 1) != 1) fail("no answer");
    if (byte != 0) {
      if (held < sizeof in) in[held++] = byte;
      continue;
    }
    uint8_t kind, answered;
    uint16_t of;
    size_t body_length;
    const uint8_t *body = pam_unframe(in, held, &kind, &answered, &of, &body_length);
    held = 0;
    if (!body || kind == PAM_TOPIC || answered != number || of != sequence) continue;
    if (kind == PAM_REFUSAL_FRAME) {
      pam_reader r = {body, body_length, 0, false};
      pam_refusal refusal;
      pam_read_refusal(&r, &refusal);
      fprintf(stderr, "example: request %u is refused, reason %u\n", number, refusal.kind);
      exit(1);
    }
    memcpy(answer, body, body_length);
    return body_length;
  }
}

static pam_status status_of(uint8_t number, const pam_writer *request) {
  uint8_t answer[PAM_LONGEST_BODY];
  size_t length = ask(number, request, answer);
  pam_reader r = {answer, length, 0, false};
  pam_status status;
  pam_read_status(&r, &status);
  if (!pam_is_whole(&r)) fail("the status cannot be read");
  return status;
}

static void wait_ms(long ms) {
  struct timespec time = {0, ms * 1000000};
  nanosleep(&time, NULL);
}

int main(int count, char **given) {
  if (count < 4) fail("give HOST PORT KILOPASCALS");
  struct addrinfo hints = {0}, *found;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(given[1], given[2], &hints, &found)) fail("no such address");
  line = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
  struct timeval patience = {3, 0};
  setsockopt(line, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (line < 0 || connect(line, found->ai_addr, found->ai_addrlen)) fail("nothing listens there");
  freeaddrinfo(found);

  uint8_t answer[PAM_LONGEST_BODY], buffer[64];
  size_t length = ask(PAM_HELLO, NULL, answer);
  if (length < 44 || memcmp(answer, "PAM!", 4)) fail("this is not a controller");
  uint64_t hash = 0;
  for (int n = 0; n < 8; n++) hash |= (uint64_t)answer[16 + n] << 8 * n;
  if (hash != PAM_SCHEMA_HASH) fail("the device has another version of the link");

  pam_session session = {(uint32_t)time(NULL)};
  pam_writer w = {buffer, 0, sizeof buffer, false};
  pam_write_session(&w, &session);
  status_of(PAM_ARM, &w);
  for (int n = 0; n < 60 && status_of(PAM_STATUS, NULL).state == PAM_STATE_DISARMED; n++) wait_ms(50);

  pam_start start = {PAM_MODE_PRESSURE, session};
  w = (pam_writer){buffer, 0, sizeof buffer, false};
  pam_write_start(&w, &start);
  status_of(PAM_START, &w);

  pam_set_point_order order = {{PAM_SET_POINT_PRESSURE, .pressure = 1e3f * (float)atof(given[3])}, session};
  w = (pam_writer){buffer, 0, sizeof buffer, false};
  pam_write_set_point_order(&w, &order);
  status_of(PAM_SET_POINT, &w);

  pam_status status = {0};
  for (int n = 0; n < 10; n++) {
    w = (pam_writer){buffer, 0, sizeof buffer, false};
    pam_write_session(&w, &session);
    ask(PAM_KEEP_ALIVE, &w, answer);
    status = status_of(PAM_STATUS, NULL);
    wait_ms(100);
  }
  printf("state %d, %llu ticks, %s\n", (int)status.state, (unsigned long long)status.ticks, status.has_fault ? "a fault" : "no fault");
  status = status_of(PAM_DISARM, NULL);
  printf("now %d\n", (int)status.state);
  close(line);
  return status.state == PAM_STATE_DISARMED ? 0 : 1;
}
