// Messages of a region's log and saved states: as they come, and under a checksum that is right, so that the rest of
// the decoder is reached. The first byte chooses. What is accepted is sane and says the same when it is written again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "core/region/log.h"
#include "core/region/log_wire.h"
#include "core/region/standby_copy.h"
#include "tests/fuzz/planted_seed.h"

namespace {

using namespace tessera;
using namespace tessera::region;

constexpr std::uint8_t kSeal = 1, kOnTop = 2;

Catalog MakeCatalog() {
  auto scene = std::make_shared<Scene>();
  for (std::uint64_t id = 1; id <= 40; ++id) {
    BodyDef def;
    def.id = BodyId(id);
    scene->bodies.push_back(def);
  }
  scene->player.emplace().max_force_n = 100;
  scene->properties = {{"armed", false}, {"health", std::int64_t{100}}, {"speed", 1.5}, {"team", std::string("none")}};
  return Catalog(scene);
}

// Tick 7 of region 1: some bodies, a player's, a grant.
RegionState MakeState() {
  RegionState state;
  state.region = RegionId(1);
  state.incarnation = Incarnation(1);
  state.tick = Tick(7);
  for (std::uint64_t id = 3; id <= 12; id += 3) {
    StateBody body{BodyId(id), Epoch(2), {}};
    body.state.position = {static_cast<double>(id), 1, 2};
    body.state.asleep = id == 6;
    state.bodies.push_back(body);
  }
  state.bodies.push_back({PlayerBodyId(PlayerNumber(1)), Epoch(1), {}});
  state.controls[PlayerNumber(1)] = {.last_input = 3, .queue = {{.number = 5, .force_n = {1, 0, 0}}}};
  state.spawned = {PlayerNumber(1)};
  state.touching = {{BodyId(3), BodyId(6), false}};
  KeptGrant& grant = state.grants[{BodyId(20), Epoch(4)}];
  grant.to = RegionId(2);
  grant.tick = Tick(6);
  grant.record = {2, {1, 160, 1}};  // health 80
  state.records[BodyId(6)] = {3, {0, 1, 3, 3, 'r', 'e', 'd'}};
  game::GameRecord& game = state.records[BodyId(6)].game;
  game.last_timer = 4;
  game.timers.push_back({Tick(90), 4, "open", {}});
  game.push_ns = {0, 5, 0};
  return state;
}

// A message as the fuzzer takes it: what to do with it, then its bytes, without the checksum where that is added.
Bytes Input(std::uint8_t flags, Bytes message) {
  if ((flags & kSeal) != 0) message.resize(message.size() - sizeof(std::uint64_t));
  message.insert(message.begin(), flags);
  return message;
}

// The tick after MakeState's: a body has moved, one is new, a record has changed.
Bytes MakeChanges(const Catalog& catalog) {
  const RegionState state = MakeState();
  std::vector<OwnedBody> owned;
  owned.reserve(state.bodies.size() + 1);
  for (const StateBody& body : state.bodies)
    owned.push_back({.def = catalog.Find(body.id), .epoch = body.epoch, .state = body.state});
  std::erase_if(owned, [](const OwnedBody& body) { return body.def == nullptr; });
  LogView view{.region = state.region,
               .incarnation = state.incarnation,
               .tick = state.tick,
               .owned = owned,
               .grants = &state.grants};
  LogWriter writer(1.0 / 60);
  (void)writer.Write(view, {});
  owned[0].state.position.y += 0.25;
  owned.push_back({.def = catalog.Find(BodyId(30)), .epoch = Epoch(1), .state = {}});
  view.owned = owned;
  view.tick = view.tick + 1;
  return writer.Write(view, {});
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const Catalog catalog = MakeCatalog();
  fuzz::PlantSeed(*argc, *argv, "state", Input(0, EncodeState(MakeState())));
  fuzz::PlantSeed(*argc, *argv, "state_unsealed", Input(kSeal, EncodeState(MakeState())));
  fuzz::PlantSeed(*argc, *argv, "changes_unsealed", Input(kSeal | kOnTop, MakeChanges(catalog)));
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Catalog catalog = MakeCatalog();
  static const Bytes base = EncodeState(MakeState());
  if (size == 0) return 0;
  Bytes bytes(data + 1, data + size);
  if ((data[0] & kSeal) != 0) {
    std::uint64_t sum = LogChecksum(bytes);
    for (int i = 0; i < 8; ++i, sum >>= 8) bytes.push_back(static_cast<std::uint8_t>(sum));
  }
  StandbyCopy standby_copy(RegionId(1), catalog);
  if ((data[0] & kOnTop) != 0 && !standby_copy.Receive(base).ok()) std::abort();
  const Bytes before = EncodeState(standby_copy.state());
  if (!standby_copy.Receive(bytes).ok()) {
    if (EncodeState(standby_copy.state()) != before) std::abort();
    return 0;
  }
  if (!standby_copy.whole()) std::abort();
  if (!CheckRegionState(standby_copy.state(), catalog).ok()) std::abort();
  const Bytes again = EncodeState(standby_copy.state());
  const auto state = DecodeState(again, catalog);
  if (!state.ok() || EncodeState(*state) != again) std::abort();
  return 0;
}
