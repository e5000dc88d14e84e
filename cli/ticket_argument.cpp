#include "cli/ticket_argument.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/str_split.h"
#include "host/files.h"
#include "local_cluster/command_error.h"

namespace tessera::cli {
namespace {

// 10 000 players' tickets of the longest kind.
constexpr std::size_t kMaxTicketFileBytes = std::size_t{32} << 20;

}  // namespace

std::vector<std::string> TicketsFrom(const std::string& argument) {
  std::error_code error;
  if (!std::filesystem::exists(argument, error)) {
    // No base64url has a slash or a dot, so this was meant to be a path.
    if (argument.find_first_of("/.") != std::string::npos) {
      throw local::CommandError(fmt::format("--ticket {}: no such file", argument));
    }
    return {argument};
  }
  const auto text = host::ReadFile(argument, kMaxTicketFileBytes);
  if (!text.ok()) throw local::CommandError(fmt::format("--ticket {}", std::string(text.status().message())));
  std::vector<std::string> tickets;
  for (const auto line : absl::StrSplit(*text, '\n')) {
    if (const auto ticket = absl::StripAsciiWhitespace(line); !ticket.empty()) tickets.emplace_back(ticket);
  }
  if (tickets.empty()) throw local::CommandError(fmt::format("--ticket {}: no ticket is in it", argument));
  return tickets;
}

}  // namespace tessera::cli
