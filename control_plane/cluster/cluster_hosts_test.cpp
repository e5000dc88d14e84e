// Hosts and their agents' admission.
#include <gmock/gmock.h>

#include <cstdint>
#include <limits>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

v1::AddHostRequest Add(const std::string& name) {
  v1::AddHostRequest request;
  request.set_name(name);
  return request;
}

TEST(HostTest, IsExpectedUntilItsAgentJoins) {
  ClusterHarness harness;
  ASSERT_TRUE(harness.cluster().AddHost(harness.now, Add("alpha")).ok());
  EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_EXPECTED);
  harness.AddHost("beta", 4);
  EXPECT_EQ(harness.HostState("beta"), v1::HOST_STATE_READY);
  EXPECT_EQ(harness.HostState("host-2"), v1::HOST_STATE_READY);
}

TEST(HostTest, RefusesNamesThatAreNone) {
  ClusterHarness harness;
  for (const std::string name : {"", "Alpha", "a b", "-a", "a-", "a.b", "\xc3\xa4"}) {
    const auto added = harness.cluster().AddHost(harness.now, Add(name));
    EXPECT_EQ(added.status().code(), absl::StatusCode::kInvalidArgument) << name;
    EXPECT_THAT(std::string(added.status().message()), HasSubstr("name: "));
  }
  EXPECT_FALSE(harness.cluster().AddHost(harness.now, Add(std::string(64, 'a'))).ok());
  EXPECT_TRUE(harness.cluster().AddHost(harness.now, Add(std::string(63, 'a'))).ok());
  EXPECT_EQ(harness.cluster().AddHost(harness.now, Add(std::string(63, 'a'))).status().code(),
            absl::StatusCode::kAlreadyExists);
}

// Alone with the control plane it is fine; its workers have no links to those of another machine.
TEST(HostTest, OneThatAdvertisesLoopbackIsWarnedOfOnceOthersAreElsewhere) {
  ClusterHarness harness;
  v1::AgentHello hello = ClusterHarness::Hello(4);
  hello.set_advertise_address("127.0.0.1");
  hello.set_join_token(harness.cluster().AddHost(harness.now, Add("alpha"))->join_token());
  const auto admitted = harness.cluster().HandleHello(harness.now, hello);
  ASSERT_TRUE(admitted.ok()) << admitted.status();
  const auto warnings = [&] {
    int count = 0;
    for (const LogLine& line : harness.cluster().TakeEffects().log) {
      if (line.text.find("host cannot be reached host=alpha: advertises 127.0.0.1") == std::string::npos) continue;
      EXPECT_EQ(line.severity, Severity::kWarning);
      ++count;
    }
    return count;
  };
  const auto notes = [&](int host) { return ListHosts(harness.cluster().state(), {})->hosts(host).notes(); };
  EXPECT_EQ(warnings(), 0);
  EXPECT_EQ(notes(0).size(), 0);
  harness.AddHost("beta", 4);
  EXPECT_EQ(warnings(), 1);
  ASSERT_EQ(notes(0).size(), 1);
  EXPECT_THAT(notes(0)[0], HasSubstr("--advertise-address"));
  EXPECT_EQ(notes(1).size(), 0);
  hello.clear_join_token();
  hello.set_host_id(admitted->admitted.host_id());
  hello.set_host_secret(admitted->admitted.host_secret());
  ASSERT_TRUE(harness.cluster().HandleHello(harness.now, hello).ok());
  EXPECT_EQ(warnings(), 1) << "each time that it attaches";
  hello.set_advertise_address("10.0.0.2");
  ASSERT_TRUE(harness.cluster().HandleHello(harness.now, hello).ok());
  EXPECT_EQ(warnings(), 0);
  EXPECT_EQ(notes(0).size(), 0);
}

TEST(HostTest, ADryRunMakesNothing) {
  ClusterHarness harness;
  v1::AddHostRequest request = Add("alpha");
  request.set_validate_only(true);
  const auto added = harness.cluster().AddHost(harness.now, request);
  ASSERT_TRUE(added.ok());
  EXPECT_EQ(added->join_token(), "");
  EXPECT_EQ(ListHosts(harness.cluster().state(), {})->hosts_size(), 0);
}

