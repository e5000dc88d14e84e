#include "control_plane/message_cost.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>

#include <string>

#include "control_plane/control_records.pb.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/scene.pb.h"

namespace tessera::control {
namespace {

constexpr std::size_t kMegabyte = 1'000'000;

template <class Message>
bool Fits(const Message& message, std::size_t limit) {
  return TakesAtMost(message.SerializeAsString(), *Message::descriptor(), limit);
}

// A length-delimited field of up to 127 bytes.
std::string Field(int number, const std::string& content) {
  return std::string{static_cast<char>(number << 3 | 2), static_cast<char>(content.size())} + content;
}
std::string Times(int times, const std::string& bytes) {
  std::string all;
  for (int i = 0; i < times; ++i) all += bytes;
  return all;
}

TEST(MessageCostTest, AMessageTakesWhatItTakesInMemory) {
  v1::AgentMessage message;
  for (int i = 0; i < 1000; ++i) {
    v1::WorkerReport& report = *message.mutable_heartbeat()->add_workers();
    report.mutable_identity()->set_instance_id("inst-" + std::to_string(i));
    report.mutable_identity()->set_region(7);
  }
  const std::size_t takes = message.SpaceUsedLong();
  EXPECT_FALSE(Fits(message, takes * 3 / 4));
  EXPECT_TRUE(Fits(message, takes * 5 / 4));
}

TEST(MessageCostTest, EmptyMessagesInARowAreNoSmallMatter) {
  v1::AgentMessage message;
  message.mutable_heartbeat();
  // 200 000 bytes that would be 100 000 reports.
  const std::string reports = Times(100'000, Field(1, ""));
  v1::AgentHeartbeat heartbeat;
  ASSERT_TRUE(heartbeat.ParseFromString(reports));
  ASSERT_EQ(heartbeat.workers_size(), 100'000);
  EXPECT_GT(heartbeat.SpaceUsedLong(), 10 * kMegabyte);
  EXPECT_FALSE(TakesAtMost(reports, *v1::AgentHeartbeat::descriptor(), 10 * kMegabyte));
}

TEST(MessageCostTest, StringsCountWithTheirBytesAndNumbersOfAListWithTheirs) {
  v1::FetchGameResponse game;
  game.set_game(std::string(kMegabyte, 'x'));
  EXPECT_TRUE(Fits(game, kMegabyte + 1000));
  EXPECT_FALSE(Fits(game, kMegabyte - 1));
  v1::Shape shape;
  for (std::uint32_t i = 0; i < 300'000; ++i) shape.mutable_mesh()->add_indices(i % 100);
  EXPECT_TRUE(Fits(shape, 1'300'000)) << "four bytes each";
  EXPECT_FALSE(Fits(shape, 1'100'000));
}

TEST(MessageCostTest, WhatIsNotKnownCountsToo) {
  // Field 9 of a message that has no such one.
  EXPECT_FALSE(TakesAtMost(Times(100'000, Field(9, "")), *v1::FetchGameRequest::descriptor(), 3 * kMegabyte));
  const std::string number{9 << 3, 1};
  EXPECT_FALSE(TakesAtMost(Times(100'000, number), *v1::FetchGameRequest::descriptor(), kMegabyte / 2));
  EXPECT_TRUE(TakesAtMost(number, *v1::FetchGameRequest::descriptor(), 1000));
  const std::string group{9 << 3 | 3, 9 << 3 | 4};
  EXPECT_FALSE(TakesAtMost(group, *v1::FetchGameRequest::descriptor(), kMegabyte));
}

TEST(MessageCostTest, EachFieldOfOneOfSeveralHasALimitOfItsOwn) {
  v1::AgentMessage message;
  for (int i = 0; i < 1000; ++i) message.mutable_heartbeat()->add_workers();
  const std::string bytes = message.SerializeAsString();
  const auto within = [&](std::size_t heartbeat, std::size_t others) {
    google::protobuf::io::ArrayInputStream stream(bytes.data(), static_cast<int>(bytes.size()));
    return FieldsTakeAtMost(stream, *v1::AgentMessage::descriptor(), [&](int field) {
      return field == v1::AgentMessage::kHeartbeatFieldNumber ? heartbeat : others;
    });
  };
  EXPECT_TRUE(within(10 * kMegabyte, 0));
  EXPECT_FALSE(within(1000, 10 * kMegabyte));
}

TEST(MessageCostTest, WhatIsCutShortOrNestedWithoutEndIsLeftToTheParser) {
  v1::AgentMessage message;
  message.mutable_heartbeat()->add_workers()->mutable_identity()->set_instance_id("inst-1");
  const std::string bytes = message.SerializeAsString();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    EXPECT_TRUE(TakesAtMost(bytes.substr(0, i), *v1::AgentMessage::descriptor(), 10'000)) << i;
  }
  std::string deep;  // shapes in shapes
  for (int i = 0; i < 30; ++i) {
    v1::Shape outer;
    v1::Shape inner;
    ASSERT_TRUE(deep.empty() || inner.ParseFromString(deep));
    *outer.mutable_compound()->add_children()->mutable_shape() = inner;
    deep = outer.SerializeAsString();
  }
  EXPECT_TRUE(TakesAtMost(deep, *v1::Shape::descriptor(), kMegabyte));
}

}  // namespace
}  // namespace tessera::control
