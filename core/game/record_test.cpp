#include "core/game/record.h"

#include <gmock/gmock.h>

#include <limits>

#include "core/game/settings.h"
#include "core/game/value.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

using ::testing::HasSubstr;

GameTimer Timer(std::uint64_t due, std::uint32_t number) {
  GameTimer timer;
  timer.due = Tick(due);
  timer.number = number;
  timer.name = "open";
  timer.values = *EncodeFields({{"door", BodyId(12)}, {"speed", 1.5}, {"where", Vec3d{1, -2, 3}}});
  return timer;
}

GameRecord Full() {
  GameRecord record;
  record.last_timer = 9;
  record.timers = {Timer(5, 2), Timer(5, 3), Timer(80, 1)};
  record.push_ns = {1, 2, 3};
  record.push_nms = {0, 0, -4};
  record.game = 3;
  record.waiting = {{kOnBodyContact, BodyId(1), BodyId(2)}, {kOnBodyBlast, BodyId(1), BodyId()}};
  record.waiting[0].contact = {{1, 2, 3}, {0, 1, 0}, 4};
  record.waiting[1].blown = {{1, 2, 3}, 0.5, "barrel"};
  return record;
}

std::vector<std::uint8_t> Encoded(const GameRecord& record) {
  ByteWriter out;
  Write(out, record);
  return out.Take();
}

TEST(GameRecordTest, ComesBackAsItWas) {
  for (const GameRecord& record : {GameRecord(), Full()}) {
    const std::vector<std::uint8_t> bytes = Encoded(record);
    ByteReader in(bytes);
    EXPECT_EQ(ReadRecord(in), record);
    EXPECT_TRUE(in.ok()) << in.error();
    EXPECT_EQ(in.remaining(), 0U);
    EXPECT_TRUE(CheckRecord(record).ok()) << CheckRecord(record);
  }
  EXPECT_TRUE(GameRecord().empty());
  EXPECT_FALSE(Full().empty());
  EXPECT_EQ(Full().next_due(), Tick(5));
}

TEST(GameRecordTest, EveryCutIsNoticed) {
  const std::vector<std::uint8_t> bytes = Encoded(Full());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ByteReader in({bytes.data(), size});
    (void)ReadRecord(in);
    EXPECT_FALSE(in.ok()) << size;
  }
}

TEST(GameRecordTest, WhatNoRegionSendsIsRefused) {
  const auto refused = [](const auto& change) {
    GameRecord record = Full();
    change(record);
    return std::string(CheckRecord(record).message());
  };
  EXPECT_EQ(refused([](GameRecord& r) { std::swap(r.timers[0], r.timers[2]); }), "timers: out of order");
  EXPECT_EQ(refused([](GameRecord& r) { r.timers[1] = r.timers[0]; }), "timers: out of order");
  EXPECT_EQ(refused([](GameRecord& r) { r.last_timer = 2; }), "timers: 3 is no number of a timer");
  EXPECT_EQ(refused([](GameRecord& r) { r.timers[0].number = 0; }), "timers: 0 is no number of a timer");
  EXPECT_EQ(refused([](GameRecord& r) { r.timers[0].name = std::string(33, 'x'); }), "timers: a name is too long");
  EXPECT_THAT(refused([](GameRecord& r) { r.timers[0].values.pop_back(); }), HasSubstr("truncated"));
  EXPECT_THAT(refused([](GameRecord& r) { r.timers.assign(kMaxTimers + 1, Timer(1, 1)); }), "timers: more than 16");
  EXPECT_EQ(refused([](GameRecord& r) {
              r.waiting = {{kOnTick, BodyId(1), BodyId(2)}};
            }),
            "waiting: an event of an unknown callback");
  EXPECT_EQ(refused([](GameRecord& r) { r.push_ns.x = std::numeric_limits<float>::quiet_NaN(); }),
            "push: is not finite, or too strong");
}

TEST(GameFieldsTest, ComeBackAsTheyWere) {
  const GameFields fields = {{"a", true},           {"b", std::int64_t{-7}}, {"c", 2.5},
                             {"d", std::string()},  {"e", Vec3d{1, 2, 3}},   {"f", BodyId(1ULL << 40)},
                             {"g", PlayerNumber(3)}};
  const auto bytes = EncodeFields(fields);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const auto decoded = DecodeFields(*bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, fields);
}

TEST(GameFieldsTest, WhatIsNotSoundIsRefused) {
  EXPECT_EQ(EncodeFields({{"a", std::string(300, 'x')}}).status(),
            absl::ResourceExhaustedError("values: take 305 bytes, more than 256"));
  const std::vector<std::uint8_t> names = {1, 'b', 0, 1, 1, 'a', 0, 1}, type = {1, 'b', 9, 1}, flag = {1, 'b', 0, 2};
  EXPECT_EQ(DecodeFields(names).status().message(), "values: names do not ascend");
  EXPECT_EQ(DecodeFields(type).status().message(), "values: one is of an unknown type");
  EXPECT_EQ(DecodeFields(flag).status().message(), "values: one is of an unknown type");
  EXPECT_EQ(DecodeFields(std::vector<std::uint8_t>(257)).status().message(), "values: are too long");
  EXPECT_FALSE(DecodeFields(std::vector<std::uint8_t>{1, 'b', 2, 0, 0, 0, 0, 0, 0, 0xf0, 0x7f}).ok()) << "infinite";
}

}  // namespace
}  // namespace tessera::game
