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

Document ReadDocument(const std::string& name);
// In the order of their names.
std::vector<Document> ReadDocuments();

// "a  b" to {"a", "b"}.
std::vector<std::string> SplitWords(const std::string& text);

}  // namespace tessera::programs
