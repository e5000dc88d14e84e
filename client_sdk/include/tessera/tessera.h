/* Tessera's client, for any language that can call C: a player's way into a running world.
 *
 *   tessera_grant_options options = TESSERA_GRANT_OPTIONS;              // `grant` came from the game's backend
 *   options.scene_cache_dir = "cache";
 *   tessera_client* client = NULL;
 *   if (tessera_join_grant(grant, grant_size, &options, &client) != TESSERA_OK) puts(tessera_last_error());
 *   while (running) {                                                   // once a frame
 *     tessera_poll(client, tessera_now());
 *     tessera_event event = TESSERA_EVENT;
 *     while (tessera_next_event(client, &event)) ...
 *     tessera_move(client, force, NULL);
 *     size_t n = tessera_bodies(client, tessera_now(), bodies, sizeof *bodies, capacity);
 *   }
 *   tessera_leave(client, 2000);
 *   tessera_close(client);
 *
 * Right-handed, y up; metres, seconds, kilograms, newtons, radians; quaternions x, y, z, w.
 *
 * Promises: nothing here waits but tessera_leave, up to its deadline. No thread is asked of the host and none calls
 * back. connect.h, a library of its own, joins through a control plane. A client may be used by one thread at a time;
 * different clients by different threads. A NULL client, a closed handle's id or a wrong argument gives
 * TESSERA_INVALID_ARGUMENT or 0, never a crash, but for pointers that lead nowhere.
 *
 * Stability: structs begin with their size, which the caller sets (the TESSERA_... initialisers do). A library that
 * knows more fields than the program leaves them out; one that knows fewer leaves the program's as they are. A size (or
 * a stride) that leaves out the first fields as well was never set: TESSERA_INVALID_ARGUMENT, or 0, and nothing is
 * written. Functions
 * and fields are added, never changed, while the major version stays. */
#ifndef TESSERA_TESSERA_H_
#define TESSERA_TESSERA_H_

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#if defined(TESSERA_BUILDS_CLIENT)
#define TESSERA_API __declspec(dllexport)
#else
#define TESSERA_API __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define TESSERA_API __attribute__((visibility("default")))
#else
#define TESSERA_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define TESSERA_VERSION_MAJOR 0
#define TESSERA_VERSION_MINOR 1
/* Version of the loaded library: major * 1000 + minor. */
TESSERA_API uint32_t tessera_version(void);

/* --- Errors ------------------------------------------------------------------------------------------------------ */

typedef int32_t tessera_code; /* one of: */
enum {
  TESSERA_OK = 0,
  TESSERA_INVALID_ARGUMENT = 3,    /* tessera_last_error names the argument */
  TESSERA_DEADLINE_EXCEEDED = 4,   /* no answer in time */
  TESSERA_NOT_FOUND = 5,           /* no such instance, body or file */
  TESSERA_ALREADY_EXISTS = 6,      /* another process has joined as this player since */
  TESSERA_PERMISSION_DENIED = 7,   /* the player has left for good */
  TESSERA_RESOURCE_EXHAUSTED = 8,  /* the instance is full */
  TESSERA_FAILED_PRECONDITION = 9, /* it has ended, or its scene has no player */
  TESSERA_ABORTED = 10,            /* the game refused or kicked the player; tessera_disconnect_reason says why */
  TESSERA_INTERNAL = 13,           /* an answer that made no sense */
  TESSERA_UNAVAILABLE = 14,        /* nobody answers at that address */
  TESSERA_DATA_LOSS = 15,          /* a damaged recording */
  TESSERA_UNAUTHENTICATED = 16,    /* the return token was refused, or a region refused who is joining */
  TESSERA_NEW_GRANT_NEEDED = 100   /* no address that the client knows answers any more: another grant may lead there */
};
/* One line about the last call on this thread that did not give TESSERA_OK. Valid until the next call on it. */
TESSERA_API const char* tessera_last_error(void);
/* For libraries beside this one: makes `line` the last error of this thread, and gives `code` back. Cannot fail; a NULL
 * line is an empty one. */
TESSERA_API tessera_code tessera_set_last_error(tessera_code code, const char* line);

/* --- Joining ------------------------------------------------------------------------------------------------------ */

typedef struct tessera_client tessera_client;

/* Nanoseconds of a clock that never goes back; from some moment before the program began. Calls take the time, so a
 * host may use its own; it must not go back. */
TESSERA_API int64_t tessera_now(void);

enum { TESSERA_MAX_PLAYER_NAME = 32 };
enum {
  /* Show the own body and the bodies that it touches where the inputs already made will bring them. */
  TESSERA_JOIN_PREDICT = 1,
  /* Join as a viewer: sees all of the world and takes no part in it, without a player, a body or a return token, and
   * nobody knows of it. For programs that show a world; a region serves few of them. */
  TESSERA_JOIN_WATCH = 2
};

/* A join grant is all that a client needs to get into a running world, as one blob: the control plane makes it when a
 * player joins, the game's backend passes it on. Secret: who has it plays as this player. */
