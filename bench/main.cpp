// tessera-bench: runs a suite, prints its table and writes its figures as CSV. Exit status 0, 1 when it could not be
// run, 2 for usage.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "bench/dissertation.h"
#include "bench/report.h"

namespace tessera::bench {
namespace {

int Main(int argc, char** argv) {
  CLI::App app{"Benchmarks of Tessera"};
  app.require_subcommand(1);
  std::string csv;
  bool quick = false;
  CLI::App* dissertation = app.add_subcommand(
      "dissertation", "The dissertation's evaluation: 2 and 3 regions, 1 and 100 objects each, two clients");
  dissertation->add_option("--csv", csv, "Also write the figures to this file");
  dissertation->add_flag("--quick", quick, "3 s a layout instead of 20");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  Report report("dissertation");
  absl::Status status;
  try {
    status = RunDissertation({.seconds = quick ? 3.0 : 20.0}, report);
  } catch (const std::exception& error) {
    status = absl::InternalError(error.what());
  }
  if (status.ok()) {
    std::cout << report.Table();
    if (!csv.empty()) status = report.WriteCsv(csv);
  }
  if (!status.ok()) {
    std::cerr << fmt::format("tessera-bench: {}\n", std::string(status.message()));
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  const int exit_code = tessera::bench::Main(argc, argv);
  std::cout.flush();
  _exit(exit_code);  // not by return, as in cli/main.cpp
}
