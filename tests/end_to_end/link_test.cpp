// Hosts with networks of their own, and links that break. A program of its own: it leaves this machine's network before
// anything else.
#include "host/process.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

class LinkTest : public WorldTest {
 protected:
  static void SetUpTestSuite() {
    const absl::Status own = local::EnterOwnNetwork();
    auto network = own.ok() ? local::HostNetwork::Create(2) : absl::StatusOr<std::unique_ptr<local::HostNetwork>>(own);
    why_not_ = network.status();
    if (network.ok()) network_ = *std::move(network);
  }
  static void TearDownTestSuite() { network_.reset(); }
  void SetUp() override {
    if (network_ == nullptr) GTEST_SKIP() << "no network namespaces here: " << why_not_;
    Start({.scene = "", .regions = 4, .bots = kBots, .hosts = 2, .capacity = 8, .network = network_.get()});
    ASSERT_TRUE(PlayUntilProtected());
    ASSERT_TRUE(PlayOn(1));
  }

  static inline std::unique_ptr<local::HostNetwork> network_;
  static inline absl::Status why_not_;
};

// Its workers stand still before others take their place, and end when they hear of it.
TEST_F(LinkTest, AHostThatIsCutOffIsCarriedOnByTheOtherAndItsWorkersEndWhenItIsBack) {
  std::vector<std::int64_t> cut_off;
  const v1::Instance before = run_->Latest();
  for (const v1::RegionStatus& status : before.region_status()) {
    if (status.host() == "local-1") cut_off.push_back(status.report().identity().pid());
  }
  ASSERT_EQ(cut_off.size(), 2u);
  ASSERT_TRUE(network_->Cut(0).ok());
  ASSERT_TRUE(PlayUntilFailedOver());
  EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
  for (const std::int64_t pid : cut_off) EXPECT_TRUE(host::IsAlive(pid));
  ASSERT_TRUE(network_->Mend(0).ok());
  ASSERT_TRUE(PlayUntil(
      "they end", [&] { return std::ranges::none_of(cut_off, [](std::int64_t pid) { return host::IsAlive(pid); }); }));
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

// Too short to be taken for a death: all go on as they were.
TEST_F(LinkTest, AShortCutCostsTimeAndNothingElse) {
  const auto pids = Pids();
  const std::uint64_t tick = run_->bots()[0]->client().tick().value();
  ASSERT_TRUE(network_->Cut(0).ok());
  ASSERT_TRUE(network_->Mend(0).ok());
  ASSERT_TRUE(PlayUntil("the world moves", [&] { return run_->bots()[0]->client().tick().value() > tick + 120; }));
  ASSERT_TRUE(PlayOn(2));
  EXPECT_EQ(run_->Latest().failovers(), 0u);
  EXPECT_EQ(Pids(), pids);
  ExpectAllIsThere();
}

}  // namespace
}  // namespace tessera::end_to_end
