#include "net/join_grant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera::net {
namespace {

using ::testing::StartsWith;
using GrantBytes = std::vector<std::uint8_t>;

struct JoinGrantTest : testing::Test {
  const SigningKey instance = SigningKey::Make();
  JoinGrant grant = Make(4);

  JoinGrant Make(std::uint32_t regions) const {
    JoinGrant made{.player = PlayerNumber(7),
                   .credentials = IssuePlayer("plaza-1", PlayerNumber(7), Generation(3), instance),
                   .map = *MakeGridMap({-100, -100, 100, 100}, regions),
                   .regions = {},
                   .scene_hash = std::string(60, 'a') + "0129",
                   .tick_rate_hz = 60,
                   .snapshot_rate_hz = 30,
                   .expected_players = 2};
    for (const MapRegion& region : made.map.regions()) {
      made.regions.push_back({region.id, "10.0.0." + std::to_string(region.id.value() % 200),
                              static_cast<std::uint16_t>(7000 + region.id.value()), Incarnation(1ull << 40)});
    }
    return made;
  }
  std::string Fault(const JoinGrant& of) const {
    const auto read = DecodeJoinGrant(EncodeJoinGrant(of));
    EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(read.status().message());
  }
};

TEST_F(JoinGrantTest, GivesBackAllThatItWasMadeOf) {
  for (const std::uint32_t regions : {1u, 4u, 1000u}) {
    const JoinGrant made = Make(regions);
    const GrantBytes bytes = EncodeJoinGrant(made);
    EXPECT_LE(bytes.size(), kMaxJoinGrantBytes);
    const auto read = DecodeJoinGrant(bytes);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->player, made.player);
    EXPECT_EQ(read->credentials.instance_id, made.credentials.instance_id);
    EXPECT_EQ(read->credentials.statement, made.credentials.statement);
    EXPECT_EQ(read->credentials.key.verification_key(), made.credentials.key.verification_key());
    EXPECT_EQ(read->credentials.instance_key, made.credentials.instance_key);
    EXPECT_EQ(read->map, made.map);
    EXPECT_EQ(read->regions, made.regions);
    EXPECT_EQ(read->scene_hash, made.scene_hash);
    EXPECT_EQ(read->tick_rate_hz, made.tick_rate_hz);
    EXPECT_EQ(read->snapshot_rate_hz, made.snapshot_rate_hz);
    EXPECT_EQ(read->expected_players, made.expected_players);
    EXPECT_EQ(EncodeJoinGrant(*read), bytes);
  }
}

TEST_F(JoinGrantTest, TheLongestThatCanBeMadeIsRead) {
  JoinGrant longest = grant;
  std::vector<Cell> cells;
  std::vector<MapRegion> regions;
  for (std::uint32_t i = 0; i < 4096; ++i) {
    cells.push_back({{double(i), 0, i + 1.0, 1}, RegionId(4'000'000'000 + i % 1000), Epoch(4'000'000'000), RegionId()});
  }
  longest.regions.clear();
  for (std::uint32_t i = 0; i < 1000; ++i) {
    regions.push_back({RegionId(4'000'000'000 + i), RegionId()});
    longest.regions.push_back({regions.back().id, std::string(kMaxHostBytes, 'h'), 65535, Incarnation(~0ull)});
  }
  longest.map = *PartitionMap::Create(MapVersion(~0ull), {0, 0, 4096, 1}, std::move(cells), std::move(regions));
  EXPECT_TRUE(DecodeJoinGrant(EncodeJoinGrant(longest)).ok());
}

TEST_F(JoinGrantTest, NoPartOfItIsAGrantAndNothingMayFollow) {
  GrantBytes bytes = EncodeJoinGrant(grant);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_FALSE(DecodeJoinGrant(std::span(bytes).first(size)).ok()) << size;
  }
  bytes.push_back(0);
  EXPECT_EQ(DecodeJoinGrant(bytes).status().message(), "checksum: more bytes follow");
  bytes.resize(kMaxJoinGrantBytes + 1);
  EXPECT_THAT(std::string(DecodeJoinGrant(bytes).status().message()), StartsWith("grant: has "));
}

TEST_F(JoinGrantTest, AnyChangedBitIsNoticed) {
  const GrantBytes genuine = EncodeJoinGrant(Make(1));
  for (std::size_t bit = 0; bit < 8 * genuine.size(); ++bit) {
    GrantBytes damaged = genuine;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    ASSERT_EQ(DecodeJoinGrant(damaged).status().code(), absl::StatusCode::kInvalidArgument) << bit;
  }
}

TEST_F(JoinGrantTest, NamesWhatItIsNot) {
  EXPECT_EQ(DecodeJoinGrant({}).status().message(), "grant: this is no join grant");
  GrantBytes other = EncodeJoinGrant(grant);
  other[4] = 9;
  EXPECT_EQ(DecodeJoinGrant(other).status().message(), "grant: of version 9; this library reads 1");
}

TEST_F(JoinGrantTest, NamesTheFieldThatIsWrong) {
  const auto with = [&](auto change) {
    JoinGrant wrong = grant;
    change(wrong);
    return Fault(wrong);
  };
  EXPECT_EQ(with([](JoinGrant& g) { g.player = PlayerNumber(); }), "player: is 0");
  EXPECT_EQ(with([](JoinGrant& g) { g.player = PlayerNumber(8); }), "credential: is of player 7, the grant of 8");
  EXPECT_THAT(with([](JoinGrant& g) { g.credentials.instance_id = "forum-2"; }), StartsWith("credential: "));
  EXPECT_THAT(with([](JoinGrant& g) { g.credentials.instance_id.clear(); }), StartsWith("instance_id: "));
  EXPECT_EQ(with([](JoinGrant& g) { g.credentials.key = SigningKey::Make(); }),
            "credential_key: is not the credential's");
  EXPECT_THAT(with([](JoinGrant& g) { g.credentials.instance_key[0] ^= 1; }), StartsWith("credential: "));
  EXPECT_EQ(with([](JoinGrant& g) { g.map = PartitionMap(); }), "map.version: must not be 0");
  EXPECT_EQ(with([](JoinGrant& g) { g.regions.pop_back(); }), "regions: not those of the map");
  EXPECT_EQ(with([](JoinGrant& g) { std::swap(g.regions[0], g.regions[1]); }), "regions: not those of the map");
  EXPECT_EQ(with([](JoinGrant& g) { g.regions[1].host.clear(); }), "regions.host: region 2 has no host");
  EXPECT_EQ(with([](JoinGrant& g) { g.regions[1].host = "a b"; }), "regions.host: region 2 has no host");
  EXPECT_EQ(with([](JoinGrant& g) { g.regions[1].host = std::string(256, 'h'); }), "regions.host: too long");
  EXPECT_EQ(with([](JoinGrant& g) { g.regions[1].port = 0; }), "regions.port: region 2 has port 0");
  EXPECT_THAT(with([](JoinGrant& g) { g.scene_hash[5] = 'X'; }), StartsWith("scene_hash: "));
  EXPECT_EQ(with([](JoinGrant& g) { g.tick_rate_hz = 0; }), "tick_rate_hz: 0");
  EXPECT_EQ(with([](JoinGrant& g) { g.snapshot_rate_hz = 1001; }), "snapshot_rate_hz: 1001");
}

}  // namespace
}  // namespace tessera::net
