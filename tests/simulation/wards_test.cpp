#include "region_worker/wards.h"

#include <gmock/gmock.h>

#include "region_worker/link_message.h"
#include "tests/simulation/instance.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct Asked : LinkPort {
  net::PeerHandle LinkTo(RegionId) const override { return net::PeerHandle(1); }
  bool SendNow(RegionId to, std::span<const std::uint8_t> message) override {
    const auto read = ReadLinkMessage(message);
    if (read && read->kind == LinkMessageKind::kLogAgain) whom.push_back(to);
    return true;
  }
  void Outrank(RegionId, Incarnation) override {}
  void SetMapVersion(MapVersion) override {}
  std::vector<RegionId> whom;  // for the whole state
};

class WardsTest : public testing::Test {
 protected:
  const std::shared_ptr<const Scene> scene_ = simulation::Swarm(10, 1).Build();
  const region::Catalog catalog_{scene_};
  WorkerMetrics metrics_;
  Asked asked_;
  Wards wards_{asked_, catalog_, metrics_};
};

TEST_F(WardsTest, AnHeirThatHearsLateOfItsWardAsksForAllThatItMissed) {
  const std::vector<RegionId> wards = {RegionId(2)};
  wards_.Set(wards);
  EXPECT_THAT(asked_.whom, ElementsAre(RegionId(2)));
  wards_.Set(wards);
  EXPECT_THAT(asked_.whom, ElementsAre(RegionId(2)));
}

TEST_F(WardsTest, TheNextLifeOfADeadWardIsAskedOnceTheDeadIsSettled) {
  const std::vector<RegionId> wards = {RegionId(2)};
  wards_.Set(wards);
  asked_.whom.clear();
  wards_.DeclareDead(RegionId(2));
  wards_.Set(wards);
  EXPECT_THAT(asked_.whom, IsEmpty());
  wards_.Forget();
  EXPECT_THAT(asked_.whom, ElementsAre(RegionId(2)));
}

}  // namespace
}  // namespace tessera::worker
