#include "tests/programs/accepted.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <map>
#include <sstream>

#include "host/child_process.h"
#include "host/files.h"
#include "host/temporary_folder.h"
#include "tests/programs/documents.h"
#include "tests/programs/program_help.h"

namespace tessera::programs {
namespace {

constexpr std::size_t kMaxHelpBytes = 1 << 16;

bool IsOption(const std::string& word) { return word.size() > 1 && word[0] == '-'; }

bool IsPlaceholder(const std::string& word) {
  return std::none_of(word.begin(), word.end(), [](unsigned char c) { return std::islower(c) != 0; });
}

// The parts of `./dev help`, by command.
const std::map<std::string, std::string>& DevHelp() {
  static const std::map<std::string, std::string> help = [] {
    const host::TemporaryFolder folder;
    const std::string out = folder.path() + "/out";
    auto dev = host::ChildProcess::Start({.argv = {std::string(TESSERA_SOURCE_DIR) + "/dev", "help"}, .log_path = out});
    if (dev.ok()) dev->Wait(std::chrono::seconds(20));
    std::istringstream lines(host::ReadFile(out, kMaxHelpBytes).value_or(""));
    std::map<std::string, std::string> parts;
    std::string command;
    for (std::string line; std::getline(lines, line);) {
      const bool begins = line.rfind("  ", 0) == 0 && line.size() > 2 && line[2] != ' ';
      if (begins) command = SplitWords(line).front();
      if (line.empty()) command.clear();
      if (!command.empty()) parts[command] += line + "\n";
    }
    return parts;
  }();
  return help;
}

std::string NotAcceptedByDev(const std::vector<std::string>& words) {
  if (words.size() == 1 || words[1] == "help") return "";
  const auto found = DevHelp().find(words[1]);
  if (found == DevHelp().end()) return "./dev has no command " + words[1];
  const auto has = [&](const std::string& word) { return found->second.find(word) != std::string::npos; };
  for (std::size_t i = 2; i < words.size(); ++i) {
    if (IsOption(words[i]) && words[i] != "--help" && !has(words[i])) {
      return "./dev " + words[1] + " has no option " + words[i];
    }
  }
  if (words[1] == "bench" && words.size() > 2 && !IsPlaceholder(words[2]) && !has(words[2])) {
    return "./dev bench has no suite " + words[2];
  }
  return "";
}

}  // namespace

bool IsOurs(const std::vector<std::string>& words) {
  constexpr std::array<const char*, 6> kPrograms{"./dev",           "tessera",        "tessera-agent",
                                                 "tessera-control", "tessera-region", "tessera-gateway"};
  return !words.empty() && std::find(kPrograms.begin(), kPrograms.end(), words.front()) != kPrograms.end();
}

std::string NotAccepted(const std::vector<std::string>& words) {
  if (words.front() == "./dev") return NotAcceptedByDev(words);
  std::string command = words.front();
  std::vector<std::string> options;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const CommandHelp& help = HelpOf(command);
    if (IsOption(words[i])) {
      options.push_back(words[i].substr(0, words[i].find('=')));
      const bool takes_value = i + 1 < words.size() && !IsOption(words[i + 1]) && command == "tessera";
      if (takes_value) ++i;
    } else if (std::find(help.commands.begin(), help.commands.end(), words[i]) != help.commands.end()) {
      command += " " + words[i];
    } else if (!help.commands.empty()) {
      return command + " has no command " + words[i];
    }
  }
  const bool of_tessera = words.front() == "tessera";  // its own options may follow the command
  for (const std::string& option : options) {
    if (HelpOf(command).options.count(option) > 0) continue;
    if (of_tessera && HelpOf("tessera").options.count(option) > 0) continue;
    return command + " has no option " + option;
  }
  return "";
}

}  // namespace tessera::programs
