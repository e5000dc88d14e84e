// Golden hashes: what the engine makes of each golden scene, to the bit. A change that alters one alters what every
// game sees, so it is made on purpose or not at all:
//
//   TESSERA_WRITE_GOLDEN=1 build/dev/tests/physics_golden_test   # rewrites core/physics/golden.txt
//
// The hashes are the same on every host, in every build, on every SIMD path and with any number of threads.
#include <gmock/gmock.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <map>
#include <string>

#include "core/physics/world.h"
#include "scenes/measured/golden.h"

namespace tessera::physics {
namespace {

constexpr char kFile[] = TESSERA_SOURCE_DIR "/core/physics/golden.txt";

// FNV-1a over the bits of numbers, low byte first, so that the host's byte order does not matter.
class StateHash {
 public:
  void Add(const BodyState& state) {
    Add(state.position);
    for (const double part : {state.orientation.x, state.orientation.y, state.orientation.z, state.orientation.w}) {
      AddBits(std::bit_cast<std::uint64_t>(part), 8);
    }
    Add(state.linear_velocity);
    Add(state.angular_velocity);
    Add(state.angular_momentum);
    AddBits(std::bit_cast<std::uint32_t>(state.still_s), 4);
    AddBits(state.asleep, 1);
  }
  std::uint64_t value() const { return hash_; }

 private:
  void Add(Vec3d v) {
    for (const double part : {v.x, v.y, v.z}) AddBits(std::bit_cast<std::uint64_t>(part), 8);
  }
  void Add(Vec3f v) {
    for (const float part : {v.x, v.y, v.z}) AddBits(std::bit_cast<std::uint32_t>(part), 4);
  }
  void AddBits(std::uint64_t bits, int bytes) {
    for (int i = 0; i < bytes; ++i, bits >>= 8) hash_ = (hash_ ^ (bits & 0xff)) * 0x100000001b3;
  }

  std::uint64_t hash_ = 0xcbf29ce484222325;
};

std::uint64_t HashOf(const scenes::GoldenScene& golden, WorldSettings settings = {}) {
  const Scene scene = golden.make();
  settings.gravity_m_s2 = scene.gravity_m_s2;
  World world(settings);
  for (const BodyDef& body : scene.bodies) world.Add(body, body.initial);
  for (const JointDef& joint : scene.joints) world.AddJoint(joint);
  for (int step = 0; step < golden.steps; ++step) world.Step(1.0 / 60);
  StateHash hash;
  for (const BodyDef& body : scene.bodies) hash.Add(world.StateOf(body.id));
  return hash.value();
}

std::map<std::string, std::uint64_t> ReadGolden() {
  std::map<std::string, std::uint64_t> hashes;
  std::ifstream in(kFile);
  std::string name;
  for (std::uint64_t hash = 0; in >> name >> std::hex >> hash;) hashes[name] = hash;
  return hashes;
}

TEST(GoldenTest, EveryRunComesToTheSameBitsWithAnyNumberOfThreads) {
  for (const scenes::GoldenScene& golden : scenes::GoldenScenes()) {
    const std::uint64_t alone = HashOf(golden);
    for (const int threads : {1, 2, 3}) {
      EXPECT_EQ(HashOf(golden, {.threads = threads}), alone) << golden.name << " with " << threads << " threads";
    }
  }
}

TEST(GoldenTest, StatesAreThoseThatWereCommitted) {
  if (std::getenv("TESSERA_WRITE_GOLDEN") != nullptr) {
    std::ofstream out(kFile, std::ios::trunc);
    for (const scenes::GoldenScene& golden : scenes::GoldenScenes()) {
      out << golden.name << ' ' << std::hex << std::setw(16) << std::setfill('0') << HashOf(golden) << '\n';
    }
    ASSERT_TRUE(out.good()) << kFile;
  }
  const std::map<std::string, std::uint64_t> committed = ReadGolden();
  for (const scenes::GoldenScene& golden : scenes::GoldenScenes()) {
    const auto entry = committed.find(std::string(golden.name));
    ASSERT_NE(entry, committed.end()) << golden.name << " is missing in " << kFile;
    EXPECT_EQ(HashOf(golden, {.portable = true}), entry->second) << golden.name << " without wide SIMD";
    EXPECT_EQ(HashOf(golden), entry->second)
        << golden.name << " comes to other states than when " << kFile << " was written";
  }
}

}  // namespace
}  // namespace tessera::physics
