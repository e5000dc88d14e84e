// Output: what every command shares: which control plane it speaks to and in which form it answers.
#pragma once

#include <google/protobuf/message.h>
#include <google/protobuf/timestamp.pb.h>

#include <string>

namespace tessera::cli {

enum class Format { kTable, kWide, kJson, kName };

// The options before the command, e.g. `tessera --context work -o json host list`.
struct Globals {
  std::string control, context;  // empty: see ControlOf
  Format format = Format::kTable;
};

// A message as JSON with the field names of the .proto, every field present.
std::string ToJson(const google::protobuf::Message& message);
// Seconds since then; -1 when unset.
long long AgeSeconds(const google::protobuf::Timestamp& time);
// "RUNNING" from "INSTANCE_STATE_RUNNING".
std::string ShortName(const std::string& enum_name, const std::string& prefix);

// A change that was made, or would be: "host/alpha added", "host/alpha added (dry run)"; with -o name only
// "host/alpha"; with -o json the message.
void PrintChange(const Globals& globals, const std::string& type, const std::string& name, const std::string& verb,
                 bool dry_run, const google::protobuf::Message& message);

}  // namespace tessera::cli
