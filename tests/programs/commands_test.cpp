// Every command that a document shows is run against a real cluster, or stands below with the reason why it is not. A
// command that is not run is still held against the options of its program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "host/files.h"
#include "tests/programs/accepted.h"
#include "tests/programs/documents.h"
#include "tests/programs/terminal.h"

namespace tessera::programs {
namespace {

struct NotRun {
  std::string_view begin;  // the first words of the command
  std::string_view reason;
};

constexpr const char* kInContainer = "needs root and systemd; deploy/systemd/try_units.sh does it in a container";
constexpr const char* kWholeBuild = "builds this repository, of which this test is a part";
constexpr const char* kNativeGame = "needs a game of the reader's own; end_to_end_native_test has one";
constexpr const char* kTakesLong = "takes minutes or more; its parts are run by their own tests";
constexpr const char* kTickets = "needs tickets for an instance; end_to_end_trust_test has some";
constexpr const char* kPeers = "builds another engine, whose sources are not here";

constexpr auto kNotRun = std::to_array<NotRun>({
    {"./dev test", kWholeBuild},
    {"./dev build", kWholeBuild},
    {"./dev fmt", "changes the sources"},
    {"./dev lint", kTakesLong},
    {"./dev play", "opens a window; end_to_end_desktop_test runs tessera-desktop"},
    {"./dev demo", "builds the release; end_to_end_instance_test runs tessera demo"},
    {"./dev bench", kTakesLong},
    {"./dev sim", kTakesLong},
    {"./dev skew", kTakesLong},
    {".ci/run", kTakesLong},
    {"P=$HOME/peers", "goes with the next ones"},
    {"cmake -S box3d", kPeers},
    {"cmake -S JoltPhysics/Build", kPeers},
    {"cmake --preset release", kWholeBuild},
    {"python3 make_binding.py", "works in an installed package; sdk_python_test runs it"},
    {"cmake -S first", "needs an installed package; programs_sdk_tutorial_test does it with one"},
    {"cmake --build first", "goes with the one before"},
    {"first/build/first", "goes with the one before"},
    {"cmake -S /opt/tessera/share/tessera/godot",
     "needs an installed package; sdk_package_test builds the same from one"},
    {"cmake --build plugin", "goes with the one before"},
    {"cmake build/dev -DTESSERA_GODOT=", "needs Godot; godot_plugin_test has a fake of it"},
    {"godot --path sample", "goes with the one before"},
    {"mcs -unsafe", "works in an installed package; sdk_csharp_test compiles and runs the sample"},
    {"LD_LIBRARY_PATH=/opt/tessera/lib", "goes with the one before"},
    {"cmake --install", "installs into the system; sdk_package_test installs elsewhere"},
    {"apt-get install",
     "needs root and the network; ./dev package --try installs the same packages in an empty system"},
    {"./dev package", kTakesLong},
    {"tessera instance set-property inst-1 world", "needs a world with a game, and those of this test have none"},
    {"tessera demo", "runs for a minute; end_to_end_instance_test runs it for less"},
    {"systemd-sysusers", kInContainer},
    {"sysctl", "needs root, and changes the kernel of the machine"},
    {"journalctl -k", "reads the log of the machine's kernel, which not every user may"},
    {"systemctl daemon-reload", kInContainer},
    {"systemctl edit tessera-agent", kInContainer},
    {"systemctl enable", kInContainer},
    {"systemctl disable", kInContainer},
    {"systemctl kill tessera-agent", kInContainer},
    {"systemctl stop tessera-agent && systemctl kill tessera-agent", kInContainer},
    {"tessera-control --state-dir /var/lib/tessera/control --restore",
     "needs an empty machine; end_to_end_trust_test restores a backup under running worlds"},
    {"AWS_", "lines of /etc/default/tessera-control, with somebody's own keys"},
    {"tessera-control --state-dir /var/lib/tessera/control --checkpoints",
     "needs an etcd of three machines; control_grpc_server_test restores into one"},
    {"systemctl stop tessera-control", kInContainer},
    {"systemctl start tessera-control", kInContainer},
    {"systemctl restart tessera-agent tessera-control", kInContainer},
    {"systemctl link", kInContainer},
    {"install -d -m 0700 /etc/credstore", kInContainer},
    {"(umask 077; cat > /etc/credstore/tessera.join-token)", kInContainer},
    {"rm /etc/credstore/tessera.join-token", kInContainer},
    {"head -c 24 /dev/urandom", "writes a secret into /etc"},
    {"chmod 640 /etc/tessera-metrics.token", "goes with the one before"},
    {"rm /var/lib/tessera/agent/host.json", "needs an installed agent that has lost its control plane"},
    {"journalctl -u tessera-control", kInContainer},
    {"journalctl -p warning", kInContainer},
    {"journalctl -u 'tessera-*'", kInContainer},
    {"systemctl status", kInContainer},
    {"journalctl -u tessera-agent", kInContainer},
    {"less /var/lib/tessera/agent/logs/", "needs a person and an installed agent"},
    {"c++ -std=c++17 -O2 -fPIC -shared", "needs a game of the reader's own; game_native_test builds one like it"},
    {"cc -O2 -ffp-contract=off", "needs a copy of the example's sources; game_native_test loads the same library"},
    {"tessera-region --scene scene.textproto --game drive.lua", "runs until it is stopped; worker_test does it"},
    {"tessera game test drive_test.lua", "needs a game of the reader's own; game_tests_test has one like it"},
    {"tessera instance create --scene scene.json --game native:", kNativeGame},
    {"tessera instance create --scene scene.textproto --game drive.lua", kNativeGame},
    {"install -d /usr/local/lib/tessera/games", kNativeGame},
    {"install -m 644 arena.so", kNativeGame},
    {"mv /usr/local/lib/tessera/games/", kNativeGame},
    {"tessera --control unix:/var/lib/tessera",
     "needs an installed control plane; end_to_end_trust_test does it with one"},
    {"tessera up --players-https", "runs until it is stopped; programs_up_test does it"},
    {"tessera-desktop --page", "opens a window; end_to_end_desktop_test runs tessera-desktop"},
    {"tessera-desktop --visuals", "opens a window; end_to_end_desktop_test runs tessera-desktop"},
    {"tessera client inst-7 --ticket", kTickets},
    {"tessera swarm inst-7 --players 20 --ticket", kTickets},
    {"tessera context add", "needs a cluster that is reached by TLS; end_to_end_trust_test has one"},
    {"prometheus --config.file=", "runs until it is stopped; deploy_prometheus_config checks the file"},
    {"valgrind --tool=callgrind", kTakesLong},
    {"deploy/systemd/try_units.sh", "needs root, and makes a container from Debian's mirror"},
});

// A command that a block takes for granted: `word` occurs in the block, and none of its commands begins with `maker`.
struct Preparation {
  std::string_view word, maker, command;
};
constexpr std::array<Preparation, 5> kPreparations = {{
    {"game.lua", "echo", "echo 'function on_tick() end' > game.lua"},
    {"set-game", "tessera instance create", "tessera instance create --scene plaza --game game.lua --regions 2 --wait"},
    {"inst-1", "tessera instance create", "tessera instance create --scene plaza --regions 2 --wait"},
    {"alpha", "tessera host add", "tessera host add alpha"},
    {"harbour.glb", "cp", "cp " TESSERA_SOURCE_DIR "/tests/fuzz/seeds/gltf_fuzz/harbour.glb ."},
}};

bool BeginsWith(const std::string& text, std::string_view begin) { return text.rfind(begin, 0) == 0; }

const NotRun* FindNotRun(const std::string& text) {
  const auto* const found = std::find_if(kNotRun.begin(), kNotRun.end(),
                                         [&](const NotRun& listed) { return BeginsWith(text, listed.begin); });
  return found == kNotRun.end() ? nullptr : found;
}

// A line of a service's file in /etc/default as the command line that its unit makes of it; "" for other lines.
std::string FromEnvironmentFile(const std::string& text) {
  static const std::regex kLine("TESSERA_(CONTROL|AGENT|GATEWAY)_FLAGS=(.*)");
  std::smatch match;
  if (!std::regex_match(text, match, kLine)) return "";
  const std::string service = match[1] == "CONTROL" ? "control" : match[1] == "AGENT" ? "agent" : "gateway";
  return "tessera-" + service + " " + match[2].str();
}

void Prepare(Terminal& terminal, const std::vector<Command>& block) {
  for (const Preparation& preparation : kPreparations) {
    const auto any = [&](const auto& holds) { return std::any_of(block.begin(), block.end(), holds); };
    const bool needed =
        any([&](const Command& command) { return command.text.find(preparation.word) != std::string::npos; });
    const bool made = any([&](const Command& command) { return BeginsWith(command.text, preparation.maker); });
    if (needed && !made) terminal.Run(std::string(preparation.command));
  }
}

void ExpectAccepted(const std::string& text) {
  const std::vector<std::string> words = SplitWords(text);
  if (IsOurs(words)) {
    EXPECT_EQ(NotAccepted(words), "");
  }
}

void CheckBlock(const std::vector<Command>& block) {
  std::unique_ptr<Terminal> terminal;
  for (const Command& command : block) {
    SCOPED_TRACE(command.place + ": " + command.text);
    if (const std::string line = FromEnvironmentFile(command.text); !line.empty()) {
      ExpectAccepted(line);
    } else if (FindNotRun(command.text) != nullptr) {
      ExpectAccepted(command.text);
    } else if (BeginsWith(command.text, "tessera ")) {
      if (terminal == nullptr) {
        terminal = std::make_unique<Terminal>();
        Prepare(*terminal, block);
      }
      terminal->Run(command.text);
    } else {
      ADD_FAILURE() << "neither run nor listed in kNotRun";
    }
  }
}

TEST(CommandsTest, BlocksOfCommandsRun) {
  int blocks = 0;
  for (const Document& document : ReadDocuments()) {
    if (document.name == kTutorial) continue;  // tutorial_test.cpp
    for (const std::vector<Command>& block : document.blocks) {
      CheckBlock(block);
      ++blocks;
    }
  }
  EXPECT_GT(blocks, 10);
}

TEST(CommandsTest, CommandsInTheTextAreAccepted) {
  for (const Document& document : ReadDocuments()) {
    if (document.name == "docs/protocol.md") continue;  // it quotes labels of keys, such as "tessera login"
    for (const Command& command : document.in_text) {
      SCOPED_TRACE(command.place + ": " + command.text);
      ExpectAccepted(command.text);
      const std::vector<std::string> words = SplitWords(command.text);
      const bool of_system = words.front() == "systemctl" || words.front() == "rm" || words.front() == "journalctl";
      if (of_system && words.size() > 1) {
        EXPECT_NE(FindNotRun(command.text), nullptr) << "not listed in kNotRun";
      }
    }
  }
}

TEST(CommandsTest, NoCommandHidesInABlockOfAnotherKind) {
  for (const Document& document : ReadDocuments()) {
    for (const Command& line : document.unmarked) {
      EXPECT_FALSE(IsOurs(SplitWords(line.text))) << line.place << ": fence it by ```sh: " << line.text;
    }
  }
}

TEST(CommandsTest, NothingIsListedThatNoDocumentShows) {
  std::string shown;
  for (const Document& document : ReadDocuments()) {
    for (const Command& command : document.in_text) shown += "\n" + command.text;
    for (const auto& block : document.blocks) {
      for (const Command& command : block) shown += "\n" + command.text;
    }
  }
  for (const NotRun& listed : kNotRun) {
    EXPECT_NE(shown.find("\n" + std::string(listed.begin)), std::string::npos) << listed.begin;
  }
}

// The units and the examples in their comments.
TEST(CommandsTest, UnitsGiveOptionsThatTheProgramsHave) {
  static const std::regex kExec("ExecStart=/usr/bin/(.*) \\$TESSERA_[A-Z]+_FLAGS");
  int checked = 0;
  for (const char* unit : {"tessera-control", "tessera-agent", "tessera-gateway"}) {
    std::ifstream lines(std::string(TESSERA_SOURCE_DIR) + "/deploy/systemd/" + unit + ".service");
    for (std::string line; std::getline(lines, line);) {
      std::smatch match;
      const std::string example = line.rfind("#   ", 0) == 0 ? FromEnvironmentFile(line.substr(4)) : "";
      const std::string command = std::regex_match(line, match, kExec) ? match[1].str() : example;
      if (command.empty()) continue;
      ExpectAccepted(command);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 6);
}

}  // namespace
}  // namespace tessera::programs
