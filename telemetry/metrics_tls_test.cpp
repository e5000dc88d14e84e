// Metrics over HTTPS, asked for by libcurl as scrapers do.
#include "telemetry/metrics_tls.h"

#include <curl/curl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "host/temporary_folder.h"
#include "telemetry/http_get.h"
#include "telemetry/metrics_server.h"
#include "trust/certificate.h"

namespace tessera::telemetry {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr char kScrapeToken[] = "0123456789abcdef";
constexpr long kScrapePatience_s = 60;

struct Scrape {
  CURLcode result = CURLE_OK;
  long status = 0;
  std::string body;
};

std::size_t AppendScrape(char* data, std::size_t, std::size_t size, void* body) {
  static_cast<std::string*>(body)->append(data, size);
  return size;
}

class MetricsTlsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto authority = trust::MakeAuthority(), others = trust::MakeAuthority();
    ASSERT_TRUE(authority.ok() && others.ok());
    const auto own = trust::IssueServer(*authority, "07");
    ASSERT_TRUE(own.ok()) << own.status();
    Write("authority.pem", authority->certificate);
    Write("server.pem", own->certificate + authority->certificate);
    Write("server.key", own->key);
    for (const auto& [name, issuer] : {std::pair("client", &*authority), std::pair("stranger", &*others)}) {
      const std::string key = *trust::MakeKey();
      const auto certificate = trust::IssueClient(*issuer, *trust::MakeRequest(key), "prometheus", "08");
      ASSERT_TRUE(certificate.ok()) << certificate.status();
      Write(absl::StrCat(name, ".pem"), *certificate);
      Write(absl::StrCat(name, ".key"), key);
    }
  }
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }
  void Write(const std::string& name, const std::string& content) const { std::ofstream(Path(name)) << content; }
  MetricsTlsFiles Files(bool of_clients) const {
    return {.certificate = Path("server.pem"),
            .key = Path("server.key"),
            .client_authority = of_clients ? Path("authority.pem") : ""};
  }
  void Serve(bool of_clients, const std::string& token = "") {
    const auto tls = ReadMetricsTls(Files(of_clients));
    ASSERT_TRUE(tls.ok()) << tls.status();
    auto server = MetricsServer::Start("127.0.0.1", 0, std::make_shared<prometheus::Registry>(), token, *tls);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    server_->AddHandler("/healthz", [](const HttpRequest&) { return HttpReply{.body = "ok\n"}; });
  }
  // `client`: by whose certificate; empty: none.
  Scrape Ask(const std::string& path, const std::string& client = "", const std::string& token = "") const {
    const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> curl(curl_easy_init(), curl_easy_cleanup);
    const auto set = [&](auto option, auto value) { curl_easy_setopt(curl.get(), option, value); };
    const std::string url = absl::StrCat("https://", trust::kControlName, ":", server_->port(), path);
    const std::string authority = Path("authority.pem"), certificate = Path(client + ".pem"),
                      key = Path(client + ".key");
    const std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)> here(
        curl_slist_append(nullptr, absl::StrCat("::127.0.0.1:", server_->port()).c_str()), curl_slist_free_all);
    Scrape scrape;
    set(CURLOPT_URL, url.c_str());
    set(CURLOPT_CONNECT_TO, here.get());
    set(CURLOPT_PROXY, "");
    set(CURLOPT_CAINFO, authority.c_str());
    set(CURLOPT_TIMEOUT, kScrapePatience_s);
    set(CURLOPT_WRITEFUNCTION, AppendScrape);
    set(CURLOPT_WRITEDATA, &scrape.body);
    if (!client.empty()) {
      set(CURLOPT_SSLCERT, certificate.c_str());
      set(CURLOPT_SSLKEY, key.c_str());
    }
    if (!token.empty()) {
      set(CURLOPT_HTTPAUTH, CURLAUTH_BEARER);
      set(CURLOPT_XOAUTH2_BEARER, token.c_str());
    }
    scrape.result = curl_easy_perform(curl.get());
    curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &scrape.status);
    return scrape;
  }

  const host::TemporaryFolder folder_;
  std::unique_ptr<MetricsServer> server_;
};

