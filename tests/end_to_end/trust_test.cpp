// A cluster that is reached over the network, as operators set it up: the first administrator, tokens, a host that
// joins by TLS and runs a world, players at their door; and what strangers, former hosts and viewers get.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "host/files.h"
#include "host/last_lines.h"
#include "local_cluster/bot.h"
#include "tests/end_to_end/gateway_fixture.h"
#include "tests/end_to_end/trust_fixture.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(TrustTest, AWorldRunsOnAHostThatJoinedByTlsAndPlayersComeIn) {
  const std::string token = JoinToken("alpha");
  ASSERT_TRUE(StartAgent(token)) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies",
                                              "50", "--regions", "2", "--guests", "on", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  EXPECT_EQ(Tessera({"instance", "checkpoint", "inst-1"}).exit_code, 0) << "the agent uploads it";
  EXPECT_EQ(Tessera({"instance", "restore", "inst-1", "--wait"}).exit_code, 0) << "and fetches it";

  // A player knows the players' door and the fingerprint, and has no token.
  const auto bot = local::Bot::Join(players_ + "#" + fingerprint_, "inst-1", "ada", 7);
  ASSERT_TRUE(bot.ok()) << bot.status();
  EXPECT_TRUE((*bot)->client().Leave(std::chrono::seconds(10)).ok());
  const auto at_operators = local::Bot::Join(operators_ + "#" + fingerprint_, "inst-1", "eve", 7);
  EXPECT_EQ(at_operators.status().code(), absl::StatusCode::kUnauthenticated);

  // Both come back by what they have stored: the authority with its key, the host with its certificate.
  control_->End(kPatience);
  StartControl(operators_, players_);
  agent_->End(kPatience);
  ASSERT_TRUE(StartAgent("tsj_used." + fingerprint_)) << host::LastLinesText(AgentLog(), 5);
  EXPECT_EQ(FirstLine(Tessera({"cluster", "authority"})), fingerprint_);
  EXPECT_THAT(Everything(), Not(HasSubstr(token.substr(0, 68)))) << "no secret is in a log";
}

// By certificates that live 3.6 s, under a world that runs on.
TEST_F(TrustTest, ACertificateRenewsItselfAndTheEarlierOneIsWorthNothing) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"), {"--certificate-hours", "0.001"})) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies",
                                              "50", "--regions", "2", "--guests", "on", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  const std::string earlier = folder_.path() + "/earlier";
  std::filesystem::create_directory(earlier);
  std::filesystem::copy_file(folder_.path() + "/agent/host.json", earlier + "/host.json");
  const std::string metrics = AwaitRenewals(3);
  EXPECT_THAT(metrics, HasSubstr("\ntessera_agent_certificate_life_seconds 3.6\n"));
  EXPECT_THAT(metrics, HasSubstr("\ntessera_agent_certificate_left_seconds "));
  EXPECT_THAT(*host::ReadFile(ControlLog(), kMaxFileBytes), HasSubstr("host shows its next certificate host=alpha"));
  const auto instance = nlohmann::json::parse(Tessera({"-o", "json", "instance", "describe", "inst-1"}).out);
  EXPECT_EQ(instance.at("state"), "INSTANCE_STATE_RUNNING");
  EXPECT_EQ(instance.value("failovers", 0), 0);

  const support::RunResult thief = support::RunProgram(
      "tessera-agent", {"--control", operators_, "--state-dir", earlier, "--metrics-listen", "127.0.0.1:0"});
  EXPECT_EQ(thief.exit_code, 1);
  EXPECT_THAT(thief.out + thief.err, HasSubstr("the certificate is not that of host-1"));
  agent_->End(kPatience);
  ASSERT_TRUE(StartAgent("tsj_used." + fingerprint_)) << host::LastLinesText(AgentLog(), 5);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // a sanitizer wants to be the first library