typedef struct tessera_grant_options {
  uint32_t size;
  uint32_t deadline_ms; /* until all regions have answered; it begins anew with each part of the scene that comes */
  uint32_t flags;       /* TESSERA_JOIN_PREDICT; a viewer's grant watches by itself */
  uint32_t reserved;
  const char* bind_address; /* IPv4, of the local socket; NULL: any */
  /* A folder that keeps scenes, so that the next join needs not fetch them; NULL: none. It is made where there is none.
   */
  const char* scene_cache_dir;
  /* The packed scene (docs/protocol.md), if the caller has it: it is copied and not fetched, and a large one is read
   * with the first polls, as one from the folder is. NULL, 0: the regions send it. */
  const void* scene;
  size_t scene_size;
  /* Called by tessera_leave, so that whoever gave the grant lets the player go: with the return token. NULL:
   * tessera_leave closes the connections, and the player can come back. */
  tessera_code (*on_leave)(void* user, const uint8_t* token, size_t token_size, uint32_t deadline_ms);
  void* user;
  void (*free_user)(void* user); /* called once: when joining fails, or by tessera_close; may be NULL */
} tessera_grant_options;
#define TESSERA_GRANT_OPTIONS \
  { sizeof(tessera_grant_options), 10000, TESSERA_JOIN_PREDICT, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL }
enum { TESSERA_MAX_GRANT = 1048576 };

/* Gives a client that is TESSERA_JOINING; does not wait. While it is, tessera_poll goes on, and the scene is an empty
 * one. `options` may be NULL. TESSERA_INVALID_ARGUMENT: the grant is damaged, or of another version; tessera_last_error
 * names the field. Every client wants tessera_close. */
TESSERA_API tessera_code tessera_join_grant(const void* grant, size_t grant_size, const tessera_grant_options* options,
                                            tessera_client** client);
/* Goes on by another grant for the same player (a viewer: another viewer's): its addresses count beside those that are
 * known, and are dialled at once. For TESSERA_EVENT_GRANT_NEEDED, or at any time before; does not wait.
 * TESSERA_INVALID_ARGUMENT: damaged, or for another instance or player; tessera_last_error names the field.
 * TESSERA_FAILED_PRECONDITION: the client has ended, or plays a recording. */
TESSERA_API tessera_code tessera_renew(tessera_client* client, const void* grant, size_t grant_size);
enum { TESSERA_MAX_TOKEN = 1024 };
/* A token that makes its holder this player, until the player leaves: keep it where a later process of the game finds
 * it, and keep it secret. Writes it only if it fits into `capacity` bytes, and gives how many it has; at most
 * TESSERA_MAX_TOKEN, 0 for a viewer and for a recording. */
TESSERA_API size_t tessera_return_token(const tessera_client* client, uint8_t* token, size_t capacity);
/* Has the player's body removed, and ends; by a grant, see on_leave. Waits up to `deadline_ms` for whoever lets the
 * player go: TESSERA_DEADLINE_EXCEEDED, TESSERA_UNAVAILABLE, or the code that on_leave gave, says that it was not heard
 * of; the client has ended all the same. The handle stays until tessera_close. */
TESSERA_API tessera_code tessera_leave(tessera_client* client, uint32_t deadline_ms);
/* Without tessera_leave before it, the body stays in the world, and the player can come back. NULL is fine. */
TESSERA_API void tessera_close(tessera_client* client);

/* --- Once a frame ------------------------------------------------------------------------------------------------- */

typedef int32_t tessera_state; /* one of: */
enum {
  TESSERA_JOINING = 0, /* not all regions have answered yet, or the scene is not here */
  TESSERA_WAITING = 1, /* for the other players */
  TESSERA_PLAYING = 2, /* the world moves */
  TESSERA_ENDED = 3    /* for good */
};

/* Takes in what has come, sends what is due. At least 30 times a second. When the client has ended for a reason that is
 * an error, gives it: TESSERA_NEW_GRANT_NEEDED, TESSERA_ABORTED, TESSERA_ALREADY_EXISTS, or another of the codes above.
 */
TESSERA_API tessera_code tessera_poll(tessera_client* client, int64_t now_ns);
/* One of TESSERA_JOINING to TESSERA_ENDED, as of the last tessera_poll; TESSERA_ENDED for a NULL client. */
TESSERA_API tessera_state tessera_get_state(const tessera_client* client);

