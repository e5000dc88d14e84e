# Finds sources that include what stands above or beside their own room (docs/architecture.md, "The house").
#
#   awk -f cmake/room_arrows.awk FILE...              prints a line for each, and exits with 1 if there is one
#
# Tests are free: files *_test.cpp and *_fixture.h, folders named `testing`, and tests/ and bench/.

BEGIN {
  core = " core/world core/physics core/replication core/game core/region "
  shells = " net telemetry host trust "
  below["core/world"] = " game_sdk "  # the tables of functions in game_sdk/include, which are C
  below["core/physics"] = below["core/replication"] = below["scenes"] = below["games"] = below["net"] = " core/world "
  below["core/game"] = " core/world game_sdk "
  below["core/region"] = " core/world core/physics core/game game_sdk "
  below["game_sdk"] = " core/world core/game "
  below["host"] = " "
  below["telemetry"] = " host trust "
  below["trust"] = " core/world net host "
  below["agent"] = below["control_plane"] = below["region_worker"] = core shells " game_sdk "
  below["client_sdk"] = core shells " game_sdk region_worker "
  below["gateway"] = core shells " client_sdk "
  below["local_cluster"] = core shells " game_sdk games client_sdk "
  below["cli"] = core shells " game_sdk games client_sdk local_cluster "
}
function room_of(path, parts) {
  split(path, parts, "/")
  return parts[1] == "core" ? "core/" parts[2] : parts[1]
}
FNR == 1 {
  path = FILENAME
  sub(/^\.\//, "", path)
  own = room_of(path)
  free = !(own in below) || path ~ /(^|\/)testing\/|_test\.cpp$|_fixture\.h$/
}
!free && match($0, /^#include "[^"]*\//) {
  named = $2
  gsub(/"/, "", named)
  other = room_of(named)
  tested = named ~ /(^|\/)testing\// && other != "game_sdk"  # there it runs the tests of games
  if (!(other in below) || (other == own && !tested)) next
  if (!tested && index(below[own], " " other " ")) next
  printf "%s:%d: %s may not include %s\n", FILENAME, FNR, own, named
  failed = 1
}
END { exit failed }