// Nobody's certificate, lease or link looks at a date.
TEST_F(TrustTest, AHostWhoseClockIs400DaysOffRunsAWorldAsAnyOther) {
  for (const char* shift_s : {"34560000", "-34560000", "3600"}) {
    setenv("LD_PRELOAD", TESSERA_BINARY_DIR "/tests/shifted_clock.so", 1);
    setenv("TESSERA_CLOCK_SHIFT_S", shift_s, 1);
    const bool admitted = StartAgent(agent_ ? "tsj_used." + fingerprint_ : JoinToken("alpha"));
    unsetenv("LD_PRELOAD");
    ASSERT_TRUE(admitted) << shift_s << host::LastLinesText(AgentLog(), 5);
    const support::RunResult running =
        Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies", "20", "--regions", "2",
                 "--guests", "on", "--wait", "-o", "name"});
    ASSERT_EQ(running.exit_code, 0) << running.err;
    const std::string name = FirstLine(running), id = name.substr(name.find('/') + 1);
    const auto bot = local::Bot::Join(players_ + "#" + fingerprint_, id, "ada", 7);
    ASSERT_TRUE(bot.ok()) << bot.status();
    EXPECT_TRUE((*bot)->client().Leave(std::chrono::seconds(10)).ok());
    EXPECT_NEAR(SecondsAhead(std::stod(shift_s)), std::stod(shift_s), 60) << "it is measured, and no more";
    EXPECT_EQ(Tessera({"instance", "delete", id, "--wait"}).exit_code, 0);
    agent_->End(kPatience);
  }
  const std::time_t shifted = std::time(nullptr) + 34'560'000;
  EXPECT_THAT(*host::ReadFile(AgentLog(), kMaxFileBytes), HasSubstr(fmt::format("{:%Y-%m-}", *std::gmtime(&shifted))))
      << "the clock was wrong indeed";
}
#endif

// Where no guests are taken, a developer's bots show tickets too.
TEST_F(TrustTest, BotsComeInByTickets) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies",
                                              "20", "--regions", "1", "--guests", "off", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  const std::string key = folder_.path() + "/game.key", bots = folder_.path() + "/bots.tickets";
  ASSERT_EQ(Tessera({"issuer", "create", "game", "--key-out", key}).exit_code, 0);
  const auto sign = [&](const std::string& player) {
    return FirstLine(Tessera({"ticket", "sign", "--key", key, "--player", player, "--name", player}));
  };
  const auto at_door = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--control", players_ + "#" + fingerprint_});
    arguments.insert(arguments.end(), {"--seconds", "0.5"});
    return Tessera(arguments);
  };
  const std::string ticket = sign("ada");
  const support::RunResult ada = at_door({"client", "inst-1", "--ticket", ticket});
  EXPECT_EQ(ada.exit_code, 0) << ada.err;
  EXPECT_THAT(at_door({"client", "inst-1", "--ticket", ticket}).err, HasSubstr("ticket: ")) << "good for one join";
  EXPECT_THAT(at_door({"client", "inst-1"}).err, HasSubstr("a ticket is needed"));
  EXPECT_THAT(at_door({"client", "inst-1", "--ticket", folder_.path() + "/none"}).err, HasSubstr("no such file"));
  EXPECT_EQ(at_door({"client", "inst-1", "--ticket", ticket, "--name", "eve"}).exit_code, 2);

  std::ofstream(bots) << sign("bot-1") << "\n" << sign("bot-2") << "\n";
  EXPECT_THAT(at_door({"swarm", "inst-1", "--players", "3", "--ticket", bots}).err, HasSubstr("2 for 3 players"));
  const support::RunResult swarm = at_door({"swarm", "inst-1", "--players", "2", "--ticket", bots});
  EXPECT_EQ(swarm.exit_code, 0) << swarm.err;
}

