// Entries of a recording to bytes and back.
#include "absl/strings/str_cat.h"
#include "client_sdk/recording.h"
#include "client_sdk/recording_format.h"
#include "core/replication/codec/dense_codec.h"
#include "core/world/byte_view.h"
#include "core/world/bytes.h"
#include "core/world/limits.h"
#include "core/world/map_bytes.h"
#include "core/world/properties.h"

namespace tessera::client {
namespace {

using replication::Bytes;
using replication::DepartureRecord;
using Payload = decltype(RecordedEntry::what);

constexpr std::size_t kMaxText = 1024;          // the longest line of an event, or name
constexpr std::size_t kMaxMapBytes = 64 << 20;  // far more than kMaxCells cells take
constexpr std::size_t kMaxRecordedPropertyBytes = 1 << 16;

absl::Status Bad(absl::string_view what) { return absl::DataLossError(what); }

absl::Status Finished(const ByteReader& in) {
  if (!in.ok()) return Bad(in.error());
  return in.remaining() == 0 ? absl::OkStatus() : Bad("trailing bytes");
}

std::string TakeText(ByteReader& in, std::size_t most) {
  const std::span<const std::uint8_t> bytes = in.Block(most);
  return {bytes.begin(), bytes.end()};
}

void Put(ByteWriter& out, const FrameEntry& entry) {
  out.Varint(entry.region.value());
  out.Varint(entry.last_input);
  out.Varint(entry.departures.size());
  for (const DepartureRecord& departure : entry.departures) {
    out.Varint(departure.id.value());
    out.Varint(departure.epoch.value());
    out.U8(static_cast<std::uint8_t>(departure.why));
    out.Varint(departure.to.value());
  }
  out.Varint(entry.properties.size());
  for (const auto& [id, bytes] : entry.properties) {
    out.Varint(id.value());
    out.Block(*bytes);
  }
  out.Block(entry.frame);
  if (entry.jumps.empty()) return;  // as in all files before there were any
  out.Varint(entry.jumps.size());
  for (const auto& [id, jumps] : entry.jumps) {
    out.Varint(id.value());
    out.U8(jumps);
  }
}

absl::StatusOr<FrameEntry> TakeFrame(ByteReader& in) {
  in.Field("frame");
  FrameEntry entry;
  entry.region = RegionId(in.Varint32());
  entry.last_input = in.Varint32();
  in.Field("departures");
  for (std::size_t n = in.Count(4); n > 0 && in.ok(); --n) {
    DepartureRecord departure;
    departure.id = BodyId(in.Varint());
    departure.epoch = Epoch(in.Varint32());
    const std::uint8_t why = in.U8();
    departure.to = RegionId(in.Varint32());
    if (why > static_cast<std::uint8_t>(DepartureRecord::Why::kOutOfInterest)) return Bad("departure: unknown reason");
    departure.why = static_cast<DepartureRecord::Why>(why);
    if ((departure.why == DepartureRecord::Why::kHandedOver) != (departure.to != RegionId())) {
      return Bad("departure: new owner");
    }
    entry.departures.push_back(departure);
  }
  in.Field("properties");
  for (std::size_t n = in.Count(2); n > 0 && in.ok(); --n) {
    const BodyId id(in.Varint());
    const std::span<const std::uint8_t> bytes = in.Block(kMaxRecordedPropertyBytes);
    if (!entry.properties.empty() && entry.properties.back().first >= id) return Bad("properties: ids do not ascend");
    entry.properties.emplace_back(id, std::make_shared<const Bytes>(bytes.begin(), bytes.end()));
  }
  in.Field("frame");
  const std::span<const std::uint8_t> frame = in.Block(kMaxEntryBytes);
  entry.frame.assign(frame.begin(), frame.end());
  in.Field("jumps");
  for (std::size_t n = in.remaining() > 0 ? in.Count(2) : 0; n > 0 && in.ok(); --n) {
    const BodyId id(in.Varint());
    if (!entry.jumps.empty() && entry.jumps.back().first >= id) return Bad("jumps: ids do not ascend");
    entry.jumps.emplace_back(id, in.U8());
  }
  if (in.ok() && entry.region == RegionId()) return Bad("region: is 0");
  return entry;
}

void Put(ByteWriter& out, const RegionEntry& entry) {
  out.Varint(entry.region.value());
  out.U8(static_cast<std::uint8_t>(entry.change));
}

absl::StatusOr<Payload> TakeRegion(ByteReader& in) {
  in.Field("region");
  RegionEntry entry;
  entry.region = RegionId(in.Varint32());
  const std::uint8_t change = in.U8();
  if (change > static_cast<std::uint8_t>(RegionEntry::Change::kOutOfSight)) return Bad("region: unknown change");
  if (in.ok() && entry.region == RegionId()) return Bad("region: is 0");
  entry.change = static_cast<RegionEntry::Change>(change);
  return entry;
}

void Put(ByteWriter& out, const MapEntry& entry) { out.Block(entry.map); }
absl::StatusOr<Payload> TakeMap(ByteReader& in) {
  in.Field("map");
  return MapEntry{TakeText(in, kMaxMapBytes)};
}

void Put(ByteWriter& out, const ClientEvent& event) {
  out.U8(static_cast<std::uint8_t>(event.kind));
  out.Varint(event.body.value());
  out.Varint(event.other.value());
  out.Varint(event.region.value());
  out.Varint(event.input_number);
  out.Block(std::string_view(event.detail).substr(0, kMaxText));
}

absl::StatusOr<Payload> TakeEvent(ByteReader& in) {
  in.Field("event");
  ClientEvent event;
  const std::uint8_t kind = in.U8();
  if (kind > static_cast<std::uint8_t>(ClientEvent::kLastKind)) return Bad("event: unknown kind");
  event.kind = static_cast<ClientEvent::Kind>(kind);
  event.body = BodyId(in.Varint());
  event.other = BodyId(in.Varint());
  event.region = RegionId(in.Varint32());
  event.input_number = in.Varint32();
  event.detail = TakeText(in, kMaxText);
  return event;
}

Bytes TakeWorldProperties(ByteReader& in) {
  const std::span<const std::uint8_t> bytes = in.Block(kMaxPropertyBytes);
  return {bytes.begin(), bytes.end()};
}

// The count of frames comes first, for whoever looks for keys alone.
void Put(ByteWriter& out, const KeyEntry& entry) {
  out.Varint(entry.frames);
  out.U8(entry.started ? 1 : 0);
  out.Block(entry.map);
  out.Varint(entry.regions.size());
  for (const auto& [region, connected] : entry.regions) {
    out.Varint(region.value());
    out.U8(connected ? 1 : 0);
  }
  if (!entry.world.empty()) out.Block(entry.world);  // else as in all files before there were any
}

absl::StatusOr<Payload> TakeKey(ByteReader& in) {
  in.Field("key");
  KeyEntry entry;
  entry.frames = in.Varint32();
  const std::uint8_t started = in.U8();
  entry.started = started != 0;
  entry.map = TakeText(in, kMaxMapBytes);
  for (std::size_t n = in.Count(2); n > 0 && in.ok(); --n) {
    const RegionId region(in.Varint32());
    const std::uint8_t connected = in.U8();
    if (region == RegionId() || (!entry.regions.empty() && entry.regions.back().first >= region)) {
      return Bad("key: regions do not ascend");
    }
    if (connected > 1) return Bad("key: connected");
    entry.regions.emplace_back(region, connected != 0);
  }
  if (started > 1) return Bad("key: started");
  if (in.remaining() > 0) entry.world = TakeWorldProperties(in);
  return entry;
}

void Put(ByteWriter& out, const KeyFrameEntry& entry) { Put(out, entry.frame); }
absl::StatusOr<Payload> TakeKeyFrame(ByteReader& in) {
  absl::StatusOr<FrameEntry> frame = TakeFrame(in);
  if (!frame.ok()) return frame.status();
  return KeyFrameEntry{*std::move(frame)};
}

void Put(ByteWriter& out, const NoteEntry& entry) { out.Block(entry.text); }
absl::StatusOr<Payload> TakeNote(ByteReader& in) {
  in.Field("note");
  return NoteEntry{TakeText(in, kMaxNoteBytes)};
}

void Put(ByteWriter& out, const WorldEntry& entry) { out.Block(entry.properties); }
absl::StatusOr<Payload> TakeWorld(ByteReader& in) {
  in.Field("world");
  return WorldEntry{TakeWorldProperties(in)};
}

// In the order of the variant, from EntryKind::kFrame on.
absl::StatusOr<Payload> TakePayload(ByteReader& in, std::uint8_t kind) {
  switch (static_cast<EntryKind>(kind)) {
    case EntryKind::kFrame:
      return TakeFrame(in);
    case EntryKind::kRegion:
      return TakeRegion(in);
    case EntryKind::kMap:
      return TakeMap(in);
    case EntryKind::kEvent:
      return TakeEvent(in);
    case EntryKind::kKey:
      return TakeKey(in);
    case EntryKind::kKeyFrame:
      return TakeKeyFrame(in);
    case EntryKind::kNote:
      return TakeNote(in);
    case EntryKind::kWorld:
      return TakeWorld(in);
    default:
      return Bad(absl::StrCat("unknown kind ", kind));
  }
}

}  // namespace

std::string WrittenMap(const PartitionMap& map) {
  ByteWriter out;
  WriteMap(map, out);
  return std::string(AsText(out.bytes()));
}

absl::StatusOr<PartitionMap> MapFromWritten(const std::string& written) {
  ByteReader in(AsBytes(written));
  absl::StatusOr<PartitionMap> map = ReadMap(in);
  if (map.ok() && in.remaining() > 0) return absl::InvalidArgumentError("more bytes follow");
  return map;
}

Bytes EncodeHeader(const RecordingHeader& header) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(EntryKind::kHeader));
  out.Block(header.instance_id);
  out.Varint(header.player.value());
  out.Varint(header.tick_rate_hz);
  out.Varint(header.snapshot_rate_hz);
  out.U8(header.started ? 1 : 0);
  out.Block(header.map);
  out.Block(header.scene);
  return out.Take();
}

