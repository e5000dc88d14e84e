/* A world in the game's own process: for a single player, for editors and for the tests of a game. A scene and its game
 * run as they do on a cluster, in one region, and the client is the one of tessera.h, so a game that plays with others
 * needs nothing else to play alone. Between the two are sockets of this machine (127.0.0.1); nobody without a grant of
 * this world gets in.
 *
 * It is in libtessera-local, which brings what a region needs. What holds for tessera.h holds here: one thread, the
 * caller's clock, errors by tessera_last_error. */
#ifndef TESSERA_LOCAL_H_
#define TESSERA_LOCAL_H_

#include "tessera.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct tessera_local tessera_local;

typedef struct tessera_local_options {
  uint32_t size;
  uint32_t snapshot_rate_hz; /* at most the scene's tick rate, which 0 stands for */
  const char* scene;         /* JSON or textproto, UTF-8 */
  size_t scene_size;         /* bytes */
  const char* scene_name;    /* with which errors begin; NULL: "scene" */
  const char* game;          /* Lua; NULL: none */
  size_t game_size;          /* bytes */
  const char* game_name;     /* with which its errors begin; NULL: "game.lua" */
  /* How players' inputs move bodies (tessera/movement.h), in the world and in the prediction of every client that joins
   * by tessera_local_join; NULL: as the scene says. What it points to outlives the world and its clients. */
  const struct tessera_movement* movement;
} tessera_local_options;
#define TESSERA_LOCAL_OPTIONS \
  { sizeof(tessera_local_options), 0, NULL, 0, NULL, NULL, 0, NULL, NULL }

/* Loads the scene and the game, which takes as long as they are large. TESSERA_INVALID_ARGUMENT names what is wrong
 * with them or the movement, with file, line and field; TESSERA_UNAVAILABLE: there is no socket. Every world wants
 * tessera_local_close.
 */
TESSERA_API tessera_code tessera_local_world(const tessera_local_options* options, tessera_local** world);

/* Once a frame, before tessera_poll: steps what is due by this clock, a few ticks at most. A world whose clock stood
 * goes on from where it was, and does not race. TESSERA_FAILED_PRECONDITION: why the world cannot go on. */
TESSERA_API tessera_code tessera_local_advance(tessera_local* world, int64_t now_ns);

/* Another player comes in, as tessera_join_grant does it: the client is TESSERA_JOINING until both are polled.
 * `options` may be NULL; its scene and its address are given by the world. TESSERA_FAILED_PRECONDITION: the scene has
 * no player; TESSERA_RESOURCE_EXHAUSTED: too many have come. The body of one that has left stays. */
TESSERA_API tessera_code tessera_local_join(tessera_local* world, const tessera_grant_options* options,
                                            tessera_client** client);

/* The newest tick that was stepped; 0 for NULL. */
TESSERA_API uint64_t tessera_local_tick(const tessera_local* world);

/* The oldest line that the game has printed and that was not taken yet, with "error: " before one that says what
 * failed; NULL: there is none, or `world` is NULL. It is valid until the next call. The newest 1000 lines are kept; of
 * more than 32 in a tick, or 50 a second for long, some are left out. */
TESSERA_API const char* tessera_local_line(tessera_local* world);

/* Ends the world; its clients are told so and end. NULL is ignored. */
TESSERA_API void tessera_local_close(tessera_local* world);

#ifdef __cplusplus
}
#endif

#endif
