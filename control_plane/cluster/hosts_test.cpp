// Hosts on records and entries alone.
#include "control_plane/cluster/hosts.h"

#include <gtest/gtest.h>

#include <limits>

#include "control_plane/cluster/free_hosts.h"
#include "control_plane/host_serial.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;

class HostsTest : public ::testing::Test {
 protected:
  std::string Random(std::size_t n) { return std::string(n, static_cast<char>('a' + calls_++)); }
  v1::AddHostResponse Add(const std::string& name) {
    v1::AddHostRequest request;
    request.set_name(name);
    return *hosts_.Add(request, rig_.now);
  }
  static v1::AgentHello Hello(const std::string& join_token) {
    v1::AgentHello hello;
    hello.set_advertise_address("10.0.0.1");
    hello.set_join_token(join_token);
    hello.mutable_resources()->set_region_capacity(4);
    return hello;
  }

  StateRig rig_;
  int calls_ = 0;
  Hosts hosts_{*rig_.state, rig_.settings, [this](std::size_t n) { return Random(n); }};
};

TEST_F(HostsTest, ATokenAdmitsOnceAndThenTheSecretDoes) {
  v1::AgentHello hello = Hello(Add("alpha").join_token());
  const auto first = hosts_.Admit(hello, rig_.now);
  ASSERT_TRUE(first.ok()) << first.status();
  hosts_.NoteSecretCame(*rig_.state->HostOf(first->stream));
  EXPECT_EQ(hosts_.Admit(hello, rig_.now).status().code(), absl::StatusCode::kUnauthenticated);
  hello.clear_join_token();
  hello.set_host_id(first->admitted.host_id());
  hello.set_host_secret(first->admitted.host_secret());
  const auto second = hosts_.Admit(hello, rig_.now);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(rig_.state->HostOf(first->stream), nullptr);
  EXPECT_EQ(rig_.state->HostOf(second->stream)->record.name(), "alpha");
  EXPECT_TRUE(CheckHostSecret(*rig_.state, "host-1", first->admitted.host_secret()).ok());
  EXPECT_FALSE(CheckHostSecret(*rig_.state, "host-1", "guess").ok());
}

// Else it would be refused for good, and an operator had to add it anew.
TEST_F(HostsTest, AnAgentWhoseAnswerWasLostIsAdmittedByItsTokenAgain) {
  const std::string token = Add("alpha").join_token();
  v1::AgentHello hello = Hello(token);
  hello.set_certificate_request("request");
  const auto lost = hosts_.Admit(hello, rig_.now), came = hosts_.Admit(hello, rig_.now);
  ASSERT_TRUE(lost.ok() && came.ok()) << lost.status() << came.status();
  EXPECT_EQ(rig_.state->HostOf(lost->stream), nullptr);
  EXPECT_FALSE(CheckHostSecret(*rig_.state, "host-1", lost->admitted.host_secret()).ok());
  EXPECT_FALSE(CheckHostCertificate(*rig_.state, "host-1", lost->serial).ok());

  hello.clear_join_token();
  hello.clear_certificate_request();
  hello.set_host_id("host-1");
  hello.set_host_secret(came->admitted.host_secret());
  ASSERT_TRUE(hosts_.Admit(hello, rig_.now, came->serial).ok());
  EXPECT_EQ(hosts_.Admit(Hello(token), rig_.now).status().message(), "hello.join_token: unknown, or used already");
}

