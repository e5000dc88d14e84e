#include "core/replication/snapshot_receiver.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/replication/codec/fast_list.h"
#include "core/replication/codec/velocity.h"
#include "core/replication/datagram.h"
#include "core/replication/record_codec.h"
#include "core/world/bytes.h"
#include "core/world/limits.h"
#include "core/world/prefetch.h"

namespace tessera::replication {
namespace {

// A sequence further ahead than a connection could have lost without ending is a lie, and would silence what follows.
constexpr std::uint32_t kMaxSequenceJump = 1 << 20;
// A datagram may come so much later than one that overtook it and still be understood: half a second at 60 Hz.
constexpr std::uint64_t kOvertaking_ticks = 30;
// States of a body that are kept, in lengths of the sender's history: one length, and room for those that come before
// old ones are dropped.
constexpr std::size_t kHistoriesKept = 3;
constexpr std::size_t kMaxTracked = kMaxBodies + kMaxPlayers;
// A change is mostly predicted from samples among the newest of its body.
constexpr std::size_t kSamplesAhead = 4;

struct Sample {
  Tick tick;
  QuantizedState state;
  std::uint8_t jumps = 0;
};

struct TrackedBody;
using TrackedEntry = std::pair<const BodyId, TrackedBody>;  // an entry of a hash table stays where it is

struct TrackedBody {
  Epoch epoch;  // the ownership's; when `gone`, that of the one that ended or is out of interest
  bool gone = false;
  Tick newest;                    // newest tick of a record or departure
  Tick properties{};              // newest tick of a record with properties
  std::vector<Sample> samples{};  // ascending by tick
  Tick tuned{};                   // newest tick of a full record, and the tuning that it had
  BodyTuning tuning{};
  // Datagrams of tick `from` and later use no sample older than `needed`. 0: no sample is to be dropped.
  Tick from{}, needed{};
  TrackedEntry* follower = nullptr;  // whichever came after it in a datagram last
};

struct ParsedBody {
  BodyId id;
  Epoch epoch;
  bool full = false;
  bool has_velocities = false;
  std::uint8_t jumps = 0;  // a change has those of the sample that it was predicted from
  // A change's body stays where it is, and so does its tuning as long as that ownership lasts. Null: a full record,
  // which has its own tuning.
  TrackedBody* tracked = nullptr;
  Tick oldest;  // sample used
  QuantizedState state;
  BodyTuning tuning;
  std::shared_ptr<const Bytes> properties;
};

struct Parsed {
  void Clear() {
    departures.clear();
    bodies.clear();
  }

  SnapshotHeader header;
  std::vector<DepartureRecord> departures;
  std::vector<ParsedBody> bodies;
};

// The end of the samples up to `tick`. Searches from the newest, where most searches end.
std::vector<Sample>::const_iterator After(const std::vector<Sample>& samples, Tick tick) {
  auto at = samples.end();
  while (at != samples.begin() && std::prev(at)->tick > tick) --at;
  return at;
}

absl::Status Malformed(const std::string& what) { return absl::InvalidArgumentError(absl::StrCat("snapshot: ", what)); }

}  // namespace

struct SnapshotReceiver::Impl {
  Impl(const Aabb& world_bounds, const SnapshotSettings& settings_in)
      : settings(settings_in),
        quantizer(world_bounds, settings),
        predictor(quantizer, settings, settings.gravity_m_s2),
        velocities(settings) {}

  // Parsing changes nothing but `parsed`, and who follows whom.
  absl::Status CheckSequence(std::uint32_t sequence) const;
  absl::Status Parse(std::span<const std::uint8_t> datagram);
  absl::Status ParseDepartures(BitReader& reader);
  absl::Status ParseChanges(BitReader& reader);
  absl::Status ParseChange(BitReader& reader, const SampleTicks& ticks, bool with_velocities, TrackedEntry* entry,
                           ParsedBody& body);
  TrackedEntry* FindAfter(TrackedEntry* before, BodyId id);
  absl::Status ParseFullRecords(BitReader& reader);
  absl::Status ParseProperties(BitReader& reader);
  static const Sample* Find(const TrackedBody& body, Tick tick);

  void Remember(std::uint32_t sequence);
  bool Depart(Tick tick, const DepartureRecord& departure);  // false: out of date
  TrackedBody* Store(Tick tick, const ParsedBody& body);     // null: that ownership has ended
  static void DropSamples(TrackedBody& body, Tick tick, Tick oldest_used);
  void Take(const ParsedBody& body, ReceivedSnapshot& result);
  void EstimateVelocities(Tick tick, std::uint8_t jumps, const TrackedBody& body, BodyState& state) const;

