#include "telemetry/metrics_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "prometheus/counter.h"
#include "telemetry/http_get.h"

namespace tessera::telemetry {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Sends `request` to 127.0.0.1:port and returns all that comes back until the server closes.
std::string Exchange(std::uint16_t port, const std::string& request) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    close(fd);
    return "no connection";
  }
  EXPECT_EQ(send(fd, request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
  std::string reply;
  char buffer[4096];
  for (ssize_t n = 0; (n = recv(fd, buffer, sizeof(buffer), 0)) > 0;) reply.append(buffer, static_cast<std::size_t>(n));
  close(fd);
  return reply;
}

std::string Request(std::uint16_t port, const std::string& method, const std::string& path) {
  return Exchange(port, absl::StrCat(method, " ", path, " HTTP/1.1\r\nHost: localhost\r\n\r\n"));
}
std::string Get(std::uint16_t port, const std::string& path) { return Request(port, "GET", path); }

class MetricsServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto server = MetricsServer::Start("127.0.0.1", 0, registry_);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    ASSERT_NE(server_->port(), 0);
  }

  std::shared_ptr<prometheus::Registry> registry_ = std::make_shared<prometheus::Registry>();
  std::unique_ptr<MetricsServer> server_;
};

TEST_F(MetricsServerTest, ScrapeShowsRegistryAndProcess) {
  auto& family = prometheus::BuildCounter().Name("tessera_test_total").Help("Counts").Register(*registry_);
  family.Add({{"kind", "a"}}).Increment(3);
  const std::string reply = Get(server_->port(), "/metrics");
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(reply, HasSubstr("Content-Type: text/plain; version=0.0.4"));
  EXPECT_THAT(reply, HasSubstr("\ntessera_test_total{kind=\"a\"} 3\n"));
  EXPECT_THAT(reply, HasSubstr("\nprocess_resident_memory_bytes "));
}

TEST_F(MetricsServerTest, ContentLengthIsThatOfTheBody) {
  const std::string reply = Get(server_->port(), "/metrics");
  const auto body = reply.find("\r\n\r\n");
  ASSERT_NE(body, std::string::npos);
  EXPECT_THAT(reply, HasSubstr(absl::StrCat("Content-Length: ", reply.size() - body - 4, "\r\n")));
}

TEST_F(MetricsServerTest, UnknownPathIsNotFound) {
  EXPECT_THAT(Get(server_->port(), "/nothing"), StartsWith("HTTP/1.1 404 Not Found\r\n"));
  EXPECT_THAT(Get(server_->port(), "/metrics/deeper"), StartsWith("HTTP/1.1 404 Not Found\r\n"));
  EXPECT_THAT(Get(server_->port(), "/../../etc/passwd"), Not(HasSubstr("root:")));
}

TEST_F(MetricsServerTest, RefusesMethodsThatChangeThings) {
  for (const char* method : {"POST", "PUT", "DELETE", "PATCH"}) {
    EXPECT_THAT(Exchange(server_->port(), absl::StrCat(method, " /metrics HTTP/1.1\r\nContent-Length: 0\r\n\r\n")),
                StartsWith("HTTP/1.1 405 "))
        << method;
  }
}

TEST_F(MetricsServerTest, HeadSendsNoBody) {
  const std::string reply = Request(server_->port(), "HEAD", "/metrics");
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(reply, EndsWith("\r\n\r\n"));
}

TEST_F(MetricsServerTest, HandlerGetsPathAndQueryAndItsReplyIsSent) {
  server_->AddHandler("/sd/prometheus", [](const HttpRequest& request) {
    return HttpReply{.status = 503, .content_type = "application/json", .body = request.path + "|" + request.query};
  });
  const std::string reply = Get(server_->port(), "/sd/prometheus?a=b");
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 503 Service Unavailable\r\n"));
  EXPECT_THAT(reply, HasSubstr("Content-Type: application/json\r\n"));
  EXPECT_THAT(reply, EndsWith("/sd/prometheus|a=b"));
}

