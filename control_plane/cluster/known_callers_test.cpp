// Pictures of who may call: each is as the cluster was, and each change that matters is noted.
#include "control_plane/cluster/known_callers.h"

#include <gmock/gmock.h>

#include <chrono>
#include <string>

#include "control_plane/cluster/hosts.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class KnownCallersTest : public ::testing::Test {
 protected:
  v1::CreateTokenResponse Token(const std::string& name) {
    v1::CreateTokenRequest request;
    request.set_name(name);
    request.set_role(v1::ROLE_VIEWER);
    request.mutable_ttl()->set_seconds(3600);
    auto made = tokens_.Create(request, rig_.now);
    EXPECT_TRUE(made.ok()) << made.status();
    return *std::move(made);
  }
  void Revoke(const std::string& name) {
    v1::RevokeTokenRequest request;
    request.set_name(name);
    EXPECT_TRUE(tokens_.Revoke(request).ok());
  }
  std::string JoinToken(const std::string& name) {
    v1::AddHostRequest request;
    request.set_name(name);
    return hosts_.Add(request, rig_.now)->join_token();
  }
  KnownCallers Picture() const { return {*rig_.state, tokens_}; }
  // True if another picture is made for `change`.
  template <class Change>
  bool Noted(Change change) {
    const std::uint64_t before = rig_.state->access_changes();
    change();
    return rig_.state->access_changes() != before;
  }

  StateRig rig_;
  int drawn_ = 0;
  RandomBytes random_ = [this](std::size_t n) { return std::string(n, static_cast<char>(++drawn_)); };
  AccessTokens tokens_{*rig_.state, random_};
  Hosts hosts_{*rig_.state, rig_.settings, random_};
};

TEST_F(KnownCallersTest, ATokenIsKnownFromTheNextPictureOnUntilItIsRevokedOrHasRunOut) {
  const KnownCallers before = Picture();
  v1::CreateTokenResponse ada;
  EXPECT_TRUE(Noted([&] { ada = Token("ada"); }));
  EXPECT_EQ(before.FindToken(ada.secret(), rig_.now), nullptr);
  const KnownCallers with = Picture();
  ASSERT_NE(with.FindToken(ada.secret(), rig_.now), nullptr);
  EXPECT_EQ(with.FindToken(ada.secret(), rig_.now)->name(), "ada");
  EXPECT_EQ(with.FindToken(ada.secret() + "x", rig_.now), nullptr);
  Now later = rig_.now;
  later.unix_time += std::chrono::hours(1);
  EXPECT_EQ(with.FindToken(ada.secret(), later), nullptr) << "it has run out";
  EXPECT_TRUE(Noted([&] { Revoke("ada"); }));
  EXPECT_EQ(Picture().FindToken(ada.secret(), rig_.now), nullptr);
}

// A list of revocations names it, and the store does not take its removal: it proves nothing all the same.
TEST_F(KnownCallersTest, ATokenThatCannotBeRemovedFromTheStoreIsKnownNoMore) {
  const v1::CreateTokenResponse ada = Token("ada");
  const std::string hash = tokens_.Named("ada")->secret_hash();
  rig_.store.FailNext(1);
  EXPECT_TRUE(Noted([&] { tokens_.Drop({{hash, records::RevokedToken()}}); }));
  EXPECT_EQ(Picture().FindToken(ada.secret(), rig_.now), nullptr);
}

TEST_F(KnownCallersTest, AHostsCertificateCountsUntilTheHostIsRemoved) {
  HostEntry& alpha = rig_.AddHost("alpha");
  records::Host shown = alpha.record;
  shown.set_certificate_serial("9f3c");
  EXPECT_TRUE(Noted([&] { ASSERT_TRUE(rig_.state->StoreHost(alpha, shown).ok()); }));
  EXPECT_TRUE(Picture().CheckCertificate("host-1", "9f3c").ok());
  EXPECT_EQ(Picture().CheckCertificate("host-1", "0000").code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(Picture().CheckCertificate("host-2", "9f3c").code(), absl::StatusCode::kUnauthenticated);
  EXPECT_TRUE(Noted([&] { ASSERT_TRUE(rig_.state->RemoveHost(alpha, absl::OkStatus()).ok()); }));
  EXPECT_EQ(Picture().CheckCertificate("host-1", "9f3c").code(), absl::StatusCode::kPermissionDenied);
}

TEST_F(KnownCallersTest, AJoinTokenIsKnownUntilItIsUsed) {
  std::string token;
  EXPECT_TRUE(Noted([&] { token = JoinToken("alpha"); }));
  EXPECT_TRUE(Picture().CheckJoinToken(token, rig_.now).ok());
  Now later = rig_.now;
  later.unix_time += std::chrono::hours(25);
  EXPECT_THAT(std::string(Picture().CheckJoinToken(token, later).message()), HasSubstr("remove host alpha"));
  HostEntry& alpha = *rig_.state->FindHost("host-1");
  records::Host used = alpha.record;
  used.clear_join_token_hash();
  EXPECT_TRUE(Noted([&] { ASSERT_TRUE(rig_.state->StoreHost(alpha, used).ok()); }));
  EXPECT_EQ(Picture().CheckJoinToken(token, rig_.now).code(), absl::StatusCode::kUnauthenticated);
}

// Agents attach again all at once.
TEST_F(KnownCallersTest, WhatElseAHostSaysNeedsNoOtherPicture) {
  HostEntry& alpha = rig_.AddHost("alpha");
  records::Host next = alpha.record;
  next.set_boot_id("another");
  EXPECT_FALSE(Noted([&] { ASSERT_TRUE(rig_.state->StoreHost(alpha, next).ok()); }));
}

}  // namespace
}  // namespace tessera::control
