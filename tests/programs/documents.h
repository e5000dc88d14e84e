// The commands in the documents of this repository: README.md, CONTRIBUTING.md and docs/.
//
// A document writes commands in blocks fenced by ```sh and between backticks in its text.
#pragma once

#include <string>
#include <vector>

namespace tessera::programs {

struct Command {
  std::string place;  // "docs/operating.md:49"
  std::string text;   // one line: continued lines are joined, comments and repeated blanks are gone
};

struct Document {
  std::string name;                          // "docs/operating.md"
  std::vector<std::vector<Command>> blocks;  // the ```sh blocks, in order
  std::vector<Command> in_text;              // all that stands between backticks
  std::vector<Command> unmarked;             // lines of other blocks and of indented ones
};

// One document whose blocks belong together: a reader makes files and types commands from its beginning to its end.
inline constexpr const char* kTutorial = "docs/tutorial.md";

// A fenced block of it.
struct Fenced {
  std::string place;      // "docs/tutorial.md:12"
  std::string section;    // "A first client": the title of the second order that it stands below
  std::string language;   // "sh", "text", "lua"
  std::string file, how;  // from the language's line: "lua orchard/game.lua +"; both may be empty
  std::vector<std::string> lines;
};
std::vector<Fenced> ReadFenced(const std::string& name);

Document ReadDocument(const std::string& name);
// In the order of their names.
std::vector<Document> ReadDocuments();

// "a  b" to {"a", "b"}.
std::vector<std::string> SplitWords(const std::string& text);

}  // namespace tessera::programs
