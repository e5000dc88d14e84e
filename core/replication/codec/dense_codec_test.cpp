// Frames come back as they went in, whatever is in them; damage is found; and nothing that passes the checksum harms.
#include "core/replication/codec/dense_codec.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "core/replication/codec/checksum.h"
#include "core/replication/testing/arena.h"
#include "core/replication/testing/moving_bodies.h"

namespace tessera::replication {
namespace {

void ExpectSame(const DenseFrame& a, const DenseFrame& b) {
  EXPECT_EQ(a.tick, b.tick);
  EXPECT_EQ(a.bodies, b.bodies);
  EXPECT_EQ(a.departures, b.departures);
}

// Both ends of one stream, with a choice of references.
struct Ends {
  using KeptPtr = DenseCodec::KeptPtr;
  std::deque<KeptPtr> sent, got;  // the newest first

  static KeptPtr At(const std::deque<KeptPtr>& kept, std::size_t age) {
    return age < kept.size() ? kept[age] : nullptr;
  }
  DenseCodec::References Referring(std::size_t age) const {
    return {.base = At(sent, age), .older = At(sent, age + 2), .oldest = At(sent, age + 5)};
  }
  KeptPtr Find(Tick tick) const {
    for (const KeptPtr& kept : got) {
      if (kept->frame.tick == tick) return kept;
    }
    return nullptr;
  }
  auto Pass(const DenseCodec& codec, const DenseFrame& frame, std::size_t age, Bytes* bytes = nullptr) {
    const auto encoded = codec.Encode(frame, Referring(age));
    if (bytes != nullptr) *bytes = encoded.bytes;
    const auto decoded = codec.Decode(encoded.bytes, [&](Tick tick) { return Find(tick); });
    EXPECT_TRUE(decoded.ok()) << decoded.status();
    if (decoded.ok()) ExpectSame(encoded.kept->frame, (*decoded)->frame);
    sent.push_front(encoded.kept);
    if (decoded.ok()) got.push_front(*decoded);
    if (sent.size() > 16) sent.pop_back();
    if (got.size() > 16) got.pop_back();
    return encoded.bytes.size();
  }
};

DenseFrame Quantised(const Quantizer& quantizer, Tick tick, const std::vector<BodyRecord>& bodies) {
  DenseFrame frame{.tick = tick, .bodies = {}, .departures = {}};
  for (const BodyRecord& body : bodies) frame.bodies.push_back({body.id, body.epoch, quantizer.Quantize(body.state)});
  return frame;
}

// Anything at all, with changes of any size.
class Chaos {
 public:
  explicit Chaos(unsigned seed) : random_(seed) {}
  std::uint64_t Below(std::uint64_t n) { return random_() % n; }

  DenseFrame Quantised(Tick tick, const Quantizer& quantizer, const DenseFrame& before) {
    DenseFrame frame{.tick = tick, .bodies = {}, .departures = {}};
    for (DenseBody body : before.bodies) {
      if (Below(10) == 0) {
        frame.departures.push_back({body.id, body.epoch, RegionId(static_cast<std::uint32_t>(random_()))});
        continue;
      }
      if (Below(10) == 0) body.epoch = Epoch(static_cast<std::uint32_t>(random_()));
      if (Below(2) == 0) Scramble(body.state, quantizer);
      frame.bodies.push_back(body);
    }
    for (std::uint64_t n = Below(4); n > 0; --n) {
      DenseBody body{BodyId(Below(3) == 0 ? random_() | 1 : 1 + Below(500)), Epoch(7), {}};
      Scramble(body.state, quantizer);
      const auto at = std::lower_bound(frame.bodies.begin(), frame.bodies.end(), body,
                                       [](const auto& a, const auto& b) { return a.id < b.id; });
      if (at == frame.bodies.end() || at->id != body.id) frame.bodies.insert(at, body);
    }
    return frame;
  }

