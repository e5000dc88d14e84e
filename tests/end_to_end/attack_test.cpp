// Attacks on a cluster of real processes, each of which must be refused, leave the control plane small, and keep nobody
// from their work. docs/security.md says for each kind of attacker which tests these are.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "host/temporary_folder.h"
#include "local_cluster/local_cluster.h"
#include "tests/support/attacks.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

// An attack may cost the control plane so much memory, also for a moment, MB.
constexpr double kMostGrowth_mb = 64;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kAttackTestSanitized = true;  // freed memory is kept back
#else
constexpr bool kAttackTestSanitized = false;
#endif

class AttackTest : public testing::Test {
 protected:
  void SetUp() override {
    cluster_ = std::make_unique<local::LocalCluster>(local::LocalClusterOptions{
        .state_dir = folder_.path(), .listen = "127.0.0.1:0", .players_listen = "127.0.0.1:0", .capacity = 4});
    const support::RunResult authority = Tessera({"cluster", "authority"});
    ASSERT_EQ(authority.exit_code, 0) << authority.err;
    const std::string fingerprint = "#" + authority.out.substr(0, authority.out.find('\n'));
    target_ = {.socket = cluster_->control_address(),
               .operators = cluster_->operators_address() + fingerprint,
               .players = cluster_->players_address() + fingerprint};
  }
  support::RunResult Tessera(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--control", cluster_->control_address()});
    return support::RunProgram("tessera", arguments, std::chrono::seconds(100));
  }
  void CreateWorld() const {
    const support::RunResult made = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies",
                                             "20", "--regions", "2", "--guests", "on", "--wait"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  // The memory of the control plane now; its highest is counted from here on.
  double Megabytes() const {
    EXPECT_TRUE(support::ForgetHighest(cluster_->control().pid()));
    return support::ResidentMegabytes(cluster_->control().pid());
  }
  // Nothing got through, the control plane did not grow meanwhile, and answers.
  void ExpectRefused(const support::Outcome& outcome, double memory_before_mb) const {
    EXPECT_GT(outcome.tries, 0);
    for (const std::string& line : outcome.through) ADD_FAILURE() << "got through: " << line;
    const double growth_mb = support::HighestMegabytes(cluster_->control().pid()) - memory_before_mb;
    std::printf("%d tries, %.1f MB more at the highest\n", outcome.tries, growth_mb);
    if (!kAttackTestSanitized) {
      EXPECT_LE(growth_mb, kMostGrowth_mb);
    }
    EXPECT_GE(support::OperatorsCallSeconds(target_), 0) << "no operator is answered";
    EXPECT_EQ(cluster_->WaitForDeath(std::chrono::milliseconds(0)), "");
  }

  const host::TemporaryFolder folder_;
  std::unique_ptr<local::LocalCluster> cluster_;
  support::Target target_;
};

TEST_F(AttackTest, AStrangerReachesNoMethodOfAnyService) {
  const double before = Megabytes();
  const support::Outcome outcome = support::CallEveryMethod(target_);
  EXPECT_GT(outcome.tries, 80);
  ExpectRefused(outcome, before);
}

TEST_F(AttackTest, PlainTextIsSpokenToNobody) {
  const double before = Megabytes();
  ExpectRefused(support::SpeakPlainText(target_), before);
}

TEST_F(AttackTest, TokensOf60MegabytesProveNothingAndLeaveNoTrace) {
  const double before = Megabytes();
  ExpectRefused(support::ShowLongTokens(target_, 8, std::size_t{60} << 20), before);
}

TEST_F(AttackTest, RequestsOf60MegabytesAreNotReadWithoutAProof) {
  const double before = Megabytes();
  ExpectRefused(support::AskAtLength(target_, 16, std::size_t{60} << 20), before);
}

TEST_F(AttackTest, AHundredStreamsThatSayNothingKeepNobodyOut) {
  const double before = Megabytes();
  ExpectRefused(support::SayNothing(target_, 100), before);
}

TEST_F(AttackTest, ConnectionsOfOneAddressAreFewAndOthersComeIn) {
  const double before = Megabytes();
  ExpectRefused(support::HoldConnections(target_, 300, 64), before);
}

TEST_F(AttackTest, ImportsOfStrangersAreNotRead) {
  const double before = Megabytes();
  ExpectRefused(support::ImportAsStranger(target_, 4, std::size_t{512} << 20), before);
}

TEST_F(AttackTest, JoinsAndLeavesInAFloodLeaveNobodyBehind) {
  CreateWorld();
  const double before = Megabytes();
  ExpectRefused(support::JoinAndLeave(target_, "inst-1", 8, 125), before);
}

TEST_F(AttackTest, OneWhoComesBackAgainAndAgainIsRefusedAfterAFew) {
  CreateWorld();
  const double before = Megabytes();
  ExpectRefused(support::ReturnAgainAndAgain(target_, "inst-1", 8, 125), before);
}

TEST_F(AttackTest, WhoHasLeftIsRefusedAtARegionsOwnPortForEverAndIsSoonNotLookedAt) {
  CreateWorld();
  const double before = Megabytes();
  ExpectRefused(support::ComeBackAtTheRegion(target_, "inst-1", 200), before);
}

TEST_F(AttackTest, StrangersWhoWatchAreToldFromGateways) {
  CreateWorld();
  const double before = Megabytes();
  ExpectRefused(support::WatchAsStranger(target_, "inst-1", 10), before);
}

TEST_F(AttackTest, WrongTicketsLetNobodyIn) {
  CreateWorld();
  const double before = Megabytes();
  const support::Outcome outcome = support::ShowWrongTickets(target_, "inst-1");
  EXPECT_GE(outcome.tries, 7);
  ExpectRefused(outcome, before);
}

TEST_F(AttackTest, TokensWithTooSmallARightChangeNothing) {
  CreateWorld();
  const double before = Megabytes();
  const support::Outcome outcome = support::ChangeEverything(target_, "inst-1");
  EXPECT_GT(outcome.tries, 80);
  ExpectRefused(outcome, before);
}

TEST_F(AttackTest, AHostWithAValidCertificateGetsNothingOfAWorldElsewhere) {
  CreateWorld();
  const double before = Megabytes();
  ExpectRefused(support::LieAsHost(target_, "inst-1"), before);
}

TEST_F(AttackTest, AHostThatNeverReadsFillsNoMemory) {
  CreateWorld();
  const double before = Megabytes();
  ExpectRefused(support::NeverRead(target_, "inst-1", 100'000), before);
}

}  // namespace
}  // namespace tessera::end_to_end
