#include "core/region/question_desk.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/region/testing/row_map.h"
#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr Tick kAsked{6}, kNow{7};

// A ray along x at this height of z, for at most three bodies, as of tick 5.
game::GameQuestion RayAlongX(double from_x, double to_x, double z = 0) {
  game::Question question;
  question.query.from = {from_x, 0, z};
  question.query.to = {to_x, 0, z};
  question.query.most_hits = 3;
  question.query.at_tick = 5.5;
  return {.number = 1, .asked = kAsked, .due = kNow, .name = "seen", .values = {}, .query = EncodeQuestion(question)};
}

// One region of four, in a square: 1 has x < 0, z < 0; 2 has x > 0, z < 0. Balls of half a metre lie along z = -9.
class Side {
 public:
  explicit Side(std::uint32_t region) : Side(region, *MakeGridMap(Balls({}).ground(), 4)) {}
  Side(std::uint32_t region, const PartitionMap& map)
      : neighborhood_(RegionId(region), map), bodies_(catalog_, {.gravity_m_s2 = scene_->gravity_m_s2}) {}

  void Own(std::uint64_t id) { bodies_.Own(BodyId(id), Epoch(1), catalog_.Find(BodyId(id))->initial); }
  void SeeGhost(std::uint64_t id, std::uint32_t owner) {
    Ghost ghost;
    ghost.record.id = BodyId(id);
    ghost.record.epoch = Epoch(1);
    ghost.record.state = catalog_.Find(BodyId(id))->initial;
    ghost.owner = RegionId(owner);
    ghosts_.push_back(ghost);
    bodies_.PlaceGhosts(ghosts_);
  }
  // Makes steps until the poses of tick 5 and the one after it are remembered.
  void Remember() {
    bodies_.NotePlaces();
    for (std::uint64_t tick = 1; tick <= kNow.value(); ++tick) {
      bodies_.Step(SmallWorld::kTick_s, Tick(tick - 1));
      bodies_.ReadBack();
      bodies_.NotePlaces();
      bodies_.NotePoses(Tick(tick), SmallWorld::kTick_s, 60);
    }
  }
  void Put(std::uint64_t asker, const game::GameQuestion& question) {
    CarriedRecord record;
    record.game.questions = {question};
    records_.Adopt(BodyId(asker), record);
  }
  QuestionDesk& desk() { return desk_; }

 private:
  std::shared_ptr<const Scene> scene_ = std::make_shared<const Scene>(Balls({{-5, 0, -9}, {5, 0, -9}, {-9, 0, -9}}));
  Catalog catalog_{scene_};
  Neighborhood neighborhood_;
  Bodies bodies_;
  std::vector<Ghost> ghosts_;
  RecordTable records_;
  SharedProperties shared_;
  QuestionDesk desk_{catalog_, neighborhood_, bodies_, records_, shared_};
};

std::vector<std::uint64_t> HitsOf(const std::optional<game::Answer>& answer) {
  std::vector<std::uint64_t> bodies;
  if (answer) {
    for (const QueryHit& hit : answer->hits) bodies.push_back(hit.body.value());
  }
  return bodies;
}

// Region 1 has the balls 1 and 3, region 2 has ball 2; each sees the other's as a ghost.
class QuestionDeskTest : public ::testing::Test {
 protected:
  QuestionDeskTest() {
    one.Own(1);
    one.Own(3);
    one.SeeGhost(2, 2);
    two.Own(2);
    two.SeeGhost(1, 1);
    one.Remember();
    two.Remember();
  }
  std::optional<game::Answer> Answer(const game::GameQuestion& question, Tick now = kNow) {
    return one.desk().AnswerTo(BodyId(1), question, now);
  }

  Side one{1}, two{2};
  const game::GameQuestion across = RayAlongX(-8, 9, -9);
};

