#include "core/region/inbox.h"

#include <gtest/gtest.h>

namespace tessera::region {
namespace {

std::shared_ptr<const Scene> EmptyScene() { return std::make_shared<const Scene>(); }

std::vector<std::uint8_t> FrameOf(RegionId sender, MapVersion map, MapVersion committed) {
  Frame frame;
  frame.tick = Tick(9);
  frame.sender = sender;
  frame.map_version = map;
  frame.committed_version = committed;
  return Encode(frame, {});
}

// A newcomer goes by the map that it is to join before anybody has committed it.
TEST(InboxTest, FramesByTheNextMapCommitItOnlyIfTheySaySo) {
  const Catalog catalog(EmptyScene());
  const RegionId self(1), other(2), newcomer(3);
  Inbox inbox(self, std::vector{other}, MapVersion(4), catalog);
  inbox.Expect(MapVersion(5), std::vector{other, newcomer});
  const Frame* taken = nullptr;
  ASSERT_TRUE(inbox.Put(newcomer, FrameOf(newcomer, MapVersion(5), MapVersion()), Tick(3), &taken).ok());
  EXPECT_EQ(taken, nullptr);
  EXPECT_EQ(inbox.newest_commit(), MapVersion());
  ASSERT_TRUE(inbox.Put(other, FrameOf(other, MapVersion(5), MapVersion(5)), Tick(3), &taken).ok());
  EXPECT_EQ(inbox.newest_commit(), MapVersion(5));
}

}  // namespace
}  // namespace tessera::region
