#include "control_plane/s3/s3_client.h"

#include <curl/curl.h>

#include <algorithm>
#include <pugixml.hpp>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/one_line.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

constexpr std::size_t kMaxAnswerBytes = 8 << 20;  // a listing of a thousand keys takes some 300 kB
constexpr std::size_t kMaxSaidBytes = 200;        // more of what a store says is cut
constexpr std::size_t kPageSize = 1000;           // S3's largest

struct CurlDeleter {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

// Everything but what needs no escape in a query, as a signature counts it.
std::string Escape(const std::string& text) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = (byte >= 'A' && byte <= 'Z') || (byte >= 'a' && byte <= 'z') || (byte >= '0' && byte <= '9') ||
                       byte == '-' || byte == '_' || byte == '.' || byte == '~';
    if (plain) {
      out += c;
    } else {
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

std::size_t GiveBytes(char* buffer, std::size_t size, std::size_t count, void* rest_pointer) {
  auto& rest = *static_cast<std::string_view*>(rest_pointer);
  const std::size_t n = std::min(size * count, rest.size());
  std::copy_n(rest.data(), n, buffer);
  rest.remove_prefix(n);
  return n;
}

struct Sink {
  std::string bytes;
  std::size_t max = 0;
};

std::size_t TakeBytes(const char* data, std::size_t size, std::size_t count, void* sink_pointer) {
  auto& sink = *static_cast<Sink*>(sink_pointer);
  const std::size_t n = size * count;
  if (n > sink.max - sink.bytes.size()) return 0;  // ends the transfer
  sink.bytes.append(data, n);
  return n;
}

// Not 0 ends the transfer.
int EndIfStopped(void* stopped, curl_off_t /*down*/, curl_off_t /*got*/, curl_off_t /*up*/, curl_off_t /*sent*/) {
  return *static_cast<const std::atomic<bool>*>(stopped) ? 1 : 0;
}

// "AccessDenied: Access Denied", or nothing where the answer does not say.
std::string SaidIn(const std::string& xml) {
  pugi::xml_document document;
  if (!document.load_buffer(xml.data(), xml.size())) return "";
  const pugi::xml_node error = document.child("Error");
  const std::string code = error.child_value("Code"), message = error.child_value("Message");
  return OneLine(message.empty() ? code : absl::StrCat(code, ": ", message), kMaxSaidBytes);
}

}  // namespace

struct S3Client::Request {
  const char* method = "GET";
  std::string key;    // without the prefix; empty: the bucket
  std::string query;  // names ascending, escaped
  std::string_view body;
  std::size_t max_answer = kMaxAnswerBytes;

  std::string Text() const { return key.empty() ? "list of objects" : absl::StrCat(method, " ", key); }
};

struct S3Client::Answer {
  long status = 0;  // NOLINT(google-runtime-int): libcurl's
  std::string body;
};

S3Client::S3Client(S3Settings settings, S3Patience patience) : settings_(std::move(settings)), patience_(patience) {
  static const CURLcode once = curl_global_init(CURL_GLOBAL_DEFAULT);
  (void)once;
}

S3Client::~S3Client() = default;

absl::Status S3Client::StatusOf(const Request& request, const Answer& answer) const {
  if (answer.status >= 200 && answer.status < 300) return absl::OkStatus();
  const std::string said = SaidIn(answer.body);
  const std::string text = absl::StrCat(settings_.name, ": ", request.method, " ", request.key, ": HTTP ",
                                        answer.status, said.empty() ? "" : ", ", said);
  switch (answer.status) {
    case 401:
    case 403:
      return absl::PermissionDeniedError(text);
    case 404:
      return absl::NotFoundError(text);
    case 429:
    case 507:
      return absl::ResourceExhaustedError(text);
    default:
      return answer.status >= 500 ? absl::UnavailableError(text) : absl::FailedPreconditionError(text);
  }
}

absl::StatusOr<S3Client::Answer> S3Client::TryOnce(const Request& request) {
  const std::unique_ptr<CURL, CurlDeleter> curl(curl_easy_init());
  if (!curl) return absl::UnavailableError("libcurl has no memory");
  const auto set = [&curl](CURLoption option, auto value) { curl_easy_setopt(curl.get(), option, value); };
  const std::string path = absl::StrCat(settings_.endpoint, "/", settings_.address.bucket,
                                        request.key.empty() ? "" : "/" + settings_.address.prefix + request.key);
  const std::string url = request.query.empty() ? path : absl::StrCat(path, "?", request.query);
  set(CURLOPT_URL, url.c_str());
  set(CURLOPT_CUSTOMREQUEST, request.method);
  set(CURLOPT_PATH_AS_IS, 1L);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(patience_.connect.count()));
  set(CURLOPT_LOW_SPEED_LIMIT, 1000L);
  set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(patience_.slow.count()));

  const std::string signer = absl::StrCat("aws:amz:", settings_.region, ":s3");
  const std::string user = absl::StrCat(settings_.access_key, ":", settings_.secret_key);
  set(CURLOPT_AWS_SIGV4, signer.c_str());
  set(CURLOPT_USERPWD, user.c_str());
  std::unique_ptr<curl_slist, CurlDeleter> headers;
  const auto add = [&headers](const std::string& header) {
    headers.reset(curl_slist_append(headers.release(), header.c_str()));
  };
  add("x-amz-content-sha256: " + Sha256Hex(request.body));
  if (!settings_.session_token.empty()) add("x-amz-security-token: " + settings_.session_token);
  add("Content-Type: application/octet-stream");
  add("Expect:");
  set(CURLOPT_HTTPHEADER, headers.get());

  std::string_view rest = request.body;
  if (request.method == std::string_view("PUT")) {
    set(CURLOPT_UPLOAD, 1L);
    set(CURLOPT_READFUNCTION, &GiveBytes);
    set(CURLOPT_READDATA, &rest);
    set(CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(request.body.size()));
  }
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, &EndIfStopped);
  set(CURLOPT_XFERINFODATA, static_cast<void*>(&stopped_));
  Sink sink{.bytes = {}, .max = request.max_answer};
  set(CURLOPT_WRITEFUNCTION, &TakeBytes);
  set(CURLOPT_WRITEDATA, &sink);

  const CURLcode code = curl_easy_perform(curl.get());
  if (code == CURLE_WRITE_ERROR) {
    return absl::DataLossError(
        absl::StrCat(settings_.name, ": ", request.key, ": has more than ", request.max_answer, " bytes"));
  }
  if (code != CURLE_OK) {
    return absl::UnavailableError(
        absl::StrCat(settings_.name, ": ", request.Text(), ": ", settings_.endpoint, ": ", curl_easy_strerror(code)));
  }
  Answer answer{.status = 0, .body = std::move(sink.bytes)};
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &answer.status);
  return answer;
}

