/* Joining through a control plane, for development and for programs that are no game: a library of its own,
 * libtessera-connect, which speaks to the control plane's players' door in JSON and needs libcurl. A game ships
 * tessera.h alone, and joins by a grant that its backend got for it. What holds for tessera.h holds here. */
#ifndef TESSERA_CONNECT_H_
#define TESSERA_CONNECT_H_

#include "tessera.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- The worlds that there are -------------------------------------------------------------------------------------
 */

typedef int32_t tessera_instance_state; /* one of these, or of others in between: */
enum {
  TESSERA_INSTANCE_WAITING = 4, /* for players; below it: not that far yet */
  TESSERA_INSTANCE_RUNNING = 5,
  TESSERA_INSTANCE_ENDED = 8,
  TESSERA_INSTANCE_PAUSED = 10
};
enum { TESSERA_MAX_LISTED_INSTANCES = 256, TESSERA_MAX_LISTED_PLAYERS = 16, TESSERA_MAX_LISTED_NAME = 63 };
typedef struct tessera_instance_info {
  uint32_t size;
  tessera_instance_state state;
  uint32_t regions;
  uint32_t players;          /* joined and not left */
  uint32_t expected_players; /* the world starts when so many are in */
  uint32_t name_count;       /* in player_names: known of the first 16 worlds that wait */
  char id[64];               /* each text ends in 0 */
  char scene[64];
  char game[64]; /* empty: it runs none */
  char player_names[TESSERA_MAX_LISTED_PLAYERS][TESSERA_MAX_LISTED_NAME + 1];
} tessera_instance_info;
#define TESSERA_INSTANCE_INFO                                      \
  {                                                                \
    sizeof(tessera_instance_info), 0, 0, 0, 0, 0, {0}, {0}, {0}, { \
      { 0 }                                                        \
    }                                                              \
  }
/* The control plane's instances, those that have ended too (`control_address`: as in tessera_join_options): writes up
 * to `capacity` of them, `stride` bytes apart (sizeof your tessera_instance_info), and gives in `count` how many there
 * are, at most TESSERA_MAX_LISTED_INSTANCES. Waits for the answer, up to the deadline; any thread may call it. */
TESSERA_API tessera_code tessera_list_instances(const char* control_address, uint32_t deadline_ms,
                                                tessera_instance_info* instances, size_t stride, size_t capacity,
                                                size_t* count);

/* --- Joining ------------------------------------------------------------------------------------------------------ */

enum { TESSERA_MAX_CONTROL_ADDRESSES = 16 };
typedef struct tessera_join_options {
  uint32_t size;
  uint32_t deadline_ms; /* until the control plane has answered, and then until all regions have */
  /* HOST:PORT#FINGERPRINT of a players' door in JSON (tessera-control --players-https), which is dialled by TLS: the
   * fingerprint is that of the cluster's authority. HOST:PORT: its certificate is of an authority that this system
   * knows. Or unix:PATH, the socket of a control plane on this machine; NULL: that of this user's `tessera up`.
   * A cluster with several control planes: up to TESSERA_MAX_CONTROL_ADDRESSES of HOST:PORT..., parted by commas. They
   * are asked in order until one of them serves, within the one deadline. */
  const char* control_address;
  const char* instance_id;
  /* Shown to others: at most TESSERA_MAX_PLAYER_NAME bytes of UTF-8 without control characters; may be NULL. */
  const char* player_name;
  const char* bind_address; /* IPv4, of the local socket; NULL: any */
  uint32_t flags;           /* TESSERA_JOIN_... */
  /* tessera_return_token of an earlier client of this player, in whatever process: comes back as the same player, whose
   * body is where the world left it. Of two processes that play one player the newer one goes on; the other ends with
   * TESSERA_ALREADY_EXISTS and does not dial again. NULL, 0: a new player. */
  uint32_t returning_size;
  const uint8_t* returning;
  /* A ticket that a game's backend signed (docs/tickets.md): it says who the player is and the name, and is good for
   * one join; a player who is there already comes back. Then player_name is NULL or "", and returning_size 0. NULL: a
   * guest, where guests are taken. */
  const char* ticket;
} tessera_join_options;
#define TESSERA_JOIN_OPTIONS \
  { sizeof(tessera_join_options), 10000, NULL, NULL, NULL, NULL, TESSERA_JOIN_PREDICT, 0, NULL, NULL }

/* Waits for the control plane, then gives a client that is TESSERA_JOINING. The scene is not there yet: the regions
 * send it, as tessera_join_grant says. Every client wants tessera_close. */
TESSERA_API tessera_code tessera_join(const tessera_join_options* options, tessera_client** client);
/* The grant alone, as a game's backend passes it on: the player has joined then, and whoever has the grant plays it.
 * Writes it only if it fits into `capacity` bytes (TESSERA_MAX_GRANT always do), and gives in `size` how many it has.
 * Among the flags TESSERA_JOIN_WATCH counts. Waits for the control plane; any thread may call it. */
TESSERA_API tessera_code tessera_get_grant(const tessera_join_options* options, void* grant, size_t capacity,
                                           size_t* size);

#ifdef __cplusplus
}
#endif

#endif
