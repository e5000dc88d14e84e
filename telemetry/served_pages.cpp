#include "telemetry/served_pages.h"

#include <cassert>
#include <exception>
#include <iterator>
#include <mutex>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "prometheus/text_serializer.h"
#include "telemetry/metrics_token.h"

namespace tessera::telemetry {
namespace {

// Probes of health carry no secret, and the answer tells nothing that one is needed for.
constexpr std::string_view kOpenPage = "/healthz";

}  // namespace

const char* ReasonPhrase(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 500:
      return "Internal Server Error";
    case 503:
      return "Service Unavailable";
    default:
      return "Status";
  }
}

ServedPages::ServedPages(std::shared_ptr<prometheus::Registry> registry, std::string token)
    : registry_(std::move(registry)), token_(std::move(token)) {
  handlers_["/metrics"] = [this](const HttpRequest&) { return Metrics(); };
}

void ServedPages::AddHandler(const std::string& path, HttpHandler handler) {
  assert(path.starts_with('/') && handler);
  const std::unique_lock lock(mutex_);
  handlers_[path] = std::move(handler);
}

void ServedPages::AddCollectable(std::weak_ptr<prometheus::Collectable> collectable) {
  const std::unique_lock lock(mutex_);
  collectables_.push_back(std::move(collectable));
}

HttpReply ServedPages::Reply(const Question& question) {
  const bool may_ask =
      token_.empty() || question.request.path == kOpenPage || ShowsToken(question.authorization, token_);
  return may_ask ? Answer(question) : HttpReply{.status = 401, .body = "the token of the metrics is needed\n"};
}

HttpReply ServedPages::Metrics() {
  std::vector<prometheus::MetricFamily> families = process_metrics_.Collect();
  const auto append = [&families](std::vector<prometheus::MetricFamily> more) {
    families.insert(families.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  if (registry_ != nullptr) append(registry_->Collect());
  std::vector<std::weak_ptr<prometheus::Collectable>> added;
  {
    const std::shared_lock lock(mutex_);
    added = collectables_;
  }
  for (const auto& weak : added) {
    if (const auto collectable = weak.lock()) append(collectable->Collect());
  }
  return {.content_type = "text/plain; version=0.0.4; charset=utf-8",
          .body = prometheus::TextSerializer().Serialize(families)};
}

HttpReply ServedPages::Answer(const Question& question) {
  if (question.method != "GET" && question.method != "HEAD") return {.status = 405, .body = "only GET and HEAD\n"};
  HttpHandler handler;
  {
    const std::shared_lock lock(mutex_);
    if (const auto found = handlers_.find(question.request.path); found != handlers_.end()) handler = found->second;
  }
  if (!handler) return {.status = 404, .body = absl::StrCat("no page ", question.request.path, "\n")};
  try {
    return handler(question.request);
  } catch (const std::exception& error) {  // must not unwind into a server, which is C
    return {.status = 500, .body = absl::StrCat(error.what(), "\n")};
  }
}

}  // namespace tessera::telemetry
