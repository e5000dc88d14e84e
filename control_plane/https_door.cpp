#include "control_plane/https_door.h"

#include <libwebsockets.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "control_plane/counted_address.h"
#include "control_plane/doors.h"
#include "control_plane/join_requests.h"
#include "control_plane/restraint.h"
#include "telemetry/log_throttle.h"
#include "telemetry/logging.h"
#include "telemetry/web_listener.h"
#include "trust/server_certificate.h"

namespace tessera::control {
namespace {

using HttpsClock = std::chrono::steady_clock;

constexpr int kRequestSeconds = 10;  // from the connection to its whole request
constexpr std::chrono::seconds kRequestPatience{kRequestSeconds};

telemetry::LogThrottle& WebLogThrottle() {
  static telemetry::LogThrottle throttle;
  return throttle;
}

// Strangers cause these lines as often as they like.
void ForwardWebLog(int, const char* line) {
  if (!spdlog::should_log(spdlog::level::debug)) return;
  if (!WebLogThrottle().Take(telemetry::LogThrottle::Clock::now())) return;
  spdlog::debug("https {}", telemetry::LogValue(std::string(absl::StripTrailingAsciiWhitespace(line))));
}

constexpr char kCertificateName[] = "players' certificate";

trust::ServerCertificate CertificateOf(const HttpsSettings& settings) {
  return {.chain = settings.certificate, .key = settings.key};
}

}  // namespace

struct HttpsDoor::Impl {
  // A connection, from its accepting on.
  struct Connection {
    std::string address;
    HttpsClock::time_point begun;
    std::uint64_t number = 0;
    std::string path, body;
    std::optional<PageAnswer> answer;
    bool options = false;  // the question of a browser whether a page of another origin may ask
  };
  // A request that is being carried out.
  struct Work {
    std::atomic<bool> given_up{false};
    std::thread thread;
  };

  Impl(HttpsSettings settings_in, ControlPlane& plane, ControlMetrics& metrics)
      : settings(std::move(settings_in)),
        requests(plane, metrics, IsSocket() ? JoinRequests::Askers::kLocal : JoinRequests::Askers::kStrangers) {}

  static int OnEvent(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len);
  static Impl& Of(lws* wsi) { return *static_cast<Impl*>(lws_context_user(lws_get_context(wsi))); }

  bool IsSocket() const { return !settings.socket_path.empty(); }
  bool MayConnect(int socket_fd);
  void Opened(lws* wsi);
  void Closed(lws* wsi);
  int Begin(lws* wsi, Connection& connection);
  int TakeBody(lws* wsi, Connection& connection, std::string_view bytes);
  int Answer(lws* wsi, Connection& connection, PageAnswer answer);
  int Write(lws* wsi, Connection& connection);
  void Start(lws* wsi, Connection& connection);
  void TakeFinished();
  void Stop();

