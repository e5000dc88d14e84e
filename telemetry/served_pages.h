// ServedPages: what a process serves over HTTP, without a socket: /metrics, further pages, and who may ask for them.
//
//   ServedPages pages(registry, token);
//   pages.AddHandler("/healthz", [](const HttpRequest&) { return HttpReply{.body = "ok\n"}; });
//   const HttpReply reply = pages.Reply({.method = "GET", .request = {.path = "/metrics"}, .authorization = ""});
//
// Thread rule: any thread. Handlers and collectables run on the caller's.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <shared_mutex>
#include <string>
#include <utility>
#include <vector>

#include "prometheus/collectable.h"
#include "prometheus/registry.h"
#include "telemetry/process_metrics.h"

namespace tessera::telemetry {

struct HttpRequest {
  std::string path;   // decoded, without the query
  std::string query;  // as sent, without '?'
};

struct HttpReply {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
};

using HttpHandler = std::function<HttpReply(const HttpRequest&)>;

class ServedPages {
 public:
  struct Question {
    std::string method;  // "GET"
    HttpRequest request;
    std::string authorization;  // the header of that name; empty: there is none
  };

  // `token`: see metrics_token.h; empty: everybody may ask.
  ServedPages(std::shared_ptr<prometheus::Registry> registry, std::string token);

  HttpReply Reply(const Question& question);
  void AddHandler(const std::string& path, HttpHandler handler);
  void AddCollectable(std::weak_ptr<prometheus::Collectable> collectable);

 private:
  HttpReply Metrics();
  HttpReply Answer(const Question& question);

  const std::shared_ptr<prometheus::Registry> registry_;
  const std::string token_;
  ProcessMetrics process_metrics_;
  std::shared_mutex mutex_;  // guards the two below; handlers are copied out, never called under it
  std::map<std::string, HttpHandler, std::less<>> handlers_;
  std::vector<std::weak_ptr<prometheus::Collectable>> collectables_;
};

// "Not Found"
const char* ReasonPhrase(int status);

}  // namespace tessera::telemetry
