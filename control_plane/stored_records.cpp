#include "control_plane/stored_records.h"

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/world/partition_io.h"

namespace tessera::control {
namespace {

constexpr char kHostPrefix[] = "host/";
constexpr char kInstancePrefix[] = "instance/";
constexpr char kPlayersPrefix[] = "players/";
constexpr char kScenePrefix[] = "scene/", kGamePrefix[] = "game/", kScenePiecePrefix[] = "scene_piece/";
// No message begins with a zero, so no scene does.
constexpr std::string_view kPiecesMark{"\0pieces 1 ", 10};

absl::Status Damaged(const std::string& key) {
  return absl::DataLossError(absl::StrCat("store: ", key, ": cannot be read"));
}

bool IsSound(const records::Host&) { return true; }
bool IsSound(const records::Instance& instance) { return FromProto(instance.map()).ok(); }

template <class Record>
absl::Status ReadAll(const Store& store, const char* prefix, std::vector<StoredRecord<Record>>& all,
                     std::vector<StoreEntry>& unreadable) {
  auto entries = store.List(prefix);
  if (!entries.ok()) return entries.status();
  all.reserve(entries->size());
  for (StoreEntry& entry : *entries) {
    StoredRecord<Record> stored;
    stored.number = NumberOf(entry.key, prefix);
    stored.revision = entry.revision;
    if (stored.number != 0 && ReadRecord(entry, stored.record) && IsSound(stored.record)) {
      all.push_back(std::move(stored));
    } else {
      unreadable.push_back(std::move(entry));
    }
  }
  return absl::OkStatus();
}

absl::Status ReadCounters(const Store& store, StoredRecord<records::Counters>& counters) {
  const absl::StatusOr<StoreEntry> entry = store.Get(kCountersKey);
  if (absl::IsNotFound(entry.status())) return absl::OkStatus();
  if (!entry.ok()) return entry.status();
  if (!counters.record.ParseFromString(entry->value)) return Damaged(kCountersKey);
  counters.revision = entry->revision;
  return absl::OkStatus();
}

// "players/<instance>/<bucket>"
absl::Status ReadPlayers(const Store& store, std::map<std::uint64_t, StoredPlayers>& players,
                         std::vector<StoreEntry>& unreadable) {
  auto entries = store.List(kPlayersPrefix);
  if (!entries.ok()) return entries.status();
  for (StoreEntry& entry : *entries) {
    const std::string_view key = entry.key;
    const std::size_t slash = key.rfind('/');
    const std::uint64_t instance = InstanceOfPlayersKey(key);
    std::uint32_t bucket = 0;
    records::PlayerBucket read;
    if (instance == 0 || !absl::SimpleAtoi(std::string(key.substr(slash + 1)), &bucket) ||
        PlayersKey(instance, bucket) != key || !ReadRecord(entry, read) ||
        !players[instance].players.SetBucket(bucket, std::move(read)).ok()) {
      unreadable.push_back(std::move(entry));
    } else {
      players[instance].revisions[bucket] = entry.revision;
    }
  }
  return absl::OkStatus();
}

}  // namespace

std::uint64_t NumberOf(std::string_view id, std::string_view prefix) {
  std::uint64_t number = 0;
  if (!id.starts_with(prefix)) return 0;
  const std::string digits(id.substr(prefix.size()));
  // The same id in one spelling only: "host-07" and "host-+7" are not host-7.
  return absl::SimpleAtoi(digits, &number) && absl::StrCat(number) == digits ? number : 0;
}

std::string HostKey(std::uint64_t number) { return absl::StrCat(kHostPrefix, number); }
std::string InstanceKey(std::uint64_t number) { return absl::StrCat(kInstancePrefix, number); }
std::string PlayersKey(std::uint64_t instance, std::uint32_t bucket) {
  return absl::StrCat(kPlayersPrefix, instance, "/", bucket);
}
std::string SceneKey(std::string_view hash) { return kScenePrefix + std::string(hash); }
std::string GameKey(std::string_view hash) { return kGamePrefix + std::string(hash); }

std::vector<std::string> ScenePieceKeys(std::string_view hash, const ScenePieces& pieces) {
  std::vector<std::string> keys;
  for (std::uint64_t at = 0; at < pieces.bytes; at += kScenePieceBytes) {
    keys.push_back(absl::StrCat(kScenePiecePrefix, std::string(hash), "/", pieces.version, "/", keys.size()));
  }
  return keys;
}

std::string SceneRecord(const ScenePieces& pieces) {
  return absl::StrCat(std::string(kPiecesMark), pieces.version, " ", pieces.bytes);
}

std::optional<ScenePieces> ReadSceneRecord(std::string_view value) {
  if (!value.starts_with(kPiecesMark)) return std::nullopt;
  value.remove_prefix(kPiecesMark.size());
  ScenePieces pieces{.version = std::string(value.substr(0, value.find(' ')))};
  const std::string bytes(value.substr(std::min(value.size(), pieces.version.size() + 1)));
  if (!absl::SimpleAtoi(bytes, &pieces.bytes)) pieces.bytes = 0;  // it has none then, and is not whole
  return pieces;
}

absl::StatusOr<std::string> ReadContent(const Store& store, const std::string& key) {
  auto entry = store.Get(key);
  if (!entry.ok()) return entry.status();
  const auto pieces = IsSceneKey(key) ? ReadSceneRecord(entry->value) : std::nullopt;
  if (!pieces) return std::move(entry->value);
  std::string bytes;
  for (const std::string& piece : ScenePieceKeys(key.substr(sizeof kScenePrefix - 1), *pieces)) {
    const auto read = store.Get(piece);
    if (!read.ok()) return read.status();
    bytes += read->value;
  }
  if (bytes.empty() || bytes.size() != pieces->bytes) return Damaged(key);
  return bytes;
}

std::string VisualKey(std::string_view sha256) { return kVisualPrefix + std::string(sha256); }
std::string VisualPieceKey(std::string_view sha256, std::uint64_t number) {
  return absl::StrCat(kVisualKeys, "_piece/", std::string(sha256), "/", number);
}
bool IsSceneKey(std::string_view key) { return key.starts_with(kScenePrefix); }
std::uint64_t InstanceOfKey(std::string_view key) { return NumberOf(key, kInstancePrefix); }
std::uint64_t InstanceOfPlayersKey(std::string_view key) {
  return NumberOf(key.substr(0, key.rfind('/')), kPlayersPrefix);
}

std::vector<std::string> ContentKeys(const records::Instance& record) {
  std::vector<std::string> keys{SceneKey(record.scene_hash())};
  if (record.game_native()) return keys;  // its file is with the hosts
  const records::Games& games = record.games();
  for (const std::string& hash : {record.game_hash(), games.next().hash(), games.previous().hash()}) {
    if (!hash.empty()) keys.push_back(GameKey(hash));
  }
  std::sort(keys.begin() + 1, keys.end());
  keys.erase(std::unique(keys.begin() + 1, keys.end()), keys.end());
  return keys;
}

namespace {

absl::Status ReadContents(const Store& store, StoredRecords& stored) {
  for (const char* prefix : {kScenePrefix, kGamePrefix}) {
    auto contents = store.List(prefix);
    if (!contents.ok()) return contents.status();
    for (StoreEntry& entry : *contents) {
      if (entry.damaged) {
        stored.unreadable.push_back(std::move(entry));
      } else {
        stored.contents[entry.key] = {std::move(entry.value), entry.revision};
      }
    }
  }
  return absl::OkStatus();
}

// Scenes that lie in pieces, whole, and the pieces of none. A damaged piece is as good as none.
absl::Status ReadScenePieces(const Store& store, StoredRecords& stored) {
  auto all = store.List(kScenePiecePrefix);
  if (!all.ok()) return all.status();
  std::map<std::string, StoreEntry> pieces;  // by key
  for (StoreEntry& entry : *all) pieces[entry.key] = std::move(entry);
  std::vector<std::string> not_whole;
  for (auto& [key, content] : stored.contents) {
    content.pieces = IsSceneKey(key) ? ReadSceneRecord(content.bytes) : std::nullopt;
    if (!content.pieces) continue;
    std::string record = std::exchange(content.bytes, "");
    for (const std::string& piece : ScenePieceKeys(key.substr(sizeof kScenePrefix - 1), *content.pieces)) {
      const auto found = pieces.find(piece);
      if (found == pieces.end()) continue;
      if (!found->second.damaged) content.bytes += found->second.value;
      pieces.erase(found);
    }
    if (!content.bytes.empty() && content.bytes.size() == content.pieces->bytes) continue;
    stored.unreadable.push_back({key, std::move(record), content.revision});
    not_whole.push_back(key);
  }
  for (const std::string& key : not_whole) stored.contents.erase(key);
  for (const auto& [key, piece] : pieces) stored.stray_pieces.push_back(key);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<StoredRecords> ReadRecords(const Store& store) {
  StoredRecords stored;
  if (absl::Status status = ReadCounters(store, stored.counters); !status.ok()) return status;
  if (absl::Status status = ReadAll(store, kHostPrefix, stored.hosts, stored.unreadable); !status.ok()) return status;
  if (absl::Status status = ReadAll(store, kInstancePrefix, stored.instances, stored.unreadable); !status.ok()) {
    return status;
  }
  if (absl::Status status = ReadPlayers(store, stored.players, stored.unreadable); !status.ok()) return status;
  if (absl::Status status = ReadContents(store, stored); !status.ok()) return status;
  if (absl::Status status = ReadScenePieces(store, stored); !status.ok()) return status;
  return stored;
}

}  // namespace tessera::control
