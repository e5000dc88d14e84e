#include "cli/output.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <ctime>
#include <iostream>

namespace tessera::cli {

std::string ToJson(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(message, &json, options);
  return status.ok() ? json : "{}\n";
}

long long AgeSeconds(const google::protobuf::Timestamp& time) {
  return time.seconds() == 0 ? -1 : static_cast<long long>(std::time(nullptr)) - time.seconds();
}

std::string ShortName(const std::string& enum_name, const std::string& prefix) {
  return enum_name.starts_with(prefix) ? enum_name.substr(prefix.size()) : enum_name;
}

void PrintChange(const Globals& globals, const std::string& type, const std::string& name, const std::string& verb,
                 bool dry_run, const google::protobuf::Message& message) {
  if (globals.format == Format::kJson) {
    std::cout << ToJson(message);
  } else if (globals.format == Format::kName) {
    std::cout << fmt::format("{}/{}\n", type, name);
  } else {
    std::cout << fmt::format("{}/{} {}{}\n", type, name, verb, dry_run ? " (dry run)" : "");
  }
}

}  // namespace tessera::cli