  SnapshotSettings settings;
  Quantizer quantizer;
  PosePredictor predictor;
  VelocityEstimator velocities;
  std::unordered_map<BodyId, TrackedBody> bodies;
  Parsed parsed;             // the datagram that is being read; it keeps its room for the next
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

absl::Status SnapshotReceiver::Impl::ParseDepartures(BitReader& reader) {
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

const Sample* SnapshotReceiver::Impl::Find(const TrackedBody& body, Tick tick) {
  const auto after = After(body.samples, tick);
  return after != body.samples.begin() && std::prev(after)->tick == tick ? &*std::prev(after) : nullptr;
}

// Null: there is none. Datagrams name bodies in much the same order each time, so the one that came after `before` last
// time is likely that, and what is to be read next is asked for ahead: it lies anywhere, and a frame is long enough for
// the caches to forget it.
TrackedEntry* SnapshotReceiver::Impl::FindAfter(TrackedEntry* before, BodyId id) {
  TrackedEntry* entry = before != nullptr ? before->second.follower : nullptr;
  if (entry == nullptr || entry->first != id) {
    const auto found = bodies.find(id);
    if (found == bodies.end()) return nullptr;
    entry = &*found;
    if (before != nullptr) before->second.follower = entry;
  }
  const TrackedEntry* next = entry->second.follower;
  if (next != nullptr) next = next->second.follower;
  if (next != nullptr) {
    const std::vector<Sample>& samples = next->second.samples;
    const std::size_t count = std::min(samples.size(), kSamplesAhead);
    Prefetch(samples.data() + (samples.size() - count), count * sizeof(Sample));
    Prefetch(next->second.follower, sizeof(TrackedEntry));
  }
  return entry;
}

absl::Status SnapshotReceiver::Impl::ParseChange(BitReader& reader, const SampleTicks& ticks, bool with_velocities,
                                                 TrackedEntry* entry, ParsedBody& body) {
  const std::uint64_t now = parsed.header.tick.value();
  if (ticks.ticks > now || ticks.gap > now - ticks.ticks || ticks.gap2 > now - ticks.ticks - ticks.gap) {
    return Malformed(absl::StrCat("body ", body.id.value(), ": samples from before the beginning"));
  }
  const std::uint64_t base_tick = now - ticks.ticks, older_tick = base_tick - ticks.gap;
  body.oldest = Tick(older_tick - ticks.gap2);
  const auto missing = [&](std::uint64_t of) {
    return absl::FailedPreconditionError(absl::StrCat("snapshot: body ", body.id.value(), ": no sample of tick ", of));
  };
  if (entry == nullptr || entry->second.gone) return missing(base_tick);
  TrackedBody& tracked = entry->second;
  const Sample* base = Find(tracked, Tick(base_tick));
  if (base == nullptr) return missing(base_tick);
  const Sample* older = ticks.gap != 0 ? Find(tracked, Tick(older_tick)) : nullptr;
  if (ticks.gap != 0 && older == nullptr) return missing(older_tick);
  const Sample* oldest = ticks.gap2 != 0 ? Find(tracked, body.oldest) : nullptr;
  if (ticks.gap2 != 0 && oldest == nullptr) return missing(body.oldest.value());
  const Samples samples{.base = &base->state,
                        .older = older != nullptr ? &older->state : nullptr,
                        .oldest = oldest != nullptr ? &oldest->state : nullptr,
                        .ticks = ticks.ticks,
                        .gap = ticks.gap,
                        .gap2 = ticks.gap2};
  Prediction prediction = predictor.PredictMove(samples);
  const std::int32_t limit = quantizer.orientation_limit();
  const auto out_of_range = [&] { return Malformed(absl::StrCat("body ", body.id.value(), ": out of range")); };
  bool turned = false;
  if (!ReadMove(reader, prediction, base->state, body.state, turned)) return out_of_range();
  const bool velocities_follow = with_velocities && !body.state.asleep;
  // Velocities are written by how far it was to turn, even if it did not.
  const bool turned_before = older != nullptr && !SameTurn(base->state, older->state);
  if (turned || (velocities_follow && turned_before)) predictor.PredictTurn(samples, prediction);
  if (turned && !ReadTurn(reader, prediction, limit, body.state)) return out_of_range();
  body.epoch = tracked.epoch;
  body.jumps = base->jumps;
  body.tracked = &tracked;
  body.has_velocities = with_velocities || body.state.asleep;
  if (!velocities_follow) return absl::OkStatus();
  const VelocityEstimate estimate = velocities.From(base->state, body.state, prediction, ticks.ticks, limit);
  return ReadVelocities(reader, estimate, body.state) ? absl::OkStatus() : out_of_range();
}

absl::Status SnapshotReceiver::Impl::ParseChanges(BitReader& reader) {
  FastListReader list(reader);
  BodyId id;
  SampleTicks ticks;
  TrackedEntry* entry = nullptr;
  while (list.Next(id, ticks)) {
    ParsedBody& body = parsed.bodies.emplace_back();
    body.id = id;
    entry = FindAfter(entry, id);
    absl::Status status = ParseChange(reader, ticks, list.has_velocities(), entry, body);
    if (!status.ok()) return status;
  }
  return list.ok() ? absl::OkStatus() : Malformed("changes: ids do not ascend, or samples of no tick");
}

absl::Status SnapshotReceiver::Impl::ParseFullRecords(BitReader& reader) {
  BodyId previous;
  while (reader.ReadBit()) {
    const std::optional<BodyId> id = ReadIdGap(reader, previous);
    if (!id.has_value()) return Malformed("full records: ids do not ascend");
    ParsedBody& body = parsed.bodies.emplace_back();
    body.id = previous = *id;
    body.full = body.has_velocities = true;
    BodyTraits traits;
    if (!ReadFull(reader, quantizer, body.epoch, body.state, traits)) {
      return Malformed(absl::StrCat("body ", body.id.value(), ": out of range"));
    }
    body.jumps = traits.jumps;
    body.tuning = traits.tuning;
  }
  return absl::OkStatus();
}

absl::Status SnapshotReceiver::Impl::ParseProperties(BitReader& reader) {
  BodyId previous;
  while (reader.ReadBit()) {
    const std::optional<BodyId> id = ReadIdGap(reader, previous);
    if (!id.has_value()) return Malformed("properties: ids do not ascend");
    const auto body = std::find_if(parsed.bodies.begin(), parsed.bodies.end(),
                                   [&](const ParsedBody& b) { return b.id == *id && b.properties == nullptr; });
    if (body == parsed.bodies.end()) return Malformed(absl::StrCat("properties: body ", id->value(), " has no record"));
    Bytes bytes;
    if (!ReadProperties(reader, bytes)) return Malformed(absl::StrCat("body ", id->value(), ": properties: length"));
    body->properties = std::make_shared<const Bytes>(std::move(bytes));
    previous = *id;
  }
  return absl::OkStatus();
}

absl::Status SnapshotReceiver::Impl::Parse(std::span<const std::uint8_t> datagram) {
  if (datagram.size() > settings.max_datagram_bytes) return Malformed("too long");
  BitReader reader(datagram);
  if (absl::Status status = ReadHeader(reader, parsed.header); !status.ok()) return status;
  if (parsed.header.fingerprint != quantizer.fingerprint()) return Malformed("other settings or world bounds");
  if (absl::Status status = CheckSequence(parsed.header.sequence); !status.ok()) return status;
  // A reader that has run out gives zeros, so all loops end; their results are refused here.
  absl::Status status = ParseDepartures(reader);
  if (status.ok()) status = ParseChanges(reader);
  if (status.ok()) status = ParseFullRecords(reader);
  if (status.ok()) status = ParseProperties(reader);
  if (!reader.ok()) return Malformed("truncated");
  if (!status.ok()) return status;
  if (!reader.AtEnd()) return Malformed("trailing bytes");
  if (bodies.size() + parsed.bodies.size() + parsed.departures.size() > 2 * kMaxTracked)
    return Malformed("too many bodies");
  return absl::OkStatus();
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

// The order is by epoch, then by tick: a body that was out of interest comes back under the epoch that it had.
bool SnapshotReceiver::Impl::Depart(Tick tick, const DepartureRecord& departure) {
  TrackedBody& body = bodies[departure.id];
  if (departure.epoch < body.epoch) return false;
  if (departure.epoch == body.epoch && (body.gone || tick < body.newest)) {
    body.newest = std::max(body.newest, tick);
    return false;
  }
  body = {.epoch = departure.epoch, .gone = true, .newest = tick};
  return true;
}

TrackedBody* SnapshotReceiver::Impl::Store(Tick tick, const ParsedBody& fresh) {
  TrackedBody& body = fresh.tracked != nullptr ? *fresh.tracked : bodies[fresh.id];
  if (fresh.epoch < body.epoch) return nullptr;
  if (fresh.epoch == body.epoch && body.gone && tick <= body.newest) return nullptr;
  if (fresh.epoch > body.epoch || body.gone) body = {.epoch = fresh.epoch, .gone = false, .newest = tick};
  body.newest = std::max(body.newest, tick);
  if (fresh.full && tick >= body.tuned) {
    body.tuned = tick;
    body.tuning = fresh.tuning;
  }
  std::vector<Sample>& samples = body.samples;
  if (!fresh.full) DropSamples(body, tick, fresh.oldest);
  const auto after = After(samples, tick);
  if (after != samples.begin() && std::prev(after)->tick == tick) return &body;  // the same tick written twice
  samples.insert(after, {tick, fresh.state, fresh.jumps});
  if (samples.size() > kHistoriesKept * settings.history_ticks) samples.erase(samples.begin());
  return &body;
}

// The sender goes on from the newest acknowledgement: it never looks back behind the oldest sample that it has used.
// But datagrams overtake each other, and a sample used before may be much older if the body had rested. So a sample is
// dropped only once datagrams that need it cannot come any more.
void SnapshotReceiver::Impl::DropSamples(TrackedBody& body, Tick tick, Tick oldest_used) {
  if (body.from == Tick()) {
    body.from = tick;
    body.needed = oldest_used;
  }
  if (tick < body.from + kOvertaking_ticks) return;
  const auto keep =
      std::find_if(body.samples.begin(), body.samples.end(), [&](const Sample& s) { return s.tick >= body.needed; });
  body.samples.erase(body.samples.begin(), keep);
  body.from = tick;
  body.needed = oldest_used;
}

// Velocities that were not sent follow from the sample before.
void SnapshotReceiver::Impl::EstimateVelocities(Tick tick, std::uint8_t jumps, const TrackedBody& body,
                                                BodyState& state) const {
  auto at = After(body.samples, tick);
  if (at != body.samples.begin() && std::prev(at)->tick == tick) --at;
  if (at == body.samples.begin()) return;
  const Sample& before = *std::prev(at);
  if (before.jumps != jumps) return;
  const BodyState was = quantizer.Dequantize(before.state);
  const double per_s = settings.tick_rate_hz / static_cast<double>(tick - before.tick);
  state.linear_velocity = Vec3f((state.position - was.position) * per_s);
  const Quatd turn = state.orientation * Conjugate(was.orientation);
  const Vec3d axis(turn.x, turn.y, turn.z);
  const double sine = Length(axis);
  if (sine == 0) return;
  const double angle = 2 * std::atan2(sine, std::abs(turn.w));
  state.angular_velocity = Vec3f(axis * ((turn.w < 0 ? -angle : angle) * per_s / sine));
}

void SnapshotReceiver::Impl::Take(const ParsedBody& body, ReceivedSnapshot& result) {
  TrackedBody* const stored = Store(result.tick, body);
  if (stored == nullptr) return;
  if (body.full) ++result.full_records;
  BodyRecord& record = result.bodies.emplace_back();
  record.id = body.id;
  record.epoch = body.epoch;
  record.state = quantizer.Dequantize(body.state);
  if (!body.has_velocities) EstimateVelocities(result.tick, body.jumps, *stored, record.state);
  record.traits.jumps = body.jumps;
  record.traits.tuning = body.full ? body.tuning : stored->tuning;
  if (body.properties == nullptr || result.tick <= stored->properties) return;
  stored->properties = result.tick;
  record.properties = body.properties;
}

SnapshotReceiver::SnapshotReceiver(const Aabb& world_bounds, const SnapshotSettings& settings)
    : impl_(std::make_unique<Impl>(world_bounds, settings)) {}
SnapshotReceiver::~SnapshotReceiver() = default;
SnapshotReceiver::SnapshotReceiver(SnapshotReceiver&&) noexcept = default;
SnapshotReceiver& SnapshotReceiver::operator=(SnapshotReceiver&&) noexcept = default;

absl::StatusOr<ReceivedSnapshot> SnapshotReceiver::Read(std::span<const std::uint8_t> datagram) {
  Parsed& parsed = impl_->parsed;
  parsed.Clear();
  if (absl::Status status = impl_->Parse(datagram); !status.ok()) return status;
  impl_->Remember(parsed.header.sequence);
  ReceivedSnapshot result{.tick = parsed.header.tick,
                          .last_input = parsed.header.last_input,
                          .input_margin_ticks = parsed.header.input_margin_ticks,
                          .bodies = {},
                          .departures = {}};
  for (const DepartureRecord& departure : parsed.departures) {
    if (impl_->Depart(result.tick, departure)) result.departures.push_back(departure);
  }
  result.bodies.reserve(parsed.bodies.size());
  for (const ParsedBody& body : parsed.bodies) impl_->Take(body, result);
  return result;
}

std::uint32_t SnapshotReceiver::newest_sequence() const { return impl_->newest; }

Bytes SnapshotReceiver::WriteAck() const {
  if (impl_->newest == 0) return {};
  ByteWriter out;
  out.U32(impl_->newest);
  out.U64(impl_->mask);
  return out.Take();
}

}  // namespace tessera::replication
