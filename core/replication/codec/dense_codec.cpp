// A frame in bytes: format 8 bits, ticks to the base (0: none), from base to older (0: none), from older to oldest (0:
// none) and the tick as varints; the range coder's bytes; CRC-32C of all before, seeded by the settings. In the range
// coder: per body of the base whether it is there still, whether its epoch changed and to what, its state; then
// arrivals, then departures, each after a 1, each list ended by a 0.
#include "core/replication/codec/dense_codec.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/replication/codec/checksum.h"
#include "core/replication/codec/dense_model.h"
#include "core/replication/codec/number_model.h"
#include "core/replication/datagram.h"
#include "core/world/bytes.h"
#include "core/world/limits.h"

namespace tessera::replication {

struct DenseCodec::Learnt {
  explicit Learnt(const DenseSetup& setup) : states(setup) {}
  DenseModel states;
  BitModel present, epoch_kept, arrival, departure;
  PlainNumber epoch_change, id_gap, epoch, departure_gap, departure_to;
};

namespace {

constexpr std::size_t kMaxFrameBodies = kMaxBodies + kMaxPlayers;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::uint8_t kFormat = 1;

// A number that both ends hold to a range: false outside it.
template <class Coder>
bool CodeWithin(Coder& coder, std::uint64_t& value, std::uint64_t low, std::uint64_t high, PlainNumber& model) {
  auto number = static_cast<std::int64_t>(value);
  Code(coder, number, model);
  if (number < 0 || static_cast<std::uint64_t>(number) < low || static_cast<std::uint64_t>(number) > high) return false;
  value = static_cast<std::uint64_t>(number);
  return true;
}

template <class Coder>
bool CodeEpoch(Coder& coder, Epoch& epoch, PlainNumber& model) {
  std::uint64_t value = epoch.value();
  if (!CodeWithin(coder, value, 0, std::numeric_limits<std::uint32_t>::max(), model)) return false;
  epoch = Epoch(static_cast<std::uint32_t>(value));
  return true;
}

// Ids beyond 2^62 come in two parts.
template <class Coder>
bool CodeId(Coder& coder, BodyId previous, BodyId& id, PlainNumber& model) {
  const std::uint64_t gap = id.value() - previous.value();
  std::uint64_t high = gap >> 32, low = gap & 0xffffffff;
  bool far = high != 0;
  Code(coder, far, std::uint32_t{1} << 4);
  if (!far) high = 0;
  if (far && !CodeWithin(coder, high, 1, 0xffffffff, model)) return false;
  if (!CodeWithin(coder, low, 0, 0xffffffff, model)) return false;
  const std::uint64_t step = (high << 32) | low;
  if (step == 0 || step > std::numeric_limits<std::uint64_t>::max() - previous.value()) return false;
  id = BodyId(previous.value() + step);
  return true;
}

bool Exhausted(const RangeEncoder&) { return false; }
bool Exhausted(const RangeDecoder& decoder) { return decoder.overrun(); }

// Walks the states of one body through frames, ascending by id.
class Cursor {
 public:
  explicit Cursor(const DenseFrame* frame) : frame_(frame) {}
  const DenseBody* Find(BodyId id) {
    if (frame_ == nullptr) return nullptr;
    while (at_ < frame_->bodies.size() && frame_->bodies[at_].id < id) ++at_;
    return at_ < frame_->bodies.size() && frame_->bodies[at_].id == id ? &frame_->bodies[at_] : nullptr;
  }

 private:
  const DenseFrame* frame_;
  std::size_t at_ = 0;
};

// One frame either way: an encoder reads `frame`, a decoder fills it.
template <class Coder, bool kDecoding>
class FramePass {
 public:
  FramePass(Coder& coder, const DenseSetup& setup, DenseCodec::Learnt& learnt)
      : coder_(coder), setup_(setup), learnt_(learnt) {}

