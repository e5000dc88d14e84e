// A worker's report: what an honest one sends is taken at its largest, and one entry more is refused by name.
#include "control_plane/report_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "core/world/limits.h"

namespace tessera::control {
namespace {

v1::WorkerReport Largest() {
  v1::WorkerReport report;
  for (std::uint32_t i = 1; i <= kMaxPlayers; ++i) {
    report.add_connected_players(i);
    report.add_ended_players()->set_reason(std::string(200, 'x'));
  }
  for (int i = 0; i < 1000; ++i)
    report.add_linked_regions(1), report.add_standby_copies(), report.add_property_answers();
  for (int i = 0; i < 10'000; ++i) report.add_removed_first(1), report.add_removed_last(1);
  for (int i = 0; i < 512; ++i) report.add_game_events();
  for (int i = 0; i < 256; ++i) report.add_spread_x(1), report.add_spread_z(1);
  for (int i = 0; i < 100; ++i) report.add_nonfinite_ids(1);
  for (int i = 0; i < 64; ++i) report.add_backend_answers();
  for (int i = 0; i < 32; ++i) report.add_game_lines()->set_text(std::string(600, 'x'));
  report.set_tick_rate_hz(60);
  report.set_public_key(std::string(32, 'k'));
  return report;
}

TEST(ReportLimitsTest, WhatAnHonestWorkerSendsIsTaken) {
  EXPECT_EQ(CheckReport(v1::WorkerReport()), absl::OkStatus());
  EXPECT_EQ(CheckReport(Largest()), absl::OkStatus());
}

TEST(ReportLimitsTest, OneMoreIsRefusedByName) {
  const auto refusal = [](auto change) {
    v1::WorkerReport report = Largest();
    change(report);
    return std::string(CheckReport(report).message());
  };
  using R = v1::WorkerReport;
  EXPECT_EQ(refusal([](R& r) { r.add_connected_players(9); }),
            "report.connected_players: has 10001 entries, at most 10000");
  EXPECT_EQ(refusal([](R& r) { r.add_ended_players(); }), "report.ended_players: has 10001 entries, at most 10000");
  EXPECT_EQ(refusal([](R& r) { r.add_linked_regions(1); }), "report.linked_regions: has 1001 entries, at most 1000");
  EXPECT_EQ(refusal([](R& r) { r.add_removed_last(1); }), "report.removed_last: has 10001 entries, at most 10000");
  EXPECT_EQ(refusal([](R& r) { r.add_game_lines(); }), "report.game_lines: has 33 entries, at most 32");
  EXPECT_EQ(refusal([](R& r) { r.add_spread_x(1); }), "report.spread_x: has 257 entries, at most 256");
  EXPECT_EQ(refusal([](R& r) { r.set_failure(std::string(1 << 20, 'x')); }),
            "report.failure: has 1048576 bytes, at most 16384");
  EXPECT_EQ(refusal([](R& r) { r.set_public_key(std::string(33, 'k')); }), "report.public_key: has 33 bytes, not 32");
  EXPECT_EQ(refusal([](R& r) { r.set_public_key(std::string(31, 'k')); }), "report.public_key: has 31 bytes, not 32");
  EXPECT_EQ(refusal([](R& r) { r.set_tick_rate_hz(std::nan("")); }), "report.tick_rate_hz: is no time or rate");
  EXPECT_EQ(refusal([](R& r) { r.mutable_step()->set_p99_seconds(-1); }), "report.step: is no time or rate");
}

TEST(ReportLimitsTest, AnAgentNamesNoMoreWorkersThanAHostMayRun) {
  v1::AgentMessage message;
  for (int i = 0; i < 2000; ++i) {
    message.mutable_heartbeat()->add_workers()->mutable_identity()->set_instance_id("inst-18446744073709551615");
  }
  v1::AgentMessage hello;
  *hello.mutable_hello()->mutable_workers() = message.heartbeat().workers();
  EXPECT_EQ(CheckMessage(message), absl::OkStatus());
  EXPECT_EQ(CheckMessage(hello), absl::OkStatus());
  message.mutable_heartbeat()->add_workers();
  hello.mutable_hello()->add_workers();
  EXPECT_EQ(CheckMessage(message).message(), "heartbeat.workers: has 2001 entries, at most 2000");
  EXPECT_EQ(CheckMessage(hello).message(), "hello.workers: has 2001 entries, at most 2000");
}

TEST(ReportLimitsTest, TheLastWordsOfAWorkerAreFewAndShort) {
  v1::AgentMessage message;
  v1::WorkerExited& exited = *message.mutable_exited();
  for (int i = 0; i < 20; ++i) exited.add_last_log_lines(std::string(500, 'x'));  // as an agent sends
  EXPECT_EQ(CheckMessage(message), absl::OkStatus());
  const auto refusal = [&](auto change) {
    v1::AgentMessage changed = message;
    change(*changed.mutable_exited());
    return std::string(CheckMessage(changed).message());
  };
  using E = v1::WorkerExited;
  EXPECT_EQ(refusal([](E& e) {
              for (int i = 0; i < 45; ++i) e.add_last_log_lines("x");
            }),
            "exited.last_log_lines: has 65 entries, at most 64");
  EXPECT_EQ(refusal([](E& e) { e.set_last_log_lines(3, std::string(20'000, 'x')); }),
            "exited.last_log_lines: has 20000 bytes, at most 16384");
  EXPECT_EQ(refusal([](E& e) { e.set_reason(std::string(20'000, 'x')); }),
            "exited.reason: has 20000 bytes, at most 16384");
  EXPECT_EQ(refusal([](E& e) { e.set_died_in_game(std::string(20'000, 'x')); }),
            "exited.died_in_game: has 20000 bytes, at most 16384");
}

TEST(ReportLimitsTest, NativeGamesOfAHostAreFewNamedAndWhole) {
  v1::AgentMessage message;
  for (int i = 100; i < 164; ++i) {
    v1::GameModule& module = *message.mutable_game_modules()->add_modules();
    module.set_name("game" + std::to_string(i));
    module.set_hash(std::string(64, 'a'));
  }
  EXPECT_EQ(CheckMessage(message), absl::OkStatus());
  const auto refusal = [&](auto change) {
    v1::AgentMessage changed = message;
    change(*changed.mutable_game_modules());
    return std::string(CheckMessage(changed).message());
  };
  using L = v1::GameModuleList;
  EXPECT_EQ(refusal([](L& l) { l.add_modules(); }), "message.game_modules: has 65 entries, at most 64");
  EXPECT_EQ(refusal([](L& l) { l.mutable_modules(0)->set_name("../arena"); }),
            "message.game_modules.name: game module: its name must be 1 to 63 letters, digits, '_' and '-'");
  EXPECT_EQ(refusal([](L& l) { l.mutable_modules(1)->set_name("game100"); }),
            "message.game_modules: are not ascending by name");
  EXPECT_EQ(refusal([](L& l) { l.mutable_modules(1)->set_hash("feed"); }),
            "message.game_modules.hash: must be 64 hexadecimal digits");
  EXPECT_EQ(refusal([](L& l) { l.mutable_modules(1)->set_failure(std::string(700, 'x')); }),
            "message.game_modules.failure: has 700 bytes, at most 600");
}

TEST(ReportLimitsTest, AnIdentityThatNoInstanceCanHaveIsRefused) {
  v1::WorkerIdentity identity;
  identity.set_instance_id(std::string(64, 'x'));
  v1::AgentMessage heartbeat, report, exited, inventory, lease;
  *heartbeat.mutable_heartbeat()->add_workers()->mutable_identity() = identity;
  *report.mutable_report()->mutable_identity() = identity;
  *exited.mutable_exited()->mutable_identity() = identity;
  *inventory.mutable_inventory()->mutable_identity() = identity;
  *lease.mutable_lease()->mutable_identity() = identity;
  const std::string says = ".instance_id: has 64 bytes, at most 63";
  EXPECT_EQ(CheckMessage(heartbeat).message(), "heartbeat.workers.identity" + says);
  EXPECT_EQ(CheckMessage(report).message(), "report.identity" + says);
  EXPECT_EQ(CheckMessage(exited).message(), "exited.identity" + says);
  EXPECT_EQ(CheckMessage(inventory).message(), "inventory.identity" + says);
  EXPECT_EQ(CheckMessage(lease).message(), "lease.identity" + says);
}

}  // namespace
}  // namespace tessera::control
