#include "core/replication/input.h"

#include <gtest/gtest.h>

#include <random>

#include "core/replication/datagram.h"

namespace tessera::replication {
namespace {

InputMessage AMessage() {
  InputMessage message;
  message.ack.assign(12, 0xab);
  for (std::uint32_t i = 0; i < 3; ++i) {
    message.inputs.push_back({.number = 1000 + i,
                              .body = PlayerBodyId(PlayerNumber(2)),
                              .target = Tick(60'000 + i),
                              .force_n = {1, -2.5f, 3e6f},
                              .torque_nm = {0, 0.25f, -0.f}});
  }
  return message;
}

TEST(InputTest, ComesBackAsWritten) {
  const InputMessage sent = AMessage();
  const std::vector<std::uint8_t> bytes = EncodeInput(sent);
  EXPECT_EQ(KindOf(bytes), DatagramKind::kInput);
  EXPECT_LE(bytes.size(), 400u);
  const auto got = DecodeInput(bytes);
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->ack, sent.ack);
  EXPECT_EQ(got->inputs, sent.inputs);
}

TEST(InputTest, AnAcknowledgementAloneIsAMessage) {
  const auto got = DecodeInput(EncodeInput({.ack = {1, 2, 3}, .inputs = {}}));
  ASSERT_TRUE(got.ok());
  EXPECT_EQ(got->ack.size(), 3u);
  EXPECT_TRUE(got->inputs.empty());
}

TEST(InputTest, TheLargestMessageIsSmall) {
  InputMessage message;
  message.ack.assign(kMaxInputAckBytes, 1);
  for (std::size_t i = 0; i < kMaxInputs; ++i) {
    message.inputs.push_back({.number = 0xfffffff0 + static_cast<std::uint32_t>(i),
                              .body = BodyId(~std::uint64_t{0}),
                              .target = Tick(std::uint64_t{1} << 48),
                              .force_n = {},
                              .torque_nm = {}});
  }
  EXPECT_LE(EncodeInput(message).size(), 450u);
  EXPECT_TRUE(DecodeInput(EncodeInput(message)).ok());
}

TEST(InputTest, NamesTheFieldThatIsWrong) {
  InputMessage message = AMessage();
  message.inputs[1].force_n.y = std::nanf("");
  EXPECT_EQ(DecodeInput(EncodeInput(message)).status().message(), "input: inputs[1].force_n is not finite");
  message = AMessage();
  message.inputs[2].torque_nm.x = INFINITY;
  EXPECT_EQ(DecodeInput(EncodeInput(message)).status().message(), "input: inputs[2].torque_nm is not finite");
  message = AMessage();
  message.inputs[2].number = 1001;
  EXPECT_EQ(DecodeInput(EncodeInput(message)).status().message(), "input: inputs[2].number does not ascend");
  message = AMessage();
  message.inputs[1].target = Tick(std::uint64_t{1} << 63);  // differences of such ticks would overflow
  EXPECT_EQ(DecodeInput(EncodeInput(message)).status().message(), "input: inputs[1].target is out of range");
  message = AMessage();
  message.inputs[0].number = 0;
  EXPECT_EQ(DecodeInput(EncodeInput(message)).status().message(), "input: inputs[0].number does not ascend");
}

TEST(InputTest, EveryOtherLengthIsRefused) {
  std::vector<std::uint8_t> bytes = EncodeInput(AMessage());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(DecodeInput(std::span(bytes).first(length)).ok()) << length;
  }
  bytes.push_back(0);
  EXPECT_EQ(DecodeInput(bytes).status().message(), "input: trailing bytes");
}

TEST(InputTest, NoiseNeverHarms) {
  std::mt19937 random(5);
  const std::vector<std::uint8_t> good = EncodeInput(AMessage());
  for (int i = 0; i < 100'000; ++i) {
    std::vector<std::uint8_t> bytes = good;
    if (i % 2 == 0) bytes.resize(random() % 200);
    for (unsigned flips = 1 + random() % 8; flips > 0 && !bytes.empty(); --flips) {
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    }
    const auto got = DecodeInput(bytes);
    if (!got.ok()) continue;
    EXPECT_LE(got->inputs.size(), kMaxInputs);
    for (const PlayerInput& input : got->inputs) EXPECT_TRUE(IsFinite(input.force_n) && IsFinite(input.torque_nm));
  }
}

}  // namespace
}  // namespace tessera::replication