  // An error names what was out of range; an encoder has none.
  absl::Status Run(const DenseFrame* base, const DenseFrame* older, const DenseFrame* oldest, DenseFrame& frame) {
    learnt_.states.BeginFrame();
    std::vector<DenseBody> arrivals;
    if (base != nullptr) {
      if (absl::Status status = Stayers(*base, older, oldest, frame, arrivals); !status.ok()) return status;
    } else if (!kDecoding) {
      arrivals = frame.bodies;
    }
    if (absl::Status status = Arrivals(arrivals); !status.ok()) return status;
    if (kDecoding) {
      if (absl::Status status = Merge(arrivals, frame); !status.ok()) return status;
    }
    return Departures(frame);
  }

 private:
  static absl::Status Bad(const char* what, BodyId id) {
    return absl::InvalidArgumentError(absl::StrCat("frame: body ", id.value(), ": ", what));
  }

  absl::Status Stayers(const DenseFrame& base, const DenseFrame* older, const DenseFrame* oldest, DenseFrame& frame,
                       std::vector<DenseBody>& arrivals) {
    Cursor older_at(older), oldest_at(oldest);
    auto now = frame.bodies.begin();
    std::vector<DenseBody> stayed;
    BodyHistory history;
    history.ticks = static_cast<std::uint64_t>(frame.tick - base.tick);
    if (older != nullptr) history.gap = static_cast<std::uint64_t>(base.tick - older->tick);
    if (oldest != nullptr) history.gap2 = static_cast<std::uint64_t>(older->tick - oldest->tick);
    for (const DenseBody& before : base.bodies) {
      if (Exhausted(coder_)) return absl::InvalidArgumentError("frame: truncated");
      DenseBody body{.id = before.id, .epoch = before.epoch, .state = {}};
      bool present = false;
      if (!kDecoding) {
        while (now != frame.bodies.end() && now->id < before.id) arrivals.push_back(*now++);
        present = now != frame.bodies.end() && now->id == before.id;
        if (present) body = *now++;
      }
      Code(coder_, present, learnt_.present);
      if (!present) continue;
      bool kept = body.epoch == before.epoch;
      Code(coder_, kept, learnt_.epoch_kept);
      if (!kept && !CodeEpoch(coder_, body.epoch, learnt_.epoch_change)) return Bad("epoch", body.id);
      const DenseBody* second = older_at.Find(before.id);
      const DenseBody* third = oldest_at.Find(before.id);
      history.id = before.id;
      history.base = &before.state;
      history.older = second != nullptr ? &second->state : nullptr;
      history.oldest = second != nullptr && third != nullptr ? &third->state : nullptr;
      if (!learnt_.states.CodeState(coder_, setup_, history, body.state)) return Bad("out of range", body.id);
      if (kDecoding) stayed.push_back(body);
    }
    if (kDecoding) {
      frame.bodies = std::move(stayed);
    } else {
      arrivals.insert(arrivals.end(), now, frame.bodies.end());
    }
    return absl::OkStatus();
  }

  absl::Status Arrivals(std::vector<DenseBody>& arrivals) {
    DenseBody before{};
    for (std::size_t i = 0;; ++i) {
      if (Exhausted(coder_)) return absl::InvalidArgumentError("frame: truncated");
      bool more = i < arrivals.size();
      Code(coder_, more, learnt_.arrival);
      if (!more) return absl::OkStatus();
      if (i >= kMaxFrameBodies) return absl::InvalidArgumentError("frame: too many bodies");
      DenseBody body = kDecoding ? DenseBody{} : arrivals[i];
      if (!CodeId(coder_, before.id, body.id, learnt_.id_gap)) return Bad("next id", before.id);
      if (!CodeEpoch(coder_, body.epoch, learnt_.epoch)) return Bad("epoch", body.id);
      if (!learnt_.states.CodeArrival(coder_, setup_, before.state, body.state)) return Bad("out of range", body.id);
      if (kDecoding) arrivals.push_back(body);
      before = body;
    }
  }

  absl::Status Merge(std::vector<DenseBody>& arrivals, DenseFrame& frame) {
    if (frame.bodies.size() + arrivals.size() > kMaxFrameBodies) {
      return absl::InvalidArgumentError("frame: too many bodies");
    }
    std::vector<DenseBody> merged;
    merged.reserve(frame.bodies.size() + arrivals.size());
    const auto by_id = [](const DenseBody& a, const DenseBody& b) { return a.id < b.id; };
    std::merge(frame.bodies.begin(), frame.bodies.end(), arrivals.begin(), arrivals.end(), std::back_inserter(merged),
               by_id);
    for (std::size_t i = 1; i < merged.size(); ++i) {
      if (merged[i].id == merged[i - 1].id) return Bad("twice", merged[i].id);
    }
    frame.bodies = std::move(merged);
    return absl::OkStatus();
  }