typedef int32_t tessera_event_kind; /* one of: */
enum {
  TESSERA_EVENT_APPEARED = 0,      /* body, region */
  TESSERA_EVENT_VANISHED = 1,      /* body, region */
  TESSERA_EVENT_STARTED = 2,       /* the world moves from now on */
  TESSERA_EVENT_INPUT_REFUSED = 3, /* body, input, detail */
  TESSERA_EVENT_REGION_LOST = 4,   /* region: is dialled again; its bodies stand still */
  TESSERA_EVENT_REGION_BACK = 5,   /* region: one that was lost, and only then */
  TESSERA_EVENT_MAP_CHANGED = 6,
  TESSERA_EVENT_ENDED = 7,         /* detail */
  TESSERA_EVENT_CONTACT_BEGAN = 8, /* body, other, region, contact: of players' bodies and the moved one */
  TESSERA_EVENT_CONTACT_ENDED = 9,
  TESSERA_EVENT_TRIGGER_ENTERED = 10, /* body, other, region: one of them is a trigger */
  TESSERA_EVENT_TRIGGER_LEFT = 11,
  TESSERA_EVENT_RECORDING_ENDED = 12,  /* detail: why it could not go on; nothing after tessera_stop_recording */
  TESSERA_EVENT_PROPERTY_CHANGED = 13, /* body, region, property: of one that has appeared; see tessera_get_property */
  TESSERA_EVENT_CLOCK_CHANGED = 14,    /* the world pauses, goes on, or goes at another pace; see tessera_get_clock */
  /* input: number of the command, detail. It is sent again, unless it can never be taken. */
  TESSERA_EVENT_COMMAND_REFUSED = 15,
  /* No address that the client knows has answered for 1.5 s: the world has moved, or is being restored, or is gone. A
   * newer grant (tessera_renew) may lead back; without one the client ends after 30 s with TESSERA_NEW_GRANT_NEEDED. */
  TESSERA_EVENT_GRANT_NEEDED = 16,
  /* The world goes on from an earlier moment, by a checkpoint: all bodies vanish, and appear as they were then. */
  TESSERA_EVENT_RESTORED = 17,
  /* property: of the world; also for those that differ from the scene's when the client comes. See
   * tessera_get_world_property */
  TESSERA_EVENT_WORLD_PROPERTY_CHANGED = 18,
  /* The own body was shown more than a centimetre elsewhere than it came to be. body, region, input: the newest that
   * had acted by then, other: the body that it touched, or 0, detail: how far, and why as far as the client knows. */
  TESSERA_EVENT_PREDICTION_CORRECTED = 19,
  /* The world moves the own body by a function of its game that this program has not given to tessera_set_movement, or
   * in another version: the body is shown as the server has it. Once for each. body, region, detail: which one the
   * world has, and which one is here. */
  TESSERA_EVENT_MOVEMENT_MISSING = 20,
  /* The game has made what tessera_predict_spawn showed. body: its id from now on, region, other: the id until now,
   * detail: how far the two were apart, which is blended away. */
  TESSERA_EVENT_SPAWN_TAKEN = 21,
  /* body: the id of tessera_predict_spawn. It is gone: the game did not make it, or not in time, or nothing is
   * predicted any more, as when the client ends; then the game may make it still. detail: which. */
  TESSERA_EVENT_SPAWN_LOST = 22,
  TESSERA_EVENT_TILE_CAME = 23, /* tile: its bodies can be drawn from now on, see tessera_tile_body */
  /* tile: it is far away by now. What it holds, shapes and names among it, is valid until the next tessera_poll. */
  TESSERA_EVENT_TILE_GONE = 24
};

typedef struct tessera_event {
  uint32_t size;
  tessera_event_kind kind; /* more may be added: pass over what you do not know */
  uint64_t body;
  uint32_t region;
  uint32_t input;
  const char* detail; /* one line, maybe empty; valid until the next tessera_next_event or tessera_poll */
  uint64_t other;
  const char* property; /* its name; valid as long as `detail` */
  /* Where and how hard `body` and `other` met: m in the world, a unit vector from `body` to `other`, N s. All 0 for a
   * pair that touched before this client came. */
  double contact_point[3];
  double contact_normal[3];
  double contact_impulse;
  uint32_t flags; /* TESSERA_EVENT_..., of: */
  uint32_t tile;  /* 0 to tile_count - 1, see tessera_get_scene */
} tessera_event;
enum {
  /* CONTACT_BEGAN, TRIGGER_ENTERED: the two touched or overlapped already when this client connected to the region, at
   * joining or later; nothing has just begun. */
  TESSERA_EVENT_SINCE_BEFORE = 1
};
#define TESSERA_EVENT \
  { sizeof(tessera_event), 0, 0, 0, 0, NULL, 0, NULL, {0}, {0}, 0, 0, 0 }

/* 1 and the next event since the last tessera_poll, 0 when there is none, or event.size is too small for one. */
TESSERA_API int32_t tessera_next_event(tessera_client* client, tessera_event* event);

/* Why the client has ended: the game's own words where the game refused or kicked the player (TESSERA_ABORTED), else
 * one line; empty while it has not, and when it ended in order. Writes it, with a 0 at its end, only if it fits into
 * `capacity` bytes, and gives how many it has without that. */
TESSERA_API size_t tessera_disconnect_reason(const tessera_client* client, char* reason, size_t capacity);

/* --- Talk with the game ------------------------------------------------------------------------------------------- */

enum { TESSERA_MAX_COMMAND = 1024 };
/* Asks something of the game, as bytes of whatever form the game reads (its on_command). It is repeated until a region
 * has taken it for good, so the game gets it exactly once, after all that was sent before it. TESSERA_INVALID_ARGUMENT:
 * more than TESSERA_MAX_COMMAND bytes; TESSERA_RESOURCE_EXHAUSTED: 64 wait already. Regions take 20 a second and 4 KiB
 * a second, after a burst of twice that; what is beyond waits, and TESSERA_EVENT_COMMAND_REFUSED says so. */
TESSERA_API tessera_code tessera_send(tessera_client* client, const void* bytes, size_t size);

/* A body that the game is to make: what the player throws. */
typedef struct tessera_spawn {
  uint32_t size;
  uint32_t flags;     /* TESSERA_SPAWN_..., of: */
  const char* prefab; /* the name of one of the scene's, of one body */
  double position[3]; /* m in the world, where its origin is, at most 20 m from the own body */
  double orientation[4];
  double velocity[3]; /* m/s, at most 1000 long */
  double spin[3];     /* rad/s, at most 1000 long */
} tessera_spawn;
enum {
  TESSERA_SPAWN_FROM_OWN = 1 /* `position` counts from the own body's centre of mass when the game makes the body */
};
#define TESSERA_SPAWN                                             \
  {                                                               \
    sizeof(tessera_spawn), 0, NULL, {0}, {0, 0, 0, 1}, {0}, { 0 } \
  }