 private:
  void Scramble(QuantizedState& s, const Quantizer& quantizer) {
    const std::int64_t limit = quantizer.orientation_limit();
    const auto within = [&](std::int64_t most) {
      const std::int64_t range = Below(2) == 0 ? most : std::min<std::int64_t>(most, 100);
      return Below(8) == 0 ? (Below(2) == 0 ? most : -most)
                           : static_cast<std::int64_t>(Below(static_cast<std::uint64_t>(2 * range + 1))) - range;
    };
    for (std::int64_t& c : s.position) c = within(kMaxPosition);
    for (std::int16_t& c : s.smallest) c = static_cast<std::int16_t>(within(limit));
    s.largest = static_cast<std::uint8_t>(Below(4));
    s.asleep = Below(2) == 0;
    for (std::int32_t& c : s.linear) c = s.asleep ? 0 : static_cast<std::int32_t>(within(kMaxVelocity));
    for (std::int32_t& c : s.angular) c = s.asleep ? 0 : static_cast<std::int32_t>(within(kMaxVelocity));
  }
  std::mt19937_64 random_;
};

TEST(DenseCodecTest, MovingBodiesComeBackAtAnyReference) {
  const SnapshotSettings settings;
  for (const std::size_t age : {0, 1, 5}) {
    MovingBodies world({.count = 80, .seed = 3, .rest_speed_m_s = 0.8});
    const Quantizer quantizer(world.bounds(), settings);
    const DenseCodec dense = MakeDenseCodec(world.bounds(), settings, -9.81);
    const DenseCodec poses = MakeDenseCodec(world.bounds(), settings, -9.81, false);
    Ends dense_ends, pose_ends;
    for (std::uint64_t n = 1; n <= 60; ++n) {
      world.Step(1.0 / 60);
      dense_ends.Pass(dense, Quantised(quantizer, Tick(n), world.bodies()), age);
      pose_ends.Pass(poses, Quantised(quantizer, Tick(n), world.bodies()), age);
      ASSERT_FALSE(testing::Test::HasFailure()) << "age " << age << " tick " << n;
    }
  }
}

TEST(DenseCodecTest, ChaosComesBackToo) {
  const Quantizer quantizer(kBounds, {});
  const DenseCodec dense = MakeDenseCodec(kBounds, {}, -9.81);
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Chaos chaos(seed);
    Ends dense_ends;
    DenseFrame quantised;
    std::uint64_t tick = 0;
    for (int n = 0; n < 60; ++n) {
      tick += 1 + chaos.Below(n % 10 == 0 ? 1000 : 3);
      quantised = chaos.Quantised(Tick(tick), quantizer, quantised);
      dense_ends.Pass(dense, quantised, chaos.Below(4));
      ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed << " frame " << n;
    }
  }
}

TEST(DenseCodecTest, WithoutVelocitiesTheyComeBackAsNone) {
  const DenseCodec poses = MakeDenseCodec(kBounds, {}, -9.81, false);
  DenseFrame frame{.tick = Tick(1), .bodies = {{BodyId(1), Epoch(1), {}}}, .departures = {}};
  frame.bodies[0].state.linear = {1, 2, 3};
  const auto encoded = poses.Encode(frame, {});
  const auto decoded = poses.Decode(encoded.bytes, [](Tick) { return nullptr; });
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ((*decoded)->frame.bodies[0].state.linear, (std::array<std::int32_t, 3>{}));
}

TEST(DenseCodecTest, RestCostsAFewBytesAFrame) {
  MovingBodies world({.count = 900});
  for (BodyRecord& body : world.bodies()) body.state.asleep = true;
  const Quantizer quantizer(world.bounds(), {});
  const DenseCodec dense = MakeDenseCodec(world.bounds(), {}, -9.81);
  Ends ends;
  std::size_t bytes = 0;
  for (std::uint64_t n = 1; n <= 20; ++n) bytes = ends.Pass(dense, Quantised(quantizer, Tick(n), world.bodies()), 0);
  EXPECT_LE(bytes, 24u);
}

void ExpectDamageFound(const DenseCodec& codec, const Bytes& good, const DenseCodec::Lookup& lookup) {
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(codec.Decode(std::span<const std::uint8_t>(good).first(size), lookup).ok()) << "cut to " << size;
  }
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_EQ(codec.Decode(bad, lookup).status().code(), absl::StatusCode::kInvalidArgument) << "bit " << bit;
  }
  Bytes longer = good;
  longer.push_back(0);
  EXPECT_FALSE(codec.Decode(longer, lookup).ok());
}

