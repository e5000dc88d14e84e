// The page as the gateway's one port sends it over the wire.
#include "gateway/web_server.h"

#include <gmock/gmock.h>
#include <openssl/pem.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "core/world/sha256.h"
#include "gateway/page_files.h"
#include "gateway/testing/page_request.h"
#include "gateway/testing/web_loop.h"
#include "host/temporary_folder.h"
#include "trust/certificate.h"
#include "trust/openssl_handles.h"
#include "trust/server_certificate.h"

namespace tessera::gateway {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class WebServerTest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_.path() + "/page/assets");
    Write("../secret", "hidden");
    for (int line = 0; line < 40'000; ++line) script_ += "let line_" + std::to_string(line) + " = 0;\n";
    Write("index.html", "<!doctype html><title>page</title>");
    Write("assets/page.js", script_);
    Write("assets/dot.png", "\x89PNG\x01\x02");
    loop_.emplace(WebOptions{
        .listen = {"127.0.0.1", 0}, .page = folder_.path() + "/page", .visuals = folder_.path(), .allow_origins = {}});
  }

  void Write(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path() + "/page/" + name, std::ios::binary) << content;
  }
  PageAnswer Get(const std::string& path, const std::vector<std::string>& headers = {},
                 const std::string& method = "GET") {
    return RequestPage(loop_->address(), path, headers, method);
  }

  const host::TemporaryFolder folder_;
  std::string script_;
  std::optional<WebLoop> loop_;
};

TEST_F(WebServerTest, CompressesForWhoAcceptsIt) {
  PageAnswer packed = Get("/assets/page.js", {"Accept-Encoding: br, gzip;q=0.8"});
  EXPECT_EQ(packed.status, 200);
  EXPECT_EQ(packed.headers["content-encoding"], "gzip");
  EXPECT_EQ(packed.headers["vary"], "Accept-Encoding");
  EXPECT_THAT(packed.headers["content-type"], HasSubstr("text/javascript"));
  EXPECT_THAT(packed.headers["content-security-policy"], HasSubstr("default-src 'self'"));
  EXPECT_EQ(packed.headers["content-length"], std::to_string(packed.body.size()));
  EXPECT_LT(packed.body.size(), script_.size() / 4);
  EXPECT_TRUE(Gunzip(packed.body) == script_);

  PageAnswer plain = Get("/assets/page.js", {"Accept-Encoding: gzip;q=0, br"});
  EXPECT_FALSE(plain.headers.contains("content-encoding"));
  EXPECT_TRUE(plain.body == script_) << plain.body.size() << " of " << script_.size() << " bytes";
  EXPECT_TRUE(Get("/assets/page.js").body == script_);
  EXPECT_FALSE(Get("/assets/dot.png", {"Accept-Encoding: gzip"}).headers.contains("content-encoding"))
      << "it would not be smaller";
}

TEST_F(WebServerTest, ABrowserThatHasItIsSentNothing) {
  PageAnswer first = Get("/", {"Accept-Encoding: gzip"});
  const std::string tag = first.headers["etag"];
  ASSERT_GT(tag.size(), 10u);
  EXPECT_EQ(first.headers["cache-control"], "no-cache") << "it asks each time";
  const PageAnswer again = Get("/", {"Accept-Encoding: gzip", "If-None-Match: " + tag});
  EXPECT_EQ(again.status, 304);
  EXPECT_THAT(again.body, IsEmpty());
  EXPECT_EQ(Get("/", {"If-None-Match: \"another\""}).status, 200);
  EXPECT_NE(Get("/assets/page.js").headers["etag"], tag);
}

TEST_F(WebServerTest, AMeshFileIsServedByItsHashForEver) {
  const std::string glb(300'000, 'g'), sha256 = Sha256Hex(glb);
  Write("../" + sha256 + ".glb", glb);
  PageAnswer file = Get("/visuals/" + sha256 + ".glb", {"Accept-Encoding: gzip"});
  EXPECT_EQ(file.status, 200);
  EXPECT_TRUE(file.body == glb) << file.body.size();
  EXPECT_EQ(file.headers["content-type"], "model/gltf-binary");
  EXPECT_THAT(file.headers["cache-control"], HasSubstr("immutable"));
  PageAnswer head = Get("/visuals/" + sha256 + ".glb", {}, "HEAD");
  EXPECT_EQ(head.headers["content-length"], std::to_string(glb.size()));
  EXPECT_THAT(head.body, IsEmpty());
}

TEST_F(WebServerTest, AMeshFileThatIsNotThereOrDamagedIsRefusedAndWhy) {
  const std::string damaged = Sha256Hex("whole"), none = Sha256Hex("none");
  Write("../" + damaged + ".glb", "whol");
  const PageAnswer wrong = Get("/visuals/" + damaged + ".glb");
  EXPECT_EQ(wrong.status, 500);
  EXPECT_THAT(wrong.body, HasSubstr("is damaged: it has another hash"));
  const PageAnswer missing = Get("/visuals/" + none + ".glb");
  EXPECT_EQ(missing.status, 404);
  EXPECT_THAT(missing.body, HasSubstr("--visuals has no file " + none));
  for (const char* path : {"/visuals/", "/visuals/secret", "/visuals/../secret", "/visuals/secret.glb"}) {
    EXPECT_THAT(Get(path).body, Not(HasSubstr("hidden"))) << path;
  }
}

TEST_F(WebServerTest, ServesNothingElse) {
  for (const char* path : {"/assets/none.js", "/assets", "/assets/", "/../secret", "/assets/..%2f..%2fsecret"}) {
    const PageAnswer answer = Get(path);
    EXPECT_TRUE(answer.status == 404 || answer.status == 403) << path << ": " << answer.status;
    EXPECT_THAT(answer.body, Not(HasSubstr("hidden"))) << path;
  }
  EXPECT_EQ(Get("/healthz").body, "ok\n");
  PageAnswer head = Get("/assets/page.js", {}, "HEAD");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.headers["content-length"], std::to_string(script_.size()));
  EXPECT_THAT(head.body, IsEmpty());
  EXPECT_EQ(RequestPage(loop_->address(), "/").status, 200) << "it is still there";
}