enum { TESSERA_MAX_PREDICTED_SPAWNS = 16 };
/* tessera_send, for a command by which the game makes a body with `predicted` (docs/games.md): that body is among
 * tessera_bodies at once, of region 0 and with TESSERA_BODY_PREDICTED, under the id that `body` gets (which may be
 * NULL), simulated as the own body is. TESSERA_EVENT_SPAWN_TAKEN says under which id it goes on once the game has made
 * it, or TESSERA_EVENT_SPAWN_LOST, half a second and a round trip later, or more where the world's ticks are long, that
 * it does not. tessera_find_body does not have it before. The game gets the command when the next input has acted.
 * Where it fails nothing is sent; a game calls tessera_send then. Beside the errors of tessera_send: TESSERA_NOT_FOUND
 * (the scene has no such prefab), TESSERA_INVALID_ARGUMENT (naming the field, or a prefab of several bodies),
 * TESSERA_RESOURCE_EXHAUSTED (TESSERA_MAX_PREDICTED_SPAWNS are shown already), TESSERA_FAILED_PRECONDITION (nothing is
 * predicted, or not yet, or the world is paused). */
TESSERA_API tessera_code tessera_predict_spawn(tessera_client* client, const tessera_spawn* spawn, const void* command,
                                               size_t command_size, uint64_t* body);

/* An event that the game sent this player: each comes once, in order, through handovers and deaths of regions. */
typedef struct tessera_game_event {
  uint32_t size;
  const char* name; /* valid until the next tessera_next_game_event */
  size_t field_count;
} tessera_game_event;
#define TESSERA_GAME_EVENT \
  { sizeof(tessera_game_event), NULL, 0 }
/* 1 and the next event, 0 when there is none. */
TESSERA_API int32_t tessera_next_game_event(tessera_client* client, tessera_game_event* event);

typedef int32_t tessera_field_type; /* one of: */
enum {
  TESSERA_FIELD_BOOL = 0, /* integer: 0 or 1 */
  TESSERA_FIELD_INT = 1,  /* integer */
  TESSERA_FIELD_REAL = 2,
  TESSERA_FIELD_TEXT = 3,
  TESSERA_FIELD_VECTOR = 4,
  TESSERA_FIELD_BODY = 5,  /* integer: its id */
  TESSERA_FIELD_PLAYER = 6 /* integer: its number */
};
typedef struct tessera_game_event_field {
  uint32_t size;
  tessera_field_type type; /* which of these is set: */
  const char* name;        /* this and `text` are valid until the next tessera_next_game_event */
  int64_t integer;
  double real;
  double vector[3];
  const char* text; /* text_size bytes, whatever the game put there, and a 0 */
  size_t text_size;
} tessera_game_event_field;
#define TESSERA_GAME_EVENT_FIELD \
  { sizeof(tessera_game_event_field), 0, NULL, 0, 0, {0, 0, 0}, NULL, 0 }
/* The values of the event that tessera_next_game_event gave last: by place, 0 to field_count - 1, ascending by name; or
 * by name. TESSERA_NOT_FOUND if it has no such value. */
TESSERA_API tessera_code tessera_game_event_field_at(const tessera_client* client, size_t index,
                                                     tessera_game_event_field* field);
/* The same by its name. TESSERA_NOT_FOUND if the event has no such value. */
TESSERA_API tessera_code tessera_find_game_event_field(const tessera_client* client, const char* name,
                                                       tessera_game_event_field* field);

/* The name of a player whose body is in sight. Writes it, with a 0 at its end, only if it fits into `capacity` bytes
 * (TESSERA_MAX_PLAYER_NAME + 1 always do), and gives how many it has; 0 without a name. */
TESSERA_API size_t tessera_player_name(const tessera_client* client, uint32_t player, char* name, size_t capacity);
/* 1 while the game keeps the own body out of the world; `view`, which may be NULL, is where the player looks from. */
TESSERA_API int32_t tessera_spectating(const tessera_client* client, double view[3]);

/* --- Recordings --------------------------------------------------------------------------------------------------- */

/* Records the present state of the world, and from now on everything that comes from the regions, into a file of at
 * most `max_bytes` (0: 1 GiB); a file of that name is replaced. TESSERA_UNAVAILABLE where it cannot be written. */
TESSERA_API tessera_code tessera_record(tessera_client* client, const char* file, uint64_t max_bytes);
/* A file that is not ended, by this or by tessera_close, cannot be played. TESSERA_OK if there is no recording. */
TESSERA_API tessera_code tessera_stop_recording(tessera_client* client);
/* Gives a client that gets everything that the recorded one got, as if it were played again now: poll it, take its
 * events, draw its bodies. It ends with the file. TESSERA_NOT_FOUND, TESSERA_INVALID_ARGUMENT (not a recording),
 * TESSERA_DATA_LOSS (damaged or cut short); tessera_last_error names the file. */
