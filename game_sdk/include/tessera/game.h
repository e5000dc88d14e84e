/* The interface between a region's game host and game code: a C ABI. EXPERIMENTAL: its number changes until games of
 * the first release run on it; a module of another number is refused by name.
 *
 * A game module is loaded once in each region's worker. The host calls it with events, in one order that is the same in
 * each run; the module calls the host's functions from inside such a call, and from nowhere else. What a call asked for
 * takes effect when it returns 0, and all of it is discarded when it returns anything else.
 *
 *   const tessera_game_module* tessera_game_module_1(void) { return &module; }   // a native module exports this
 *
 * Which functions and callbacks there are, with their parameters, is the table in game_sdk/api/api.h; docs/games.md
 * is written from it.
 *
 * Nothing may be kept between two calls but what follows from the module's source: the region may hand a body over, or
 * die, after any of them. State belongs into properties and timers, which the host carries along.
 *
 * Threads: one region calls its game from one thread at a time. Text is UTF-8 with a length, not ended by a 0.
 */
#ifndef TESSERA_GAME_H
#define TESSERA_GAME_H

#include <stddef.h>
#include <stdint.h>

#include "movement.h"

#ifdef __cplusplus
extern "C" {
#endif

#define TESSERA_GAME_ABI 1

/* --- Values */

typedef uint32_t tessera_game_type;
enum {
  TESSERA_GAME_NOTHING = 0,
  TESSERA_GAME_FLAG = 1,     /* whole: 0 or 1 */
  TESSERA_GAME_WHOLE = 2,    /* whole */
  TESSERA_GAME_REAL = 3,     /* real, finite */
  TESSERA_GAME_TEXT = 4,     /* text, count bytes */
  TESSERA_GAME_VECTOR = 5,   /* vector: x, y, z */
  TESSERA_GAME_ROTATION = 6, /* rotation: a unit quaternion x, y, z, w */
  TESSERA_GAME_BODY = 7,     /* id of a body */
  TESSERA_GAME_PLAYER = 8,   /* id: a player's number */
  TESSERA_GAME_INSTANCE = 9, /* the world as a whole */
  TESSERA_GAME_LIST = 10,    /* list, count values */
  TESSERA_GAME_FIELDS = 11   /* fields, count of them, names ascending by their bytes */
};

typedef struct tessera_game_field tessera_game_field;

/* Memory that a value points to belongs to whoever made the value, and is valid until the call that it was passed to,
 * or returned from, is followed by another one or ends. */
typedef struct tessera_game_value {
  uint32_t type;  /* tessera_game_type */
  uint32_t count; /* text bytes, list values or fields */
  union {
    int64_t whole;
    uint64_t id;
    double real;
    double vector[3];
    double rotation[4];
    const char* text;
    const struct tessera_game_value* list;
    const tessera_game_field* fields;
  } as;
} tessera_game_value;

struct tessera_game_field {
  const char* name;
  size_t name_bytes;
  tessera_game_value value;
};

/* --- What the host gives to a module */

typedef struct tessera_game_call tessera_game_call; /* one call of a module; valid until it returns */

typedef struct tessera_game_host {
  uint32_t size; /* bytes of this struct */
  /* Calls function `function` of the table with `count` arguments. Returns 0 and a result (NOTHING where the function
   * has none), or not 0: then nothing happened, and error() says why in one line that names the argument. */
  int (*call)(tessera_game_call* call, uint32_t function, const tessera_game_value* arguments, uint32_t count,
              tessera_game_value* result);
  /* Why the last call() of this call failed; ended by a 0, valid until the next one. */
  const char* (*error)(const tessera_game_call* call);
  /* Counts work that the module did. Returns 0 while the call is within its budget; otherwise it has to return soon,
   * and what it asked for is discarded. `instructions`: steps of an interpreter, or what takes as long as one (some 5
   * ns). */
  int (*charge)(tessera_game_call* call, uint64_t instructions);
} tessera_game_host;

/* --- What a module gives to the host */

/* One line, ended by a 0, with file and line where they are known; longer ones are cut. */
typedef struct tessera_game_error {
  char text[512];
} tessera_game_error;

/* A game as it was uploaded. */
typedef struct tessera_game_source {
  uint32_t size;    /* bytes of this struct */
  const char* name; /* the file's, as errors shall name it; ended by a 0 */
  const char* bytes;
  size_t byte_count;
} tessera_game_source;

/* One callback, as run() is told of it. */
typedef struct tessera_game_callback {
  uint32_t size;     /* bytes of this struct */
  uint32_t callback; /* its number in the table */
  const char* kind;  /* kind of the body that it is about, ended by a 0; NULL for the callbacks of the world */
  const tessera_game_value* arguments;
  uint32_t count;
} tessera_game_callback;

typedef struct tessera_game_module {
  uint32_t size; /* bytes of this struct */
  uint32_t abi;  /* TESSERA_GAME_ABI */
  /* Makes a game of a source. Returns 0, or not 0 and why; then nothing is left behind. */
  int (*load)(const tessera_game_host* host, const tessera_game_source* source, void** game, tessera_game_error* error);
  void (*unload)(void* game);
  /* Whether the game has this callback, for bodies of `kind` or, where that is NULL, for the world. The host asks once
   * and does not call what is not there. */
  int (*handles)(const void* game, uint32_t callback, const char* kind);
  /* Runs one callback. Returns 0, or not 0 and why. */
  int (*run)(void* game, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error* error);
  /* How players' inputs move bodies; NULL: as the scene says. Modules whose `size` ends before this have none. */
  const tessera_movement* movement;
} tessera_game_module;

/* A native module exports this function, under this name. */
typedef const tessera_game_module* (*tessera_game_module_1_function)(void);

#ifdef __cplusplus
}
#endif

#endif
