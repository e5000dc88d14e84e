#include "gateway/http_site.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/world/sha256.h"
#include "gateway/gateway_message.h"
#include "gateway/web_request.h"

namespace tessera::gateway {
namespace {

constexpr unsigned kOk = 200, kNotModified = 304, kUnauthorized = 401, kForbidden = 403, kNotFound = 404,
                   kConflict = 409, kBroken = 500, kUnavailable = 503;
constexpr char kPlainText[] = "text/plain; charset=utf-8", kJson[] = "application/json", kGlb[] = "model/gltf-binary",
               kBinary[] = "application/octet-stream";
constexpr absl::string_view kVisualPath = "/visuals/", kVisualEnding = ".glb", kRecordPath = "/api/recordings/";
constexpr absl::string_view kTilePath = "/tiles/";
constexpr char kImmutable[] = "private, max-age=31536000, immutable";
constexpr int kVisualPatience_s = 60;  // it may have to be fetched
// An order waits for the control plane to say whose token it came with.
constexpr int kOrderPatience_s = 30;

HttpAnswer Say(unsigned status, const char* type, std::string text) {
  return {.status = status, .type = type, .body = std::make_shared<const std::string>(std::move(text))};
}

// A browser asks each time whether what it has is still the newest, for the names of files stay the same.
HttpAnswer PageAnswerOf(const PageFile& file, const HttpRequest& request) {
  const bool packed = !file.gzip.empty() && AcceptsGzip(request.accept_encoding);
  HttpAnswer answer{.type = file.type,
                    .cache_control = "no-cache",
                    .etag = absl::StrCat("W/\"", file.tag, "\""),
                    .varies = true,
                    .body = {}};
  if (HasTag(request.if_none_match, file.tag)) {
    answer.status = kNotModified;
    answer.body = std::make_shared<const std::string>();
    return answer;
  }
  if (packed) answer.content_encoding = "gzip";
  // The page is there for as long as its server.
  answer.body = std::shared_ptr<const std::string>(std::shared_ptr<void>(), packed ? &file.gzip : &file.plain);
  return answer;
}

// A name that is a hash has one content for ever, so a browser asks once.
HttpAnswer VisualAnswerOf(const VisualFiles::Answer& file) {
  if (file.ok()) {
    return {.type = kGlb, .cache_control = kImmutable, .body = *file};
  }
  unsigned status = kBroken;
  if (absl::IsNotFound(file.status())) status = kNotFound;
  if (absl::IsUnavailable(file.status())) status = kUnavailable;
  return Say(status, kPlainText, absl::StrCat(file.status().message(), "\n"));
}

HttpAnswer RecordAnswerOf(const absl::StatusOr<RecordingState>& state) {
  if (state.ok()) return Say(kOk, kJson, RecordingMessage(*state));
  unsigned status = kConflict;
  if (absl::IsNotFound(state.status())) status = kNotFound;
  if (absl::IsPermissionDenied(state.status())) status = kForbidden;
  if (absl::IsUnauthenticated(state.status())) status = kUnauthorized;
  return Say(status, kPlainText, absl::StrCat(state.status().message(), "\n"));
}

// The hash in "/visuals/<sha256>.glb"; empty: it is another address.
std::string VisualIn(absl::string_view path) {
  const bool named = absl::ConsumePrefix(&path, kVisualPath) && absl::ConsumeSuffix(&path, kVisualEnding);
  std::string sha256(path);
  return named && IsSha256Hex(sha256) ? sha256 : "";
}

// Answers what is not answered yet, if anybody still waits for it; says so if that is later than it was asked.
struct Answering {
  std::weak_ptr<HttpExchange> exchange;
  std::function<void()> ready;
  std::shared_ptr<bool> later = std::make_shared<bool>(false);

  void operator()(HttpAnswer answer) const {
    const auto waiting = exchange.lock();
    if (waiting == nullptr) return;
    waiting->answer = std::move(answer);
    if (*later) ready();
  }
};

}  // namespace

std::shared_ptr<HttpExchange> HttpSite::Ask(const HttpRequest& request, std::function<void()> ready) {
  auto exchange = std::make_shared<HttpExchange>();
  if (request.method == HttpMethod::kPost) {
    Record(request, exchange, std::move(ready));
  } else if (const std::string sha256 = VisualIn(request.path); !sha256.empty()) {
    AskVisual(sha256, request.method == HttpMethod::kGet, exchange, std::move(ready));
  } else {
    exchange->answer = Find(request);
    exchange->answer->with_body = request.method == HttpMethod::kGet;
  }
  return exchange;
}

HttpAnswer HttpSite::Find(const HttpRequest& request) const {
  if (const PageFile* file = page_.Find(request.path)) return PageAnswerOf(*file, request);
  if (request.path == "/healthz") return Say(kOk, kPlainText, "ok\n");
  if (request.path == "/api/worlds") {
    const WorldList::List list = gateway_ == nullptr ? WorldList::List() : gateway_->Worlds();
    return Say(kOk, kJson, WorldsPage(list.instances, list.problem));
  }
  if (absl::string_view sha256 = request.path; absl::ConsumePrefix(&sha256, kTilePath)) {
    const auto tile = gateway_ == nullptr ? nullptr : gateway_->TileBy(std::string(sha256));
    if (tile == nullptr) return Say(kNotFound, kPlainText, "No world that is watched here has such a tile.\n");
    return {.type = kBinary, .cache_control = kImmutable, .body = tile};
  }
  if (request.path == "/api/recordings") {
    const auto list = gateway_ == nullptr ? std::vector<ListedRecording>() : gateway_->Recordings();
    return Say(kOk, kJson, RecordingsPage(list));
  }
  return Say(kNotFound, kPlainText,
             request.path == "/" ? "The page is not built or not installed; --page names its folder.\n"
                                 : "There is nothing at this address.\n");
}

// Answers once the file is read.
void HttpSite::AskVisual(const std::string& sha256, bool with_body, const Exchange& exchange,
                         std::function<void()> ready) {
  exchange->patience_s = kVisualPatience_s;
  const Answering answering{exchange, std::move(ready)};
  visuals_.Ask(sha256, [answering, with_body](const VisualFiles::Answer& file) {
    HttpAnswer answer = VisualAnswerOf(file);
    answer.with_body = with_body;
    answering(std::move(answer));
  });
  *answering.later = true;
}

// Ends or begins a recording: /api/recordings/INSTANCE/start, by the right in the header `Authorization: Bearer ...`.
// The body of the request is not read.
void HttpSite::Record(const HttpRequest& request, const Exchange& exchange, std::function<void()> ready) {
  absl::string_view instance = request.path;
  const bool known = absl::ConsumePrefix(&instance, kRecordPath);
  const bool on = absl::ConsumeSuffix(&instance, "/start");
  const bool off = !on && absl::ConsumeSuffix(&instance, "/stop");
  if (gateway_ == nullptr || !known || (!on && !off) || !IsName(instance, kMaxInstanceName)) {
    exchange->answer = Say(kNotFound, kPlainText, "There is nothing to post to at this address.\n");
    return;
  }
  absl::string_view shown = request.authorization;
  if (!absl::ConsumePrefix(&shown, "Bearer ")) shown = "";
  exchange->patience_s = kOrderPatience_s;
  const Answering answering{exchange, std::move(ready)};
  gateway_->Record(std::string(instance), on, std::string(shown),
                   [answering](const absl::StatusOr<RecordingState>& state) { answering(RecordAnswerOf(state)); });
  *answering.later = true;
}

}  // namespace tessera::gateway