TESSERA_API tessera_code tessera_play(const char* file, tessera_client** client);
/* How long a recording is, seconds; 0 for a client of a world. */
TESSERA_API double tessera_recording_seconds(const tessera_client* client);
/* The next tessera_poll is at this time of the recording, seconds from its beginning, as if the client had only just
 * come to know what stood then: that poll tells first that all bodies known so far vanish. Beyond the end: the end, and
 * back from there. TESSERA_INVALID_ARGUMENT (not finite, or negative), TESSERA_FAILED_PRECONDITION (not a recording).
 */
TESSERA_API tessera_code tessera_seek(tessera_client* client, double seconds);

/* --- The world ---------------------------------------------------------------------------------------------------- */

typedef struct tessera_body {
  uint32_t size;
  uint32_t region; /* its owner */
  uint64_t id;
  double position[3];
  double orientation[4];
  float linear_velocity[3];  /* as newest known */
  float angular_velocity[3]; /* world frame */
  uint32_t flags;            /* TESSERA_BODY_... */
} tessera_body;
#define TESSERA_BODY \
  { sizeof(tessera_body), 0, 0, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, {0, 0, 0}, 0 }
enum {
  TESSERA_BODY_ASLEEP = 1,
  TESSERA_BODY_EXTRAPOLATED = 2, /* its newest state is older than the moment that is shown */
  TESSERA_BODY_OWN = 4,          /* the player's */
  TESSERA_BODY_PREDICTED = 8     /* ahead of the others, by the inputs already made */
};

/* All bodies as they are to be drawn now, ascending by id. Writes up to `capacity` of them, `stride` bytes apart
 * (sizeof your tessera_body), and gives how many there are. */
TESSERA_API size_t tessera_bodies(tessera_client* client, int64_t now_ns, tessera_body* bodies, size_t stride,
                                  size_t capacity);
/* The newest state known of one body: TESSERA_NOT_FOUND if it is not in sight. */
TESSERA_API tessera_code tessera_find_body(const tessera_client* client, uint64_t id, tessera_body* body);

typedef int32_t tessera_property_type; /* one of: */
enum {
  TESSERA_PROPERTY_BOOL = 0,
  TESSERA_PROPERTY_INT = 1,
  TESSERA_PROPERTY_REAL = 2,
  TESSERA_PROPERTY_TEXT = 3,
  TESSERA_PROPERTY_VECTOR = 4,
  TESSERA_PROPERTY_BODY = 5,
  TESSERA_PROPERTY_BYTES = 6
};
enum { TESSERA_MAX_PROPERTY_TEXT = 63, TESSERA_MAX_PROPERTY_BYTES = 256 };
typedef struct tessera_property {
  uint32_t size;
  tessera_property_type type; /* which of these is set: */
  int64_t integer;            /* bool: 0 or 1 */
  double real;
  char text[TESSERA_MAX_PROPERTY_TEXT + 1]; /* ends in 0 */
  double vector[3];
  uint64_t body; /* an id; 0: none. The body need not be in sight */
  uint32_t byte_count;
  uint8_t bytes[TESSERA_MAX_PROPERTY_BYTES];
} tessera_property;
#define TESSERA_PROPERTY                                     \
  {                                                          \
    sizeof(tessera_property), 0, 0, 0, {0}, {0}, 0, 0, { 0 } \
  }

/* A property of a body by its name: its owner's newest value; for a static body, for one that is not in sight, and for
 * a property that this player may not see, the scene's value. TESSERA_NOT_FOUND if the scene has no such body, or
 * declares no such property. */
TESSERA_API tessera_code tessera_get_property(const tessera_client* client, uint64_t body, const char* name,
                                              tessera_property* property);

/* A property of the world as a whole, one of the scene's instance_properties, by its name: its newest value; in a
 * recording that of the moment, where no client may see it the scene's. TESSERA_NOT_FOUND if the scene declares no such
 * one. */
TESSERA_API tessera_code tessera_get_world_property(const tessera_client* client, const char* name,
                                                    tessera_property* property);

/* Number of the player, from 1; 0 for a viewer and for a recording of one. */
TESSERA_API uint32_t tessera_player(const tessera_client* client);
/* The body that the player's inputs move: tessera_player_body of the player, or another one that the game gave, such as
 * a vehicle. 0 for a viewer. */
TESSERA_API uint64_t tessera_own_body(const tessera_client* client);
/* Id of the body that a player has, whether it is in the world or not; 0 for player 0. */
TESSERA_API uint64_t tessera_player_body(uint32_t player);
/* Number of the player whose body it is; 0 for a body that is no player's. */
TESSERA_API uint32_t tessera_player_of_body(uint64_t body);
/* The newest tick of any region that has come; 0 before the first. */
TESSERA_API uint64_t tessera_tick(const tessera_client* client);
/* Version of the map that says which region has what, from 1; it grows with each TESSERA_EVENT_MAP_CHANGED. */
TESSERA_API uint64_t tessera_map_version(const tessera_client* client);

/* How the world's time goes. A tick is as long in the world's own time at each pace. */
typedef struct tessera_clock {
  uint32_t size;
  int32_t paused;          /* 1: nothing moves, and inputs are not taken */
  double ticks_per_second; /* while it moves */
} tessera_clock;
#define TESSERA_CLOCK \
  { sizeof(tessera_clock), 0, 0 }