  absl::Status Departures(DenseFrame& frame) {
    BodyId previous;
    for (std::size_t i = 0;; ++i) {
      if (Exhausted(coder_)) return absl::InvalidArgumentError("frame: truncated");
      bool more = i < frame.departures.size();
      Code(coder_, more, learnt_.departure);
      if (!more) return absl::OkStatus();
      if (i >= kMaxFrameBodies) return absl::InvalidArgumentError("frame: too many departures");
      DepartureRecord departure = kDecoding ? DepartureRecord{} : frame.departures[i];
      if (!CodeId(coder_, previous, departure.id, learnt_.departure_gap)) return Bad("next departure", previous);
      if (!CodeEpoch(coder_, departure.epoch, learnt_.epoch)) return Bad("epoch", departure.id);
      std::uint64_t to = departure.to.value();
      if (!CodeWithin(coder_, to, 0, std::numeric_limits<std::uint32_t>::max(), learnt_.departure_to)) {
        return Bad("new owner", departure.id);
      }
      departure.to = RegionId(static_cast<std::uint32_t>(to));
      departure.why = to == 0 ? DepartureRecord::Why::kRemoved : DepartureRecord::Why::kHandedOver;
      if (kDecoding) frame.departures.push_back(departure);
      previous = departure.id;
    }
  }

