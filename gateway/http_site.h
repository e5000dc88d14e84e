// HttpSite: what the gateway answers over HTTP, without a socket: the page, mesh files, its two lists, and orders to
// record.
//
//   HttpSite site(page, "visuals", wake);
//   const auto asked = site.Ask({.path = "/assets/page.js"}, [] { CarryOn(); });
//   if (asked->answer) Send(*asked->answer);   // or else later, when CarryOn is called
//   loop: site.Finish();
//
// Thread rule: one thread. `wake` is called from another one when there is something to finish.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "gateway/gateway.h"
#include "gateway/page_files.h"
#include "gateway/visual_files.h"

namespace tessera::gateway {

// The longest name of an instance in an address.
inline constexpr std::size_t kMaxInstanceName = 64;

enum class HttpMethod : std::uint8_t { kGet, kHead, kPost };

struct HttpRequest {
  HttpMethod method = HttpMethod::kGet;
  std::string path;                                                 // "/assets/page.js"
  std::string accept_encoding{}, if_none_match{}, authorization{};  // headers; empty: there is none
};

struct HttpAnswer {
  unsigned status = 200;
  const char* type = "";
  const char* cache_control = "no-store";
  std::string etag{};                         // empty: none
  const char* content_encoding = nullptr;     // "gzip"
  bool varies = false;                        // with the Accept-Encoding of the request
  std::shared_ptr<const std::string> body{};  // never null
  bool with_body = true;                      // false: only its length is sent
};

// A request until its answer is sent. Who drops it is not called any more.
struct HttpExchange {
  std::optional<HttpAnswer> answer;
  int patience_s = 0;  // while there is no answer: how long it may take
};

class HttpSite {
 public:
  // `visuals`, `fetch`: as VisualFiles takes them.
  HttpSite(PageFiles page, std::string visuals, std::function<void()> wake, VisualFetch fetch = nullptr)
      : page_(std::move(page)), visuals_(std::move(visuals), std::move(wake), std::move(fetch)) {}

  // From now on lists and orders are the gateway's, which outlives this.
  void Serve(Gateway& gateway) { gateway_ = &gateway; }

  // `ready` is called if the answer is not there yet, once it is: by Finish, or by the gateway's Tick.
  std::shared_ptr<HttpExchange> Ask(const HttpRequest& request, std::function<void()> ready);
  void Finish() { visuals_.Finish(); }

 private:
  using Exchange = std::shared_ptr<HttpExchange>;

  HttpAnswer Find(const HttpRequest& request) const;
  void AskVisual(const std::string& sha256, bool with_body, const Exchange& exchange, std::function<void()> ready);
  void Record(const HttpRequest& request, const Exchange& exchange, std::function<void()> ready);

  Gateway* gateway_ = nullptr;
  PageFiles page_;
  VisualFiles visuals_;
};

}  // namespace tessera::gateway