/* How the world's time goes, as of the last tessera_poll. TESSERA_INVALID_ARGUMENT: a NULL, or clock.size. */
TESSERA_API tessera_code tessera_get_clock(const tessera_client* client, tessera_clock* clock);

/* --- Moving ------------------------------------------------------------------------------------------------------- */

/* Force (N) and torque (N m) on the own body, world frame, from now until the next call; NULL: none. The scene limits
 * them. Gives the number of the next input. */
TESSERA_API uint32_t tessera_move(tessera_client* client, const float force[3], const float torque[3]);

/* All that a player can ask for. In a scene of characters the move vector, the look angles and the buttons count: the
 * body walks by `move` as the player looks, jumps while button 0 is held, and runs while button 1 is; otherwise force
 * and torque do. Every field goes to the server with every input. */
typedef struct tessera_steering {
  uint32_t size;
  uint32_t buttons; /* bit i: button i is held down */
  float force[3], torque[3];
  float move[2]; /* right, forward; a longer vector counts as one of length 1 */
  float yaw;     /* radians about +y, to the left; 0 looks along -z */
  float pitch;   /* radians, up, -pi/2 to pi/2 */
} tessera_steering;
#define TESSERA_STEERING \
  { sizeof(tessera_steering), 0, {0, 0, 0}, {0, 0, 0}, {0, 0}, 0, 0 }
/* From now until the next call of this or of tessera_move, which replaces force and torque alone. Gives the number of
 * the next input; 0: an argument is wrong. */
TESSERA_API uint32_t tessera_steer(tessera_client* client, const tessera_steering* steering);
struct tessera_movement; /* see tessera/movement.h */
/* The function by which the world's game moves players' bodies (tessera/movement.h), so that the own body is predicted
 * by it: where its name, version and state_bytes are the world's; TESSERA_EVENT_MOVEMENT_MISSING says where not. Before
 * the first tessera_poll, or at any time; NULL: none any more. What it points to outlives the client.
 * TESSERA_INVALID_ARGUMENT: tessera_last_error names the field, or the kind that the scene does not have; then there is
 * none. */
TESSERA_API tessera_code tessera_set_movement(tessera_client* client, const struct tessera_movement* movement);
/* Number of the last input that moved the own body, as its region says; 0 before the first. */
TESSERA_API uint32_t tessera_last_applied_input(const tessera_client* client);

/* --- The scene: what does not change, as the instance was made from it
 * ------------------------------------------------ */

typedef int32_t tessera_shape_kind; /* one of: */
enum {
  TESSERA_SHAPE_BOX = 0,          /* dimensions: half extents x, y, z */
  TESSERA_SHAPE_SPHERE = 1,       /* radius */
  TESSERA_SHAPE_CAPSULE = 2,      /* along y: radius, half height of the straight part */
  TESSERA_SHAPE_CYLINDER = 3,     /* along y: radius, half height */
  TESSERA_SHAPE_CONE = 4,         /* along y, apex up, origin halfway: radius, height */
  TESSERA_SHAPE_CONVEX_HULL = 5,  /* vertices */
  TESSERA_SHAPE_COMPOUND = 6,     /* children */
  TESSERA_SHAPE_MESH = 7,         /* vertices, indices: counter-clockwise triangles */
  TESSERA_SHAPE_HEIGHT_FIELD = 8, /* vertices: heights, count = columns * rows; spacing; centred in x and z */
  TESSERA_SHAPE_PLANE = 9         /* normal x, y, z, offset: solid below */
};
typedef struct tessera_shape tessera_shape;
typedef struct tessera_shape_info {
  uint32_t size;
  tessera_shape_kind kind;
  double dimensions[4];
  const float* vertices; /* x, y, z each; of a height field one height each, row by row */
  size_t vertex_count;
  const uint32_t* indices; /* three a triangle */
  size_t index_count;
  uint32_t columns, rows; /* height field */
  double spacing;
  size_t child_count; /* compound */
} tessera_shape_info;
#define TESSERA_SHAPE_INFO \
  { sizeof(tessera_shape_info), 0, {0, 0, 0, 0}, NULL, 0, NULL, 0, 0, 0, 0, 0 }

/* A mesh that is drawn in place of a shape by who has its file, as `tessera scene import` writes it. */
typedef struct tessera_visual_info {
  uint32_t size;
  uint32_t mesh;      /* its place in the file's meshes */
  const char* sha256; /* hash of the file (.glb), 64 lower-case hexadecimal digits; valid as long as the client */
  double position[3]; /* m, in the shape's frame */
  double orientation[4];
  double scale[3]; /* along the mesh's own axes; negative: mirrored */
} tessera_visual_info;
#define TESSERA_VISUAL_INFO                                                    \
  {                                                                            \
    sizeof(tessera_visual_info), 0, NULL, {0, 0, 0}, {0, 0, 0, 1}, { 1, 1, 1 } \
  }

typedef struct tessera_body_info {
  uint32_t size;
  int32_t dynamic; /* 0: static; it never appears among the bodies, draw it from here */
  uint64_t id;
  const char* name; /* may be empty */
  const tessera_shape* shape;
  double mass_kg;
  int32_t trigger;
  double position[3]; /* at tick 0 */
  double orientation[4];
} tessera_body_info;
#define TESSERA_BODY_INFO                                                        \
  {                                                                              \
    sizeof(tessera_body_info), 0, 0, NULL, NULL, 0, 0, {0, 0, 0}, { 0, 0, 0, 1 } \
  }

