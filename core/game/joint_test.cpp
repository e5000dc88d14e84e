#include "core/game/joint.h"

#include <gmock/gmock.h>

#include <limits>

#include "core/game/record.h"

namespace tessera::game::joint {
namespace {

using ::testing::HasSubstr;

GameJoint Sound() {
  GameJoint joint;
  joint.id = JointId((std::uint64_t{1} << 62) + 7);
  joint.other = BodyId(9);
  joint.kind = GameJointKind::kHinge;
  joint.frame.position = {1, 2, 3};
  joint.lower = -1, joint.upper = 2;
  joint.bodies_collide = true;
  joint.until = Tick(600);
  joint.answer = "held";
  joint.asked_by = BodyId(4);
  return joint;
}

TEST(GameJointTest, ARecordKeepsItsJoints) {
  GameRecord record;
  record.joints = {Sound(), Sound()};
  record.joints[1].other = BodyId(12);
  record.joints[1].until = Tick();
  record.joints[1].answer.clear();
  record.joints[1].asked_by = BodyId();
  ByteWriter out;
  Write(out, record);
  const std::vector<std::uint8_t> bytes = out.Take();
  ByteReader in(bytes);
  EXPECT_EQ(ReadRecord(in), record);
  EXPECT_TRUE(in.ok() && in.remaining() == 0);
  EXPECT_TRUE(CheckRecord(record).ok());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ByteReader cut(std::span<const std::uint8_t>(bytes).first(size));
    ReadRecord(cut);
    EXPECT_FALSE(cut.ok() && cut.remaining() == 0) << size;
  }
}

TEST(GameJointTest, AClientIsToldOfThoseThatHoldAndOfNothingElse) {
  std::vector<JointOfBody> joints{{BodyId(5), Sound()}, {BodyId(7), Sound()}};
  joints[1].joint.kind = GameJointKind::kSpring;
  joints[1].joint.stiffness_n_m = 300;
  const std::vector<std::uint8_t> bytes = EncodeJoints(joints);
  for (JointOfBody& one : joints) one.joint.until = Tick(), one.joint.answer = "", one.joint.asked_by = BodyId();
  const auto told = DecodeJoints(bytes);
  ASSERT_TRUE(told.ok()) << told.status();
  EXPECT_EQ(*told, joints) << "without what only the game needs";
  EXPECT_TRUE(EncodeJoints({}).empty());
  EXPECT_TRUE(DecodeJoints({})->empty());
  EXPECT_EQ(DecodeJoints(EncodeJoints(std::vector<JointOfBody>(100, joints[0])))->size(), kMaxToldJoints);
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeJoints(std::span(bytes).first(size)).ok()) << size;
  }
  joints[1].body = BodyId(9);
  EXPECT_THAT(DecodeJoints(EncodeJoints(joints)).status().message(), HasSubstr("lower id"));
  joints[0].joint.frame.position.x = std::numeric_limits<double>::infinity();
  EXPECT_THAT(DecodeJoints(EncodeJoints(joints)).status().message(), HasSubstr("frame"));
}

TEST(GameJointTest, WhatIsNotSoundIsRefused) {
  const auto refused = [](auto change) {
    GameJoint joint = Sound();
    change(joint);
    return std::string(CheckJoints({joint}).message());
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(refused([](GameJoint&) {}), "");
  EXPECT_THAT(refused([](GameJoint& joint) { joint.id = JointId(5); }), HasSubstr("no game gives"));
  EXPECT_THAT(refused([](GameJoint& joint) { joint.other = BodyId(); }), HasSubstr("out of order"));
  EXPECT_THAT(refused([](GameJoint& joint) { joint.kind = GameJointKind(7); }), HasSubstr("unknown kind"));
  EXPECT_THAT(refused([](GameJoint& joint) { joint.frame.position.x = kNan; }), HasSubstr("frame"));
  EXPECT_THAT(refused([](GameJoint& joint) { joint.other_frame.orientation.w = 2; }), HasSubstr("frame"));
  EXPECT_THAT(refused([](GameJoint& joint) { joint.upper = kNan; }), HasSubstr("limit"));
  EXPECT_THAT(refused([](GameJoint& joint) { joint.stiffness_n_m = -1; }), HasSubstr("stiffness"));
  EXPECT_THAT(CheckJointsOf(BodyId(9), {Sound()}).message(), HasSubstr("lower id"));
  EXPECT_THAT(CheckJoints(std::vector<GameJoint>(9, Sound())).message(), HasSubstr("more than 8"));
}

}  // namespace
}  // namespace tessera::game::joint