// The player's own client learns of it, in the operator's words, and stays away.
TEST_F(TrustTest, WhoIsKickedOrBannedByAnOperatorIsToldWhy) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies",
                                              "20", "--regions", "2", "--guests", "on", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  const std::string door = players_ + "#" + fingerprint_, key = folder_.path() + "/game.key";
  ASSERT_EQ(Tessera({"issuer", "create", "game", "--key-out", key}).exit_code, 0);
  const auto sign = [&] { return FirstLine(Tessera({"ticket", "sign", "--key", key, "--player", "ada"})); };
  const auto guest = local::Bot::Join(door, "inst-1", "eve", 7);
  ASSERT_TRUE(guest.ok()) << guest.status();
  const auto ada = local::Bot::Join(door, "inst-1", "", 8, {}, false, sign());
  ASSERT_TRUE(ada.ok()) << ada.status();
  const auto ends = [](local::Bot& bot) {
    const auto patience_ends = std::chrono::steady_clock::now() + kPatience;
    while (bot.Frame(std::chrono::steady_clock::now()) && std::chrono::steady_clock::now() < patience_ends) {
    }
    return std::string(bot.client().reason().message());
  };
  const std::string number = std::to_string((*guest)->client().player().value());
  const support::RunResult kicked = Tessera({"player", "kick", "inst-1", number, "--reason", "mind your words"});
  ASSERT_EQ(kicked.exit_code, 0) << kicked.err;
  EXPECT_THAT(ends(**guest), HasSubstr("mind your words"));
  const support::RunResult banned = Tessera({"player", "ban", "inst-1", "ada", "--reason", "cheats"});
  ASSERT_EQ(banned.exit_code, 0) << banned.err;
  EXPECT_THAT(ends(**ada), HasSubstr("cheats"));
  const auto again = local::Bot::Join(door, "inst-1", "", 9, {}, false, sign());
  EXPECT_THAT(std::string(again.status().message()), HasSubstr("cheats"));
}

