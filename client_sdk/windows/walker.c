/* Walker: tries the library where its unit tests do not run. Joins a world of characters, walks in circles and jumps,
 * keeps the scene and a recording in a folder, plays the recording, and says how well the own body was predicted.
 *
 *   walker GRANT_FILE FOLDER SECONDS */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <tessera/tessera.h>

enum { MAX_BODIES = 256 };
static tessera_body bodies[MAX_BODIES];
static unsigned char grant[TESSERA_MAX_GRANT];
static const int64_t second = 1000000000;

static int Fail(const char* where) {
  fprintf(stderr, "%s: %s\n", where, tessera_last_error());
  return 1;
}

/* The way that the own body has gone since the last call, on the ground. */
static double Step(tessera_client* client, int64_t now) {
  static double at[2];
  static int known;
  const size_t count = tessera_bodies(client, now, bodies, sizeof bodies[0], MAX_BODIES);
  for (size_t i = 0; i < count && i < MAX_BODIES; ++i) {
    if ((bodies[i].flags & TESSERA_BODY_OWN) == 0) continue;
    const double x = bodies[i].position[0], z = bodies[i].position[2];
    const double way = known ? hypot(x - at[0], z - at[1]) : 0;
    at[0] = x;
    at[1] = z;
    known = 1;
    return way;
  }
  return 0;
}

static int Walk(tessera_client* client, double seconds) {
  int64_t start = 0, now = tessera_now(), frame_at = now;
  const int64_t limit = now + 60 * second;
  double walked_m = 0;
  while ((now = tessera_now()) < limit && (start == 0 || now - start < (int64_t)(seconds * 1e9))) {
    if (now < frame_at) continue;
    frame_at = now + second / 120;
    if (tessera_poll(client, now) != TESSERA_OK) return Fail("poll");
    if (tessera_get_state(client) != TESSERA_PLAYING) continue;
    if (start == 0) start = now;
    const double t = (double)(now - start) / 1e9;
    tessera_steering steering = TESSERA_STEERING;
    steering.move[1] = 1;
    steering.yaw = (float)remainder(.8 * t, 6.283185307179586);
    steering.buttons = fmod(t, 2) > 1.8;
    if (tessera_steer(client, &steering) == 0) return Fail("steer");
    walked_m += Step(client, now);
  }
  tessera_stats stats = TESSERA_STATS;
  if (start == 0) return Fail("it never came into the world");
  if (tessera_get_stats(client, &stats) != TESSERA_OK) return Fail("stats");
  printf("walked %.1f m in %.0f s, predicting %d, %llu corrections, last %.3f m, %llu decode errors\n", walked_m,
         seconds, (int)stats.predicting, (unsigned long long)stats.corrections, stats.last_correction_m,
         (unsigned long long)stats.decode_errors);
  return 0;
}

static int Play(const char* file) {
  tessera_client* client = NULL;
  if (tessera_play(file, &client) != TESSERA_OK) return Fail("play");
  const int64_t begin = tessera_now();
  size_t most = 0;
  for (int frame = 0; tessera_get_state(client) != TESSERA_ENDED && frame < 60 * 60; ++frame) {
    const int64_t now = begin + frame * (second / 60);
    if (tessera_poll(client, now) != TESSERA_OK) break;
    const size_t count = tessera_bodies(client, now, bodies, sizeof bodies[0], MAX_BODIES);
    if (count > most) most = count;
  }
  tessera_close(client);
  printf("the recording has %zu bodies\n", most);
  return 0;
}

int main(int argc, char** argv) {
  if (argc != 4) {
    fprintf(stderr, "usage: %s GRANT_FILE FOLDER SECONDS\n", argv[0]);
    return 2;
  }
  FILE* file = fopen(argv[1], "rb");
  const size_t size = file == NULL ? 0 : fread(grant, 1, sizeof grant, file);
  if (file != NULL) fclose(file);
  /* Names in UTF-8 that are not of the code page. */
  char scenes[1024], recording[1024];
  snprintf(scenes, sizeof scenes, "%s/\xd0\xbc\xd0\xb8\xd1\x80", argv[2]);
  snprintf(recording, sizeof recording, "%s/\xd0\xbc\xd0\xb0\xd1\x82\xd1\x87.tsr", argv[2]);
  tessera_grant_options options = TESSERA_GRANT_OPTIONS;
  options.bind_address = "127.0.0.1";
  options.scene_cache_dir = scenes;
  tessera_client* client = NULL;
  if (tessera_join_grant(grant, size, &options, &client) != TESSERA_OK) return Fail("join");
  const double seconds = atof(argv[3]);
  int failed = Walk(client, seconds / 2);
  if (!failed && tessera_record(client, recording, 1 << 24) != TESSERA_OK) failed = Fail("record");
  if (!failed) failed = Walk(client, seconds / 2);
  if (!failed && tessera_stop_recording(client) != TESSERA_OK) failed = Fail("stop");
  if (!failed && tessera_leave(client, 2000) != TESSERA_OK) failed = Fail("leave");
  tessera_close(client);
  return failed ? failed : Play(recording);
}
