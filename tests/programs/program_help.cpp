#include "tests/programs/program_help.h"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/support/run_program.h"

namespace tessera::programs {
namespace {

std::vector<std::string> Words(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

// The names before the first blank of a line such as "  -o,--output FORM": each ends at a comma, or at the default of a
// flag ("--stay{false}").
std::vector<std::string> OptionNames(const std::string& line) {
  std::vector<std::string> names;
  std::istringstream stream(Words(line).front());
  for (std::string name; std::getline(stream, name, ',');) names.push_back(name.substr(0, name.find('{')));
  return names;
}

// Options and commands are indented by two; all that is said about one is indented further.
CommandHelp Parse(const std::string& text) {
  CommandHelp help;
  std::vector<std::string> described;
  bool in_commands = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] != ' ') {
      in_commands = line.rfind("Subcommands", 0) == 0;
      described.clear();
    } else if (line.rfind("  -", 0) == 0) {
      described = OptionNames(line);
      for (const std::string& name : described) help.options[name] = line;
    } else if (in_commands && line.rfind("  ", 0) == 0 && line[2] != ' ') {
      help.commands.push_back(Words(line).front());
    } else {
      for (const std::string& name : described) help.options[name] += line;
    }
  }
  return help;
}

void AddCommands(const std::string& command, std::vector<std::string>& all) {
  const CommandHelp& help = HelpOf(command);
  for (const std::string& below : help.commands) AddCommands(command + " " + below, all);
  if (help.commands.empty() || command == "tessera") all.push_back(command);
}

}  // namespace

const CommandHelp& HelpOf(const std::string& command) {
  static std::map<std::string, CommandHelp> known;
  const auto found = known.find(command);
  if (found != known.end()) return found->second;
  std::vector<std::string> words = Words(command);
  const std::string program = words.front();
  words.erase(words.begin());
  words.emplace_back("--help");
  const support::RunResult result = support::RunProgram(program, words);
  EXPECT_EQ(result.exit_code, 0) << command << " --help: " << result.err;
  return known[command] = Parse(result.out);
}

std::vector<std::string> AllCommands() {
  std::vector<std::string> all;
  for (const char* program : {"tessera", "tessera-control", "tessera-agent", "tessera-region", "tessera-gateway"}) {
    AddCommands(program, all);
  }
  return all;
}

}  // namespace tessera::programs
