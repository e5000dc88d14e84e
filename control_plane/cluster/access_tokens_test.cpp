#include "control_plane/cluster/access_tokens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

class AccessTokensTest : public ::testing::Test {
 protected:
  v1::CreateTokenRequest Request(const std::string& name, v1::Role role = v1::ROLE_OPERATOR) const {
    v1::CreateTokenRequest request;
    request.set_name(name);
    request.set_role(role);
    return request;
  }

  StateRig rig_;
  AccessTokens tokens_{*rig_.state, SystemRandomBytes};
};

TEST_F(AccessTokensTest, ASecretProvesItsTokenAlone) {
  const auto ada = tokens_.Create(Request("ada", v1::ROLE_VIEWER), rig_.now);
  const auto bob = tokens_.Create(Request("bob"), rig_.now);
  ASSERT_TRUE(ada.ok() && bob.ok()) << ada.status() << bob.status();
  EXPECT_TRUE(ada->secret().starts_with("tsa_"));
  EXPECT_EQ(tokens_.Find(ada->secret(), rig_.now)->role(), v1::ROLE_VIEWER);
  EXPECT_EQ(tokens_.Find(bob->secret(), rig_.now)->name(), "bob");
  EXPECT_EQ(tokens_.Find("", rig_.now), nullptr);
  EXPECT_EQ(tokens_.Find(ada->secret().substr(1), rig_.now), nullptr);
}

TEST_F(AccessTokensTest, TheStoreHoldsNoSecretAndTheNextLifeKnowsTheToken) {
  const auto made = tokens_.Create(Request("ada"), rig_.now);
  const auto stored = rig_.store.Get("token/ada");
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->value.find(made->secret()), std::string::npos);
  AccessTokens next{*rig_.state, SystemRandomBytes};
  ASSERT_TRUE(next.Load().ok());
  ASSERT_NE(next.Find(made->secret(), rig_.now), nullptr);
  v1::RevokeTokenRequest revoke;
  revoke.set_name("ada");
  EXPECT_TRUE(next.Revoke(revoke).ok());
  EXPECT_EQ(next.Find(made->secret(), rig_.now), nullptr);
  EXPECT_EQ(next.Revoke(revoke).code(), absl::StatusCode::kNotFound);
}

TEST_F(AccessTokensTest, OneThatHasRunOutProvesNothing) {
  v1::CreateTokenRequest request = Request("ada");
  request.mutable_ttl()->set_seconds(3600);
  const auto made = tokens_.Create(request, rig_.now);
  ASSERT_TRUE(made.ok()) << made.status();
  Now later = rig_.now;
  later.unix_time += 1h - 1s;
  EXPECT_NE(tokens_.Find(made->secret(), later), nullptr);
  later.unix_time += 1s;
  EXPECT_EQ(tokens_.Find(made->secret(), later), nullptr);
  EXPECT_EQ(tokens_.List().tokens_size(), 1) << "whoever looks for why a call is refused finds it";
}

TEST_F(AccessTokensTest, BadRequestsNameTheField) {
  EXPECT_THAT(std::string(tokens_.Create(Request("Ada"), rig_.now).status().message()), HasSubstr("name: "));
  EXPECT_THAT(std::string(tokens_.Create(Request("ada", v1::ROLE_UNSPECIFIED), rig_.now).status().message()),
              HasSubstr("role: "));
  EXPECT_THAT(std::string(tokens_.Create(Request("ada", static_cast<v1::Role>(9)), rig_.now).status().message()),
              HasSubstr("role: "));
  for (const std::int64_t seconds : {std::int64_t{-1}, std::int64_t{0}, std::int64_t{59}, std::int64_t{1} << 40}) {
    v1::CreateTokenRequest request = Request("ada");
    request.mutable_ttl()->set_seconds(seconds);
    EXPECT_THAT(std::string(tokens_.Create(request, rig_.now).status().message()), HasSubstr("ttl: ")) << seconds;
  }
  ASSERT_TRUE(tokens_.Create(Request("ada"), rig_.now).ok());
  EXPECT_EQ(tokens_.Create(Request("ada"), rig_.now).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(AccessTokensTest, OneForSomeInstancesStaysSoInTheNextLife) {
  v1::CreateTokenRequest request = Request("eve", v1::ROLE_VIEWER);
  request.set_instances("inst-7");
  const auto made = tokens_.Create(request, rig_.now);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->token().instances(), "inst-7");
  AccessTokens next{*rig_.state, SystemRandomBytes};
  ASSERT_TRUE(next.Load().ok());
  EXPECT_EQ(next.Find(made->secret(), rig_.now)->instances(), "inst-7");
  EXPECT_EQ(next.List().tokens(0).instances(), "inst-7");
  for (const std::string& wrong : {std::string("Inst-7"), std::string("inst 7"), std::string(64, 'x')}) {
    request = Request("bob");
    request.set_instances(wrong);
    EXPECT_THAT(std::string(tokens_.Create(request, rig_.now).status().message()), HasSubstr("instances: ")) << wrong;
  }
  request = Request("ada", v1::ROLE_ADMINISTRATOR);
  request.set_instances("inst-7");
  EXPECT_EQ(tokens_.Create(request, rig_.now).status().message(),
            "instances: an administrator's token is for the whole cluster");
}

TEST_F(AccessTokensTest, ThereIsAMost) {
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(tokens_.Create(Request("t" + std::to_string(i)), rig_.now).ok());
  EXPECT_EQ(tokens_.Create(Request("one-more"), rig_.now).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace tessera::control