TEST_F(MetricsServerTest, HandlerThatThrowsIsAnErrorPage) {
  server_->AddHandler("/broken", [](const HttpRequest&) -> HttpReply { throw std::runtime_error("broken inside"); });
  const std::string reply = Get(server_->port(), "/broken");
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 500 "));
  EXPECT_THAT(reply, EndsWith("broken inside\n"));
}

TEST_F(MetricsServerTest, RubbishDoesNotStopIt) {
  for (const char* rubbish : {"\r\n\r\n", "GET\r\n\r\n", "\x01\x02\x03\r\n\r\n", "GET /metrics HTTP/9.9\r\n\r\n"}) {
    Exchange(server_->port(), rubbish);
  }
  EXPECT_THAT(Get(server_->port(), "/metrics"), StartsWith("HTTP/1.1 200 OK\r\n"));
}

TEST_F(MetricsServerTest, HttpGetReadsItsPages) {
  server_->AddHandler("/echo", [](const HttpRequest& request) {
    return HttpReply{.status = request.query == UrlEncode("a b&c") ? 200 : 400, .body = request.query};
  });
  const auto answer = HttpGet(server_->address(), "/echo?" + UrlEncode("a b&c"));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->status, 200);
  EXPECT_EQ(answer->body, "a%20b%26c");
}

TEST(HttpGetTest, NobodyListeningIsAnErrorThatNamesThePlace) {
  const auto answer = HttpGet("127.0.0.1:1", "/metrics");
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(std::string(answer.status().message()),
              AllOf(HasSubstr("http://127.0.0.1:1/metrics: "), HasSubstr("Connection refused")));
}

class OneGauge : public prometheus::Collectable {
 public:
  std::vector<prometheus::MetricFamily> Collect() const override {
    prometheus::ClientMetric metric;
    metric.gauge.value = 7;
    return {{.name = "tessera_added", .help = "Added", .type = prometheus::MetricType::Gauge, .metric = {metric}}};
  }
};

TEST_F(MetricsServerTest, CollectableIsShownForAsLongAsItLives) {
  auto gauge = std::make_shared<OneGauge>();
  server_->AddCollectable(gauge);
  EXPECT_THAT(Get(server_->port(), "/metrics"), HasSubstr("\ntessera_added 7\n"));
  gauge.reset();
  EXPECT_THAT(Get(server_->port(), "/metrics"), Not(HasSubstr("tessera_added")));
}

TEST_F(MetricsServerTest, PortInUseIsAnErrorThatNamesAddressAndPort) {
  const auto second = MetricsServer::Start("127.0.0.1", server_->port(), registry_);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(std::string(second.status().message()),
            absl::StrCat("cannot serve HTTP on 127.0.0.1:", server_->port(), ": Address already in use"));
}

TEST_F(MetricsServerTest, PortIsFreeAfterItsEnd) {
  const std::uint16_t port = server_->port();
  server_.reset();
  EXPECT_EQ(Get(port, "/metrics"), "no connection");
  EXPECT_TRUE(MetricsServer::Start("127.0.0.1", port, registry_).ok());
}

TEST(MetricsServerStartTest, RefusesWhatIsNoAddress) {
  for (const char* address : {"", "nowhere", "127.0.0.1:80", "127.0.0.1,0.0.0.0", "256.0.0.1"}) {
    const auto server = MetricsServer::Start(address, 0, nullptr);
    EXPECT_EQ(server.status().code(), absl::StatusCode::kInvalidArgument) << address;
    EXPECT_THAT(std::string(server.status().message()), HasSubstr(absl::StrCat("\"", address, "\""))) << address;
  }
}

TEST(MetricsServerStartTest, RefusesAnAddressOfAnotherHost) {
  const auto server = MetricsServer::Start("192.0.2.1", 0, nullptr);  // TEST-NET-1, RFC 5737: no host has it
  EXPECT_EQ(server.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(server.status().message()), HasSubstr("192.0.2.1:0: Cannot assign requested address"));
}

TEST(MetricsServerStartTest, AddressIsWhatAClientDials) {
  const auto server = MetricsServer::Start("localhost", 0, nullptr);
  ASSERT_TRUE(server.ok());
  EXPECT_EQ((*server)->address(), absl::StrCat("127.0.0.1:", (*server)->port()));
}

}  // namespace
}  // namespace tessera::telemetry
