// Requests and answers on one connection, over the wire: in pieces, one after another, and to who does not stay.
#include "gateway/http_connections.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "absl/numeric/bits.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/world/sha256.h"
#include "gateway/testing/page_request.h"
#include "gateway/testing/web_loop.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

// A connection that is kept, and reads no more than it is told to.
class KeptConnection {
 public:
  explicit KeptConnection(const std::string& address) : address_(address) {
    const std::size_t colon = address.rfind(':');
    std::uint32_t port = 0;
    sockaddr_in to{};
    to.sin_family = AF_INET;
    EXPECT_TRUE(absl::SimpleAtoi(address.substr(colon + 1), &port));
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
    socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{.tv_sec = 30, .tv_usec = 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }
  ~KeptConnection() { close(socket_); }
  KeptConnection(const KeptConnection&) = delete;
  KeptConnection& operator=(const KeptConnection&) = delete;

  void Ask(const std::string& method, const std::string& path) {
    const std::string text = absl::StrCat(method, " ", path, " HTTP/1.1\r\nHost: ", address_, "\r\n\r\n");
    EXPECT_EQ(send(socket_, text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
  }
  // The next answer's head; its length is that which it tells.
  std::string Head() {
    while (received_.find("\r\n\r\n") == std::string::npos) {
      if (!More()) return "";
    }
    const std::size_t end = received_.find("\r\n\r\n") + 4;
    std::string head = received_.substr(0, end);
    received_.erase(0, end);
    return head;
  }
  std::string Body(std::size_t size) {
    while (received_.size() < size) {
      if (!More()) break;
    }
    std::string body = received_.substr(0, size);
    received_.erase(0, size);
    return body;
  }

 private:
  bool More() {
    std::string piece(std::size_t{1} << 14, '\0');
    const ssize_t got = recv(socket_, piece.data(), piece.size(), 0);
    if (got > 0) received_.append(piece, 0, static_cast<std::size_t>(got));
    return got > 0;
  }

  std::string address_, received_;
  int socket_ = -1;
};

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
