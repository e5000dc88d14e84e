// Recording: everything that the regions sent to a client, as a file that can be played back.
//
//   auto writer = RecordingWriter::Create("match.tsr", header, kDefaultMaxBytes);
//   writer->Write({.at = 33ms, .what = FrameEntry{...}});
//   writer->Close();
//   ...
//   auto reader = RecordingReader::Open("match.tsr");    // all of it is checked here
//   while (auto entry = *reader->Next()) ...
//
// A file is a magic number, a format, and entries, each sealed with a checksum that counts its place: an entry that is
// changed, missing, doubled or moved is found, and so is a file that is cut short, since the last entry says so. A
// malformed entry under a right checksum is an error too; nothing in a file is trusted (docs/protocol.md has the
// layout). Every few seconds a key says all that is known then, so that playing can begin there. Thread rule: one
// thread at a time for each object.
#pragma once

#include <chrono>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client_sdk/client.h"
#include "core/replication/snapshot.h"
#include "core/world/partition_map.h"

namespace tessera::client {

// The header of a file: everything that does not change while a client plays. No secrets.
struct RecordingHeader {
  std::string instance_id{};
  PlayerNumber player{};
  std::uint32_t tick_rate_hz = 0, snapshot_rate_hz = 0;
  bool started = false;  // the world moved when the recording began
  std::string map{};     // WrittenMap
  std::string scene{};   // PackScene
  friend bool operator==(const RecordingHeader&, const RecordingHeader&) = default;
};

// A tick of a region: all of it that the client knew then.
struct FrameEntry {
  RegionId region;
  std::uint32_t last_input = 0;
  std::vector<replication::DepartureRecord> departures{};
  // By body: properties that were sent in this tick.
  std::vector<std::pair<BodyId, std::shared_ptr<const replication::Bytes>>> properties{};
  replication::Bytes frame{};  // DenseCodec's, against the region's frames before it
  // Bodies of the frame that a game put elsewhere, ascending, and how often: SeenBody::jumps.
  std::vector<std::pair<BodyId, std::uint8_t>> jumps{};
};

struct RegionEntry {
  enum class Change : std::uint8_t { kBegins, kLost, kGone, kOutOfSight };  // as in WorldView
  RegionId region;
  Change change = Change::kBegins;
  friend bool operator==(const RegionEntry&, const RegionEntry&) = default;
};

// The next frame of the region refers to none before it.
constexpr bool BeginsAnew(RegionEntry::Change change) { return change != RegionEntry::Change::kLost; }

struct MapEntry {
  std::string map;  // WrittenMap
};

// All that stands at a moment, with the key frames that follow directly: who plays on from the beginning needs none of
// it, but that the next frame of a region refers to its key frame.
struct KeyEntry {
  bool started = false;
  std::string map{};                                 // WrittenMap
  std::vector<std::pair<RegionId, bool>> regions{};  // ascending; whether it is connected
  std::uint32_t frames = 0;
  replication::Bytes world{};  // as in WorldEntry
};

// All bodies of a region, and all their properties; refers to no other frame.
struct KeyFrameEntry {
  FrameEntry frame;
};

// A text that a program wrote beside the world: Client::Note.
struct NoteEntry {
  std::string text;
};

// Properties of the world that differ from the scene's and that every client may see: PropertySet::Encode.
struct WorldEntry {
  replication::Bytes properties;
};

// A step of the recording. Events that follow from frames are not written.
struct RecordedEntry {
  std::chrono::microseconds at{};  // since the beginning; never goes back
  std::variant<FrameEntry, RegionEntry, MapEntry, ClientEvent, KeyEntry, KeyFrameEntry, NoteEntry, WorldEntry> what;
};

// A map as recordings have it (core/world/map_bytes.h). The reader gives INVALID_ARGUMENT naming the field.
std::string WrittenMap(const PartitionMap& map);
absl::StatusOr<PartitionMap> MapFromWritten(const std::string& written);

// Errors of decoding: DATA_LOSS that names the fault.
replication::Bytes EncodeHeader(const RecordingHeader& header);
absl::StatusOr<RecordingHeader> DecodeHeader(std::span<const std::uint8_t> payload);
replication::Bytes EncodeEntry(const RecordedEntry& entry);
absl::StatusOr<RecordedEntry> DecodeEntry(std::span<const std::uint8_t> payload);

class RecordingWriter {
 public:
  // Replaces a file of that name. Errors: UNAVAILABLE (cannot be written), RESOURCE_EXHAUSTED.
  static absl::StatusOr<RecordingWriter> Create(const std::string& file, const RecordingHeader& header,
                                                std::uint64_t max_bytes);
  // Onto any stream; `name` is what errors begin with.
  RecordingWriter(std::unique_ptr<std::ostream> out, std::string name, std::uint64_t max_bytes);
  absl::Status Begin(const RecordingHeader& header);
  // RESOURCE_EXHAUSTED where the file would grow beyond its limit: the entry is not written then, and Close still makes
  // a complete file.
  absl::Status Write(const RecordedEntry& entry);
  absl::Status Close(std::chrono::microseconds at);  // when it was over
  std::uint64_t bytes() const { return bytes_; }

 private:
  absl::Status Put(std::span<const std::uint8_t> payload, std::uint64_t spare);

  std::unique_ptr<std::ostream> out_;
  std::string name_;
  std::uint64_t max_bytes_;
  std::uint64_t bytes_ = 0;
  std::uint32_t entries_ = 0;
};

// The entry of a recording in a list.
struct RecordingSummary {
  std::string instance_id;
  std::optional<std::chrono::microseconds> length{};  // nothing: it is not ended, or its end is damaged
};
// Reads a file's first and last entry alone, so that the rest may be as large and as damaged as it likes. Errors: as of
// RecordingReader::Open.
absl::StatusOr<RecordingSummary> SummaryOf(const std::string& file);

class RecordingReader {
 public:
  // Errors: NOT_FOUND (no such file), INVALID_ARGUMENT (not a recording, or its format is unknown to
  // this library), DATA_LOSS (damaged or cut short). Each begins with the file's name.
  static absl::StatusOr<RecordingReader> Open(const std::string& file);
  static absl::StatusOr<RecordingReader> Open(std::unique_ptr<std::istream> in, std::string name);

  const RecordingHeader& header() const { return header_; }
  std::chrono::microseconds length() const { return length_; }
  // Goes to the last key that is not after `at`; to the beginning where there is none. The next entry is that key.
  void Seek(std::chrono::microseconds at);
  // Nothing at the end.
  absl::StatusOr<std::optional<RecordedEntry>> Next();

 private:
  // Where an entry begins.
  struct Place {
    std::chrono::microseconds time{};
    std::uint64_t byte = 0;
    std::uint32_t entry = 0;
  };

  RecordingReader(std::unique_ptr<std::istream> in, std::string name);
  absl::StatusOr<std::vector<std::uint8_t>> Take(std::uint64_t max_bytes);
  absl::Status Check();
  void GoTo(const Place& place);
  absl::Status Damaged(absl::string_view what) const;

  std::unique_ptr<std::istream> in_;
  std::string name_;
  std::uint64_t size_ = 0, at_ = 0;
  std::uint32_t entries_ = 0;
  RecordingHeader header_;
  std::chrono::microseconds length_{};
  std::vector<Place> starts_;  // the first entry, and keys with all of their frames; ascending
};

}  // namespace tessera::client