  HttpsSettings settings;
  JoinRequests requests;
  telemetry::LogThrottle refusals;
  std::atomic<bool> stopping{false};
  std::thread loop;
  // Only the loop's thread uses these.
  std::map<lws*, Connection> connections;
  std::map<std::string, std::size_t> by_address;
  std::uint64_t last_number = 0;
  std::map<std::uint64_t, std::unique_ptr<Work>> work;  // by the connection's number
  // Under `mutex`: finished work.
  std::mutex mutex;
  std::vector<std::pair<std::uint64_t, PageAnswer>> finished;
  telemetry::WebListener listener;  // after all that its callback uses
};

// --- Connections -----------------------------------------------------------------------------------------------------

bool HttpsDoor::Impl::MayConnect(int socket_fd) {
  if (connections.size() >= settings.max_connections) return false;
  if (IsSocket()) {
    const absl::Status status = CheckPeer(socket_fd);
    if (status.ok()) return true;
    if (const auto left_out = refusals.Take(telemetry::LogThrottle::Clock::now())) {
      spdlog::warn("refused at the players' socket reason={} more={}",
                   telemetry::LogValue(std::string(status.message())), *left_out);
    }
    return false;
  }
  const auto known = by_address.find(CountedAddress(socket_fd));
  return known == by_address.end() || known->second < settings.max_from_address;
}

void HttpsDoor::Impl::Opened(lws* wsi) {
  Connection& connection = connections[wsi];
  connection.address = CountedAddress(lws_get_socket_fd(wsi));
  connection.begun = HttpsClock::now();
  connection.number = ++last_number;
  ++by_address[connection.address];
}

void HttpsDoor::Impl::Closed(lws* wsi) {
  const auto found = connections.find(wsi);
  if (found == connections.end()) return;
  if (const auto counted = by_address.find(found->second.address); --counted->second == 0) by_address.erase(counted);
  // Nobody reads the answer any more.
  if (const auto doing = work.find(found->second.number); doing != work.end()) doing->second->given_up = true;
  connections.erase(found);
}

// --- Requests --------------------------------------------------------------------------------------------------------

int HttpsDoor::Impl::Begin(lws* wsi, Connection& connection) {
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kRequestSeconds);
  if (lws_hdr_total_length(wsi, WSI_TOKEN_OPTIONS_URI) > 0) {
    connection.options = true;
    return Answer(wsi, connection, {.status = 204, .body = ""});
  }
  if (lws_hdr_total_length(wsi, WSI_TOKEN_POST_URI) <= 0) {
    return Answer(wsi, connection, {.status = 405, .body = R"({"error":"only POST is served here"})"});
  }
  connection.path = telemetry::RequestHeader(wsi, WSI_TOKEN_POST_URI);
  if (!JoinRequests::Has(connection.path)) {
    return Answer(wsi, connection,
                  {.status = 404, .body = R"({"error":"only /v1/instances, /v1/join and /v1/leave are served here"})"});
  }
  std::uint64_t bytes = 0;
  if (!absl::SimpleAtoi(telemetry::RequestHeader(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH), &bytes)) {
    return Answer(wsi, connection, {.status = 411, .body = R"({"error":"Content-Length is missing"})"});
  }
  if (bytes == 0 || bytes > kMaxJoinBodyBytes) {
    const absl::Status status =
        absl::InvalidArgumentError(absl::StrCat("body: ", bytes, " bytes are not 1 to ", kMaxJoinBodyBytes));
    PageAnswer answer = ErrorAnswer(status);
    answer.status = bytes == 0 ? 400 : 413;
    return Answer(wsi, connection, std::move(answer));
  }
  return 0;
}

int HttpsDoor::Impl::TakeBody(lws* wsi, Connection& connection, std::string_view bytes) {
  if (connection.answer) return 0;
  const bool late = HttpsClock::now() - connection.begun > kRequestPatience;
  if (late || connection.body.size() + bytes.size() > kMaxJoinBodyBytes) return -1;
  connection.body.append(bytes);
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kRequestSeconds);
  return 0;
}

void HttpsDoor::Impl::Start(lws* wsi, Connection& connection) {
  if (connection.answer) return;
  lws_set_timeout(wsi, NO_PENDING_TIMEOUT, 0);
  auto doing = std::make_unique<Work>();
  std::array<char, 64> from{};
  if (IsSocket() || lws_get_peer_simple(wsi, from.data(), from.size()) == nullptr) from = {"local"};
  PageRequest request{
      .path = connection.path, .body = std::move(connection.body), .from = from.data(), .address = connection.address};
  doing->thread =
      std::thread([this, number = connection.number, request = std::move(request), &given_up = doing->given_up] {
        PageAnswer answer = requests.CarryOut(request, [&] { return given_up || stopping; });
        const std::lock_guard lock(mutex);
        finished.emplace_back(number, std::move(answer));
        listener.Wake();
      });
  work.emplace(connection.number, std::move(doing));
}

void HttpsDoor::Impl::TakeFinished() {
  std::vector<std::pair<std::uint64_t, PageAnswer>> taken;
  {
    const std::lock_guard lock(mutex);
    taken.swap(finished);
  }
  for (auto& [number, answer] : taken) {
    if (const auto doing = work.find(number); doing != work.end()) {
      doing->second->thread.join();
      work.erase(doing);
    }
    for (auto& [wsi, connection] : connections) {
      if (connection.number != number) continue;
      Answer(wsi, connection, std::move(answer));
      break;
    }
  }
}

int HttpsDoor::Impl::Answer(lws* wsi, Connection& connection, PageAnswer answer) {
  connection.answer = std::move(answer);
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kRequestSeconds);
  lws_callback_on_writable(wsi);
  return 0;
}