TEST_F(HostsTest, TheNextCertificateIsAskedForAndTheEarlierOneEndsOnceItIsShown) {
  v1::AgentHello hello = Hello(Add("alpha").join_token());
  hello.set_certificate_request("request");
  const auto joined = hosts_.Admit(hello, rig_.now);
  ASSERT_TRUE(joined.ok()) << joined.status();
  const std::string first = joined->serial;
  hello.clear_join_token();
  hello.set_host_id("host-1");
  hello.set_host_secret(joined->admitted.host_secret());
  const auto asked = hosts_.Admit(hello, rig_.now, first), again = hosts_.Admit(hello, rig_.now, first);
  ASSERT_TRUE(again.ok()) << again.status();
  const std::string second = again->serial;
  EXPECT_EQ(second, NextHostSerial(first));
  EXPECT_EQ(asked->serial, second) << "the answer may be lost, and then it is asked for again";
  EXPECT_TRUE(CheckHostCertificate(*rig_.state, "host-1", first).ok());

  hello.clear_certificate_request();
  const auto shown = hosts_.Admit(hello, rig_.now, second);
  ASSERT_TRUE(shown.ok()) << shown.status();
  EXPECT_EQ(shown->serial, "");
  EXPECT_TRUE(CheckHostCertificate(*rig_.state, "host-1", second).ok());
  EXPECT_EQ(CheckHostCertificate(*rig_.state, "host-1", first).code(), absl::StatusCode::kUnauthenticated);
  hello.set_certificate_request("request");
  EXPECT_EQ(hosts_.Admit(hello, rig_.now, first).status().code(), absl::StatusCode::kUnauthenticated);
}

// The store is of an earlier time than the host's certificate.
TEST_F(HostsTest, AStoreThatIsBehindKnowsALaterCertificateOfTheHost) {
  v1::AgentHello hello = Hello(Add("alpha").join_token());
  hello.set_certificate_request("request");
  const auto joined = hosts_.Admit(hello, rig_.now);
  ASSERT_TRUE(joined.ok()) << joined.status();
  hello.clear_join_token();
  hello.set_host_id("host-1");
  hello.set_host_secret(joined->admitted.host_secret());
  const std::string third = NextHostSerial(NextHostSerial(joined->serial));
  ASSERT_TRUE(hosts_.Admit(hello, rig_.now, third).ok());
  EXPECT_FALSE(CheckHostCertificate(*rig_.state, "host-1", NextHostSerial(joined->serial)).ok());
}

TEST_F(HostsTest, AnAgentOfAReleaseTooFarAwayIsRefusedByNameAndMayComeBack) {
  ControlSettings settings;
  settings.release = "0.2.0";
  Hosts hosts(*rig_.state, settings, [this](std::size_t n) { return Random(n); });
  v1::AgentHello hello = Hello(Add("alpha").join_token());
  hello.set_version("0.4.0");
  const auto refused = hosts.Admit(hello, rig_.now);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(refused.status().message().find("hello.version: an agent of release 0.4.0"), std::string::npos);
  hello.set_version("0.3.1");
  EXPECT_TRUE(hosts.Admit(hello, rig_.now).ok()) << "its token was not used up";
}

// As a message of a later release would.
TEST_F(HostsTest, AHelloWithFieldsThatNobodyKnowsYetIsTaken) {
  const v1::AgentHello hello = Hello(Add("alpha").join_token());
  std::string bytes = hello.SerializeAsString();
  bytes += std::string("\xfa\xff\x01\x05later", 9);  // field 4095, five bytes
  v1::AgentHello read;
  ASSERT_TRUE(read.ParseFromString(bytes));
  ASSERT_GT(read.ByteSizeLong(), hello.ByteSizeLong());
  EXPECT_TRUE(hosts_.Admit(read, rig_.now).ok());
}

TEST_F(HostsTest, ATokenRunsOutAndItsHostIsAddedAnew) {
  v1::AddHostRequest request;
  request.set_name("alpha");
  request.mutable_join_token_ttl()->set_seconds(120);
  const auto added = hosts_.Add(request, rig_.now);
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(FromTimestamp(added->join_token_expire_time()), rig_.now.unix_time + seconds(120));
  Now late = rig_.now;
  late.unix_time += seconds(120);
  EXPECT_EQ(hosts_.Admit(Hello(added->join_token()), late).status().message(),
            "hello.join_token: has run out; remove host alpha and add it anew");
  Now early = rig_.now;
  early.unix_time += seconds(119);
  EXPECT_TRUE(hosts_.Admit(Hello(added->join_token()), early).ok());
}

