#include "core/region/record_table.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>

namespace tessera::region {
namespace {

game::GameRecord Expiring(std::uint64_t tick) {
  game::GameRecord record;
  record.expires = Tick(tick);
  return record;
}

TEST(RecordTableTest, ARecordStaysWhereItIsWhileOthersComeAndGo) {
  RecordTable table;
  table.Commit(BodyId(50), {}, Expiring(9));
  const KeptRecord* const kept = table.Find(BodyId(50));
  for (std::uint64_t id = 1; id < 100; ++id) {
    if (id != 50) table.Commit(BodyId(id), {}, Expiring(id));
  }
  for (std::uint64_t id = 1; id < 100; id += 3) {
    if (id != 50) table.Release(BodyId(id));
  }
  EXPECT_EQ(table.Find(BodyId(50)), kept);
  EXPECT_EQ(kept->game, Expiring(9));
}

TEST(RecordTableTest, ListsItsRecordsByBodyWhateverCameAndWentInBetween) {
  RecordTable table;
  std::map<BodyId, game::GameRecord> expected;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const BodyId id(1 + i * 37 % 101);
    if (expected.erase(id) != 0) {
      table.Release(id);
    } else {
      table.Commit(id, {}, expected[id] = Expiring(1 + i));
    }
    table.Validate();
  }
  ASSERT_EQ(table.all().size(), expected.size());
  auto record = table.all().begin();
  for (const auto& [id, game] : expected) {
    EXPECT_EQ(record->body, id);
    EXPECT_EQ(record++->game, game);
  }
  EXPECT_EQ(record, table.all().end());
  const auto found = std::lower_bound(table.all().begin(), table.all().end(), expected.rbegin()->first,
                                      [](const KeptRecord& kept, BodyId id) { return kept.body < id; });
  EXPECT_EQ(found - table.all().begin(), static_cast<std::ptrdiff_t>(expected.size()) - 1);
}

TEST(RecordTableTest, CommitGivesWhatItReplacedAndNothingWhereItChangedNothing) {
  RecordTable table;
  EXPECT_FALSE(table.Commit(BodyId(1), {}, {}).changed) << "an empty record is none";
  const RecordTable::Replaced first = table.Commit(BodyId(1), {}, Expiring(3));
  EXPECT_TRUE(first.changed);
  EXPECT_FALSE(first.before.has_value());
  EXPECT_FALSE(table.Commit(BodyId(1), {}, Expiring(3)).changed);
  const RecordTable::Replaced second = table.Commit(BodyId(1), {}, Expiring(4));
  ASSERT_TRUE(second.before.has_value());
  EXPECT_EQ(second.before->game, Expiring(3));
  EXPECT_EQ(table.Find(BodyId(1))->game, Expiring(4));
}

}  // namespace
}  // namespace tessera::region
