#include "bench/flood_seat.h"

#include <fmt/format.h>
#include <sched.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <optional>
#include <thread>

#include "client_sdk/control_session.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/program_folder.h"
#include "local_cluster/command_error.h"
#include "net/endpoint.h"
#include "net/testing/spoofed_flood.h"

namespace tessera::bench {
namespace {

using FloodClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr double kHellosPerSecond = 100'000;
constexpr std::size_t kStrangersAddresses = 256;
constexpr std::chrono::seconds kFloodPatience{30};
constexpr std::size_t kMaxFloodSays = 4096;

volatile std::sig_atomic_t flood_is_over = 0;

std::uint64_t FloodWithHellos(std::uint16_t port, const net::Knock& knock) {
  net::SpoofedFlood flood(kStrangersAddresses);
  const auto begin = FloodClock::now();
  for (std::uint32_t sent = 0; flood_is_over == 0;) {
    const double passed_s = std::chrono::duration<double>(FloodClock::now() - begin).count();
    const auto due = static_cast<std::uint32_t>(passed_s * kHellosPerSecond);
    for (; sent < due && flood_is_over == 0; ++sent) flood.Send(port, net::BlindHello(sent, knock));
    flood.Drain();
    std::this_thread::sleep_for(milliseconds(1));
  }
  return flood.datagrams();
}

client::JoinCall FloodersCall(const std::string& instance) {
  client::JoinCall call{.instance_id = instance, .player_name = "flood", .ticket = {}, .returning = {}};
  call.deadline = milliseconds(10'000);
  return call;
}

// The beginning of the nonce in each hello of a player of the instance.
std::optional<net::Knock> OverheardKnock(const std::string& control, const std::string& instance) {
  const auto session = client::JoinInstance(control, FloodersCall(instance));
  if (!session.ok()) return std::nullopt;
  (void)client::LeaveInstance(control, instance, session->credentials, milliseconds(5000));
  return net::KnockOf(session->credentials.instance_key);
}

// A player joins, connects to the first region, and sends what is no input as fast as it can. Thrown out, it ends, and
// another one takes its place.
std::uint64_t FloodAsPlayer(const std::string& control, const std::string& instance) {
  std::uint64_t sent = 0;
  const std::vector<std::uint8_t> junk(100, 0x55);
  while (flood_is_over == 0) {
    const auto session = client::JoinInstance(control, FloodersCall(instance));
    auto endpoint = net::Endpoint::Create({.bind_address = "127.0.0.1", .max_peers = 2});
    if (!session.ok() || !endpoint.ok()) break;
    const client::RegionEndpoint& region = session->regions.front();
    const auto peer =
        (*endpoint)->Connect(region.host, region.port, region.region, region.incarnation, session->credentials);
    if (!peer.ok()) break;
    bool connected = false, ended = false;
    while (flood_is_over == 0 && !ended) {
      for (const net::Event& event : (*endpoint)->Service(milliseconds(connected ? 0 : 5))) {
        connected |= event.kind == net::Event::Kind::kConnected;
        ended |= event.kind == net::Event::Kind::kDisconnected;
      }
      for (int i = 0; connected && !ended && i < 256; ++i) {
        sent += (*endpoint)->Send(*peer, net::Delivery::kUnsequenced, junk).ok() ? 1 : 0;
      }
      (*endpoint)->Flush();
    }
    (void)client::LeaveInstance(control, instance, session->credentials, milliseconds(5000));
  }
  return sent;
}

std::vector<std::string> FloodCommand(const FloodSeat& seat) {
  return {host::ProgramFolder() + "/tessera-bench",
          "flooder",
          seat.kind,
          std::to_string(seat.port),
          seat.control,
          seat.instance};
}

}  // namespace

int FloodFromSeat(const FloodSeat& seat) {
  if (seat.kind != "hellos" && seat.kind != "overheard" && seat.kind != "player") return 2;
  const sched_param lowest{};
  if (sched_setscheduler(0, SCHED_IDLE, &lowest) != 0) return 1;  // before there is another thread
  std::signal(SIGTERM, [](int) { flood_is_over = 1; });
  const auto begin = FloodClock::now();
  std::uint64_t sent = 0;
  if (seat.kind == "player") {
    sent = FloodAsPlayer(seat.control, seat.instance);
  } else {
    const bool strangers = seat.kind == "hellos";
    const auto knock = strangers ? net::Knock{} : OverheardKnock(seat.control, seat.instance);
    if (!knock) return 1;
    sent = FloodWithHellos(seat.port, *knock);
  }
  if (flood_is_over == 0) return 1;
  std::cout << static_cast<double>(sent) / std::chrono::duration<double>(FloodClock::now() - begin).count() << "\n";
  return 0;
}

RunningFlood::RunningFlood(const FloodSeat& seat)
    : process_(local::OrThrow(host::ChildProcess::Start({.argv = FloodCommand(seat),
                                                         .log_path = folder_.path() + "/log",
                                                         .output_path = folder_.path() + "/said"}))) {}

double RunningFlood::Stop() {
  process_.Signal(SIGTERM);
  const auto ended = process_.Wait(kFloodPatience);
  if (!ended || !ended->Clean()) {
    throw local::CommandError("the flood " + (ended ? ended->Describe() : "did not end") +
                              host::LastLinesText(folder_.path() + "/log", 4));
  }
  return std::stod(local::OrThrow(host::ReadFile(folder_.path() + "/said", kMaxFloodSays)));
}

}  // namespace tessera::bench