typedef struct tessera_scene_info {
  uint32_t size;
  uint32_t tick_rate_hz;
  const char* name;
  double bounds_min[3], bounds_max[3];
  double gravity[3];
  size_t body_count;
  double player_max_force_n; /* 0: nobody has a body, or a character has it */
  double player_max_speed_m_s;
  double character_walk_speed_m_s; /* 0: forces move the player's body */
  double character_run_speed_m_s;
  size_t tile_count; /* 0: all static bodies are among the scene's; else see tessera_get_tile */
  double tile_edge;  /* m, of the square that a tile covers; 0 without tiles */
} tessera_scene_info;
#define TESSERA_SCENE_INFO \
  { sizeof(tessera_scene_info), 0, NULL, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0, 0, 0, 0, 0, 0, 0 }

/* The scene as a whole; an empty one until it is here. Its pointers are valid as long as the client.
 * TESSERA_INVALID_ARGUMENT: a NULL, or scene.size. */
TESSERA_API tessera_code tessera_get_scene(const tessera_client* client, tessera_scene_info* scene);
/* A body of the scene by its place in the list, 0 to body_count - 1, ascending by id; without those that are in tiles.
 * TESSERA_INVALID_ARGUMENT: beyond that. */
TESSERA_API tessera_code tessera_scene_body(const tessera_client* client, size_t index, tessera_body_info* info);
/* A body by its id, players' bodies too; one that is in several tiles with the shape of its part in one of them.
 * TESSERA_NOT_FOUND if the scene has none of that id, or it is in tiles that are not here. */
TESSERA_API tessera_code tessera_body_of(const tessera_client* client, uint64_t id, tessera_body_info* info);
/* A shape: lengths in metres, in the body's own frame; vertices and indices are valid as long as the client, those of a
 * tile as long as that. The shape of a body that is in several tiles is a part of the whole.
 * TESSERA_INVALID_ARGUMENT: a NULL, or info.size. */
TESSERA_API tessera_code tessera_get_shape(const tessera_shape* shape, tessera_shape_info* info);
/* Child of a compound by its place, 0 to child_count - 1, with its pose in the compound: three doubles (m), four
 * doubles (x, y, z, w); each may be NULL. TESSERA_INVALID_ARGUMENT: no compound, or beyond that. */
TESSERA_API tessera_code tessera_shape_child(const tessera_shape* shape, size_t index, const tessera_shape** child,
                                             double position[3], double orientation[4]);
/* A mesh that a shape is drawn with, by its place from 0 on; all of them together are drawn in its place. The children
 * of a compound have none. TESSERA_NOT_FOUND: beyond the last. TESSERA_INVALID_ARGUMENT: a NULL, or info.size. */
TESSERA_API tessera_code tessera_shape_visual(const tessera_shape* shape, size_t index, tessera_visual_info* info);

/* --- A large level: static bodies that come in tiles ---------------------------------------------------------------
 *
 * The level of a large scene (a megabyte or more of static bodies) is not with the scene: it is in tiles, squares of
 * tile_edge on the ground, which come as the view reaches them, the nearest first, and go when it has left them.
 *
 *   tessera_view_tiles(client, NULL, 400);                              // draws 400 m far
 *   if (event.kind == TESSERA_EVENT_TILE_CAME) {
 *     tessera_get_tile(client, event.tile, &tile);
 *     for (size_t i = 0; i < tile.body_count; ++i) {
 *       tessera_tile_body(client, event.tile, i, &body);                // makes what is drawn of this tile
 *   ...
 *   if (event.kind == TESSERA_EVENT_TILE_GONE) ...                      // frees it
 *
 * Each triangle of a level is in one tile, so a mesh or height field that is wider than a square has a part in each
 * tile that it reaches: several bodies with one id, which together are the whole. They are kept in scene_cache_dir. A
 * client that was given the scene, and a recording, have all that they have in the scene. */

typedef struct tessera_tile_info {
  uint32_t size;
  int32_t here;                        /* 1: its bodies can be asked for; 0: it has not come, or has gone */
  int32_t row, column;                 /* its square: z from row * tile_edge on, x from column * tile_edge on */
  double bounds_min[3], bounds_max[3]; /* m, of all that it holds, which may reach beyond the square */
  uint64_t bytes;                      /* on the wire, and in scene_cache_dir */
  size_t body_count;                   /* 0 while it is not here */
} tessera_tile_info;
#define TESSERA_TILE_INFO \
  { sizeof(tessera_tile_info), 0, 0, 0, {0, 0, 0}, {0, 0, 0}, 0, 0 }

/* A tile by its place, 0 to tile_count - 1, whether it is here or not. TESSERA_INVALID_ARGUMENT: beyond that, a NULL,
 * or tile.size. */
TESSERA_API tessera_code tessera_get_tile(const tessera_client* client, uint32_t tile, tessera_tile_info* info);
/* A body of a tile by its place in it, 0 to body_count - 1, ascending by id; its pose is that of its shape here. Its
 * pointers are valid until the tessera_poll after the one that gave TESSERA_EVENT_TILE_GONE for this tile.
 * TESSERA_NOT_FOUND: the tile is not here. TESSERA_INVALID_ARGUMENT: beyond the tiles or the tile's bodies, a NULL, or
 * info.size. */