TEST(PageFilesTest, AFolderWithoutAPageIsRefused) {
  const host::TemporaryFolder folder;
  EXPECT_EQ(PageFiles::Read(folder.path()).status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(PageFiles::Read("/nowhere").status().message()), HasSubstr("has no index.html"));
}

TEST(PageFilesTest, ReadsWhatBrowsersAccept) {
  EXPECT_TRUE(AcceptsGzip("gzip"));
  EXPECT_TRUE(AcceptsGzip("br, GZIP ; q=0.5"));
  EXPECT_TRUE(AcceptsGzip("*"));
  EXPECT_FALSE(AcceptsGzip(""));
  EXPECT_FALSE(AcceptsGzip("gzip;q=0, *"));
  EXPECT_FALSE(AcceptsGzip("gzip;q=none"));
  EXPECT_FALSE(AcceptsGzip("notgzip"));
  EXPECT_TRUE(HasTag("\"a\", W/\"b\"", "b"));
  EXPECT_TRUE(HasTag("*", "b"));
  EXPECT_FALSE(HasTag("\"ab\"", "b"));
  EXPECT_FALSE(HasTag("", "b"));
}

// The answer of the server to a request by TLS, if its certificate is one of this authority; else nothing.
std::string AskByTls(const std::string& address, const std::string& authority, const std::string& path) {
  const trust::TlsContextHandle context(SSL_CTX_new(TLS_client_method()));
  const trust::CertificateHandle known(PEM_read_bio_X509(trust::ReadFrom(authority).get(), nullptr, nullptr, nullptr));
  X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), known.get());
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  const trust::BioHandle bio(BIO_new_ssl_connect(context.get()));
  BIO_set_conn_hostname(bio.get(), address.c_str());
  if (BIO_do_connect(bio.get()) != 1 || BIO_do_handshake(bio.get()) != 1) {
    ERR_clear_error();
    return "";
  }
  const std::string request = "GET " + path + " HTTP/1.1\r\nHost: " + address + "\r\nConnection: close\r\n\r\n";
  BIO_write(bio.get(), request.data(), static_cast<int>(request.size()));
  std::string answer, piece(4096, '\0');
  for (int got = 0; (got = BIO_read(bio.get(), piece.data(), static_cast<int>(piece.size()))) > 0;) {
    answer.append(piece, 0, static_cast<std::size_t>(got));
  }
  return answer;
}

TEST_F(WebServerTest, SpeaksTlsByItsCertificateAndNothingElse) {
  const auto authority = trust::MakeAuthority(), another = trust::MakeAuthority();
  ASSERT_TRUE(authority.ok() && another.ok());
  const auto own = trust::IssueServer(*authority, "07");
  ASSERT_TRUE(own.ok()) << own.status();
  WebLoop secure({.listen = {"127.0.0.1", 0},
                  .page = folder_.path() + "/page",
                  .visuals = folder_.path(),
                  .allow_origins = {},
                  .certificate = trust::ServerCertificate{.chain = own->certificate, .key = own->key}});
  const std::string answer = AskByTls(secure.address(), authority->certificate, "/");
  EXPECT_THAT(answer, HasSubstr("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("<title>page</title>"));
  EXPECT_EQ(AskByTls(secure.address(), another->certificate, "/"), "") << "who trusts another authority";
  EXPECT_THAT(RequestPage(secure.address(), "/").body, Not(HasSubstr("<title>page</title>"))) << "in the clear";

  GatewayMetrics metrics;
  WebOptions wrong{.listen = {"127.0.0.1", 0}, .page = "", .visuals = "", .allow_origins = {}};
  wrong.certificate = trust::ServerCertificate{.chain = own->certificate, .key = *trust::MakeKey()};
  const absl::Status refused = WebServer::Start(wrong, metrics).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--certificate: the key cannot be read, or is not"));
}

}  // namespace
}  // namespace tessera::gateway
