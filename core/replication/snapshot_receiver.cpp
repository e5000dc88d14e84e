#include <algorithm>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "core/replication/record_codec.h"
#include "core/world/limits.h"

namespace tessera::replication {
namespace {

constexpr std::uint32_t kAckMaskBits = 64;
// A sequence further ahead than a connection could have lost without ending is a lie, and would silence what follows.
constexpr std::uint32_t kMaxSequenceJump = 1 << 20;
constexpr std::size_t kMaxTracked = kMaxBodies + kMaxPlayers;

struct Sample {
  Tick tick;
  QuantizedState state;
};

struct TrackedBody {
  Epoch epoch;  // of the ownership; when `gone`, of the one that ended
  bool gone = false;
  std::vector<Sample> samples;  // ascending by tick: what may be a baseline
};

struct ParsedBody {
  BodyId id;
  Epoch epoch;
  std::optional<Tick> baseline;
  QuantizedState state;
};

struct Parsed {
  SnapshotHeader header;
  std::vector<DepartureRecord> departures;
  std::vector<ParsedBody> bodies;
};

absl::Status Malformed(const std::string& what) { return absl::InvalidArgumentError(absl::StrCat("snapshot: ", what)); }

}  // namespace

struct SnapshotReceiver::Impl {
  Impl(const Aabb& world_bounds, const Settings& settings_in)
      : settings(settings_in), quantizer(world_bounds, settings) {}

  // Reading changes nothing here.
  absl::Status CheckSequence(std::uint32_t sequence) const;
  absl::StatusOr<Parsed> Parse(std::span<const std::uint8_t> datagram) const;
  absl::Status ParseDepartures(BitReader& reader, Parsed& parsed) const;
  absl::Status ParseBodies(BitReader& reader, Parsed& parsed) const;
  absl::Status ParseDelta(BitReader& reader, Tick tick, std::uint64_t& previous_age, ParsedBody& body) const;

  void Remember(std::uint32_t sequence);
  bool Depart(const DepartureRecord& departure);  // false: old news
  bool Store(Tick tick, const ParsedBody& body);  // false: of an ownership that has ended

