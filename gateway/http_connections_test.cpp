// Requests and answers on one connection, over the wire: in pieces, one after another, and to who does not stay.
#include "gateway/http_connections.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "absl/numeric/bits.h"
#include "core/world/sha256.h"
#include "gateway/testing/kept_connection.h"
#include "gateway/testing/page_request.h"
#include "gateway/testing/web_loop.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

class HttpConnectionsTest : public testing::Test {
 protected:
  HttpConnectionsTest() {
    std::filesystem::create_directories(folder_.path() + "/page");
    std::ofstream(folder_.path() + "/page/index.html") << "<!doctype html><title>page</title>";
    std::ofstream(folder_.path() + "/" + Sha256Hex(large_) + ".glb", std::ios::binary) << large_;
    loop_.emplace(WebOptions{
        .listen = {"127.0.0.1", 0}, .page = folder_.path() + "/page", .visuals = folder_.path(), .allow_origins = {}});
  }

  static std::string Large() {
    std::string bytes(3'000'000, 'a');
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>('a' + absl::popcount(i) % 26);
    return bytes;
  }

  const host::TemporaryFolder folder_;
  const std::string large_ = Large();
  const std::string mesh_ = "/visuals/" + Sha256Hex(large_) + ".glb";
  std::optional<WebLoop> loop_;
};

TEST_F(HttpConnectionsTest, OneConnectionIsAnsweredOnceForEachRequest) {
  KeptConnection kept(loop_->address());
  for (int round = 0; round < 3; ++round) {
    kept.Ask("HEAD", "/healthz");
    EXPECT_THAT(kept.Head(), HasSubstr("content-length: 3"));
    kept.Ask("GET", "/healthz");
    EXPECT_THAT(kept.Head(), StartsWith("HTTP/1.1 200")) << "no body came with the head alone";
    EXPECT_EQ(kept.Body(3), "ok\n");
    kept.Ask("GET", "/nothing");
    EXPECT_THAT(kept.Head(), StartsWith("HTTP/1.1 404"));
    EXPECT_THAT(kept.Body(34), EndsWith("address.\n"));
  }
}

TEST_F(HttpConnectionsTest, ALargeFileComesWholeToAReaderThatStops) {
  KeptConnection slow(loop_->address());
  slow.Ask("GET", mesh_);
  EXPECT_THAT(slow.Head(), HasSubstr("content-length: 3000000"));
  std::string got = slow.Body(100'000);
  // Others are served while it does not read.
  EXPECT_TRUE(RequestPage(loop_->address(), mesh_).body == large_);
  got += slow.Body(large_.size() - got.size());
  EXPECT_TRUE(got == large_) << got.size();
  slow.Ask("GET", "/healthz");
  EXPECT_THAT(slow.Head(), StartsWith("HTTP/1.1 200"));
}

TEST_F(HttpConnectionsTest, WhoGoesBeforeTheAnswerHarmsNobody) {
  for (int round = 0; round < 20; ++round) {
    KeptConnection gone(loop_->address());
    gone.Ask("GET", mesh_);
    if (round % 2 == 0) {
      EXPECT_THAT(gone.Head(), StartsWith("HTTP/1.1 200"));
    }
  }
  EXPECT_TRUE(RequestPage(loop_->address(), mesh_).body == large_);
}

}  // namespace
}  // namespace tessera::gateway