TEST_F(TrustTest, AWorldThatIsMadeByTlsTakesNoGuestsAndIssuersAreAnAdministrators) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera(
      {"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies", "20", "--regions", "1", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  const auto guest = local::Bot::Join(players_ + "#" + fingerprint_, "inst-1", "ada", 7);
  EXPECT_THAT(std::string(guest.status().message()), HasSubstr("this instance takes no guests: a ticket is needed"));

  const std::string key = folder_.path() + "/game.key";
  const support::RunResult made = Tessera({"issuer", "create", "game", "--instances", "inst-1", "--key-out", key});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(std::filesystem::status(key).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(Tessera({"issuer", "create", "other", "--key-out", key}).exit_code, 1) << "no key is overwritten";
  EXPECT_THAT(Tessera({"issuer", "list"}).out, ::testing::AllOf(HasSubstr("game"), HasSubstr("inst-1")));
  const support::RunResult ticket =
      Tessera({"ticket", "sign", "--key", key, "--player", "ada", "--instance", "inst-1"});
  ASSERT_EQ(ticket.exit_code, 0) << ticket.err;
  EXPECT_GT(ticket.out.size(), 100U);
  EXPECT_EQ(Tessera({"player", "ban", "inst-1", "ada", "--reason", "cheats"}).exit_code, 0);
  EXPECT_THAT(Tessera({"player", "bans", "inst-1"}).out, ::testing::AllOf(HasSubstr("ada"), HasSubstr("cheats")));
  EXPECT_EQ(Tessera({"player", "unban", "inst-1", "ada"}).exit_code, 0);
  EXPECT_THAT(Tessera({"player", "kick", "inst-1", "7"}).err, HasSubstr("has no player 7"));
  AddPerson("oscar", "operator");
  EXPECT_THAT(Tessera({"--context", "oscar", "issuer", "list"}).err, HasSubstr("PERMISSION_DENIED"));
  EXPECT_EQ(Tessera({"issuer", "remove", "game"}).exit_code, 0);
  EXPECT_THAT(*host::ReadFile(ControlLog(), kMaxFileBytes), HasSubstr("AccessService/RemoveIssuer who=token/admin"));
}

// The machine of the control plane is lost with its store, and a backup from before everything that happened since is
// all that there is: what runs is taken up as it runs.
TEST_F(TrustTest, AnotherControlPlaneBeginsFromAnOldBackupUnderRunningWorlds) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  const auto create = [](const std::string& regions) {
    const support::RunResult made = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies",
                                             "50", "--regions", regions, "--guests", "on", "--wait"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  };
  create("1");
  (void)JoinToken("beta");
  const std::string backup = folder_.path() + "/cluster.tessera";
  const support::RunResult written = Tessera({"cluster", "backup", backup});
  ASSERT_EQ(written.exit_code, 0) << written.err;
  const support::RunResult scaled = Tessera({"instance", "scale", "inst-1", "--regions", "2", "--wait"});
  ASSERT_EQ(scaled.exit_code, 0) << scaled.err;
  const auto ada = local::Bot::Join(players_ + "#" + fingerprint_, "inst-1", "ada", 7);
  ASSERT_TRUE(ada.ok()) << ada.status();
  create("1");  // inst-2, of which the backup knows nothing
  ASSERT_EQ(Tessera({"host", "remove", "beta"}).exit_code, 0);
  ASSERT_EQ(Tessera({"player", "ban", "all", "mallory", "--reason", "cheats"}).exit_code, 0);
  AwaitKeptRevocations(2);
  const auto workers = [] {
    std::map<std::string, std::int64_t> pids;
    const support::RunResult shown = Tessera({"-o", "json", "host", "describe", "alpha"});
    EXPECT_EQ(shown.exit_code, 0) << shown.err;
    const nlohmann::json described = nlohmann::json::parse(shown.out);
    for (const nlohmann::json& worker : described["workers"]) {
      const nlohmann::json& identity = worker["identity"];
      if (identity["instance_id"] != "inst-1") continue;
      pids[identity["region"].dump()] = std::stoll(identity["pid"].get<std::string>());
    }
    return pids;
  };
  const auto before = workers();
  ASSERT_EQ(before.size(), 2u);

  control_->Signal(SIGKILL);
  ASSERT_TRUE(control_->Wait(kPatience).has_value());
  const std::string state = folder_.path() + "/control", seal = folder_.path() + "/seal.key";
  std::filesystem::copy_file(state + "/seal.key", seal);
  std::filesystem::remove_all(state);
  std::filesystem::create_directory(state);
  std::filesystem::copy_file(seal, state + "/seal.key");
  const support::RunResult restored =
      support::RunProgram("tessera-control", {"--state-dir", state, "--restore", backup});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  EXPECT_THAT(restored.out, HasSubstr("hosts 2, instances 1"));
  EXPECT_THAT(support::RunProgram("tessera-control", {"--state-dir", state, "--restore", backup}).err,
              HasSubstr("holds a cluster already"));
  StartControl(operators_, players_);

  // Commands are refused until what runs is taken up.
  support::RunResult joined = Tessera({"instance", "checkpoint", "inst-1"});
  const auto patience_ends = std::chrono::steady_clock::now() + kPatience;
  while (joined.exit_code != 0 && std::chrono::steady_clock::now() < patience_ends) {
    joined = Tessera({"instance", "checkpoint", "inst-1"});
  }
  ASSERT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_EQ(workers(), before) << "no worker was ended or started";
  EXPECT_THAT(Tessera({"player", "bans", "all"}).out, ::testing::AllOf(HasSubstr("mallory"), HasSubstr("cheats")));
  EXPECT_THAT(Tessera({"host", "list"}).out, ::testing::AllOf(HasSubstr("alpha"), Not(HasSubstr("beta"))));
  EXPECT_THAT(Tessera({"instance", "describe", "inst-1"}).out,
              ::testing::AllOf(HasSubstr("RUNNING"), HasSubstr("taken up as it runs"), HasSubstr("Players:  1")));
  const auto bob = local::Bot::Join(players_ + "#" + fingerprint_, "inst-1", "bob", 8);
  ASSERT_TRUE(bob.ok()) << bob.status();
  EXPECT_GT((*bob)->client().player(), (*ada)->client().player());
  EXPECT_THAT(Tessera({"host", "describe", "alpha"}).out,
              ::testing::AllOf(HasSubstr("UNKNOWN INSTANCE"), HasSubstr("inst-2")));
  EXPECT_EQ(Tessera({"instance", "delete", "inst-2"}).exit_code, 0);
  EXPECT_THAT(Tessera({"host", "describe", "alpha"}).out, Not(HasSubstr("UNKNOWN INSTANCE")));
}

TEST_F(TrustTest, EachRoleDoesItsPart) {
  AddPerson("eve", "viewer");
  AddPerson("oscar", "operator");
  EXPECT_EQ(Tessera({"--context", "eve", "host", "list"}).exit_code, 0);
  const support::RunResult drained = Tessera({"--context", "eve", "host", "add", "beta"});
  EXPECT_EQ(drained.exit_code, 1);
  EXPECT_THAT(drained.err,
              HasSubstr("token eve is a viewer's; this call needs an administrator's (PERMISSION_DENIED)"));
  const support::RunResult created = Tessera({"--context", "eve", "instance", "create", "--scene", "plaza"});
  EXPECT_THAT(created.err, HasSubstr("needs an operator's"));
  // An operator is let in: there is no host to place it on.
  EXPECT_THAT(Tessera({"--context", "oscar", "instance", "create", "--scene", "plaza"}).err,
              HasSubstr("RESOURCE_EXHAUSTED"));
  EXPECT_THAT(Tessera({"--context", "oscar", "token", "list"}).err, HasSubstr("PERMISSION_DENIED"));
  EXPECT_EQ(Tessera({"token", "revoke", "oscar"}).exit_code, 0);
  EXPECT_THAT(Tessera({"--context", "oscar", "host", "list"}).err, HasSubstr("an access token is needed"));
  EXPECT_THAT(Tessera({"token", "list"}).out, ::testing::AllOf(HasSubstr("eve"), Not(HasSubstr("oscar"))));
  // The log has what was done, and by whom.
  const std::string log = *host::ReadFile(ControlLog(), kMaxFileBytes);
  EXPECT_THAT(log, HasSubstr("AccessService/RevokeToken who=token/admin"));
  EXPECT_THAT(log, HasSubstr("refused method=/tessera.v1.HostService/AddHost who=token/eve"));
}

TEST_F(TrustTest, AGatewayWithTooSmallARightSaysWhichItNeeds) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera(
      {"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies", "20", "--regions", "1", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  AddPerson("eve", "viewer");
  const auto text = [](gateway::ViewerSocket& viewer) { return viewer.newest["problem"].value("text", ""); };

  // Eve's right is enough to watch, and not to play.
  FurtherGateway eves(operators_ + "#" + fingerprint_, {"--token-file", folder_.path() + "/eve.token"});
  gateway::ViewerSocket viewer(eves.address, "inst-1");
  ASSERT_TRUE(viewer.Until([&] { return viewer.decoder.bodies.size() >= 20; }, kPatience)) << text(viewer);
  viewer.Send({{"type", "join"}, {"name", "eve"}});
  ASSERT_TRUE(viewer.Until([&] { return viewer.closed.has_value(); }, kPatience));
  EXPECT_EQ(viewer.closed, "4000 not_allowed");
  EXPECT_THAT(text(viewer), ::testing::AllOf(HasSubstr("eve"), HasSubstr("--token-file")));
  EXPECT_FALSE(viewer.newest["problem"].contains("again_s")) << "asking again does not help";
  EXPECT_TRUE(eves.End().Clean());

  // A stranger's token is worth nothing.
  const std::string file = folder_.path() + "/stranger.token";
  std::ofstream(file) << "tst_" + std::string(64, '0') + "\n";
  FurtherGateway strangers(operators_ + "#" + fingerprint_, {"--token-file", file});
  gateway::ViewerSocket stranger(strangers.address, "inst-1");
  ASSERT_TRUE(stranger.Until([&] { return stranger.closed.has_value(); }, kPatience));
  EXPECT_EQ(stranger.closed, "4000 not_allowed");
  EXPECT_FALSE(stranger.newest["problem"].contains("again_s"));
  EXPECT_TRUE(strangers.End().Clean());
}

// The gateway may only watch, and its visitor is whoever the ticket says.
TEST_F(TrustTest, AVisitorPlaysByATicketThroughAGatewayThatMayOnlyWatch) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies",
                                              "20", "--regions", "1", "--guests", "off", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  const std::string key = folder_.path() + "/game.key";
  ASSERT_EQ(Tessera({"issuer", "create", "game", "--key-out", key}).exit_code, 0);
  const std::string ticket =
      FirstLine(Tessera({"ticket", "sign", "--key", key, "--player", "ada@example", "--name", "Ada"}));
  AddPerson("eve", "viewer");
  FurtherGateway gateway(operators_ + "#" + fingerprint_, {"--token-file", folder_.path() + "/eve.token",
                                                           "--players-door", players_ + "#" + fingerprint_});
  gateway::ViewerSocket viewer(gateway.address, "inst-1");
  const auto problem = [&] {
    return viewer.newest.contains("problem") ? viewer.newest.at("problem").value("text", "") : std::string();
  };
  ASSERT_TRUE(viewer.Until([&] { return viewer.decoder.bodies.size() >= 20; }, kPatience)) << problem();
  viewer.Send({{"type", "join"}, {"name", "guest"}});
  ASSERT_TRUE(viewer.Until([&] { return problem() != ""; }, kPatience));
  EXPECT_EQ(viewer.newest["problem"]["code"], "ticket");
  EXPECT_THAT(problem(), HasSubstr("a ticket is needed"));
  viewer.Send({{"type", "join"}, {"ticket", ticket}});
  ASSERT_TRUE(viewer.Until([&] { return viewer.decoder.own_body != 0; }, kPatience)) << problem();
  const std::uint64_t own = viewer.decoder.own_body;
  ASSERT_TRUE(viewer.Until([&] { return viewer.decoder.bodies.contains(own); }, kPatience));
  EXPECT_EQ(viewer.decoder.bodies.at(own).name, "Ada");
  viewer.newest.clear();
  gateway::ViewerSocket another(gateway.address, "inst-1");
  ASSERT_TRUE(another.Until([&] { return another.decoder.bodies.size() >= 20; }, kPatience));
  another.Send({{"type", "join"}, {"ticket", ticket}});
  ASSERT_TRUE(another.Until([&] { return another.newest.contains("problem"); }, kPatience));
  EXPECT_EQ(another.newest["problem"]["code"], "ticket") << "it is good for one try";
  EXPECT_FALSE(viewer.closed.has_value());
  EXPECT_TRUE(gateway.End().Clean());
}

TEST_F(TrustTest, AnOrderIsItsVisitorsAndNotTheGateways) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  const support::RunResult running = Tessera(
      {"instance", "create", "--scene", support::ScenePath("plaza"), "--bodies", "20", "--regions", "1", "--wait"});
  ASSERT_EQ(running.exit_code, 0) << running.err;
  AddPerson("eve", "viewer");
  AddPerson("oscar", "operator");
  // The gateway's own right would be enough for anything.
  AddPerson("root", "administrator");
  FurtherGateway gateway(operators_ + "#" + fingerprint_, {"--token-file", folder_.path() + "/root.token", "--local",
                                                           "--recordings-dir", folder_.path() + "/recordings"});
  gateway::ViewerSocket eve(gateway.address, "inst-1"), oscar(gateway.address, "inst-1");
  int number = 0;
  const auto ask = [&](gateway::ViewerSocket& viewer, nlohmann::json message) {
    message["number"] = ++number;
    viewer.newest.erase("answer");
    viewer.Send(message);
    EXPECT_TRUE(viewer.Until([&] { return viewer.newest.contains("answer"); }, kPatience)) << message;
    EXPECT_EQ(viewer.newest["answer"]["number"], number);
    return viewer.newest["answer"];
  };
  const auto order = [&](gateway::ViewerSocket& viewer, const std::string& what) {
    return ask(viewer, {{"type", "order"}, {"order", what}, {"on", true}, {"region", 1}, {"host", "alpha"}});
  };
  const auto show = [&](gateway::ViewerSocket& viewer, const std::string& name) {
    std::string secret;
    std::ifstream(folder_.path() + "/" + name + ".token") >> secret;
    return ask(viewer, {{"type", "authorize"}, {"token", secret}});
  };
  const auto text = [](const nlohmann::json& answer) { return answer.value("text", ""); };
  ASSERT_TRUE(eve.Until([&] { return eve.decoder.frames > 0; }, kPatience));
  ASSERT_TRUE(oscar.Until([&] { return oscar.decoder.frames > 0; }, kPatience));

  // Without a right, and with a viewer's: nothing, and the line says what to do.
  for (const char* what : {"pause", "checkpoint", "record", "end_worker", "drain"}) {
    const nlohmann::json refused = order(eve, what);
    EXPECT_EQ(refused["ok"], false) << what;
    EXPECT_EQ(refused["needs"], "token") << what;
    EXPECT_THAT(text(refused), HasSubstr("tessera token create NAME --role operator"));
  }
  const nlohmann::json too_small = show(eve, "eve");
  EXPECT_EQ(too_small["ok"], false);
  EXPECT_THAT(text(too_small), HasSubstr("token eve is a viewer's; this call needs an operator's"));
  EXPECT_EQ(order(eve, "pause")["ok"], false);
  EXPECT_EQ(ask(eve, {{"type", "authorize"}, {"token", "tsa_" + std::string(64, '0')}})["ok"], false);

  // An operator's, for him alone; and no more than an operator may.
  EXPECT_EQ(show(oscar, "oscar")["ok"], true);
  nlohmann::json saved = order(oscar, "checkpoint");
  // One that falls into a change of the world is given up, and has to be asked for again.
  for (int again = 0; again < 10 && saved["ok"] == false; ++again) saved = order(oscar, "checkpoint");
  EXPECT_EQ(saved["ok"], true) << saved;
  EXPECT_EQ(order(oscar, "record")["ok"], true);
  EXPECT_THAT(text(order(oscar, "drain")), HasSubstr("this call needs an administrator's"));
  EXPECT_EQ(order(eve, "checkpoint")["ok"], false);
  EXPECT_THAT(*host::ReadFile(ControlLog(), kMaxFileBytes),
              HasSubstr("InstanceService/CheckpointInstance who=token/oscar"));

  // The same by HTTP, as `tessera record` asks.
  const auto record = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"record", "stop", "inst-1", "--gateway", gateway.address};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Tessera(arguments);
  };
  EXPECT_THAT(record({}).err, HasSubstr("an operator's access token of your own"));
  EXPECT_THAT(record({"--token-file", folder_.path() + "/eve.token"}).err, HasSubstr("token eve is a viewer's"));
  EXPECT_THAT(record({"--token-file", folder_.path() + "/oscar.token"}).out, HasSubstr("no longer recorded"));

  // A revoked token counts no more, for the gateway's own orders neither.
  EXPECT_EQ(Tessera({"token", "revoke", "oscar"}).exit_code, 0);
  const nlohmann::json revoked = order(oscar, "end_worker");
  EXPECT_EQ(revoked["ok"], false) << revoked;
  EXPECT_EQ(revoked["needs"], "token");
  EXPECT_TRUE(gateway.End().Clean());
}