TEST(DenseCodecTest, EveryTruncationAndFlippedBitIsAnError) {
  MovingBodies world({.count = 12});
  const Quantizer quantizer(world.bounds(), {});
  const DenseCodec dense = MakeDenseCodec(world.bounds(), {}, -9.81);
  Ends dense_ends;
  Bytes dense_bytes;
  for (std::uint64_t n = 1; n <= 8; ++n) {
    world.Step(1.0 / 60);
    dense_ends.Pass(dense, Quantised(quantizer, Tick(n), world.bodies()), 0, &dense_bytes);
  }
  ExpectDamageFound(dense, dense_bytes, [&](Tick tick) { return dense_ends.Find(tick); });
}

// A checksum keeps out damage, not malice: noise under a right one is an error or a frame in range, never more.
TEST(DenseCodecTest, NoiseUnderARightChecksumNeverHarms) {
  MovingBodies world({.count = 12});
  const Quantizer quantizer(world.bounds(), {});
  const std::uint32_t fingerprint = 5;
  const DenseCodec dense({.predictor = PosePredictor(quantizer, {}, -9.81), .fingerprint = fingerprint});
  Ends ends;
  Bytes good;
  for (std::uint64_t n = 1; n <= 8; ++n) {
    world.Step(1.0 / 60);
    ends.Pass(dense, Quantised(quantizer, Tick(n), world.bodies()), 0, &good);
  }
  std::mt19937 random(1);
  for (int n = 0; n < 3000; ++n) {
    Bytes bad = good;
    bad.resize(5 + random() % (good.size() - 5));
    for (std::size_t at = n % 2 == 0 ? 0 : 5; at < bad.size(); ++at) bad[at] = static_cast<std::uint8_t>(random());
    const std::uint32_t checksum = Crc32c(bad, fingerprint);
    for (int i = 0; i < 4; ++i) bad.push_back(static_cast<std::uint8_t>(checksum >> (8 * i)));
    const auto decoded = dense.Decode(bad, [&](Tick tick) { return ends.Find(tick); });
    if (!decoded.ok()) continue;
    BodyId previous;
    for (const auto& body : (*decoded)->frame.bodies) {
      EXPECT_GT(body.id, previous);
      previous = body.id;
      for (const std::int64_t c : body.state.position) EXPECT_LE(std::abs(c), kMaxPosition);
      for (const std::int16_t c : body.state.smallest) EXPECT_LE(std::abs(c), quantizer.orientation_limit());
    }
  }
}