  Coder& coder_;
  const DenseSetup& setup_;
  DenseCodec::Learnt& learnt_;
};

struct FrameHeader {
  std::uint8_t format = 0;
  std::uint64_t ticks = 0, gap = 0, gap2 = 0, tick = 0;
};

Bytes WriteFrameHeader(const FrameHeader& header) {
  ByteWriter out;
  out.U8(header.format);
  for (const std::uint64_t number : {header.ticks, header.gap, header.gap2, header.tick}) out.Varint(number);
  return out.Take();
}

// Number of bytes that it took.
absl::StatusOr<std::size_t> ReadFrameHeader(std::span<const std::uint8_t> bytes, FrameHeader& header) {
  ByteReader in(bytes);
  in.Field("frame: header");
  header.format = in.U8();
  for (std::uint64_t* number : {&header.ticks, &header.gap, &header.gap2, &header.tick}) *number = in.Varint();
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (header.format != kFormat) return absl::InvalidArgumentError(absl::StrCat("frame: format ", header.format));
  if (header.tick > kMaxTick) return absl::InvalidArgumentError("frame: tick");
  if (header.ticks > header.tick || header.gap > header.tick - header.ticks ||
      header.gap2 > header.tick - header.ticks - header.gap) {
    return absl::InvalidArgumentError("frame: refers to before the beginning");
  }
  if ((header.ticks == 0 && header.gap != 0) || (header.gap == 0 && header.gap2 != 0)) {
    return absl::InvalidArgumentError("frame: an older reference without a newer one");
  }
  // Varints have one form each, or damage could hide in them.
  return WriteFrameHeader(header).size();
}

std::uint32_t FingerprintOf(const StandingBoxes* boxes) {
  std::uint64_t hash = 0;
  const auto add = [&](std::uint64_t value) { hash = (hash ^ value) * 0x9e3779b97f4a7c15; };
  if (boxes == nullptr) return 0;
  for (const auto& [id, box] : *boxes) {
    add(id.value());
    add(static_cast<std::uint64_t>(box.floor));
    for (const std::int64_t half : box.half) add(static_cast<std::uint64_t>(half));
  }
  return static_cast<std::uint32_t>(hash >> 32);
}

}  // namespace

DenseCodec::Encoded DenseCodec::Encode(DenseFrame frame, const References& references) const {
  const auto frame_of = [](const KeptPtr& kept) { return kept != nullptr ? &kept->frame : nullptr; };
  const DenseFrame* base = frame_of(references.base);
  const DenseFrame* older = base != nullptr ? frame_of(references.older) : nullptr;
  const DenseFrame* oldest = older != nullptr ? frame_of(references.oldest) : nullptr;
  assert(base == nullptr || base->tick < frame.tick);
  assert(older == nullptr || older->tick < base->tick);
  assert(oldest == nullptr || oldest->tick < older->tick);
  for (DenseBody& body : frame.bodies) body.state = DenseModel::Written(setup_, body.state);

  FrameHeader header{.format = kFormat, .tick = frame.tick.value()};
  if (base != nullptr) header.ticks = static_cast<std::uint64_t>(frame.tick - base->tick);
  if (older != nullptr) header.gap = static_cast<std::uint64_t>(base->tick - older->tick);
  if (oldest != nullptr) header.gap2 = static_cast<std::uint64_t>(older->tick - oldest->tick);

  auto learnt = base != nullptr ? std::make_shared<Learnt>(*references.base->learnt) : std::make_shared<Learnt>(setup_);
  RangeEncoder coder;
  const absl::Status status = FramePass<RangeEncoder, false>(coder, setup_, *learnt).Run(base, older, oldest, frame);
  assert(status.ok());
  (void)status;
  ByteWriter out;
  out.Bytes(WriteFrameHeader(header));
  out.Bytes(coder.Finish());
  out.U32(Crc32c(out.bytes(), setup_.fingerprint));
  return {.bytes = out.Take(), .kept = std::make_shared<const Kept>(Kept{std::move(frame), std::move(learnt)})};
}

absl::StatusOr<DenseCodec::KeptPtr> DenseCodec::Decode(std::span<const std::uint8_t> bytes,
                                                       const Lookup& lookup) const {
  if (bytes.size() < kChecksumBytes) return absl::InvalidArgumentError("frame: truncated");
  const std::uint32_t checksum = ByteReader(bytes.last(kChecksumBytes)).U32();
  bytes = bytes.first(bytes.size() - kChecksumBytes);
  if (Crc32c(bytes, setup_.fingerprint) != checksum) {
    return absl::InvalidArgumentError("frame: checksum: damaged, or of other settings");
  }
  FrameHeader header;
  const absl::StatusOr<std::size_t> header_bytes = ReadFrameHeader(bytes, header);
  if (!header_bytes.ok()) return header_bytes.status();
  KeptPtr base, older, oldest;
  std::uint64_t at = header.tick;
  const auto find = [&](std::uint64_t back, KeptPtr& kept) {
    if (back == 0) return true;
    at -= back;
    kept = lookup(Tick(at));
    return kept != nullptr;
  };
  if (!find(header.ticks, base) || !find(header.gap, older) || !find(header.gap2, oldest)) {
    return absl::FailedPreconditionError(absl::StrCat("frame: no frame of tick ", at));
  }
  const auto frame_of = [](const KeptPtr& kept) { return kept != nullptr ? &kept->frame : nullptr; };
  auto learnt = base != nullptr ? std::make_shared<Learnt>(*base->learnt) : std::make_shared<Learnt>(setup_);
  RangeDecoder coder(bytes.subspan(std::min(*header_bytes, bytes.size())));
  DenseFrame frame{.tick = Tick(header.tick), .bodies = {}, .departures = {}};
  const absl::Status status = FramePass<RangeDecoder, true>(coder, setup_, *learnt)
                                  .Run(frame_of(base), frame_of(older), frame_of(oldest), frame);
  if (!status.ok()) return status;
  return std::make_shared<const Kept>(Kept{std::move(frame), std::move(learnt)});
}

DenseCodec MakeDenseCodec(const Aabb& world_bounds, const SnapshotSettings& settings, double gravity_m_s2,
                          bool velocities, std::shared_ptr<const StandingBoxes> boxes) {
  const Quantizer quantizer(world_bounds, settings);
  const PosePredictor predictor(quantizer, settings, gravity_m_s2);
  const std::uint32_t fingerprint =
      quantizer.fingerprint() + (velocities ? 0x10000u : 0u) + predictor.fingerprint() + FingerprintOf(boxes.get());
  return DenseCodec(
      {.predictor = predictor, .boxes = std::move(boxes), .velocities = velocities, .fingerprint = fingerprint});
}

}  // namespace tessera::replication
