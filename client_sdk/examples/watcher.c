/* Watcher: joins an instance from C and tells what comes, what goes and where its own body is.
 *
 *   watcher GRANT_FILE [SECONDS]        the grant is what a game's backend gives; here grant.c fetched it */
#include <stdio.h>
#include <stdlib.h>
#include <tessera/tessera.h>

enum { MAX_BODIES = 4096 };
static tessera_body bodies[MAX_BODIES];

static void Tell(const tessera_event* event) {
  switch (event->kind) {
    case TESSERA_EVENT_STARTED:
      puts("the world moves");
      break;
    case TESSERA_EVENT_REGION_LOST:
      printf("region %u is lost\n", event->region);
      break;
    case TESSERA_EVENT_REGION_BACK:
      printf("region %u is back\n", event->region);
      break;
    case TESSERA_EVENT_INPUT_REFUSED:
    case TESSERA_EVENT_ENDED:
      puts(event->detail);
      break;
    default:
      break; /* bodies that appear and vanish are in tessera_bodies */
  }
}

static void Draw(const tessera_client* client, size_t count) {
  printf("tick %llu: %zu bodies", (unsigned long long)tessera_tick(client), count);
  for (size_t i = 0; i < count && i < MAX_BODIES; ++i) {
    if ((bodies[i].flags & TESSERA_BODY_OWN) == 0) continue;
    printf("; I am at (%.1f, %.1f, %.1f)", bodies[i].position[0], bodies[i].position[1], bodies[i].position[2]);
  }
  puts("");
}

static unsigned char grant[TESSERA_MAX_GRANT];

static size_t ReadGrant(const char* name) {
  FILE* file = fopen(name, "rb");
  if (file == NULL) return 0;
  const size_t size = fread(grant, 1, sizeof grant, file);
  fclose(file);
  return size;
}

static void TellWhere(const tessera_client* client) {
  tessera_scene_info scene = TESSERA_SCENE_INFO;
  tessera_get_scene(client, &scene);
  printf("player %u in %s\n", tessera_player(client), scene.name);
}

int main(int argc, char** argv) {
  if (argc < 2) {
    fprintf(stderr, "usage: %s GRANT_FILE [SECONDS]\n", argv[0]);
    return 2;
  }
  const size_t grant_size = ReadGrant(argv[1]);
  tessera_client* client = NULL;
  if (tessera_join_grant(grant, grant_size, NULL, &client) != TESSERA_OK) {
    fprintf(stderr, "%s\n", tessera_last_error());
    return 1;
  }
  int inside = 0;

  const int64_t second = 1000000000, frame = second / 120;
  const int64_t end = tessera_now() + (argc > 2 ? atoi(argv[2]) : 10) * second;
  int64_t draw_at = 0, frame_at = 0;
  tessera_code code = TESSERA_OK;
  while (tessera_now() < end && tessera_get_state(client) != TESSERA_ENDED) {
    const int64_t now = tessera_now();
    if (now < frame_at) continue; /* a game draws its frame meanwhile */
    frame_at = now + frame;
    code = tessera_poll(client, now);
    tessera_event event = TESSERA_EVENT;
    while (tessera_next_event(client, &event)) Tell(&event);
    if (!inside && tessera_get_state(client) != TESSERA_JOINING) {
      inside = 1;
      TellWhere(client); /* until then the scene was on its way */
    }
    const size_t count = tessera_bodies(client, now, bodies, sizeof bodies[0], MAX_BODIES);
    if (now < draw_at) continue;
    draw_at = now + second / 2;
    Draw(client, count);
  }
  if (code == TESSERA_OK && tessera_get_state(client) != TESSERA_ENDED) code = tessera_leave(client, 2000);
  if (code != TESSERA_OK) fprintf(stderr, "%s\n", tessera_last_error());
  tessera_close(client);
  return code == TESSERA_OK ? 0 : 1;
}