TEST(DenseCodecTest, AMissingReferenceIsNamed) {
  const DenseCodec dense = MakeDenseCodec(kBounds, {}, -9.81);
  const auto first = dense.Encode({.tick = Tick(3), .bodies = {}, .departures = {}}, {});
  const auto second =
      dense.Encode({.tick = Tick(5), .bodies = {}, .departures = {}}, {.base = first.kept, .older = {}, .oldest = {}});
  const auto decoded = dense.Decode(second.bytes, [](Tick) { return nullptr; });
  EXPECT_EQ(decoded.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(decoded.status().message(), "frame: no frame of tick 3");
}

TEST(DenseCodecTest, OtherSettingsAreRefused) {
  const DenseCodec here = MakeDenseCodec(kBounds, {}, -9.81), there = MakeDenseCodec(kBounds, {}, -20);
  const auto encoded = here.Encode({.tick = Tick(3), .bodies = {}, .departures = {}}, {});
  EXPECT_FALSE(there.Decode(encoded.bytes, [](Tick) { return nullptr; }).ok());
}

// The very bytes: another host, compiler or optimisation must not change them.
TEST(DenseCodecTest, BytesAreTheSameEverywhere) {
  const Quantizer quantizer(kBounds, {});
  const DenseCodec dense = MakeDenseCodec(kBounds, {}, -9.81);
  Chaos chaos(99);
  Ends ends;
  DenseFrame frame;
  std::uint32_t sum = 0;
  for (std::uint64_t n = 1; n <= 50; ++n) {
    frame = chaos.Quantised(Tick(n), quantizer, frame);
    Bytes bytes;
    ends.Pass(dense, frame, n % 3, &bytes);
    sum = Crc32c(bytes, sum);
  }
  EXPECT_EQ(sum, 0xd10dde2u) << std::hex << sum;
}

// A box on a floor that both ends know costs less, one elsewhere is coded as well, and ends that know different floors
// refuse each other's frames.
TEST(DenseCodecTest, KnowingTheFloorSavesBytesAndNeverHarms) {
  MovingBodies world({.count = 40, .seed = 3, .kicks_per_s = 0.1});
  const Quantizer quantizer(world.bounds(), {});
  StandingBoxes boxes;
  for (std::uint64_t id = 1; id <= 30; ++id) boxes[BodyId(id)] = StandingBox::Of(quantizer, 0, {0.3, 0.3, 0.3});
  const auto shared = std::make_shared<const StandingBoxes>(boxes);
  const DenseCodec blind = MakeDenseCodec(world.bounds(), {}, -9.81, false);
  const DenseCodec knowing = MakeDenseCodec(world.bounds(), {}, -9.81, false, shared);
  std::size_t blind_bytes = 0, knowing_bytes = 0;
  DenseCodec::References blind_refs{}, knowing_refs{};
  for (std::uint64_t tick = 1; tick <= 300; ++tick) {
    world.Step(1.0 / 30);
    DenseFrame frame{.tick = Tick(tick), .bodies = {}, .departures = {}};
    for (const BodyRecord& body : world.bodies()) {
      QuantizedState state = quantizer.Quantize(body.state);
      // Boxes that tumble over the floor, at the height that their turn gives them.
      const FixedQuaternion turn = ToFixed(state, quantizer.orientation_limit());
      if (body.id.value() <= 30) state.position[1] = boxes[body.id].HeightAt(turn);
      frame.bodies.push_back({body.id, body.epoch, state});
    }
    const DenseCodec::Encoded without = blind.Encode(frame, blind_refs), with = knowing.Encode(frame, knowing_refs);
    const auto decoded = knowing.Decode(with.bytes, [&](Tick at) {
      for (const auto& kept : {knowing_refs.base, knowing_refs.older, knowing_refs.oldest}) {
        if (kept != nullptr && kept->frame.tick == at) return kept;
      }
      return DenseCodec::KeptPtr();
    });
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    ASSERT_EQ((*decoded)->frame.bodies, with.kept->frame.bodies);
    EXPECT_FALSE(blind.Decode(with.bytes, [](Tick) { return DenseCodec::KeptPtr(); }).ok());
    blind_bytes += without.bytes.size();
    knowing_bytes += with.bytes.size();
    blind_refs = {.base = without.kept, .older = blind_refs.base, .oldest = blind_refs.older};
    knowing_refs = {.base = *decoded, .older = knowing_refs.base, .oldest = knowing_refs.older};
  }
  EXPECT_LT(static_cast<double>(knowing_bytes), 0.9 * static_cast<double>(blind_bytes));
}

}  // namespace
}  // namespace tessera::replication
