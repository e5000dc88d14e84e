// The keys of the records in the store, and reading all of them when a control plane starts.
//
//   auto stored = ReadRecords(store);   // one that cannot be read is in `unreadable`; DATA_LOSS: the counters cannot
//
// Records that could not be read lie under kSetAside, with the life that found them and their key behind it.
//
// Thread rule: free functions on values.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/players.h"
#include "control_plane/store.h"

namespace tessera::control {

inline constexpr char kHostId[] = "host-", kInstanceId[] = "inst-";
inline constexpr char kCountersKey[] = "counters", kRevocationsKey[] = "revocations";
inline constexpr char kSetAside[] = "unreadable/";

// "host-12" with the prefix "host-" is 12; 0 if it is not of that form.
std::uint64_t NumberOf(std::string_view id, std::string_view prefix);

std::string HostKey(std::uint64_t number);
std::string InstanceKey(std::uint64_t number);
std::string PlayersKey(std::uint64_t instance, std::uint32_t bucket);
std::string SceneKey(std::string_view hash);
std::string GameKey(std::string_view hash);
bool IsSceneKey(std::string_view key);
// Records of an instance: its own, and its players'. Each names the instance; 0: the key is of neither kind.
std::uint64_t InstanceOfKey(std::string_view key);
std::uint64_t InstanceOfPlayersKey(std::string_view key);
// A scene of more than kWholeSceneBytes lies in pieces, so that no write is large. They are stored before its record,
// under a version that no other has, and never change; the record then says which they are.
inline constexpr std::size_t kWholeSceneBytes = 1 << 20, kScenePieceBytes = 1 << 20;
struct ScenePieces {
  std::string version;
  std::uint64_t bytes = 0;  // the whole scene has so many
};
std::vector<std::string> ScenePieceKeys(std::string_view hash, const ScenePieces& pieces);  // in order
// The record under SceneKey then; and back, nothing where a scene lies there itself.
std::string SceneRecord(const ScenePieces& pieces);
std::optional<ScenePieces> ReadSceneRecord(std::string_view value);
// The content under this key, whole. NOT_FOUND: it, or a piece of it, is not there any more; DATA_LOSS names the key.
absl::StatusOr<std::string> ReadContent(const Store& store, const std::string& key);
// Files of meshes and their pieces; all their keys, and no others, begin with kVisualKeys.
inline constexpr char kVisualKeys[] = "visual", kVisualPrefix[] = "visual/";
std::string VisualKey(std::string_view sha256);
std::string VisualPieceKey(std::string_view sha256, std::uint64_t number);

// The files that an instance uses. Each lies in the store once, however many instances use it.
struct Contents {
  std::string scene;  // serialised tessera.v1.Scene
  std::string game;   // empty: it runs none; the only one that the store may lack
};
// The keys of the scene and, where it runs one, of the game, the one before it and the one that is to be next. Each
// once.
std::vector<std::string> ContentKeys(const records::Instance& record);

template <class Record>
struct StoredRecord {
  std::uint64_t number = 0;  // in its key and its id
  Record record;
  Revision revision = kAbsent;
};

struct StoredContent {
  std::string bytes;
  Revision revision = kAbsent;
  std::optional<ScenePieces> pieces{};  // a scene that lies in such has them
};

struct StoredPlayers {
  Players players;
  std::array<Revision, Players::kBuckets> revisions{};  // one for each bucket; kAbsent where it is empty
};

struct StoredRecords {
  StoredRecord<records::Counters> counters;  // revision kAbsent before the first start
  std::vector<StoredRecord<records::Host>> hosts;
  std::vector<StoredRecord<records::Instance>> instances;  // each with a map that can be read
  std::map<std::string, StoredContent> contents;           // by key
  std::vector<std::string> stray_pieces;                   // keys of pieces that no scene's record names
  std::map<std::uint64_t, StoredPlayers> players;          // by the instance's number; none where it has none
  // Records of hosts, instances, players, scenes and games; none of the above has them. A scene that lies in pieces is
  // one if one of them lacks or is damaged.
  std::vector<StoreEntry> unreadable;
};

absl::StatusOr<StoredRecords> ReadRecords(const Store& store);

// The record that an entry of a list holds. False: it cannot be read, or is not whole in the store.
template <class Record>
bool ReadRecord(const StoreEntry& entry, Record& record) {
  return !entry.damaged && record.ParseFromString(entry.value);
}

}  // namespace tessera::control
