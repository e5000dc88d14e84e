/* Grant: what a game's backend does for a player, for development: asks a control plane for a grant and writes it.
 *
 *   grant play.example:7704#3fa8... plaza-1 FILE */
#include <stdio.h>
#include <tessera/connect.h>

static unsigned char grant[TESSERA_MAX_GRANT];

int main(int argc, char** argv) {
  if (argc != 4) {
    fprintf(stderr, "usage: %s CONTROL_ADDRESS INSTANCE_ID FILE\n", argv[0]);
    return 2;
  }
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  options.control_address = argv[1];
  options.instance_id = argv[2];
  options.player_name = "ada";
  size_t size = 0;
  if (tessera_get_grant(&options, grant, sizeof grant, &size) != TESSERA_OK) {
    fprintf(stderr, "%s\n", tessera_last_error());
    return 1;
  }
  FILE* file = fopen(argv[3], "wb");
  if (file == NULL || fwrite(grant, 1, size, file) != size || fclose(file) != 0) {
    fprintf(stderr, "%s: cannot be written\n", argv[3]);
    return 1;
  }
  return 0;
}