TEST_F(HostsTest, ATokenLivesADayUnlessToldAndNeverForEver) {
  const v1::AddHostResponse added = Add("alpha");
  EXPECT_EQ(FromTimestamp(added.join_token_expire_time()), rig_.now.unix_time + std::chrono::hours(24));
  for (const std::int64_t wrong : {std::int64_t{-1}, std::int64_t{59}, std::int64_t{30 * 24 * 3600 + 1},
                                   std::numeric_limits<std::int64_t>::max()}) {
    v1::AddHostRequest request;
    request.set_name("beta");
    request.mutable_join_token_ttl()->set_seconds(wrong);
    const auto refused = hosts_.Add(request, rig_.now);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument) << wrong;
  }
}

TEST_F(HostsTest, WhatIsTooLongIsRefusedByNameBeforeAnythingIsHashed) {
  const std::string token = Add("alpha").join_token();
  const auto refusal = [&](auto change) {
    v1::AgentHello hello = Hello(token);
    change(hello);
    return hosts_.Admit(hello, rig_.now).status();
  };
  using H = v1::AgentHello;
  const std::string long_one(1 << 20, 'x');
  const auto says = [](const std::string& field, int most) {
    return absl::InvalidArgumentError("hello." + field + ": has 1048576 bytes, at most " + std::to_string(most));
  };
  EXPECT_EQ(refusal([&](H& hello) { hello.set_join_token(long_one); }), says("join_token", 256));
  EXPECT_EQ(refusal([&](H& hello) { hello.set_host_id(long_one); }), says("host_id", 63));
  EXPECT_EQ(refusal([&](H& hello) { hello.set_host_secret(long_one); }), says("host_secret", 256));
  EXPECT_EQ(refusal([&](H& hello) { hello.set_advertise_address(long_one); }), says("advertise_address", 253));
  EXPECT_EQ(refusal([&](H& hello) { hello.set_metrics_address(long_one); }), says("metrics_address", 253));
  EXPECT_EQ(refusal([&](H& hello) { hello.set_version(long_one); }), says("version", 128));
  EXPECT_EQ(refusal([&](H& hello) { hello.set_boot_id(long_one); }), says("boot_id", 128));
  EXPECT_EQ(refusal([&](H& hello) { hello.set_certificate_request(long_one); }), says("certificate_request", 4096));
  // It would match, and is not looked at.
  EXPECT_FALSE(SecretMatches(long_one, HashSecret(long_one)));
  EXPECT_FALSE(SecretMatches("", ""));
  EXPECT_TRUE(hosts_.Admit(Hello(token), rig_.now).ok()) << "the token still stands";
}