absl::StatusOr<RecordingHeader> DecodeHeader(std::span<const std::uint8_t> payload) {
  ByteReader in(payload);
  if (in.U8() != static_cast<std::uint8_t>(EntryKind::kHeader)) return Bad("header: is not the first");
  in.Field("header");
  RecordingHeader header;
  header.instance_id = TakeText(in, kMaxText);
  header.player = PlayerNumber(in.Varint32());
  header.tick_rate_hz = in.Varint32();
  header.snapshot_rate_hz = in.Varint32();
  const std::uint8_t started = in.U8();
  header.started = started != 0;
  header.map = TakeText(in, kMaxMapBytes);
  header.scene = TakeText(in, kMaxHeaderBytes);
  if (absl::Status status = Finished(in); !status.ok()) return status;
  if (started > 1) return Bad("header: started");
  if (header.player == PlayerNumber()) return Bad("header: player 0");
  if (header.tick_rate_hz < kMinTickRateHz || header.tick_rate_hz > kMaxTickRateHz) return Bad("header: tick rate");
  if (header.snapshot_rate_hz < 1 || header.snapshot_rate_hz > header.tick_rate_hz) return Bad("header: snapshot rate");
  return header;
}

Bytes EncodeEntry(const RecordedEntry& entry) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(static_cast<std::size_t>(EntryKind::kFrame) + entry.what.index()));
  out.Varint(static_cast<std::uint64_t>(entry.at.count()));
  std::visit([&](const auto& what) { Put(out, what); }, entry.what);
  return out.Take();
}

absl::StatusOr<RecordedEntry> DecodeEntry(std::span<const std::uint8_t> payload) {
  ByteReader in(payload);
  const std::uint8_t kind = in.U8();
  const std::uint64_t at_us = in.Varint();
  if (at_us > kMaxTime_us) return Bad("time");
  absl::StatusOr<Payload> what = TakePayload(in, kind);
  if (!what.ok()) return what.status();
  if (absl::Status status = Finished(in); !status.ok()) return status;
  return RecordedEntry{std::chrono::microseconds(at_us), *std::move(what)};
}

}  // namespace tessera::client