// One request a connection: the next one is counted anew.
int HttpsDoor::Impl::Write(lws* wsi, Connection& connection) {
  const PageAnswer& page = *connection.answer;
  // Nothing that a browser sends of itself counts here, so a page of any origin may ask as any program may.
  telemetry::LastAnswer answer{.status = page.status,
                               .content_type = "application/json",
                               .body = page.body,
                               .headers = {{"cache-control:", "no-store"}, {"access-control-allow-origin:", "*"}}};
  if (connection.options) {
    answer.headers.emplace_back("access-control-allow-methods:", "POST");
    answer.headers.emplace_back("access-control-allow-headers:", "content-type");
  }
  if (page.retry_after_s > 0) answer.headers.emplace_back("retry-after:", std::to_string(page.retry_after_s));
  return telemetry::WriteLastAnswer(wsi, answer);
}

// --- The loop --------------------------------------------------------------------------------------------------------

int HttpsDoor::Impl::OnEvent(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len) {
  // Null for a connection that is not counted yet, or no more.
  const auto connection = [wsi]() -> Connection* {
    const auto found = Of(wsi).connections.find(wsi);
    return found == Of(wsi).connections.end() ? nullptr : &found->second;
  };
  switch (reason) {
    case LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS:
      return trust::LoadServerCertificate(static_cast<SSL_CTX*>(user), CertificateOf(Of(wsi).settings),
                                          kCertificateName)
                     .ok()
                 ? 0
                 : 1;
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      return Of(wsi).MayConnect(static_cast<int>(reinterpret_cast<std::intptr_t>(in))) ? 0 : 1;
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
      Of(wsi).Opened(wsi);
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      Of(wsi).Closed(wsi);
      return 0;
    case LWS_CALLBACK_HTTP:
      return connection() == nullptr ? -1 : Of(wsi).Begin(wsi, *connection());
    case LWS_CALLBACK_HTTP_BODY:
      return connection() == nullptr ? -1 : Of(wsi).TakeBody(wsi, *connection(), {static_cast<const char*>(in), len});
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      if (connection() == nullptr) return -1;
      Of(wsi).Start(wsi, *connection());
      return 0;
    case LWS_CALLBACK_HTTP_WRITEABLE:
      if (connection() == nullptr || !connection()->answer) return 0;
      return Of(wsi).Write(wsi, *connection());
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      Of(wsi).TakeFinished();
      return 0;
    default:
      return 0;
  }
}

void HttpsDoor::Impl::Stop() {
  stopping = true;
  listener.Wake();
  if (loop.joinable()) loop.join();
  for (auto& [number, doing] : work) {
    doing->given_up = true;
    doing->thread.join();
  }
  listener.Close();
  if (IsSocket()) unlink(settings.socket_path.c_str());
}

absl::StatusOr<std::unique_ptr<HttpsDoor>> HttpsDoor::Start(HttpsSettings settings, ControlPlane& plane,
                                                            ControlMetrics& metrics) {
  absl::Status ready = settings.socket_path.empty()
                           ? trust::CheckServerCertificate(CertificateOf(settings), kCertificateName)
                           : PrepareSocket(settings.socket_path);
  if (ready.ok() && settings.socket_path.empty()) ready = host::CheckBindable(settings.listen, "players' https");
  if (!ready.ok()) return ready;
  auto impl = std::make_unique<Impl>(std::move(settings), plane, metrics);
  Impl& me = *impl;
  lws_set_log_level(LLL_ERR | LLL_WARN, ForwardWebLog);
  const bool open = me.listener.Open({.listen = me.settings.listen,
                                      .socket_path = me.settings.socket_path,
                                      .tls = !me.IsSocket(),
                                      .timeout_s = kRequestSeconds,
                                      .keepalive_s = kRequestSeconds},
                                     {{"http", Impl::OnEvent, 0, 0, 0, nullptr, 0}}, &me);
  std::unique_ptr<HttpsDoor> door(new HttpsDoor(std::move(impl)));
  if (!open) {
    const std::string where = me.IsSocket() ? me.settings.socket_path : "address " + host::ToString(me.settings.listen);
    return absl::UnavailableError(absl::StrCat(where, " cannot be served"));
  }
  if (me.IsSocket()) ready = CloseToOthers(me.settings.socket_path);
  if (!ready.ok()) return ready;
  me.loop = std::thread([&me] { me.listener.Serve(me.stopping); });
  return door;
}

HttpsDoor::HttpsDoor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

HttpsDoor::~HttpsDoor() { impl_->Stop(); }

std::string HttpsDoor::address() const {
  if (impl_->IsSocket()) return impl_->settings.socket_path;
  return host::ToString({impl_->settings.listen.host, impl_->listener.port()});
}

}  // namespace tessera::control
