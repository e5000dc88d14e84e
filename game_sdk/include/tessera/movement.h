/* A movement that a game wrote: one C function that says how a player's input moves a body. The region that owns the
 * body calls it, and so does the player's client, which shows the body ahead of the server by it. EXPERIMENTAL, like
 * tessera/game.h: its number changes until games of the first release run on it.
 *
 *   static int Move(const tessera_movement_tick* tick, void* state, tessera_movement_push* push);
 *   const tessera_movement car = {sizeof car, TESSERA_MOVEMENT_ABI, "car", 1, sizeof(CarState), "car", Move, NULL};
 *
 * A worker gets it with the module of a game (tessera_game_module::movement) or, for a game in Lua, in a library of its
 * own, whose one source file says
 *
 *   TESSERA_MOVEMENT_MODULE(&car)
 *
 * A client gets it by tessera_set_movement, and a world in the program itself by tessera_local_options::movement. All
 * have to have the same: a client goes by it only where its name, version and state_bytes are the world's.
 *
 * It is called once a tick for each player whose inputs move a body of its kind, and the push acts in the next step. It
 * is not called for a body that is asleep while no move and no button is asked; a push other than 0 keeps a body awake.
 *
 * It has to be pure: what it gives follows from `tick`, `state` and what it asks by the functions of `tick`, to the
 * bit. So it reads no clock, no chance and nothing that changes, and it is compiled alike for both sides
 * (-ffp-contract=off, no -ffast-math). A client calls it for the same tick again with each word from the server.
 *
 * `state` are `state_bytes` bytes of its own, aligned as a double, which are 0 when a player begins to move a body by
 * it, and which the engine carries from tick to tick, to other regions and to the client. No pointers belong in there.
 *
 * Threads: one thread at a time, but a client's and a worker's own if both are in one process. */
#ifndef TESSERA_MOVEMENT_H
#define TESSERA_MOVEMENT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TESSERA_MOVEMENT_ABI 1

enum {
  TESSERA_MAX_MOVEMENT_STATE = 64, /* bytes */
  TESSERA_MAX_MOVEMENT_NAME = 31,  /* bytes; letters, digits, '_' and '-' */
  TESSERA_MAX_MOVEMENT_SWEEPS = 64 /* in one call */
};

/* The first body that a sphere meets on a straight way. */
typedef struct tessera_movement_hit {
  uint32_t size; /* bytes of this struct */
  uint32_t reserved;
  uint64_t body;
  double fraction;    /* share of the way before it, 0 to 1 */
  double center[3];   /* the sphere's, which stops short of the body by a millimetre or less; m */
  double normal[3];   /* unit, from the body to the sphere */
  double velocity[3]; /* the body's where it is met, m/s */
  double mass_kg;     /* 0: nothing pushes it */
} tessera_movement_hit;
#define TESSERA_MOVEMENT_HIT \
  { sizeof(tessera_movement_hit), 0, 0, 0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0 }

typedef struct tessera_movement_call tessera_movement_call; /* one call; valid until it returns */

/* All that a tick begins with. World frame, y up; quaternions x, y, z, w. */
typedef struct tessera_movement_tick {
  uint32_t size;     /* bytes of this struct */
  uint32_t buttons;  /* bit i: the player holds button i down */
  double seconds;    /* length of a tick */
  double gravity[3]; /* the scene's, m/s^2 */
  uint64_t body;     /* its id; it differs from player to player, so it is for nothing but to be compared */
  double mass_kg;
  double inertia[3];  /* principal, about the body's axes, kg m^2 */
  double position[3]; /* the centre of mass, m */
  double orientation[4];
  double linear_velocity[3];         /* m/s */
  double angular_velocity[3];        /* rad/s */
  float move[2];                     /* right, forward, at most 1 long */
  float yaw, pitch;                  /* where the player looks, rad; as in tessera_steering */
  const void* user;                  /* tessera_movement::user */
  const tessera_movement_call* call; /* for the functions below */
  /* Sweeps a sphere of `radius_m`, .001 to 10, from one point to another, at most 1000 m away. Returns 1 and the first
   * body that it meets, other than the one that is moved: triggers and what its layer ignores are no obstacle. Returns
   * 0 if there is none. Returns -1 for an argument that is wrong, and beyond TESSERA_MAX_MOVEMENT_SWEEPS: then the
   * whole call fails. The same bits in the region and in the client, which has what is near. */
  int (*sweep)(const tessera_movement_call* call, const double from[3], const double to[3], double radius_m,
               tessera_movement_hit* hit);
} tessera_movement_tick;

/* The push on the body in the next step, beside gravity and contacts. A larger force than gives 10 000 m/s^2, or torque
 * than gives 10 000 rad/s^2, is scaled down. */
typedef struct tessera_movement_push {
  double force[3];  /* N, at the centre of mass */
  double torque[3]; /* N m */
} tessera_movement_push;

typedef struct tessera_movement {
  uint32_t size;        /* bytes of this struct */
  uint32_t abi;         /* TESSERA_MOVEMENT_ABI */
  const char* name;     /* ended by a 0 */
  uint32_t version;     /* another one for each change of what the function gives */
  uint32_t state_bytes; /* at most TESSERA_MAX_MOVEMENT_STATE */
  const char* kind;     /* which bodies it moves, as the scene names it; NULL: all that players' inputs move */
  /* Fills in `push`, which is 0 before, and changes `state`. Returns 0, or any other number where it cannot: then, and
   * where a number that it gave is not finite, nothing pushes the body in this tick, the state stays as it was, and the
   * worker's log says so with the player and the name. */
  int (*move)(const tessera_movement_tick* tick, void* state, tessera_movement_push* push);
  const void* user; /* given to it in `tick`; nothing that changes. May be NULL */
} tessera_movement;

/* A library with a movement and no game exports this function, under this name. The table is valid for ever. */
typedef const tessera_movement* (*tessera_movement_1_function)(void);

#ifdef __cplusplus
}
#define TESSERA_MOVEMENT_LINKAGE extern "C"
#else
#define TESSERA_MOVEMENT_LINKAGE
#endif

/* Stands once in a source file of such a library, after the table, without a semicolon. */
#define TESSERA_MOVEMENT_MODULE(table)                                                                               \
  TESSERA_MOVEMENT_LINKAGE __attribute__((visibility("default"))) const tessera_movement* tessera_movement_1(void);  \
  TESSERA_MOVEMENT_LINKAGE __attribute__((visibility("default"))) const tessera_movement* tessera_movement_1(void) { \
    return table;                                                                                                    \
  }

#endif