TEST_F(HostsTest, ATokenFindsItsHostAmongMany) {
  std::vector<std::string> tokens;
  for (const char* name : {"alpha", "beta", "gamma"}) tokens.push_back(Add(name).join_token());
  const auto admitted = hosts_.Admit(Hello(tokens[1]), rig_.now);
  ASSERT_TRUE(admitted.ok()) << admitted.status();
  EXPECT_EQ(admitted->admitted.host_name(), "beta");
  hosts_.NoteSecretCame(*rig_.state->HostOf(admitted->stream));
  EXPECT_EQ(hosts_.Admit(Hello(tokens[1]), rig_.now).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(HostsTest, ARemovedHostIsRefusedAndItsStreamClosed) {
  v1::AgentHello hello = Hello(Add("alpha").join_token());
  const auto admission = hosts_.Admit(hello, rig_.now);
  v1::RemoveHostRequest remove;
  remove.set_name("alpha");
  InstanceNumbers touched;
  const auto found = hosts_.FindRemovable(remove);
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_TRUE(hosts_.Remove(**found, touched).ok());
  EXPECT_TRUE(touched.empty());
  EXPECT_EQ(rig_.state->effects().closed.at(admission->stream).code(), absl::StatusCode::kPermissionDenied);
  hello.clear_join_token();
  hello.set_host_id("host-1");
  EXPECT_EQ(hosts_.Admit(hello, rig_.now).status().code(), absl::StatusCode::kPermissionDenied);
}

TEST_F(HostsTest, IsLostAfterSilenceButNotForOurOwnPause) {
  HostEntry& alpha = rig_.AddHost("alpha");
  EXPECT_EQ(hosts_.OwnPause(rig_.now), Steady(0));
  rig_.now.steady += rig_.settings.lost_after + seconds(1);
  EXPECT_GT(hosts_.OwnPause(rig_.now), Steady(0));
  EXPECT_FALSE(hosts_.Lost(alpha, rig_.now)) << "it was we who stood still";
  for (int i = 0; i < 51; ++i) {
    rig_.now.steady += rig_.settings.lost_after / 50;
    EXPECT_EQ(hosts_.OwnPause(rig_.now), Steady(0));
  }
  EXPECT_TRUE(hosts_.Lost(alpha, rig_.now));
  EXPECT_FALSE(hosts_.Lost(alpha, rig_.now)) << "said once";
  EXPECT_EQ(StateOf(alpha), v1::HOST_STATE_LOST);
  EXPECT_TRUE(hosts_.Heard(alpha, rig_.now));
  EXPECT_EQ(StateOf(alpha), v1::HOST_STATE_READY);
}

TEST_F(HostsTest, RegionsArePlacedOnHeardHostsWhileThoseHaveRoom) {
  HostEntry &alpha = rig_.AddHost("alpha", 4), &beta = rig_.AddHost("beta", 4);
  rig_.AddRunning({&alpha, &alpha});
  beta.last_heard = rig_.now.steady - seconds(2);
  const auto free = FreeHosts(*rig_.state, {.threads = 1}, nullptr);
  ASSERT_EQ(free.size(), 2U);
  EXPECT_EQ(free[0].free, 2U);
  EXPECT_EQ(HeardHosts(*rig_.state, {.threads = 1}, nullptr, seconds(1), rig_.now).size(), 1U);
  const auto places = [&](std::uint32_t regions) {
    return PlaceAnew(*rig_.state, *MakeGridMap({0, 0, 100, 100}, regions), {.threads = 1}, nullptr, seconds(1),
                     rig_.now);
  };
  const auto few = places(2);
  for (const PlacedRegion& placed : few->regions) EXPECT_EQ(placed.host_id, alpha.record.id());
  EXPECT_EQ(places(6)->regions.size(), 6U) << "beta may only be busy";
  EXPECT_EQ(places(7).status().code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(HostsTest, NativeGamesComeWithTheHelloAndLaterAndAreStored) {
  v1::AddHostRequest add;
  add.set_name("alpha");
  v1::AgentHello hello;
  hello.set_join_token(hosts_.Add(add, rig_.now)->join_token());
  hello.set_advertise_address("10.0.0.1");
  v1::GameModule& module = *hello.mutable_game_modules()->add_modules();
  module.set_name("arena");
  module.set_hash("feed");
  EXPECT_EQ(hosts_.Admit(hello, rig_.now).status().message(), "hello.game_modules.hash: must be 64 hexadecimal digits");
  module.set_hash(std::string(64, 'a'));
  const auto admission = hosts_.Admit(hello, rig_.now);
  ASSERT_TRUE(admission.ok()) << admission.status();
  HostEntry& host = *rig_.state->HostOf(admission->stream);
  ASSERT_EQ(ViewOf(host).game_modules_size(), 1);
  EXPECT_EQ(ViewOf(host).game_modules(0).name(), "arena");
  ASSERT_TRUE(hosts_.NoteModules(host, {}).ok());
  EXPECT_EQ(ViewOf(host).game_modules_size(), 0);
  rig_.store.FailNext(1);
  EXPECT_FALSE(hosts_.NoteModules(host, hello.game_modules()).ok());
  EXPECT_EQ(ViewOf(host).game_modules_size(), 0) << "memory follows the store";
}

TEST_F(HostsTest, EachThreadOfARegionTakesAPlace) {
  HostEntry& alpha = rig_.AddHost("alpha", 8);
  rig_.AddRunning({&alpha, &alpha}).record.set_region_threads(2);
  EXPECT_EQ(FreeHosts(*rig_.state, {.threads = 1}, nullptr)[0].free, 4U);
  EXPECT_EQ(FreeHosts(*rig_.state, {.threads = 2}, nullptr)[0].free, 2U);
  EXPECT_EQ(FreeHosts(*rig_.state, {.threads = 3}, nullptr)[0].free, 1U);
  EXPECT_EQ(FreeHosts(*rig_.state, {.threads = 5}, nullptr)[0].free, 0U);
}

}  // namespace
}  // namespace tessera::control
