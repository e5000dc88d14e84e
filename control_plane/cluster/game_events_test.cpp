// Published events from reports alone.
#include "control_plane/cluster/game_events.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/game_fields.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class GameEventsTest : public ::testing::Test {
 protected:
  GameEventsTest() {
    records::Instance next = instance_.record;
    next.set_game_name("game.lua");
    next.set_game_hash("feed");
    EXPECT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }
  // Reports events numbered from `first` to `last`, each made in the tick of ten times its number.
  void Report(std::uint64_t first, std::uint64_t last, const std::string& name = "e") {
    v1::WorkerReport report;
    report.mutable_identity()->set_region(1);
    for (std::uint64_t number = first; number <= last; ++number) {
      v1::ReportedGameEvent& event = *report.add_game_events();
      event.set_number(number);
      event.set_tick(10 * number);
      event.set_body(5);
      event.set_name(absl::StrCat(name, number));
    }
    events_->Take(instance_, report, rig_.now);
  }
  std::vector<std::string> After(std::uint64_t number = 0) const {
    std::vector<std::string> names;
    const auto events = events_->After(instance_, number, 100);
    if (!events.ok()) return {std::string(events.status().message())};
    for (const v1::PublishedEvent& event : *events) {
      names.push_back(event.has_restored() ? absl::StrCat("restored to ", event.restored().tick(), ", valid up to ",
                                                          event.restored().valid_up_to())
                                           : absl::StrCat(event.number(), " ", event.name()));
    }
    return names;
  }
  void Restore(std::uint64_t tick) {
    records::Instance next = instance_.record;
    next.mutable_restored()->set_tick(tick);
    next.mutable_restored()->set_last_incarnation(next.restored().last_incarnation() + 10);
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
    EXPECT_EQ(events_->StoredUpTo(instance_), 0U) << "the regions' numbers go back";
    events_->NoteRestore(instance_, rig_.now);
  }
  void RestartControlPlane() {
    events_ = std::make_unique<GameEvents>(*rig_.state);
    ASSERT_TRUE(events_->Load().ok());
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_});
  std::unique_ptr<GameEvents> events_ = std::make_unique<GameEvents>(*rig_.state);
};

TEST_F(GameEventsTest, AnEventThatIsReportedAgainIsKeptOnceAndAfterARestartToo) {
  Report(1, 2);
  EXPECT_EQ(events_->StoredUpTo(instance_), 2U);
  EXPECT_TRUE(alpha_.desired_changed) << "the regions need not keep them";
  Report(1, 3);
  RestartControlPlane();
  EXPECT_EQ(events_->StoredUpTo(instance_), 3U);
  Report(2, 4);
  EXPECT_THAT(After(), ElementsAre("1 e1", "2 e2", "3 e3", "4 e4"));
  EXPECT_THAT(After(3), ElementsAre("4 e4"));
  EXPECT_THAT(After(4), IsEmpty());
  EXPECT_EQ(instance_.published_events, 4U);
}

TEST_F(GameEventsTest, WhatCannotBeStoredIsTakenWithTheNextReport) {
  rig_.store.FailNext(1);
  Report(1, 2);
  EXPECT_THAT(After(), IsEmpty());
  EXPECT_EQ(events_->StoredUpTo(instance_), 0U) << "the regions keep them";
  Report(1, 3);
  EXPECT_THAT(After(), ElementsAre("1 e1", "2 e2", "3 e3"));
}

TEST_F(GameEventsTest, ValuesSourceAndWhatWasMissedAreGivenToTheBackend) {
  v1::WorkerReport report;
  v1::ReportedGameEvent& reported = *report.add_game_events();
  reported.set_number(9);
  reported.set_missed(8);
  reported.set_tick(60);
  reported.set_body(5);
  reported.set_name("go\xff");
  const auto values = *game::EncodeFields({{"by", PlayerNumber(3)}, {"raw", std::string("\xff")}, {"to", BodyId(7)}});
  reported.set_values(values.data(), values.size());
  events_->Take(instance_, report, rig_.now);
  const v1::PublishedEvent event = events_->After(instance_, 0, 1)->front();
  EXPECT_EQ(event.number(), 1U) << "a cursor has no gaps";
  EXPECT_EQ(event.missed(), 8U);
  EXPECT_EQ(event.body(), 5U);
  EXPECT_EQ(event.name(), "go?");
  ASSERT_EQ(event.values_size(), 3);
  EXPECT_EQ(event.values(0).player(), 3U);
  EXPECT_EQ(event.values(1).bytes(), "\xff");
  EXPECT_EQ(event.values(2).body(), 7U);
}