TEST(HostTest, ATokenAdmitsOneAgentOnce) {
  ClusterHarness harness;
  const auto added = *harness.cluster().AddHost(harness.now, Add("alpha"));
  v1::AgentHello hello = ClusterHarness::Hello(4);
  hello.set_join_token(added.join_token() + "0");
  EXPECT_EQ(harness.cluster().HandleHello(harness.now, hello).status().code(), absl::StatusCode::kUnauthenticated);
  hello.set_join_token(added.join_token());
  const auto admission = harness.cluster().HandleHello(harness.now, hello);
  ASSERT_TRUE(admission.ok());
  EXPECT_EQ(admission->admitted.host_name(), "alpha");
  v1::AgentMessage first;
  first.mutable_heartbeat();
  ASSERT_TRUE(harness.cluster().HandleAgentMessage(harness.now, admission->stream, first).ok());
  const auto again = harness.cluster().HandleHello(harness.now, hello);
  EXPECT_EQ(again.status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(std::string(again.status().message()), HasSubstr("join_token"));

  hello.clear_join_token();
  hello.set_host_id("host-1");
  hello.set_host_secret("tsh_wrong");
  EXPECT_EQ(harness.cluster().HandleHello(harness.now, hello).status().code(), absl::StatusCode::kUnauthenticated);
  hello.set_host_secret(admission->admitted.host_secret());
  harness.Restart();
  EXPECT_TRUE(harness.cluster().HandleHello(harness.now, hello).ok());
}

TEST(HostTest, StoresNoTokenAndNoSecret) {
  ClusterHarness harness;
  const auto added = *harness.cluster().AddHost(harness.now, Add("alpha"));
  const auto& agent = harness.AddHost("beta", 4);
  const auto entries = harness.store.List("");
  ASSERT_TRUE(entries.ok());
  for (const StoreEntry& entry : *entries) {
    EXPECT_EQ(entry.value.find(added.join_token()), std::string::npos) << entry.key;
    EXPECT_EQ(entry.value.find(agent.secret), std::string::npos) << entry.key;
  }
}

TEST(HostTest, RefusesMalformedHellos) {
  ClusterHarness harness;
  const auto code = [&](const v1::AgentHello& hello) {
    return harness.cluster().HandleHello(harness.now, hello).status().code();
  };
  EXPECT_EQ(code(ClusterHarness::Hello(1)), absl::StatusCode::kInvalidArgument);  // neither token nor id
  v1::AgentHello hello = ClusterHarness::Hello(1);
  hello.set_join_token("tsj_x");
  hello.set_host_id("host-1");
  EXPECT_EQ(code(hello), absl::StatusCode::kInvalidArgument);  // both
  hello.clear_host_id();
  for (const std::string address : {"", "a b", "http://x", "10.0.0.1:80"}) {
    hello.set_advertise_address(address);
    EXPECT_EQ(code(hello), absl::StatusCode::kInvalidArgument) << address;
  }
  hello.set_advertise_address("node-1.example");
  EXPECT_EQ(code(hello), absl::StatusCode::kUnauthenticated);
}

TEST(HostTest, IdsAreNeverUsedTwice) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  v1::RemoveHostRequest remove;
  remove.set_name("alpha");
  ASSERT_TRUE(harness.cluster().RemoveHost(harness.now, remove).ok());
  harness.Restart();
  EXPECT_EQ(harness.cluster().AddHost(harness.now, Add("alpha"))->host().id(), "host-2");
}

TEST(HostTest, ARemovedHostIsToldSo) {
  ClusterHarness harness;
  const auto agent = harness.AddHost("alpha", 4);
  v1::RemoveHostRequest remove;
  remove.set_name("alpha");
  harness.cluster().TakeEffects();
  ASSERT_TRUE(harness.cluster().RemoveHost(harness.now, remove).ok());
  EXPECT_EQ(harness.cluster().TakeEffects().closed.at(agent.stream).code(), absl::StatusCode::kPermissionDenied);
  v1::AgentHello hello = ClusterHarness::Hello(4);
  hello.set_host_id(agent.host_id);
  hello.set_host_secret(agent.secret);
  EXPECT_EQ(harness.cluster().HandleHello(harness.now, hello).status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(harness.cluster().RemoveHost(harness.now, remove).code(), absl::StatusCode::kNotFound);
}

TEST(HostTest, ALaterStreamReplacesAnEarlierOne) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 4);
  const StreamId first = agent.stream;
  harness.cluster().TakeEffects();
  harness.Attach(agent);
  EXPECT_EQ(harness.cluster().TakeEffects().closed.at(first).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(harness.cluster().HandleAgentMessage(harness.now, first, agent.fake.Heartbeat()).code(),
            absl::StatusCode::kAborted);
  EXPECT_TRUE(harness.cluster().HandleAgentMessage(harness.now, agent.stream, agent.fake.Heartbeat()).ok());
}

