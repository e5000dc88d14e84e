// Attacks of players at the ports of the regions themselves.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <string>

#include "client_sdk/control_session.h"
#include "local_cluster/command_error.h"
#include "net/limits.h"
#include "telemetry/http_get.h"
#include "tests/support/attack_calls.h"
#include "tests/support/attacks.h"
#include "tests/support/knocks.h"

namespace tessera::support {
namespace {

constexpr std::chrono::milliseconds kWelcomePatience = kAttackPatience;

// Logins at a region's game port so far, by how they were answered.
struct Logins {
  double accepted = 0, held_off = 0;
};

double SampleOf(const std::string& page, const std::string& name) {
  const std::size_t at = page.find("\n" + name + " ");
  if (at == std::string::npos) throw local::CommandError("a region shows no " + name);
  return std::stod(page.substr(at + name.size() + 2));
}

Logins LoginsAt(const v1::RegionAddress& address) {
  const auto page =
      local::OrThrow(telemetry::HttpGet(fmt::format("{}:{}", address.host(), address.metrics_port()), "/metrics"));
  const auto count = [&page](const char* result) {
    return SampleOf(page.body,
                    fmt::format("tessera_region_acceptor_datagrams_total{{port=\"game\",result=\"{}\"}}", result));
  };
  return {.accepted = count("accepted"), .held_off = count("held_off")};
}

v1::RegionAddress AddressOf(const v1::Instance& instance, RegionId region) {
  for (const v1::RegionStatus& status : instance.region_status()) {
    if (RegionId(status.region()) == region) return status.report().address();
  }
  throw local::CommandError(fmt::format("there is no region {}", region.value()));
}

}  // namespace

Outcome ComeBackAtTheRegion(const Target& target, const std::string& instance, int times) {
  Outcome outcome;
  client::JoinCall join{.instance_id = instance, .player_name = "leaver", .ticket = {}, .returning = {}};
  join.deadline = kWelcomePatience;
  const client::Session session = local::OrThrow(client::JoinInstance(target.players, join));
  const client::RegionEndpoint& at = session.regions.front();
  const Knock knock{.host = at.host, .port = at.port, .region = at.region, .credentials = session.credentials};
  const auto come = [&knock] { return KnockAll({knock}, kWelcomePatience).front(); };
  const Knocked first = come();
  outcome.Try("who has joined is not let in: " + first.said, first.answer == Knocked::Answer::kOpened);
  local::OrThrow(client::LeaveInstance(target.players, instance, session.credentials, kWelcomePatience));

  // The region hears of it a moment later, and says so.
  Knocked gone = come();
  const auto patience_ends = std::chrono::steady_clock::now() + kAttackPatience;
  while (gone.answer == Knocked::Answer::kOpened && std::chrono::steady_clock::now() < patience_ends) gone = come();
  outcome.Try("who has left is not told: " + gone.said,
              gone.answer == Knocked::Answer::kRefused && gone.said.find("has left") != std::string::npos);

  const v1::RegionAddress address = AddressOf(GetInstance(target, instance), at.region);
  const Logins before = LoginsAt(address);
  const auto begin = std::chrono::steady_clock::now();
  int untold = 0;
  for (int i = 0; i < times; ++i) {
    const Knocked again = come();
    outcome.Try("who has left is let in: " + again.said, again.answer != Knocked::Answer::kOpened);
    untold += again.answer == Knocked::Answer::kRefused && !again.said.empty() ? 0 : 1;
  }
  (void)come();  // once it is answered, the metrics have all before it
  const Logins after = LoginsAt(address);
  outcome.Try(fmt::format("{} of {} are not told why", untold, times), untold == 0);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const double windows = std::floor(took / net::kHoldOff) + 1;
  const double looked_at = after.accepted - before.accepted, most = net::kRefusalsAtOnce * windows;
  outcome.Try(fmt::format("{} of {} logins were looked at", looked_at, times), looked_at <= most);
  outcome.Try(fmt::format("{} of {} were held off", after.held_off - before.held_off, times),
              after.held_off - before.held_off >= times - most);
  outcome.Try("the world ended", GetInstance(target, instance).state() == v1::INSTANCE_STATE_RUNNING);
  return outcome;
}

}  // namespace tessera::support