TEST_F(GameEventsTest, ACursorThatIsTooOldOrWasNeverGivenSaysSo) {
  for (std::uint64_t first = 1; first <= kMaxPublishedKept + 5; first += 1000) {
    Report(first, std::min<std::uint64_t>(first + 999, kMaxPublishedKept + 5));
  }
  EXPECT_THAT(events_->After(instance_, 3, 1).status().ToString(),
              HasSubstr("OUT_OF_RANGE: after: events 4 to 5 of inst-1 are not kept any more, the oldest is 6"));
  EXPECT_EQ(events_->After(instance_, 5, 1)->front().number(), 6U);
  EXPECT_EQ(events_->After(instance_, 0, 1)->front().number(), 6U) << "0: all that are kept";
  EXPECT_THAT(After(kMaxPublishedKept + 6), ElementsAre(HasSubstr("there is no event 10006 of inst-1")));
  EXPECT_EQ(rig_.store.List("event/1/")->size(), kMaxPublishedKept);
}

TEST_F(GameEventsTest, ARestoreSaysWhichEventsAreTrueStillAndNoneOfThoseComesTwice) {
  Report(1, 5);
  Restore(30);
  events_->NoteRestore(instance_, rig_.now);
  EXPECT_THAT(After(5), ElementsAre("restored to 30, valid up to 3"));
  Report(2, 3, "again");  // the checkpoint was made before the regions heard that they are stored
  EXPECT_THAT(After(6), IsEmpty());
  EXPECT_EQ(events_->StoredUpTo(instance_), 3U);
  Report(2, 5, "new");
  EXPECT_THAT(After(6), ElementsAre("7 new4", "8 new5"));
}

TEST_F(GameEventsTest, ARestoreThatTheControlPlaneDiedInIsSaidByTheNextOne) {
  Report(1, 5);
  records::Instance next = instance_.record;
  next.mutable_restored()->set_tick(20);
  next.mutable_restored()->set_last_incarnation(7);
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  RestartControlPlane();
  Report(1, 3, "new");
  EXPECT_THAT(After(5), ElementsAre("restored to 20, valid up to 2", "7 new3"));
}

TEST_F(GameEventsTest, OfASecondRestoreWithoutAReportBetweenNothingComesTwice) {
  Report(1, 5);
  Restore(40);
  Restore(20);
  EXPECT_THAT(After(5), ElementsAre("restored to 40, valid up to 4", "restored to 20, valid up to 2"));
  Report(1, 3, "new");
  EXPECT_THAT(After(7), ElementsAre("8 new3"));
}

TEST_F(GameEventsTest, AWorldThatBeganWithACheckpointHasNothingToForget) {
  Restore(30);
  Report(4, 4);
  EXPECT_THAT(After(), ElementsAre("1 e4"));
}

TEST_F(GameEventsTest, WhatIsForgottenIsRemovedFromTheStore) {
  Report(1, 5);
  events_->Forget(instance_.number);
  EXPECT_THAT(*rig_.store.List("event"), IsEmpty());
}

TEST_F(GameEventsTest, AWorldWithoutAGameHasNone) {
  records::Instance next = instance_.record;
  next.clear_game_hash();
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  Report(1, 1);
  EXPECT_THAT(After(), IsEmpty());
}

TEST(GameFieldsTest, WhatIsWrongNamesTheField) {
  const auto fault = [](const auto& make) {
    GameFieldList fields;
    make(fields);
    return EncodeGameFields(fields).status().ToString();
  };
  const auto named = [](GameFieldList& fields, const char* name) -> v1::GameField& {
    fields.Add()->set_name(name);
    return fields[fields.size() - 1];
  };
  EXPECT_THAT(fault([&](GameFieldList& f) { named(f, "a"); }), HasSubstr("values[0]: has no value"));
  EXPECT_THAT(fault([&](GameFieldList& f) { named(f, "").set_flag(true); }), HasSubstr("values[0].name: is empty"));
  EXPECT_THAT(fault([&](GameFieldList& f) { named(f, "a").set_real(NAN); }), HasSubstr("values.a: is not finite"));
  EXPECT_THAT(fault([&](GameFieldList& f) { named(f, "a").mutable_vector()->set_y(INFINITY); }),
              HasSubstr("values.a: is not finite"));
  EXPECT_THAT(fault([&](GameFieldList& f) { named(f, "a").set_flag(true), named(f, "a").set_flag(true); }),
              HasSubstr("values.a: is there twice"));
  EXPECT_THAT(fault([&](GameFieldList& f) { named(f, "a").set_text(std::string(600, 'x')); }),
              HasSubstr("INVALID_ARGUMENT: values"));
}

}  // namespace
}  // namespace tessera::control