TEST_F(MetricsTlsTest, AScraperThatKnowsTheAuthorityIsServedWhole) {
  Serve(false);
  const Scrape scrape = Ask("/metrics");
  EXPECT_EQ(scrape.result, CURLE_OK) << curl_easy_strerror(scrape.result);
  EXPECT_EQ(scrape.status, 200);
  EXPECT_THAT(scrape.body, HasSubstr("\nprocess_resident_memory_bytes "));
  EXPECT_EQ(Ask("/healthz").body, "ok\n");
  EXPECT_EQ(Ask("/nothing").status, 404);
}

TEST_F(MetricsTlsTest, ALongAnswerComesWhole) {
  Serve(false);
  const std::string body(3'000'000, 'x');
  server_->AddHandler("/long", [&](const HttpRequest&) { return HttpReply{.body = body}; });
  const Scrape scrape = Ask("/long");
  EXPECT_EQ(scrape.result, CURLE_OK) << curl_easy_strerror(scrape.result);
  EXPECT_EQ(scrape.body.size(), body.size());
}

TEST_F(MetricsTlsTest, PlainTextGetsNothing) {
  Serve(false);
  EXPECT_FALSE(HttpGet(server_->address(), "/metrics").ok());
}

TEST_F(MetricsTlsTest, ATokenIsAskedForAsWithoutTls) {
  Serve(false, kScrapeToken);
  EXPECT_EQ(Ask("/metrics").status, 401);
  EXPECT_EQ(Ask("/healthz").status, 200);
  EXPECT_EQ(Ask("/metrics", "", kScrapeToken).status, 200);
}

TEST_F(MetricsTlsTest, WithAnAuthorityForClientsItsOwnAloneComeIn) {
  Serve(true);
  EXPECT_EQ(Ask("/metrics", "client").status, 200);
  for (const char* nobody : {"", "stranger"}) {
    const Scrape scrape = Ask("/healthz", nobody);
    EXPECT_NE(scrape.result, CURLE_OK) << nobody;
    EXPECT_EQ(scrape.body, "") << nobody;
  }
}

TEST_F(MetricsTlsTest, APortThatIsTakenIsNamed) {
  Serve(false);
  const auto tls = ReadMetricsTls(Files(false));
  const auto second = MetricsServer::Start("127.0.0.1", server_->port(), nullptr, "", *tls);
  EXPECT_EQ(second.status(),
            absl::UnavailableError(absl::StrCat("address ", server_->address(), " is in use (metrics)")));
}

TEST_F(MetricsTlsTest, EachFaultIsNamedByItsOption) {
  const auto fault = [](const MetricsTlsFiles& files) {
    const auto tls = ReadMetricsTls(files);
    EXPECT_EQ(tls.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(tls.status().message());
  };
  MetricsTlsFiles files = Files(true);
  files.key = "";
  EXPECT_EQ(fault(files), "--metrics-tls-cert and --metrics-tls-key are given together");
  files.key = Path("client.key");
  EXPECT_THAT(fault(files), StartsWith("--metrics-tls-key: the key cannot be read, or is not the certificate's"));
  files = Files(true);
  files.certificate = Path("none.pem");
  EXPECT_THAT(fault(files), StartsWith("--metrics-tls-cert "));
  files = Files(true);
  files.client_authority = Path("server.key");
  EXPECT_THAT(fault(files), StartsWith("--metrics-tls-client-ca: there is no certificate in it"));
  EXPECT_EQ(fault({.certificate = "", .key = "", .client_authority = Path("authority.pem")}),
            "--metrics-tls-client-ca: needs --metrics-tls-cert");
  const auto unused = ReadMetricsTls({});
  ASSERT_TRUE(unused.ok()) << unused.status();
  EXPECT_FALSE(unused->used());
}

}  // namespace
}  // namespace tessera::telemetry
