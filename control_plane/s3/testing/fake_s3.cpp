#include "control_plane/s3/testing/fake_s3.h"

#include <civetweb.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <algorithm>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

constexpr char kAccessKey[] = "TESTKEY", kSecretKey[] = "test/secret+key", kRegion[] = "eu-test-1";

std::string HmacSha256(const std::string& key, const std::string& text) {
  std::string out(crypto_auth_hmacsha256_BYTES, '\0');
  crypto_auth_hmacsha256_state state;
  crypto_auth_hmacsha256_init(&state, reinterpret_cast<const unsigned char*>(key.data()), key.size());
  crypto_auth_hmacsha256_update(&state, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  crypto_auth_hmacsha256_final(&state, reinterpret_cast<unsigned char*>(out.data()));
  return out;
}

struct Received {
  std::string method, path, query, body;
  std::map<std::string, std::string> headers;  // by name in lower case
};

Received Receive(mg_connection* connection) {
  const mg_request_info* info = mg_get_request_info(connection);
  Received request{.method = info->request_method,
                   .path = info->local_uri_raw,
                   .query = info->query_string == nullptr ? "" : info->query_string,
                   .body = {},
                   .headers = {}};
  for (int i = 0; i < info->num_headers; ++i) {
    request.headers[absl::AsciiStrToLower(info->http_headers[i].name)] =
        std::string(absl::StripAsciiWhitespace(info->http_headers[i].value));
  }
  std::string buffer(65536, '\0');  // CivetWeb's threads have little stack
  const auto read = [&] { return mg_read(connection, buffer.data(), buffer.size()); };
  for (int n = read(); n > 0; n = read()) request.body.append(buffer, 0, static_cast<std::size_t>(n));
  return request;
}

// The value of "name=" in the header that proves who asks.
std::string Part(const std::string& authorization, const std::string& name) {
  const std::size_t at = authorization.find(name + "=");
  if (at == std::string::npos) return "";
  const std::size_t begin = at + name.size() + 1;
  return authorization.substr(begin, authorization.find_first_of(", ", begin) - begin);
}

// Empty: the request is signed as it should be; else the code that S3 would answer with.
std::string Fault(const Received& request) {
  const auto header = [&](const std::string& name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string() : found->second;
  };
  const std::string authorization = header("authorization"), date = header("x-amz-date");
  const std::vector<std::string> scope = absl::StrSplit(Part(authorization, "Credential"), '/');
  if (!absl::StartsWith(authorization, "AWS4-HMAC-SHA256 ") || scope.size() != 5 || date.size() != 16) {
    return "AccessDenied";
  }
  if (scope[0] != kAccessKey) return "InvalidAccessKeyId";
  if (scope[2] != kRegion || scope[3] != "s3") return "AuthorizationHeaderMalformed";
  if (header("x-amz-content-sha256") != Sha256Hex(request.body)) return "XAmzContentSHA256Mismatch";
  const std::string signed_names = Part(authorization, "SignedHeaders");
  std::string headers;
  std::set<std::string> names;
  for (const absl::string_view name : absl::StrSplit(signed_names, ';')) {
    names.emplace(name);
    absl::StrAppend(&headers, name, ":", header(std::string(name)), "\n");
  }
  if (!names.contains("host") || !names.contains("x-amz-content-sha256") || !names.contains("x-amz-date")) {
    return "AccessDenied";
  }
  std::vector<std::string> parameters = absl::StrSplit(request.query, '&');
  std::ranges::sort(parameters);
  const std::string canonical = absl::StrCat(request.method, "\n", request.path, "\n", absl::StrJoin(parameters, "&"),
                                             "\n", headers, "\n", signed_names, "\n", header("x-amz-content-sha256"));
  const std::string where = absl::StrJoin(scope.begin() + 1, scope.end(), "/");
  const std::string to_sign = absl::StrCat("AWS4-HMAC-SHA256\n", date, "\n", where, "\n", Sha256Hex(canonical));
  std::string key = HmacSha256(absl::StrCat("AWS4", kSecretKey), scope[1]);
  for (int i = 2; i < 5; ++i) key = HmacSha256(key, scope[static_cast<std::size_t>(i)]);
  const std::string signature = absl::BytesToHexString(HmacSha256(key, to_sign));
  return signature == Part(authorization, "Signature") ? "" : "SignatureDoesNotMatch";
}

std::string Unescape(const std::string& text) {
  std::string out(text.size() + 1, '\0');
  const int n = mg_url_decode(text.data(), static_cast<int>(text.size()), out.data(), static_cast<int>(out.size()), 0);
  out.resize(static_cast<std::size_t>(std::max(n, 0)));
  return out;
}

std::map<std::string, std::string> Parameters(const std::string& query) {
  std::map<std::string, std::string> parameters;
  for (const absl::string_view parameter : absl::StrSplit(query, '&', absl::SkipEmpty())) {
    const std::pair<std::string, std::string> parts = absl::StrSplit(parameter, absl::MaxSplits('=', 1));
    parameters[parts.first] = Unescape(parts.second);
  }
  return parameters;
}

void Answer(mg_connection* connection, int status, const std::string& body, std::size_t announced) {
  mg_printf(connection, "HTTP/1.1 %d X\r\nContent-Length: %zu\r\nConnection: close\r\n\r\n", status, announced);
  mg_write(connection, body.data(), body.size());
}

void AnswerError(mg_connection* connection, int status, const std::string& code) {
  const std::string body =
      absl::StrCat("<?xml version=\"1.0\"?><Error><Code>", code, "</Code><Message>said the store</Message></Error>");
  Answer(connection, status, body, body.size());
}

}  // namespace