TESSERA_API tessera_code tessera_tile_body(const tessera_client* client, uint32_t tile, size_t index,
                                           tessera_body_info* info);
/* Which tiles are wanted from the next tessera_poll on: those with something within `radius` (m, on the ground) of
 * `centre` (three doubles, m); NULL: about the own body, where that is known, or where a spectator looks from; of a
 * viewer about the middle of the world. 0: the radius of the scene's view, as before the first call, and all of the
 * level where the scene has none, and for a viewer; INFINITY: all of it. A tile goes when it is more than a tile_edge
 * further away. What prediction needs about the own body, within 250 m, comes besides. TESSERA_INVALID_ARGUMENT: a NULL
 * client, a negative radius, or what is not a number. */
TESSERA_API tessera_code tessera_view_tiles(tessera_client* client, const double centre[3], double radius);

/* --- Statistics --------------------------------------------------------------------------------------------------- */

typedef struct tessera_duration { /* s */
  uint64_t count;
  double mean, p50, p99, max;
} tessera_duration;
typedef struct tessera_stats {
  uint32_t size;
  uint32_t regions_connected;
  uint64_t bytes_in, bytes_out; /* payload since the join */
  double bytes_in_per_s, bytes_out_per_s;
  uint64_t datagrams_lost, decode_errors, full_records, delta_records, inputs_refused, bodies;
  double round_trip_s; /* to the region of the own body */
  double tick_rate_hz; /* the world's, as seen here */
  double render_delay_s, jitter_s;
  uint64_t extrapolations, playout_jumps, reconnects;
  int32_t input_margin_ticks; /* how early inputs are at the server: the least of the last second */
  uint32_t reserved;
  uint64_t corrections; /* times the predicted own body was off by more than a centimetre */
  double last_correction_m;
  tessera_duration frame_time, network_time,
      update_time; /* between polls, within tessera_poll, within tessera_bodies */
  /* Came while newer ones were here already, after the program stood, and were not read: nothing is lost by it. */
  uint64_t datagrams_passed_over;
  int32_t predicting;     /* 1: the own body is shown ahead, by the inputs already made */
  uint32_t tiles;         /* a large level's that are here */
  uint64_t tile_bytes;    /* which those were on the wire */
  uint64_t tiles_damaged; /* times one came that was not the one of the scene's list: it is asked for again */
} tessera_stats;
#define TESSERA_STATS                                                                                         \
  {                                                                                                           \
    sizeof(tessera_stats), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {0, 0, 0, 0, 0}, \
        {0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}, 0, 0, 0, 0, 0                                                       \
  }

/* Measurements since the join, and of the last second where a field says so. TESSERA_INVALID_ARGUMENT: a NULL, or
 * stats.size. */
TESSERA_API tessera_code tessera_get_stats(const tessera_client* client, tessera_stats* stats);

/* How often a region has done something since its process began, and for how long together; and the mean of the last
 * second or so, 0 if it was not done in it. */
typedef struct tessera_work { /* s */
  uint64_t count;
  double total, recent;
} tessera_work;
/* The report of a region about itself, once a second: the same figures as its metrics for operators. */
typedef struct tessera_region_info {
  uint32_t size;
  uint32_t region;
  int32_t connected;
  uint32_t reports; /* how many have come over this connection; 0: nothing below round_trip_s is known */
  double round_trip_s;
  uint64_t tick, bodies, ghosts, asleep, clients;
  tessera_work step; /* a whole tick, without waiting; in it: */
  tessera_work physics, prediction;
  tessera_work snapshot_full, snapshot_delta; /* broadcasts where some client got bodies whole; and of changes alone */
  uint64_t process_virtual_bytes, process_physical_bytes;
  uint64_t host_virtual_usable_bytes, host_virtual_total_bytes; /* memory and swap */
  uint64_t host_physical_usable_bytes, host_physical_total_bytes;
} tessera_region_info;
#define TESSERA_REGION_INFO                                                                                           \
  {                                                                                                                   \
    sizeof(tessera_region_info), 0, 0, 0, 0, 0, 0, 0, 0, 0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0, \
        0, 0, 0, 0, 0                                                                                                 \
  }
/* A region that the client is connected to or dials, by its place: 0, 1, ... until TESSERA_NOT_FOUND; ascending by
 * number. */
TESSERA_API tessera_code tessera_region_stats(const tessera_client* client, size_t index, tessera_region_info* info);

/* --- A bad network, to try a game on --------------------------------------------------------------------------------
 */

typedef struct tessera_network {
  uint32_t size;
  uint32_t delay_ms, jitter_ms; /* each datagram's; jitter is evenly spread up to so much more */
  double loss, duplicate;       /* shares of datagrams each way, 0 to 1 */
  uint64_t seed;                /* the same seed and traffic give the same fate */
} tessera_network;
#define TESSERA_NETWORK \
  { sizeof(tessera_network), 0, 0, 0, 0, 1 }
/* From now on the network is so; the default is a perfect one. TESSERA_INVALID_ARGUMENT: a share that is not 0 to 1, or
 * more than a minute late; tessera_last_error names the field. */
TESSERA_API tessera_code tessera_simulate_network(tessera_client* client, const tessera_network* network);

#ifdef __cplusplus
}
#endif
#endif /* TESSERA_TESSERA_H_ */