TEST_F(QuestionDeskTest, AQueryThatTouchesNoOtherRegionIsAnsweredHere) {
  const game::GameQuestion question = RayAlongX(-9.9, -8.6, -9);
  one.Put(1, question);
  EXPECT_EQ(Answer(question), std::nullopt) << "it was not asked yet";
  EXPECT_THAT(one.desk().Ask(kNow), IsEmpty());
  const auto answer = Answer(question);
  EXPECT_THAT(HitsOf(answer), ElementsAre(3U));
  EXPECT_TRUE(answer->complete);
}

TEST_F(QuestionDeskTest, HopsCountBordersToTheFarthestRegionThatIsTouched) {
  Side first(1, RowMap(4));
  BodyQuery query{.from = {-5, 0, 0}, .to = {1.9, 0, 0}};
  EXPECT_EQ(first.desk().HopsFor(query), 0U);
  query.to.x = 2.1;
  EXPECT_EQ(first.desk().HopsFor(query), 1U) << "a body may be 8 m outside of its owner's cells";
  query.shape = SphereShape{10};
  EXPECT_EQ(first.desk().HopsFor(query), 2U);
  query.to.x = 100;
  EXPECT_EQ(first.desk().HopsFor(query), 3U) << "the last cell reaches on for ever";
}

TEST_F(QuestionDeskTest, EachRegionNamesItsOwnBodiesAndAllAreMerged) {
  one.Put(1, across);
  const std::vector<MessagePacket> asked = one.desk().Ask(kNow);
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].kind, PacketKind::kQuestion);
  EXPECT_EQ(asked[0].via, kTwo);
  EXPECT_EQ(Answer(across), std::nullopt);

  const std::optional<MessagePacket> answer = two.desk().Take(asked[0], kNow);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->via, kOne);
  EXPECT_EQ(one.desk().Take(*answer, kNow), std::nullopt);
  EXPECT_THAT(HitsOf(Answer(across)), ElementsAre(1U, 2U));
  EXPECT_TRUE(Answer(across)->complete);
}

TEST_F(QuestionDeskTest, ARegionThatIsBehindIsAskedAgain) {
  one.Put(1, across);
  const std::vector<MessagePacket> asked = one.desk().Ask(kNow);
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(two.desk().Take(asked[0], Tick(6)), std::nullopt) << "it has not remembered tick 6 yet";
  EXPECT_THAT(one.desk().Ask(kNow + 9), IsEmpty());
  EXPECT_THAT(one.desk().Ask(kNow + 10), SizeIs(1));
}

TEST_F(QuestionDeskTest, AfterASecondTheAnswerIsIncomplete) {
  one.Put(1, across);
  one.desk().Ask(kNow);
  EXPECT_EQ(Answer(across, kAsked + 59), std::nullopt);
  const auto answer = Answer(across, kAsked + 60);
  EXPECT_THAT(HitsOf(answer), ElementsAre(1U));
  EXPECT_FALSE(answer->complete);
}

TEST_F(QuestionDeskTest, AfterARestartAllAreAskedAnew) {
  one.Put(1, across);
  const std::vector<MessagePacket> asked = one.desk().Ask(kNow);
  const std::optional<MessagePacket> answer = two.desk().Take(asked.at(0), kNow);
  ASSERT_TRUE(answer.has_value());
  one.desk().Restart();
  one.desk().Take(*answer, kNow);
  EXPECT_EQ(Answer(across), std::nullopt) << "nobody waits for that answer";
  EXPECT_THAT(one.desk().Ask(kNow), SizeIs(1));
}

TEST_F(QuestionDeskTest, AnAnswerThatIsNotSoundIsNone) {
  one.Put(1, across);
  const std::vector<MessagePacket> asked = one.desk().Ask(kNow);
  std::optional<MessagePacket> answer = two.desk().Take(asked.at(0), kNow);
  ASSERT_TRUE(answer.has_value());
  answer->properties.pop_back();
  one.desk().Take(*answer, kNow);
  EXPECT_EQ(Answer(across), std::nullopt);
  MessagePacket question = asked[0];
  question.properties.pop_back();
  EXPECT_EQ(two.desk().Take(question, kNow), std::nullopt);
}

}  // namespace
}  // namespace tessera::region