struct FakeS3::Server {
  explicit Server(FakeS3& store) : owner(store) {}

  static int Handle(mg_connection* connection, void* self) {
    static_cast<Server*>(self)->Serve(connection);
    return 1;
  }
  void Serve(mg_connection* connection);
  std::string List(const std::map<std::string, std::string>& parameters, const std::string& bucket) const;

  FakeS3& owner;
  mutable std::mutex mutex;
  std::map<std::string, std::string> objects;  // by "bucket/key"
  std::vector<std::string> requests;
  std::atomic<bool> hangs{false};
  int port = 0;
  mg_context* context = nullptr;
};

void FakeS3::Server::Serve(mg_connection* connection) {
  hangs.wait(true);
  const Received request = Receive(connection);
  const std::string path = request.path.substr(1);
  const std::lock_guard lock(mutex);
  requests.push_back(absl::StrCat(request.method, " ", path));
  if (owner.fail_next > 0) {
    --owner.fail_next;
    return AnswerError(connection, 503, "SlowDown");
  }
  const std::string fault = owner.deny ? "AccessDenied" : Fault(request);
  if (!fault.empty()) return AnswerError(connection, 403, fault);
  if (path != "worlds" && !absl::StartsWith(path, "worlds/")) return AnswerError(connection, 404, "NoSuchBucket");
  if (request.method == "PUT") {
    objects[path] = request.body;
    return Answer(connection, 200, "", 0);
  }
  if (request.method == "DELETE") {
    objects.erase(path);
    return Answer(connection, 204, "", 0);
  }
  if (path == "worlds") {
    const std::string list = List(Parameters(request.query), path);
    return Answer(connection, 200, list, list.size());
  }
  const auto found = objects.find(path);
  if (found == objects.end()) return AnswerError(connection, 404, "NoSuchKey");
  const std::string& body = found->second;
  Answer(connection, 200, owner.cut_answers ? body.substr(0, body.size() / 2) : body, body.size());
}