absl::StatusOr<S3Client::Answer> S3Client::Send(const Request& request) {
  std::chrono::milliseconds wait = patience_.between_tries;
  for (int left = kS3Tries - 1;; --left) {
    absl::StatusOr<Answer> answer = TryOnce(request);
    if (answer.ok()) {
      if (absl::Status status = StatusOf(request, *answer); !status.ok()) answer = std::move(status);
    }
    const bool passes = absl::IsUnavailable(answer.status()) || absl::IsResourceExhausted(answer.status());
    if (answer.ok() || !passes || left == 0 || stopped_) return answer;
    std::this_thread::sleep_for(wait);
    wait *= 2;
  }
}

absl::Status S3Client::Put(const std::string& key, const std::string& bytes) {
  return Send({.method = "PUT", .key = key, .query = {}, .body = bytes}).status();
}

absl::StatusOr<std::string> S3Client::Get(const std::string& key, std::size_t max_bytes) {
  auto answer = Send({.method = "GET", .key = key, .query = {}, .body = {}, .max_answer = max_bytes});
  if (!answer.ok()) return answer.status();
  return std::move(answer->body);
}

absl::Status S3Client::Delete(const std::string& key) {
  const auto answer = Send({.method = "DELETE", .key = key, .query = {}, .body = {}});
  return absl::IsNotFound(answer.status()) ? absl::OkStatus() : answer.status();
}

absl::StatusOr<S3Client::Listing> S3Client::List(const std::string& prefix, bool by_folder, std::size_t max) {
  Listing listing;
  std::string token;
  do {
    std::string query = token.empty() ? "" : absl::StrCat("continuation-token=", Escape(token), "&");
    if (by_folder) query += "delimiter=%2F&";
    absl::StrAppend(&query, "list-type=2&max-keys=", std::min(max, kPageSize),
                    "&prefix=", Escape(settings_.address.prefix + prefix));
    const auto answer = Send({.method = "GET", .key = {}, .query = query, .body = {}});
    if (!answer.ok()) return answer.status();
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(answer->body.data(), answer->body.size());
    const pugi::xml_node root = document.child("ListBucketResult");
    if (!parsed || !root)
      return absl::DataLossError(absl::StrCat(settings_.name, ": its answer is no list of objects"));
    const auto add = [this](std::vector<std::string>& to, std::string name) {
      if (name.starts_with(settings_.address.prefix)) to.push_back(name.substr(settings_.address.prefix.size()));
    };
    for (const pugi::xml_node object : root.children("Contents")) add(listing.keys, object.child_value("Key"));
    for (const pugi::xml_node folder : root.children("CommonPrefixes")) {
      add(listing.folders, folder.child_value("Prefix"));
    }
    token = root.child("IsTruncated").text().as_bool() ? root.child_value("NextContinuationToken") : "";
  } while (!token.empty() && listing.keys.size() + listing.folders.size() < max);
  std::ranges::sort(listing.keys);
  std::ranges::sort(listing.folders);
  return listing;
}

}  // namespace tessera::control
