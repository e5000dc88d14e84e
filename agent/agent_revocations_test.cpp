// The list of revocations at an agent, the real program: kept on its disk, said to be kept only then, and given back.
#include <csignal>
#include <filesystem>

#include "agent/testing/agent_fixture.h"
#include "gmock/gmock.h"
#include "net/signing_key.h"
#include "trust/revocation_list.h"

namespace tessera::agent {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class AgentRevocationsTest : public AgentFixture {
 protected:
  AgentRevocationsTest() {
    control_.Change([this](ControlRecord& r) {
      r.revocations_key.assign(key_.verification_key().begin(), key_.verification_key().end());
    });
  }
  static v1::SignedRevocations List(std::uint64_t number, const net::SigningKey& key) {
    v1::Revocations content;
    content.set_number(number);
    return *trust::SignRevocations(content, key);
  }
  // The agent that is attached gets it with its next orders.
  void Send(const v1::SignedRevocations& list) {
    control_.Change([&](ControlRecord& r) { r.revocations = list; });
    control_.SetDesired({});
  }
  bool WaitForKept(std::uint64_t number) {
    return control_.WaitUntil(
        [=](const ControlRecord& r) { return !r.kept_revocations.empty() && r.kept_revocations.back() == number; });
  }
  // The agent has acted on all that was sent to it.
  bool WaitForOrders(std::uint64_t revision) {
    return control_.WaitUntil([=](const ControlRecord& r) { return r.acted_on == revision; });
  }

  const net::SigningKey key_ = net::SigningKey::Make();
};

TEST_F(AgentRevocationsTest, TheNewestIsKeptSaidToBeKeptAndGivenBackByTheNextAgent) {
  const auto first = StartAdmitted();
  EXPECT_EQ(control_.record().hellos.at(0).revocations_number(), 0U);
  Send(List(3, key_));
  ASSERT_TRUE(WaitForKept(3));
  Send(List(5, key_));
  ASSERT_TRUE(WaitForKept(5));
  first->Signal(SIGTERM);
  EXPECT_EQ(first->Wait(), Exited(0));
  control_.Change([](ControlRecord& r) {
    r.revocations.reset();
    r.report_revocations = true;
  });
  const auto second = StartAgent();
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return !r.reported_revocations.empty(); }));
  EXPECT_EQ(control_.record().hellos.at(1).revocations_number(), 5U);
  EXPECT_EQ(control_.record().reported_revocations.at(0).SerializeAsString(), List(5, key_).SerializeAsString());
}

TEST_F(AgentRevocationsTest, AnOlderOneAndOneOfAnotherKeyAreRefusedAndNotSaidToBeKept) {
  const auto agent = StartAdmitted();
  Send(List(5, key_));
  ASSERT_TRUE(WaitForKept(5));
  Send(List(4, key_));
  Send(List(9, net::SigningKey::Make()));
  ASSERT_TRUE(WaitForOrders(3));
  EXPECT_THAT(control_.record().kept_revocations, ElementsAre(5U));
  EXPECT_THAT(agent->Output(), HasSubstr("4 is older than 5"));
  EXPECT_THAT(agent->Output(), HasSubstr("is not of the cluster's key"));
}

TEST_F(AgentRevocationsTest, AListThatTheDiskDoesNotTakeIsNotSaidToBeKeptUntilItDoes) {
  const auto agent = StartAdmitted();
  const std::string path = state_dir_ + "/revocations.json";
  std::filesystem::create_directories(path + "/in_the_way");
  Send(List(3, key_));
  ASSERT_TRUE(WaitForOrders(1));
  EXPECT_THAT(control_.record().kept_revocations, IsEmpty());
  EXPECT_THAT(agent->Output(), HasSubstr("revocations not kept"));
  std::filesystem::remove_all(path);
  EXPECT_TRUE(WaitForKept(3)) << "it is tried again by itself";
}

TEST_F(AgentRevocationsTest, TheClustersFirstKeyStays) {
  const auto first = StartAdmitted();
  Send(List(3, key_));
  ASSERT_TRUE(WaitForKept(3));
  first->Signal(SIGTERM);
  EXPECT_EQ(first->Wait(), Exited(0));
  const net::SigningKey other = net::SigningKey::Make();
  control_.Change([&](ControlRecord& r) {
    r.revocations_key.assign(other.verification_key().begin(), other.verification_key().end());
    r.revocations.reset();
  });
  const auto second = StartAgent();
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.hellos.size() == 2 && r.streams == 1; }));
  Send(List(9, other));
  ASSERT_TRUE(WaitForOrders(2));
  EXPECT_THAT(control_.record().kept_revocations, ElementsAre(3U));
  EXPECT_THAT(second->Output(), HasSubstr("signs revocations with another key"));
}

}  // namespace
}  // namespace tessera::agent
