// Answers to requests, as they are made without a socket.
#include "gateway/http_site.h"

#include <gmock/gmock.h>

#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "core/world/sha256.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StrEq;

class HttpSiteTest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_.path() + "/page");
    Put("page/index.html", std::string(5000, 'i'));
    auto page = PageFiles::Read(folder_.path() + "/page");
    ASSERT_TRUE(page.ok()) << page.status();
    site_.emplace(*std::move(page), folder_.path(), [this] {
      const std::lock_guard lock(mutex_);
      is_woken_ = true;
      woken_.notify_all();
    });
  }
  void Put(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path() + "/" + name, std::ios::binary) << content;
  }
  // Lets the site finish what its thread has done.
  void FinishOnce() {
    std::unique_lock lock(mutex_);
    woken_.wait(lock, [this] { return is_woken_; });
    is_woken_ = false;
    lock.unlock();
    site_->Finish();
  }
  std::shared_ptr<HttpExchange> Ask(const HttpRequest& request) {
    return site_->Ask(request, [this] { ++ready_; });
  }
  // The answer of one that is there at once.
  HttpAnswer Get(const HttpRequest& request) {
    const auto asked = Ask(request);
    EXPECT_TRUE(asked->answer) << request.path;
    return asked->answer.value_or(HttpAnswer{.body = std::make_shared<const std::string>()});
  }

  const host::TemporaryFolder folder_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_woken_ = false;
  int ready_ = 0;
  std::optional<HttpSite> site_;
};

TEST_F(HttpSiteTest, ThePageIsAnsweredAtOnceAsTheBrowserTakesIt) {
  const HttpAnswer plain = Get({.path = "/"});
  EXPECT_EQ(plain.status, 200);
  EXPECT_EQ(plain.body->size(), 5000u);
  EXPECT_EQ(plain.content_encoding, nullptr);
  const HttpAnswer packed = Get({.path = "/index.html", .accept_encoding = "gzip"});
  EXPECT_THAT(packed.content_encoding, StrEq("gzip"));
  EXPECT_LT(packed.body->size(), 500u);
  EXPECT_TRUE(packed.varies);
  EXPECT_EQ(packed.etag, plain.etag);
  const HttpAnswer known = Get({.path = "/", .if_none_match = plain.etag});
  EXPECT_EQ(known.status, 304);
  EXPECT_THAT(*known.body, IsEmpty());
  EXPECT_EQ(ready_, 0) << "who has the answer is not called";
}

TEST_F(HttpSiteTest, WhoAsksForTheHeadAloneIsToldTheLengthAlone) {
  for (const char* path : {"/", "/healthz", "/nothing"}) {
    const HttpAnswer head = Get({.method = HttpMethod::kHead, .path = path}), whole = Get({.path = path});
    EXPECT_FALSE(head.with_body) << path;
    EXPECT_TRUE(whole.with_body) << path;
    EXPECT_EQ(*head.body, *whole.body) << path;
  }
}

TEST_F(HttpSiteTest, AMeshFileIsAnsweredOnceItIsRead) {
  const std::string sha256 = Sha256Hex("mesh");
  Put(sha256 + ".glb", "mesh");
  const HttpRequest request{.path = "/visuals/" + sha256 + ".glb"};
  const auto first = Ask(request);
  EXPECT_FALSE(first->answer);
  EXPECT_GT(first->patience_s, 0);
  FinishOnce();
  ASSERT_TRUE(first->answer);
  EXPECT_EQ(ready_, 1);
  EXPECT_EQ(*first->answer->body, "mesh");
  const HttpAnswer again = Get(request);
  EXPECT_EQ(*again.body, "mesh");
  EXPECT_EQ(ready_, 1) << "it was kept, so it was there at once";
}

TEST_F(HttpSiteTest, WhoIsGoneBeforeTheAnswerIsNotCalled) {
  const std::string sha256 = Sha256Hex("mesh");
  Put(sha256 + ".glb", "mesh");
  Ask({.path = "/visuals/" + sha256 + ".glb"}).reset();
  FinishOnce();
  EXPECT_EQ(ready_, 0);
}

TEST_F(HttpSiteTest, WithoutAGatewayListsAreEmptyAndOrdersFindNothing) {
  EXPECT_THAT(*Get({.path = "/api/worlds"}).body, HasSubstr("[]"));
  EXPECT_THAT(*Get({.path = "/api/recordings"}).body, HasSubstr("[]"));
  EXPECT_EQ(Get({.method = HttpMethod::kPost, .path = "/api/recordings/inst-1/start"}).status, 404);
}

TEST_F(HttpSiteTest, OtherAddressesAreNotFound) {
  const std::string hash(64, 'a');
  for (const std::string& path :
       {std::string("/visuals/"), "/visuals/" + hash, "/visuals/" + hash + "a.glb", "/visuals/../" + hash + ".glb",
        std::string("/api/"), std::string(), "/tiles/" + hash, std::string("/tiles/")}) {
    EXPECT_EQ(Get({.path = path}).status, 404) << path;
  }
  EXPECT_EQ(Get({.method = HttpMethod::kPost, .path = "/"}).status, 404) << "pages are not posted to";
}

}  // namespace
}  // namespace tessera::gateway