TEST(HostTest, TellsHowFarItsClockIsOffOurs) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 4);
  v1::AgentMessage message = agent.fake.Heartbeat();
  const auto clocks = [&] {
    EXPECT_TRUE(harness.cluster().HandleAgentMessage(harness.now, agent.stream, message).ok());
    return Summarise(harness.cluster().state()).clocks_ahead_s;
  };
  EXPECT_TRUE(clocks().empty()) << "an agent of an earlier release says no time";
  const std::chrono::hours off(400 * 24);
  *message.mutable_heartbeat()->mutable_time() = ToTimestamp(harness.now.unix_time - off);
  EXPECT_NEAR(clocks().at("alpha"), -std::chrono::duration<double>(off).count(), 1e-3);
  *message.mutable_heartbeat()->mutable_time() = ToTimestamp(harness.now.unix_time + off);
  EXPECT_NEAR(clocks().at("alpha"), std::chrono::duration<double>(off).count(), 1e-3);
  message.mutable_heartbeat()->mutable_time()->set_seconds(std::numeric_limits<std::int64_t>::max());
  EXPECT_GT(clocks().at("alpha"), 9e18) << "a lie is as good as any other time";
  EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_READY) << "nothing else looks at it";
  harness.cluster().HandleAgentGone(agent.stream);
  EXPECT_TRUE(Summarise(harness.cluster().state()).clocks_ahead_s.empty());
  harness.Attach(agent);
  EXPECT_TRUE(Summarise(harness.cluster().state()).clocks_ahead_s.empty()) << "its clock may have been set meanwhile";
}

TEST(HostTest, IsLostAfterSilenceAndBackWithTheNextWord) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 4);
  harness.Run(std::chrono::seconds(20));
  EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_READY);
  agent.silent = true;
  harness.Run(std::chrono::milliseconds(4500));
  EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_READY);
  harness.Run(std::chrono::milliseconds(1000));
  EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_LOST);
  agent.silent = false;
  harness.Pump();
  EXPECT_EQ(harness.HostState("alpha"), v1::HOST_STATE_READY);
}

TEST(HostTest, ADrainingHostTakesNothingUntilItIsUndone) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  v1::DrainHostRequest drain;
  drain.set_name("alpha");
  EXPECT_EQ(harness.cluster().DrainHost(drain)->host().state(), v1::HOST_STATE_DRAINING);
  harness.Restart();
  const auto refused = harness.cluster().CreateInstance(harness.now, TestPlan(1), false);
  EXPECT_EQ(refused.status().message(), "1 region needs 1 place; no host is ready");
  drain.set_undo(true);
  EXPECT_EQ(harness.cluster().DrainHost(drain)->host().state(), v1::HOST_STATE_READY);
  EXPECT_TRUE(harness.cluster().CreateInstance(harness.now, TestPlan(1), false).ok());
}

TEST(HostTest, ListsInPages) {
  ClusterHarness harness;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(harness.cluster().AddHost(harness.now, Add("h" + std::to_string(i))).ok());
  v1::ListHostsRequest request;
  request.set_page_size(2);
  std::vector<std::string> names;
  int pages = 0;
  do {
    const auto page = *ListHosts(harness.cluster().state(), request);
    for (const v1::Host& host : page.hosts()) names.push_back(host.name());
    request.set_page_token(page.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(names, (std::vector<std::string>{"h0", "h1", "h2", "h3", "h4"}));
  EXPECT_EQ(pages, 3);
  request.set_page_token("7");
  EXPECT_EQ(ListHosts(harness.cluster().state(), request).status().code(), absl::StatusCode::kInvalidArgument);
  request.set_page_token("");
  request.set_page_size(-1);
  EXPECT_EQ(ListHosts(harness.cluster().state(), request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(HostTest, AFailedWriteChangesNothing) {
  ClusterHarness harness;
  harness.store.FailNext(1);
  EXPECT_EQ(harness.cluster().AddHost(harness.now, Add("alpha")).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(ListHosts(harness.cluster().state(), {})->hosts_size(), 0);
  EXPECT_EQ(harness.cluster().AddHost(harness.now, Add("alpha"))->host().id(), "host-1");
}

}  // namespace
}  // namespace tessera::control