  Settings settings;
  Quantizer quantizer;
  std::unordered_map<BodyId, TrackedBody> bodies;
  std::uint32_t newest = 0;  // 0: nothing has come
  std::uint64_t mask = 0;    // bit i: newest - 1 - i has come
};

absl::Status SnapshotReceiver::Impl::CheckSequence(std::uint32_t sequence) const {
  if (sequence > newest) {
    if (newest != 0 && sequence - newest > kMaxSequenceJump) return Malformed("sequence");
    return absl::OkStatus();
  }
  const std::uint32_t age = newest - sequence;
  if (age > kAckMaskBits) return absl::FailedPreconditionError("snapshot: too old to be acknowledged");
  if (age == 0 || (mask >> (age - 1) & 1) != 0) return absl::AlreadyExistsError("snapshot: duplicate");
  return absl::OkStatus();
}

absl::Status SnapshotReceiver::Impl::ParseDepartures(BitReader& reader, Parsed& parsed) const {
  BodyId previous;
  while (reader.ReadBit()) {
    const std::optional<BodyId> id = ReadIdGap(reader, previous);
    DepartureRecord departure{};
    if (!id.has_value()) return Malformed("departures: ids do not ascend");
    if (!ReadDeparture(reader, departure)) return Malformed(absl::StrCat("departures: body ", id->value()));
    departure.id = previous = *id;
    parsed.departures.push_back(departure);
  }
  return absl::OkStatus();
}

absl::Status SnapshotReceiver::Impl::ParseDelta(BitReader& reader, Tick tick, std::uint64_t& previous_age,
                                                ParsedBody& body) const {
  const std::uint64_t age = ReadBaselineAge(reader, previous_age);
  if (age == 0 || age > tick.value()) return Malformed(absl::StrCat("body ", body.id.value(), ": baseline age"));
  previous_age = age;
  body.baseline = Tick(tick.value() - age);
  const auto missing = [&] {
    return absl::FailedPreconditionError(
        absl::StrCat("snapshot: body ", body.id.value(), ": no baseline of tick ", body.baseline->value()));
  };
  const auto tracked = bodies.find(body.id);
  if (tracked == bodies.end() || tracked->second.gone) return missing();
  const std::vector<Sample>& samples = tracked->second.samples;
  const auto base =
      std::find_if(samples.begin(), samples.end(), [&](const Sample& s) { return s.tick == body.baseline; });
  if (base == samples.end()) return missing();
  body.epoch = tracked->second.epoch;
  if (!ReadDelta(reader, quantizer, base->state, age, body.state)) {
    return Malformed(absl::StrCat("body ", body.id.value(), ": out of range"));
  }
  return absl::OkStatus();
}

absl::Status SnapshotReceiver::Impl::ParseBodies(BitReader& reader, Parsed& parsed) const {
  BodyId previous;
  std::uint64_t previous_age = 0;
  while (reader.ReadBit()) {
    ParsedBody body{};
    const std::optional<BodyId> id = ReadIdGap(reader, previous);
    if (!id.has_value()) return Malformed("bodies: ids do not ascend");
    body.id = previous = *id;
    if (reader.ReadBit()) {
      if (absl::Status status = ParseDelta(reader, parsed.header.tick, previous_age, body); !status.ok()) return status;
    } else {
      const std::optional<Epoch> epoch = ReadEpoch(reader);
      if (!epoch.has_value() || !ReadFull(reader, quantizer, body.state)) {
        return Malformed(absl::StrCat("body ", body.id.value(), ": out of range"));
      }
      body.epoch = *epoch;
    }
    parsed.bodies.push_back(body);
  }
  return absl::OkStatus();
}

absl::StatusOr<Parsed> SnapshotReceiver::Impl::Parse(std::span<const std::uint8_t> datagram) const {
  if (datagram.size() > settings.max_datagram_bytes) return Malformed("too long");
  Parsed parsed;
  BitReader reader(datagram);
  if (absl::Status status = ReadHeader(reader, parsed.header); !status.ok()) return status;
  if (parsed.header.fingerprint != quantizer.fingerprint()) return Malformed("of other settings or world bounds");
  if (absl::Status status = CheckSequence(parsed.header.sequence); !status.ok()) return status;
  // A reader that has run out gives zeros, so both loops end; what they made of zeros is refused here.
  absl::Status status = ParseDepartures(reader, parsed);
  if (status.ok()) status = ParseBodies(reader, parsed);
  if (!reader.ok()) return Malformed("truncated");
  if (!status.ok()) return status;
  if (!reader.AtEnd()) return Malformed("trailing bytes");
  if (bodies.size() + parsed.bodies.size() + parsed.departures.size() > 2 * kMaxTracked)
    return Malformed("too many bodies");
  return parsed;
}

void SnapshotReceiver::Impl::Remember(std::uint32_t sequence) {
  if (sequence < newest) {
    mask |= std::uint64_t{1} << (newest - sequence - 1);
    return;
  }
  const std::uint32_t shift = sequence - newest;
  mask = shift > kAckMaskBits ? 0 : (shift == kAckMaskBits ? 0 : mask << shift);
  if (newest != 0 && shift <= kAckMaskBits) mask |= std::uint64_t{1} << (shift - 1);
  newest = sequence;
}

bool SnapshotReceiver::Impl::Depart(const DepartureRecord& departure) {
  TrackedBody& body = bodies[departure.id];
  const bool repeated = body.gone && departure.epoch <= body.epoch;
  if (repeated || departure.epoch < body.epoch) return false;
  body = {.epoch = departure.epoch, .gone = true, .samples = {}};
  return true;
}

bool SnapshotReceiver::Impl::Store(Tick tick, const ParsedBody& parsed) {
  TrackedBody& body = bodies[parsed.id];
  if (body.gone ? parsed.epoch <= body.epoch : parsed.epoch < body.epoch) return false;
  if (parsed.epoch > body.epoch) body = {.epoch = parsed.epoch, .gone = false, .samples = {}};
  std::vector<Sample>& samples = body.samples;
  // The sender goes on from what was acknowledged last: it never looks back behind a baseline that it has used.
  if (parsed.baseline.has_value()) {
    const auto keep =
        std::find_if(samples.begin(), samples.end(), [&](const Sample& s) { return s.tick >= *parsed.baseline; });
    samples.erase(samples.begin(), keep);
  }
  const auto at =
      std::lower_bound(samples.begin(), samples.end(), tick, [](const Sample& s, Tick t) { return s.tick < t; });
  if (at != samples.end() && at->tick == tick) return true;  // the same tick written twice
  samples.insert(at, {tick, parsed.state});
  if (samples.size() > settings.history_ticks) samples.erase(samples.begin());
  return true;
}

SnapshotReceiver::SnapshotReceiver(const Aabb& world_bounds, const Settings& settings)
    : impl_(std::make_unique<Impl>(world_bounds, settings)) {}
SnapshotReceiver::~SnapshotReceiver() = default;
SnapshotReceiver::SnapshotReceiver(SnapshotReceiver&&) noexcept = default;
SnapshotReceiver& SnapshotReceiver::operator=(SnapshotReceiver&&) noexcept = default;

absl::StatusOr<ReceivedSnapshot> SnapshotReceiver::Read(std::span<const std::uint8_t> datagram) {
  const absl::StatusOr<Parsed> parsed = impl_->Parse(datagram);
  if (!parsed.ok()) return parsed.status();
  impl_->Remember(parsed->header.sequence);
  ReceivedSnapshot result{.tick = parsed->header.tick,
                          .last_input = parsed->header.last_input,
                          .input_margin_ticks = parsed->header.input_margin_ticks,
                          .bodies = {},
                          .departures = {}};
  for (const DepartureRecord& departure : parsed->departures) {
    if (impl_->Depart(departure)) result.departures.push_back(departure);
  }
  result.bodies.reserve(parsed->bodies.size());
  for (const ParsedBody& body : parsed->bodies) {
    if (!impl_->Store(parsed->header.tick, body)) continue;
    if (!body.baseline.has_value()) ++result.full_records;
    result.bodies.push_back({body.id, body.epoch, impl_->quantizer.Dequantize(body.state)});
  }
  return result;
}

std::uint32_t SnapshotReceiver::newest_sequence() const { return impl_->newest; }

Bytes SnapshotReceiver::WriteAck() const {
  if (impl_->newest == 0) return {};
  BitWriter writer;
  writer.Write(impl_->newest, 32);
  writer.Write(impl_->mask, 64);
  return writer.Finish();
}

}  // namespace tessera::replication