std::string FakeS3::Server::List(const std::map<std::string, std::string>& parameters,
                                 const std::string& bucket) const {
  const auto value = [&](const std::string& name) {
    const auto found = parameters.find(name);
    return found == parameters.end() ? std::string() : found->second;
  };
  const std::string prefix = value("prefix"), after = value("continuation-token");
  std::size_t max = owner.page_size;
  if (!value("max-keys").empty()) max = std::min<std::size_t>(max, std::stoul(value("max-keys")));
  std::set<std::string> entries;  // keys, and folders with '/' at the end
  for (const auto& [path, bytes] : objects) {
    const std::string key = path.substr(bucket.size() + 1);
    if (!absl::StartsWith(key, prefix)) continue;
    const std::size_t slash = value("delimiter").empty() ? std::string::npos : key.find('/', prefix.size());
    entries.insert(slash == std::string::npos ? key : key.substr(0, slash + 1));
  }
  std::string body = "<?xml version=\"1.0\"?><ListBucketResult xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">";
  std::size_t listed = 0;
  std::string last;
  bool more = false;
  for (const std::string& entry : entries) {
    if (!after.empty() && entry <= after.substr(1)) continue;  // a token is the last entry, after a sign to be escaped
    if (listed == max) {
      more = true;
      break;
    }
    const bool folder = entry.ends_with('/');
    absl::StrAppend(&body, folder ? "<CommonPrefixes><Prefix>" : "<Contents><Key>", entry,
                    folder ? "</Prefix></CommonPrefixes>" : "</Key></Contents>");
    last = entry;
    ++listed;
  }
  absl::StrAppend(&body, "<IsTruncated>", more ? "true" : "false", "</IsTruncated>");
  if (more) absl::StrAppend(&body, "<NextContinuationToken>+", last, "</NextContinuationToken>");
  return body + "</ListBucketResult>";
}

FakeS3::FakeS3() : server_(std::make_unique<Server>(*this)) {
  EXPECT_GE(sodium_init(), 0);
  mg_init_library(0);
  const char* const options[] = {"listening_ports", "127.0.0.1:0", "num_threads", "4", "decode_url", "no", nullptr};
  server_->context = mg_start(nullptr, nullptr, const_cast<const char**>(options));
  EXPECT_NE(server_->context, nullptr);
  mg_server_port port{};
  EXPECT_EQ(mg_get_server_ports(server_->context, 1, &port), 1);
  server_->port = port.port;
  mg_set_request_handler(server_->context, "**", &Server::Handle, server_.get());
}

FakeS3::~FakeS3() {
  Hang(false);
  mg_stop(server_->context);
}

void FakeS3::Reset() {
  Hang(false);
  fail_next = 0;
  deny = cut_answers = false;
  page_size = 1000;
  const std::lock_guard lock(server_->mutex);
  server_->objects.clear();
  server_->requests.clear();
}

void FakeS3::Hang(bool on) {
  server_->hangs = on;
  server_->hangs.notify_all();
}

S3Settings FakeS3::Settings(const std::string& address) const {
  const auto environment = [](const char* name) -> std::optional<std::string> {
    const std::string wanted = name;
    if (wanted == "AWS_ACCESS_KEY_ID") return kAccessKey;
    if (wanted == "AWS_SECRET_ACCESS_KEY") return kSecretKey;
    return std::nullopt;
  };
  return *MakeS3Settings(address, absl::StrCat("http://127.0.0.1:", server_->port), kRegion, environment);
}

std::map<std::string, std::string> FakeS3::Objects() const {
  const std::lock_guard lock(server_->mutex);
  return server_->objects;
}

void FakeS3::Damage(const std::string& path) {
  const std::lock_guard lock(server_->mutex);
  std::string& bytes = server_->objects.at(path);
  bytes[bytes.size() / 2] ^= 1;
}

std::vector<std::string> FakeS3::Requests() const {
  const std::lock_guard lock(server_->mutex);
  return server_->requests;
}

}  // namespace tessera::control