TEST_F(TrustTest, AnotherClustersFingerprintIsNotBelieved) {
  const std::string other(64, '7');
  const support::RunResult result = Tessera({"--control", operators_ + "#" + other, "host", "list"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("is not the cluster whose authority was named"));
  // An agent gives its token to nobody else.
  EXPECT_FALSE(StartAgent("tsj_" + std::string(64, '0') + "." + other));
  EXPECT_THAT(*host::ReadFile(AgentLog(), kMaxFileBytes), HasSubstr("is not the cluster whose authority was named"));
}

TEST_F(TrustTest, ARemovedHostStaysOut) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  EXPECT_EQ(Tessera({"host", "remove", "alpha"}).exit_code, 0);
  const auto ended = agent_->Wait(kPatience);
  ASSERT_TRUE(ended.has_value()) << "it is told, and ends";
  EXPECT_FALSE(StartAgent("tsj_none." + fingerprint_));
  EXPECT_THAT(*host::ReadFile(AgentLog(), kMaxFileBytes), HasSubstr("host-1 was removed"));
}

TEST_F(TrustTest, AContextIsKeptByItsUserAlone) {
  const auto file = std::filesystem::status(folder_.path() + "/tessera/contexts.json");
  EXPECT_EQ(file.permissions() & (std::filesystem::perms::group_all | std::filesystem::perms::others_all),
            std::filesystem::perms::none);
  EXPECT_THAT(Tessera({"--context", "nobody", "host", "list"}).err, HasSubstr("--context nobody: there is none"));
  const support::RunResult again = Tessera({"--control", socket_, "cluster", "init", "--address", operators_});
  EXPECT_THAT(again.err, HasSubstr("there is a context admin already"));
  EXPECT_EQ(Tessera({"context", "remove", "admin"}).exit_code, 0);
  EXPECT_THAT(Tessera({"--control", operators_, "host", "list"}).err, HasSubstr("nothing says which cluster"));
}

}  // namespace
}  // namespace tessera::end_to_end
