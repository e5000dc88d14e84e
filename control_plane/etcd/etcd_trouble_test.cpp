// Etcd that is of no use to a control plane: what the log says, and what it says to do.
#include "control_plane/etcd/etcd_trouble.h"

#include <gmock/gmock.h>

#include "control_plane/etcd/etcd_client.h"
#include "control_plane/testing/free_address.h"
#include "control_plane/testing/real_etcd.h"

namespace tessera::control {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;

const absl::Status kAway = absl::UnavailableError("etcd: connection refused");

TEST(EtcdTroubleTest, WhatStaysIsAnErrorOnceAndThatItIsOverIsSaid) {
  EtcdTrouble trouble(5s);
  EtcdTrouble::Clock::time_point now{};
  auto line = trouble.Note(kAway, now);
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(line->level, spdlog::level::warn);
  EXPECT_EQ(line->text, "election not won error=\"etcd: connection refused\"");
  EXPECT_FALSE(trouble.Note(kAway, now + 4999ms).has_value()) << "once";
  line = trouble.Note(kAway, now += 5s);
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(line->level, spdlog::level::err);
  EXPECT_THAT(line->text, AllOf(HasSubstr("etcd cannot be used"), HasSubstr("start it: "),
                                HasSubstr("error=\"etcd: connection refused\"")));
  EXPECT_FALSE(trouble.Note(kAway, now += 1h).has_value());
  EXPECT_FALSE(trouble.Note(absl::DeadlineExceededError("etcd: "), now).has_value()) << "its words change, it does not";

  line = trouble.Note(absl::OkStatus(), now);
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(line->level, spdlog::level::info);
  EXPECT_FALSE(trouble.Note(absl::OkStatus(), now).has_value());
  EXPECT_EQ(trouble.Note(kAway, now)->level, spdlog::level::warn) << "it is counted anew";
  EXPECT_FALSE(trouble.Note(kAway, now + 4s).has_value());
}

TEST(EtcdTroubleTest, WhoIsSlowerThanAnotherHasNoTrouble) {
  EtcdTrouble trouble(5s);
  const absl::Status slower = absl::AbortedError("another control plane was faster");
  const EtcdTrouble::Clock::time_point begin{};
  EXPECT_EQ(trouble.Note(slower, begin)->level, spdlog::level::warn);
  EXPECT_FALSE(trouble.Note(slower, begin + 1h).has_value());
}

class EtcdRemedyRealTest : public ::testing::Test {
 protected:
  // Why a read fails, as the election would see it when the first attempts are over.
  static absl::Status Fault(const EtcdAddress& address, const EtcdCredentials& credentials) {
    const auto client = EtcdClient::Make(address, credentials);
    EXPECT_TRUE(client.ok()) << client.status();
    etcdserverpb::RangeRequest request;
    request.set_key("x");
    absl::Status last;
    for (int i = 0; i < 3; ++i) last = (*client)->Range(request, 1s).status();
    EXPECT_FALSE(last.ok());
    return last;
  }
};

TEST_F(EtcdRemedyRealTest, ACertificateThatEitherSideRefusesIsNamed) {
  const RealEtcd etcd(RealEtcd::Kind::kTls), other(RealEtcd::Kind::kTls);
  const EtcdCredentials ours = etcd.credentials(), others = other.credentials();
  EXPECT_TRUE(EtcdClient::Make(etcd.address("x"), ours).ok());

  const absl::Status refused_by_us = Fault(etcd.address("x"), others);
  EXPECT_THAT(EtcdRemedy(refused_by_us), HasSubstr("name the authority of etcd's certificates by --store-authority"))
      << refused_by_us;
  EtcdAddress by_name = etcd.address("x");
  by_name.endpoints = {"localhost" + etcd.endpoint().substr(etcd.endpoint().find(':'))};
  const absl::Status other_name = Fault(by_name, ours);
  EXPECT_THAT(EtcdRemedy(other_name), HasSubstr("in --store an address that they are for")) << other_name;

  const absl::Status shows_none = Fault(etcd.address("x"), {.authority = ours.authority, .certificate = "", .key = ""});
  EXPECT_THAT(EtcdRemedy(shows_none), HasSubstr("by --store-certificate and --store-key")) << shows_none;
  const absl::Status shows_anothers =
      Fault(etcd.address("x"), {.authority = ours.authority, .certificate = others.certificate, .key = others.key});
  EXPECT_THAT(EtcdRemedy(shows_anothers), HasSubstr("by --store-certificate and --store-key")) << shows_anothers;
  const absl::Status no_tls = Fault(etcd.address("x"), {});
  EXPECT_THAT(EtcdRemedy(no_tls), HasSubstr("only one side speaks TLS, which --store-authority turns on")) << no_tls;
}

TEST_F(EtcdRemedyRealTest, TlsToOneThatSpeaksNoneIsNamed) {
  const RealEtcd tls(RealEtcd::Kind::kTls);
  const absl::Status fault = Fault(RealEtcd::Shared().address("x"), tls.credentials());
  EXPECT_THAT(EtcdRemedy(fault), HasSubstr("only one side speaks TLS, which --store-authority turns on")) << fault;
}

TEST_F(EtcdRemedyRealTest, WithoutAQuorumOrAnEtcdItIsToBeStarted) {
  const RealEtcd alone(RealEtcd::Kind::kAlone);
  const absl::Status no_quorum = Fault(alone.address("x"), {});
  EXPECT_THAT(EtcdRemedy(no_quorum), HasSubstr("more than half of its members have to run")) << no_quorum;
  const absl::Status nobody = Fault({.endpoints = {FreeLoopbackAddress()}, .prefix = "x", .is_local = true}, {});
  EXPECT_THAT(EtcdRemedy(nobody), HasSubstr("start it: ")) << nobody;
}

}  // namespace
}  // namespace tessera::control
